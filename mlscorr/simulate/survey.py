"""Complete simulated survey: the recorded data, and the truth."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import asdict, dataclass
from datetime import date
from functools import cached_property
from itertools import groupby
from pathlib import Path

import numpy as np
import tomlkit
from numpy.random import Generator

from mlscorr.effects import Reference, apply_effects, effect_streams
from mlscorr.frames import angles_from_attitude
from mlscorr.io.clouds import cloud_writer, write_ply
from mlscorr.io.store import NpzWriter, output_folder
from mlscorr.io.trajectories import check_crs, write_trajectory_csv
from mlscorr.simulate import recording
from mlscorr.simulate.drive import drive
from mlscorr.simulate.scan import MeasuredPulses, Platform, Surfaces, pulses_of_a_pass, shoot
from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.scene import Mesh, Scene, build_scene, static_scan
from mlscorr.survey import ControlPoints, Mounting, PointCloud, Pos, Summary, Trajectory, check_rng

STREAMS = 7  # drive, scene, scan, POS, control, effects, reference: all independent


@dataclass(frozen=True)
class PulseBlock:
    """Some pulses of one pass and scanner: measured, and georeferenced with the recorded data.
    Of ``fired`` pulses, ``pulses`` are the returns and ``cloud`` their points.
    """

    file: str
    fired: int
    pulses: MeasuredPulses
    cloud: PointCloud


@dataclass(frozen=True, repr=False)
class SimulatedSurvey(Summary):
    """One simulated survey, whose pulses are made again, block by block, on each request.

    Parameters
    ----------
    scenario : Scenario
    scene : Scene
    true_passes, passes : tuple of Trajectory
        True and recorded trajectories, one for each pass, in order of time.
    true_mountings, mountings : tuple of Mounting
        True and recorded mounting of each scanner.
    targets : ControlPoints
        All targets as surveyed, in the order of the scene's targets.
    is_check : (n,) bool array
        True for check points.
    true_centre : (n, 3) array
        Map coordinates of the targets. Units: m.
    effects : tuple of Effect
    reference : Reference
    streams : dict
        By file: random streams of its scanner's noise, and of the effects on first and later
        echoes.
    beam_streams : dict
        Random streams of the effects on the beam.
    seed : int or None
        Seed of the random numbers, if known.
    static_scan : Mesh, optional
        Ground and walls relative to the origin as from a static scan, if a reference is requested.
    """

    scenario: Scenario
    scene: Scene
    true_passes: tuple[Trajectory, ...]
    passes: tuple[Trajectory, ...]
    true_mountings: tuple[Mounting, ...]
    mountings: tuple[Mounting, ...]
    targets: ControlPoints
    is_check: np.ndarray
    true_centre: np.ndarray
    effects: tuple
    reference: Reference
    streams: dict
    beam_streams: dict
    seed: int | None = None
    static_scan: Mesh | None = None

    @cached_property
    def true_trajectory(self) -> Trajectory:
        """True trajectory of all passes, with gaps between them."""
        return Trajectory.concatenate(self.true_passes)

    @cached_property
    def trajectory(self) -> Trajectory:
        """Recorded trajectory of all passes, with gaps between them."""
        return Trajectory.concatenate(self.passes)

    @property
    def mounting(self) -> Mounting:
        """Recorded Mounting of the first scanner."""
        return self.mountings[0]

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the cloud files, in the order in which they are written."""
        return tuple(self.streams)

    @property
    def fired(self) -> int:
        """Number of pulses fired by all scanners in all passes."""
        return sum(
            pulses_of_a_pass(trajectory, scanner)
            for trajectory in self.true_passes
            for scanner in self.scenario.scanner
        )

    @cached_property
    def surfaces(self) -> Surfaces:
        """Scene as a target of rays."""
        return Surfaces(self.scene.mesh)

    def blocks(self, **size: int) -> Iterator[PulseBlock]:
        """Yield blocks of all files in sequence, each in order of time; repeatable."""
        scanners = len(self.scenario.scanner)
        for number, file in enumerate(self.files):
            yield from self._blocks_of(file, *divmod(number, scanners), **size)

    def _blocks_of(self, file, number, k, **size):
        """Yield blocks of a pass and scanner, both counted from 0."""
        scanner = self.scenario.scanner[k]
        origin = np.array(self.scenario.origin)
        noise, *streams = self.streams[file]
        used = {effect.name for effect in self.effects}
        streams = [{name: deepcopy(echo[name]) for name in used} for echo in streams]
        divergence = apply_effects(
            self.effects, "beam", 1e-3 * scanner.beam_divergence, self.reference, self.beam_streams
        )
        recorded = Platform.of(self.passes[number], self.mountings[k], origin)
        for undisturbed in shoot(
            self.surfaces,
            origin,
            self.true_passes[number],
            self.true_mountings[k],
            scanner,
            noise,
            divergence,
            **size,
        ):
            shots = recording.disturb(undisturbed, self.effects, self.reference, streams)
            # points outside the trajectory because of a wrong clock cannot be georeferenced
            shots.kept[recorded.outside(shots.gps_time)] = False
            pulses = shots.pulses()
            xyz = recorded.place(
                pulses.gps_time, pulses.angle, pulses.elevation, pulses.range, origin
            )
            cloud = PointCloud(xyz, pulses.gps_time, pulses.intensity)
            yield PulseBlock(file, shots.fired, pulses, cloud)

    @cached_property
    def pulses(self) -> MeasuredPulses:
        """MeasuredPulses of all files, for small surveys."""
        return MeasuredPulses.concatenate([block.pulses for block in self.blocks()])

    @cached_property
    def cloud(self) -> PointCloud:
        """PointCloud of all files, georeferenced with the recorded data, for small surveys."""
        return PointCloud.concatenate([block.cloud for block in self.blocks()])

    @property
    def target(self) -> np.ndarray:
        """True target of each point of the cloud, board included; -1 for none."""
        return self.scene.target[self.pulses.triangle]

    def write(
        self, folder: Path | str, progress: Callable | None = None, overwrite: bool = True
    ) -> None:
        """Write the survey folder atomically: survey.toml, clouds, trajectory, control, truth.

        Raises ValueError when a scanner met nothing on a pass; OSError when writing fails.

        Parameters
        ----------
        folder : path
        progress : function, optional
            Function of a title and a total; returns a function of the amount just done.
        overwrite : bool
            True to replace files of the same name.

        Raises
        ------
        ValueError
            If a scanner has no return in a pass.
        """
        write_survey(self, folder, progress, overwrite)


