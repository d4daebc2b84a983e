"""The folder of a simulated survey: what was recorded, as the readers expect it, and the truth."""

import json
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import asdict
from datetime import date
from itertools import groupby
from pathlib import Path

import numpy as np
import tomlkit

from mlscorr.frames import angles_from_attitude
from mlscorr.io.clouds import cloud_writer, write_ply
from mlscorr.io.store import NpzWriter, output_folder
from mlscorr.io.trajectories import write_trajectory_csv
from mlscorr.simulate.survey import SimulatedSurvey
from mlscorr.survey import Pos

REFERENCE = "reference.ply"
CREATED = date(2015, 1, 1)  # in the LAS header, so that a seed gives the same bytes on any day
NOTHING_MET = "No pulse of {} met anything: look at drive, scene, max_range and field_of_view."


def write_survey(
    survey: SimulatedSurvey, folder: Path | str, progress: Callable | None, overwrite: bool
) -> None:
    """Write a SimulatedSurvey, whole or not at all; see SimulatedSurvey.write.

    Parameters
    ----------
    survey : SimulatedSurvey
    folder : path
    progress : function or None
        As of SimulatedSurvey.write.
    overwrite : bool
        Whether files of the same name are replaced.
    """
    progress = progress or (lambda *_: lambda _done: None)
    done = progress("Simulating pulses", survey.fired)
    with _disk_errors(folder), output_folder(folder, overwrite=overwrite) as part:
        points = {}
        with NpzWriter(part / "truth.npz") as truth:
            for file, blocks in groupby(survey.blocks(), key=lambda block: block.file):
                points[file] = _write_cloud(part / file, survey, blocks, truth, done)
            for name, array in _truth_arrays(survey).items():
                truth.put(name, array)
            truth.watch = progress("Writing their truth", truth.growing)
        for file in set(survey.files) - set(points):  # no beam of it lies in its field of view
            raise ValueError(NOTHING_MET.format(file))
        write_trajectory_csv(part / "trajectory.csv", survey.trajectory)
        (part / "control.csv").write_text(_control_csv(survey))
        if survey.static_scan is not None:
            write_ply(part / REFERENCE, survey.static_scan.triangles + survey.scenario.origin)
        (part / "survey.toml").write_text(_survey_toml(survey), encoding="utf-8")
        (part / "truth.json").write_text(json.dumps(_truth(survey, points), indent=1) + "\n")


@contextmanager
def _disk_errors(folder):
    """Say of what could not be written which folder it was for."""
    try:
        yield
    except OSError as error:
        raise OSError(
            f"the survey can't be written to {folder}, and nothing is left of it: "
            f"{error.strerror or error}."
        ) from error


def _write_cloud(path, survey, blocks, truth, done):
    """One cloud file and the truth of its points; returns their number."""
    origin, scenario = np.array(survey.scenario.origin), survey.scenario
    with cloud_writer(path, origin, scenario.crs, created=CREATED) as writer:
        for block in blocks:
            pulses = block.pulses
            writer.write(
                block.cloud, pulses.scan_angle, pulses.return_number, pulses.number_of_returns
            )
            truth.append("point_xyz", pulses.point)
            truth.append("point_target", survey.scene.target[pulses.triangle].astype(np.int16))
            done(block.fired)
        if writer.points == 0:
            raise ValueError(NOTHING_MET.format(path.name))
    return writer.points


def _truth_arrays(survey):
    """Whole arrays of truth.npz beside the points': trajectory (deg) and targets."""
    true = survey.true_trajectory
    angles = np.column_stack(angles_from_attitude(true.attitude))
    return {
        "trajectory_gps_time": true.gps_time,
        "trajectory_position": true.position,
        "trajectory_roll_pitch_heading": np.degrees(angles),
        "control_name": np.array(survey.targets.name),
        "control_position": survey.true_centre,
        "control_normal": survey.scene.targets.normal,
        "control_support": np.array(survey.scene.targets.support),
        "control_hidden": np.array(survey.scene.targets.hidden),
    }


def _truth(survey, points):
    """Content of truth.json: the effects, the mountings as they are and as recorded, the rest."""
    effects = [(effect.name, asdict(effect)) for effect in survey.effects]
    single = effects[0][1] if len(effects) == 1 else dict(effects)
    return {
        "effect": "+".join(dict(effects)) or "none",
        "params": single,
        "effects": [effect.document() for effect in survey.effects],
        "seed": survey.seed,
        "points": points,
        "mountings": {
            "true": [_mounting(mounting) for mounting in survey.true_mountings],
            "recorded": [_mounting(mounting) for mounting in survey.mountings],
        },
        "scenario": survey.scenario.model_dump(mode="json"),
    }


def _mounting(mounting):
    """Lever arm (m) and boresight (deg) as survey.toml has them."""
    return {
        "lever_arm": np.asarray(mounting.lever_arm).round(9).tolist(),
        "boresight": mounting.boresight.as_euler("xyz", degrees=True).round(9).tolist(),
    }


def _control_csv(survey):
    """control.csv, with the normals left out, as a surveyor rarely has them."""
    rows = ["name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role"]
    t = survey.targets
    for i, name in enumerate(t.name):
        place = ",".join(f"{v:.4f}" for v in t.position[i])
        role = "check" if survey.is_check[i] else "control"
        horizontal, vertical = np.maximum(t.sigma[i, [0, 2]], 1e-4)  # m, the rounding here
        rows.append(f"{name},{place},{horizontal},{vertical},{t.kind[i]},{t.size[i]},{role}")
    return "\n".join(rows) + "\n"


def _survey_toml(survey):
    """survey.toml, with the recorded mountings and what is believed of scanners and POS."""
    scenario = survey.scenario
    trajectory = survey.trajectory
    attitude = np.degrees(np.median(trajectory.attitude_sigma, axis=0))
    sections = {
        "name": scenario.name,
        "crs": scenario.crs,
        "cloud": {"files": list(survey.files), "gps_time": "week"},
        "trajectory": {"file": "trajectory.csv"},
        **_scanner_sections(survey),
        "control": {"file": "control.csv"},
        "pos": {
            "position_sigma": _short(np.median(trajectory.position_sigma)),
            "attitude_sigma": [_short(sigma) for sigma in attitude],
            "correlation_time": Pos.correlation_time,
        },
    }
    if survey.static_scan is not None:
        sections["scene"] = {"reference": REFERENCE}
    return tomlkit.dumps(sections)


def _scanner_sections(survey):
    """The scanner and its mounting, or each of several with its files and mounting."""
    scanners, mountings = survey.scenario.scanner, [_mounting(m) for m in survey.mountings]
    beliefs = []
    for scanner in scanners:
        noise = {"range_noise": scanner.range_noise, "angle_noise": scanner.angle_noise}
        believed = {name: sigma for name, sigma in noise.items() if sigma > 0}
        beliefs.append(believed | {"lines_per_second": scanner.lines_per_second})
    if len(scanners) == 1:
        return {"mounting": mountings[0], "scanner": beliefs[0]}
    files = [survey.files[k :: len(scanners)] for k in range(len(scanners))]
    return {
        "scanner": [
            {"name": str(k), "files": list(of), **believed, "mounting": mounting}
            for k, (of, believed, mounting) in enumerate(
                zip(files, beliefs, mountings, strict=True), start=1
            )
        ]
    }


def _short(number):
    """A number to three digits."""
    return float(f"{number:.3g}")
