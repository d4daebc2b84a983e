"""Recording of the truth by POS, scanner and surveyor, with effects."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from mlscorr.effects import Reference, Returns, apply_effects, effect_streams
from mlscorr.simulate.pos import pos_error, record
from mlscorr.simulate.scan import Shots, noise_streams, pool
from mlscorr.simulate.scenario import ScannerScenario, Scenario, TargetScenario
from mlscorr.simulate.scene import Scene, Targets, sky_elevation
from mlscorr.survey import ControlPoints, Mounting, Trajectory

CHANGES = {"clock": "gps_time", "angle": "angle", "range": "range", "return": "kept"}  # by stage
ON_PULSES = ("clock", "angle")  # at which all echoes of a pulse are one


def disturb(shots: Shots, effects: tuple, reference: Reference, streams: tuple) -> Shots:
    """Apply the effects on clock, angle, range and return to Shots.

    Each stage receives the measurements of the scanner, and changes the declared fields. Columns
    contain all first echoes, received or not, and later echoes have separate streams, so that the
    draws of one effect do not depend on another.

    Parameters
    ----------
    shots : Shots
    effects : tuple of Effect
    reference : Reference
        Of the effects.
    streams : pair of dict
        Random streams of the effects, on first and on later echoes.
    """
    first, later = (
        Returns(*(getattr(shots, name)[rows] for name in Returns.__dataclass_fields__))
        for rows in (slice(None, shots.fired), slice(shots.fired, None))
    )

    def after(stage):
        name = CHANGES[stage]
        values = getattr(apply_effects(effects, stage, first, reference, streams[0]), name)
        more = values[shots.pulse]
        if stage not in ON_PULSES:
            more = getattr(apply_effects(effects, stage, later, reference, streams[1]), name)
        return np.append(values, more)

    stages = [stage for stage in CHANGES if any(effect.stage == stage for effect in effects)]
    changed = zip(stages, pool().map(after, stages), strict=True)
    return replace(shots, **{CHANGES[stage]: values for stage, values in changed})


def recorded_passes(
    scenario: Scenario, scene: Scene, true_passes: tuple[Trajectory, ...], rng: Generator
) -> list[Trajectory]:
    """Make the trajectories that the POS records in each pass.

    Parameters
    ----------
    scenario : Scenario
    scene : Scene
    true_passes : tuple of Trajectory
    rng : Generator
    """
    start = true_passes[0].gps_time[0]
    passes = []
    for true, pass_rng in zip(true_passes, rng.spawn(len(true_passes)), strict=True):
        sky = None
        if scenario.pos.sky_view:
            sky = sky_elevation(scene, true, np.array(scenario.origin))
        passes.append(record(true, pos_error(true, scenario.pos, pass_rng, sky, start)))
    return passes


def streams_by_file(passes: int, scanners: int, scan_rng: Generator, effect_rng: Generator) -> dict:
    """Random streams by file name: scanner noise, effects on first and on later echoes.

    Parameters
    ----------
    passes : int
        Number of passes.
    scanners : int
        Number of scanners.
    scan_rng : Generator
        For the scanners' noise.
    effect_rng : Generator
        For the effects.
    """
    streams = {}
    for number, (noise, effect) in enumerate(
        zip(scan_rng.spawn(passes), effect_rng.spawn(passes), strict=True), start=1
    ):
        pairs = zip(noise.spawn(scanners), effect.spawn(scanners), strict=True)
        for k, (noise_rng, file_rng) in enumerate(pairs, start=1):
            if k == 1:
                name = f"pass-{number}.laz"
            else:
                name = f"pass-{number}-scanner-{k}.laz"
            echoes = (effect_streams(echo_rng) for echo_rng in file_rng.spawn(2))
            streams[name] = (noise_streams(noise_rng), *echoes)
    return streams


def true_mounting(scanner: ScannerScenario) -> Mounting:
    """Return the mounting of a ScannerScenario.

    Parameters
    ----------
    scanner : ScannerScenario
    """
    return Mounting(
        np.array(scanner.lever_arm), Rotation.from_euler("xyz", scanner.boresight, degrees=True)
    )


def split_passes(trajectory: Trajectory, lengths: Iterable[int]) -> tuple[Trajectory, ...]:
    """Split a joined Trajectory into passes, by their numbers of epochs.

    Parameters
    ----------
    trajectory : Trajectory
    lengths : iterable of int
        Epochs of each pass.
    """
    lengths = list(lengths)
    parts = zip(np.cumsum(lengths), lengths, strict=True)
    return tuple(trajectory.select(slice(end - n, end)) for end, n in parts)


def surveyed_targets(
    targets: Targets, centre: np.ndarray, scenario: TargetScenario, rng: Generator
) -> ControlPoints:
    """Make ControlPoints of all targets, with the noise of the survey.

    Parameters
    ----------
    targets : Targets
    centre : (n, 3) array
        True map coordinates. Units: m.
    scenario : TargetScenario
    rng : Generator
    """
    n = len(targets)
    horizontal, vertical = scenario.survey_sigma
    sigma = np.tile([horizontal, horizontal, vertical], (n, 1))
    return ControlPoints(
        tuple(f"T{i + 1:02d}" for i in range(n)),
        centre + sigma * rng.standard_normal((n, 3)),
        sigma,
        targets.kind,
        np.full(n, scenario.size),
        targets.normal,
    )


def spread_checks(count: int, scenario: TargetScenario) -> np.ndarray:
    """Flag (count,) of check points: evenly among the targets, not at the ends.

    Parameters
    ----------
    count : int
        Number of placed targets; the share of check points among them is the same as among all.
    scenario : TargetScenario
    """
    check = round(count * scenario.check / (scenario.control + scenario.check))
    is_check = np.zeros(count, dtype=bool)
    is_check[((np.arange(check) + 0.5) * count / max(check, 1)).astype(int)] = True
    return is_check