def simulate(scenario: Scenario, rng: Generator) -> SimulatedSurvey:
    """Simulate the survey of a scenario; every stage has its own random stream.

    Parameters
    ----------
    scenario : Scenario
    rng : Generator

    Raises
    ------
    ValueError
        If the scenario is impossible, or rng is not a generator.

    Examples
    --------
    >>> import numpy as np
    >>> from mlscorr.simulate import Scenario, simulate
    >>> from mlscorr.simulate.scenario import DriveScenario, ScannerScenario, TargetScenario
    >>> short = Scenario(
    ...     drive=DriveScenario(duration=8.0),
    ...     targets=TargetScenario(control=2, check=1),
    ...     scanner=(ScannerScenario(points_per_line=50),),
    ... )
    >>> survey = simulate(short, np.random.default_rng(1))
    >>> survey.files, survey.targets.name
    (('pass-1.laz',), ('T01', 'T02', 'T03'))
    """
    check_rng(rng)
    check_crs(scenario.crs)
    drive_rng, scene_rng, scan_rng, pos_rng, control_rng, *more = rng.spawn(STREAMS)
    effect_rng, static_rng = more
    effects = scenario.imperfections
    streams = effect_streams(effect_rng)
    seed = getattr(rng.bit_generator.seed_seq, "entropy", None)

    # Way, objects along it, and drive.
    line, length, true_passes = drive(scenario, drive_rng)
    scene = build_scene(scenario, line, length, scene_rng)
    centre = np.array(scenario.origin) + scene.targets.centre
    span = true_passes[0].gps_time[0], true_passes[-1].gps_time[-1]
    reference = Reference(*span, centre.mean(axis=0))

    # Records of POS, mechanic and surveyor.
    def with_effects(stage, value):
        return apply_effects(effects, stage, value, reference, streams)

    recorded = Trajectory.concatenate(
        recording.recorded_passes(scenario, scene, true_passes, pos_rng)
    )
    mountings = tuple(recording.true_mounting(scanner) for scanner in scenario.scanner)
    targets = recording.surveyed_targets(scene.targets, centre, scenario.targets, control_rng)
    return SimulatedSurvey(
        scenario=scenario,
        scene=scene,
        true_passes=true_passes,
        passes=recording.split_passes(with_effects("pos", recorded), map(len, true_passes)),
        true_mountings=mountings,
        mountings=tuple(with_effects("mounting", mounting) for mounting in mountings),
        targets=with_effects("control", targets),
        is_check=recording.spread_checks(len(targets), scenario.targets),
        true_centre=centre,
        effects=effects,
        reference=reference,
        streams=recording.streams_by_file(len(true_passes), len(mountings), scan_rng, effect_rng),
        beam_streams=streams,
        seed=seed if isinstance(seed, int) else None,
        static_scan=static_scan(scene, static_rng) if scenario.scene.reference else None,
    )


REFERENCE = "reference.ply"


CREATED = date(2015, 1, 1)  # in the LAS header, so that a seed gives the same bytes on any day


NOTHING_MET = "No pulse of {} hit anything: check drive, scene, max_range and field_of_view."


def write_survey(
    survey: SimulatedSurvey, folder: Path | str, progress: Callable | None, overwrite: bool
) -> None:
    """Write a SimulatedSurvey atomically; see SimulatedSurvey.write.

    Parameters
    ----------
    survey : SimulatedSurvey
    folder : path
    progress : function or None
        See SimulatedSurvey.write.
    overwrite : bool
        True to replace files of the same name.
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
            truth.watch = progress("Writing the truth", truth.growing)
        for file in set(survey.files) - set(points):  # its field of view has no beam
            raise ValueError(NOTHING_MET.format(file))
        write_trajectory_csv(part / "trajectory.csv", survey.trajectory)
        (part / "control.csv").write_text(_control_csv(survey))
        if survey.static_scan is not None:
            write_ply(part / REFERENCE, survey.static_scan.triangles + survey.scenario.origin)
        (part / "survey.toml").write_text(_survey_toml(survey), encoding="utf-8")
        (part / "truth.json").write_text(json.dumps(_truth(survey, points), indent=1) + "\n")


@contextmanager
def _disk_errors(folder):
    """Name the folder in errors of writing."""
    try:
        yield
    except OSError as error:
        raise OSError(
            f"the survey can't be written to {folder}, and partial files were removed: "
            f"{error.strerror or error}."
        ) from error


def _write_cloud(path, survey, blocks, truth, done):
    """Write one cloud file and the truth of its points; return their number."""
    origin = np.array(survey.scenario.origin)
    scenario = survey.scenario
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
    """Contents of truth.json: effects, true and recorded mountings, and the rest."""
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
    """Lever arm (m) and boresight (deg) as in survey.toml."""
    return {
        "lever_arm": np.asarray(mounting.lever_arm).round(9).tolist(),
        "boresight": mounting.boresight.as_euler("xyz", degrees=True).round(9).tolist(),
    }


def _control_csv(survey):
    """Make control.csv without normals, as a surveyor rarely has them."""
    rows = ["name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role"]
    t = survey.targets
    for i, name in enumerate(t.name):
        place = ",".join(f"{v:.4f}" for v in t.position[i])
        role = "check" if survey.is_check[i] else "control"
        horizontal, vertical = np.maximum(t.sigma[i, [0, 2]], 1e-4)  # m, the rounding here
        rows.append(f"{name},{place},{horizontal},{vertical},{t.kind[i]},{t.size[i]},{role}")
    return "\n".join(rows) + "\n"


def _survey_toml(survey):
    """Make survey.toml, with the recorded mountings and the assumed accuracies of scanners and
    POS.
    """
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
    """Sections of the scanner and its mounting, or of several with their files and mountings."""
    scanners = survey.scenario.scanner
    mountings = [_mounting(m) for m in survey.mountings]
    beliefs = []
    for scanner in scanners:
        noise = {"range_noise": scanner.range_noise, "angle_noise": scanner.angle_noise}
        assumed = {name: sigma for name, sigma in noise.items() if sigma > 0}
        beliefs.append(assumed | {"lines_per_second": scanner.lines_per_second})
    if len(scanners) == 1:
        return {"mounting": mountings[0], "scanner": beliefs[0]}
    files = [survey.files[k :: len(scanners)] for k in range(len(scanners))]
    return {
        "scanner": [
            {"name": str(k), "files": list(of), **assumed, "mounting": mounting}
            for k, (of, assumed, mounting) in enumerate(
                zip(files, beliefs, mountings, strict=True), start=1
            )
        ]
    }


def _short(number):
    """Format a number to three digits."""
    return float(f"{number:.3g}")
