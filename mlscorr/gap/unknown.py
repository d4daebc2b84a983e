"""What no known effect explains, in general terms: an error in some direction that varies with
something. The blocks of functions that find it also say in words where to look.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline

from mlscorr.gap.covariates import covariates, scanner_origin

LEAST_PART = 1e-6  # of a block's largest column; below it nothing of it is seen
FINE = 10.0  # s between the knots of what comes and goes with time
LOCAL = 40.0  # m between the knots of what comes and goes with the place
MOST = 24  # functions of one block
RATE = 0.5  # s to each side, over which rates and acceleration are taken
CYCLES = tuple(range(1, 7))  # over the span of the ranges

DIRECTIONS = {
    "east": "easting error",
    "north": "northing error",
    "height": "height error",
    "right": "error to the right",
    "forward": "error along the drive",
    "beam": "range error",
    "scan": "scan angle error",
    "across": "error across the scan plane",
    "roll": "roll error",
    "pitch": "pitch error",
    "yaw": "heading error",
}
PLACES = ("east", "north", "height")
BODY = ("right", "forward", "height")
TURNS = ("roll", "pitch", "yaw")
BEAMS = ("beam", "scan", "across")
FUNCTIONS = {  # name: words, directions
    "constant": ("that is constant", (*BODY, *BEAMS, *TURNS)),
    "pass": ("that differs between passes", (*PLACES, *BODY[:2], "beam", "scan", *TURNS)),
    "elapsed": ("that grows with time", (*PLACES, *BODY[:2], "beam", "scan", "across", *TURNS)),
    "warming": ("that grows with time and settles", ("beam", "scan", *TURNS)),
    "elapsed in the pass": ("that grows in each pass", TURNS),
    "time": ("that comes and goes with time", PLACES),
    "slow time": ("that changes slowly with time", (*PLACES, "beam", *TURNS)),
    "location": ("that depends on the place along the drive", PLACES),
    "map": ("that depends on the place on the map", PLACES),
    "range": ("in proportion to the range", ("height", "beam", "right")),
    "range squared": ("that grows with the range squared", ("height", "beam")),
    "smooth range": ("that depends on the range", ("beam", "height")),
    "cyclic range": ("that repeats with the range", ("beam",)),
    "incidence": ("that depends on the incidence angle", ("beam", "scan")),
    "intensity": ("that grows with the intensity", ("beam",)),
    "smooth intensity": ("that depends on the intensity", ("beam", "scan")),
    "scan angle": ("in proportion to the scan angle", ("scan", "across", "beam")),
    "once or twice a turn": ("that repeats once or twice a turn of the scanner", BEAMS),
    "often a turn": ("that repeats several times a turn of the scanner", BEAMS),
    "speed": ("that grows with speed", (*BODY, "beam", *TURNS)),
    "speed squared": ("that grows with speed squared", (*BODY, "pitch")),
    "smooth speed": ("that depends on speed", (*BODY, "pitch")),
    "turn rate": ("that grows with the turn rate", (*BODY, *TURNS)),
    "turning": ("that grows with the turn rate to either side", ("height", "pitch")),
    "lateral acceleration": ("that grows with speed times turn rate", ("right", "height", "roll")),
    "acceleration": ("that grows with acceleration", ("forward", "height", "pitch")),
    "roll rate": ("that grows with the roll rate", ("roll",)),
    "pitch rate": ("that grows with the pitch rate", ("pitch",)),
    "heading": ("that depends on the heading", (*BODY, "beam", *TURNS)),
}
DRIFTING = ("time", "slow time", "location", "pass", "elapsed")


@dataclass(frozen=True)
class Looks:
    """Each look at each item: (k,) row in its arrays; two for a plane that was seen twice."""

    item: np.ndarray
    sign: np.ndarray
    directions: dict[str, np.ndarray]  # displacement (k, 3) on the map of one unit, m or rad
    covariates: dict[str, np.ndarray]
    xyz: np.ndarray


@dataclass(frozen=True)
class UnknownBlock:
    """One direction times one function: columns (m, p) of the rows, and the lead in words.

    is_drift tells that the POS's own drift looks like it.
    """

    lead: str
    columns: np.ndarray
    is_drift: bool


def looks(rows, survey):
    """The looks behind the metric rows of a survey."""
    pulses = rows.pulses[np.isin(rows.pulses.item, rows.item[rows.metric])]
    key = 2 * pulses.item + (pulses.weight < 0)
    known, number = np.unique(key, return_inverse=True)
    count = np.bincount(number)

    def mean(values):
        return np.column_stack([np.bincount(number, v) / count for v in values.T])

    time, xyz = mean(pulses.gps_time[:, None])[:, 0], mean(pulses.xyz)
    told = covariates(
        survey, time, xyz, replace(pulses, item=number), np.arange(len(known)),
        survey.trajectory.segment(time) + 1, np.zeros((len(known), 3)),
    )  # fmt: skip
    return Looks(
        known // 2,
        np.where(known % 2, -1.0, 1.0),
        _directions(survey, time, xyz),
        told | _motion(survey.trajectory, time),
        xyz,
    )


def _directions(survey, time, xyz):
    """Displacements (k, 3) by a unit in each of DIRECTIONS."""
    pose = survey.trajectory.at(time)
    right, forward, up = np.moveaxis(pose.attitude.as_matrix(), 2, 0)
    arm, sight = xyz - pose.position, xyz - scanner_origin(survey, time)
    beam = sight / np.linalg.norm(sight, axis=1, keepdims=True)
    unit = np.broadcast_to(np.eye(3)[:, None], (3, len(time), 3))
    found = {
        "east": unit[0],
        "north": unit[1],
        "height": unit[2],
        "right": right,
        "forward": forward,
        "beam": beam,
        "roll": np.cross(forward, arm),
        "pitch": np.cross(right, arm),
        "yaw": np.cross(-up, arm),
    }
    if survey.mounting is not None:
        axis = pose.attitude.apply(survey.mounting.boresight.apply([0.0, 0.0, 1.0]))
        found |= {"scan": np.cross(axis, sight), "across": axis}
    return found


def _motion(trajectory, time):
    """Further covariates: roll and pitch rate (rad/s), acceleration (m/s^2), time in the pass."""
    starts = np.append(trajectory.gps_time[0], trajectory.gaps[:, 1])
    ends = np.append(trajectory.gaps[:, 0], trajectory.gps_time[-1])
    segment = trajectory.segment(time)
    early = np.maximum(time - RATE, starts[segment])
    late = np.minimum(time + RATE, ends[segment])
    before, now, after = (trajectory.at(t) for t in (early, (early + late) / 2, late))
    turn = now.attitude.inv().apply((after.attitude * before.attitude.inv()).as_rotvec())
    span = (late - early)[:, None]
    moved = after.position - 2 * now.position + before.position
    forward = now.attitude.apply([0.0, 1.0, 0.0])
    return {
        "roll_rate": (turn / span)[:, 1],
        "pitch_rate": (turn / span)[:, 0],
        "acceleration": 4 * np.einsum("ki,ki->k", moved, forward) / span[:, 0] ** 2,
        "elapsed": (time - starts[segment]) / (ends - starts)[segment],
    }


def unknown_blocks(rows, survey):
    """Blocks of functions for what no effect explains, as a tuple of UnknownBlock.

    Directions and functions whose covariate the survey doesn't vary, or doesn't know, are left
    out. Errors of places appear once for all rows, and once for the surveyed targets alone where
    there are other rows too: those are errors of the control.
    """
    seen = looks(rows, survey)
    functions = _functions(seen)
    metric = np.flatnonzero(rows.metric)
    order = np.argsort(seen.item, kind="stable")
    first = np.searchsorted(seen.item[order], rows.item[metric])
    last = np.searchsorted(seen.item[order], rows.item[metric], side="right")
    of_target = rows.survey_item >= 0
    mixed = of_target[metric].any() and not of_target[metric].all()
    blocks = []

    def add(name, direction, values, only=None):
        along = np.zeros((len(rows), values.shape[1]))
        for step in range(2):
            has = metric[first + step < last]
            look = order[(first + step)[first + step < last]]
            unit = seen.sign[look, None] * seen.directions[direction][look]
            projected = np.einsum("mi,mi->m", rows.direction[has], unit)
            along[has] += projected[:, None] * values[look]
        if only is not None:
            along[~only] = 0.0
        if np.abs(along).max(initial=0.0) > LEAST_PART:
            what = DIRECTIONS[direction] + ("" if only is None else " of the surveyed targets")
            drift = only is None and direction in PLACES and name in DRIFTING
            blocks.append(UnknownBlock(f"{what} {FUNCTIONS[name][0]}", along, drift))

    for name, values in functions.items():
        for direction in FUNCTIONS[name][1]:
            if direction in seen.directions:
                add(name, direction, values)
    for direction in PLACES if mixed else ():
        for name in ("constant", "map"):
            if name in functions:
                add(name, direction, functions[name], of_target)
    return tuple(blocks)


def _functions(seen):
    """Values (k, p) of the functions of each name at the looks."""
    c = seen.covariates
    away, speed, turn = c["range"], c["speed"], c["turn_rate"]
    time = _without_gaps(c["time"])
    one = np.ones((len(time), 1))
    found = {
        "constant": one,
        "elapsed": _centred(c["time"])[:, None],
        "warming": (1 - np.exp(-3 * (c["time"] - c["time"].min()) / max(np.ptp(c["time"]), 1e-9)))[
            :, None
        ],
        "elapsed in the pass": c["elapsed"][:, None],
        "time": _splines(time, np.ptp(time) / FINE),
        "slow time": _splines(time, 5),
        "location": _splines(c["location"], np.ptp(c["location"]) / LOCAL),
        "map": np.column_stack([_centred(v) for v in seen.xyz[:, :2].T]),
        "range": away[:, None] / away.mean(),
        "range squared": (away[:, None] / away.mean()) ** 2,
        "smooth range": _splines(np.log(away), 5),
        "cyclic range": _waves(2 * np.pi * away / max(np.ptp(away), 1e-9), CYCLES),
        "incidence": _splines(c["incidence"], 5),
        "intensity": _centred(c["intensity"])[:, None],
        "smooth intensity": _splines(c["intensity"], 5),
        "speed": speed[:, None] / max(speed.mean(), 1e-9),
        "speed squared": (speed[:, None] / max(speed.mean(), 1e-9)) ** 2,
        "smooth speed": _splines(speed, 5),
        "turn rate": turn[:, None],
        "turning": np.abs(turn)[:, None],
        "lateral acceleration": (speed * turn)[:, None],
        "acceleration": c["acceleration"][:, None],
        "roll rate": c["roll_rate"][:, None],
        "pitch rate": c["pitch_rate"][:, None],
        "heading": _waves(c["heading"], (1, 2)),
    }
    if len(np.unique(c["pass"])) > 1:
        number = c["pass"][:, None] == np.unique(c["pass"])
        found["pass"] = number[:, 1:] - number[:, 1:].mean(axis=0)
    if np.isfinite(c["scan_angle"]).all():
        angle = c["scan_angle"]
        found |= {
            "scan angle": angle[:, None],
            "once or twice a turn": _waves(angle, (1, 2)),
            "often a turn": _waves(angle, (3, 4, 5, 6)),
        }
    return {name: values for name, values in found.items() if values.shape[1]}


def _centred(values):
    """Values from -1 to 1 over their span."""
    low, high = values.min(), values.max()
    return (2 * values - low - high) / max(high - low, 1e-9)


def _without_gaps(time):
    """Times (k,) with long steps in which nothing was seen cut to FINE."""
    order = np.argsort(time)
    steps = np.minimum(np.diff(time[order], prepend=time[order][:1]), FINE)
    short = np.empty_like(time)
    short[order] = np.cumsum(steps)
    return short


def _waves(angle, orders):
    return np.column_stack([f(n * angle) for n in orders for f in (np.sin, np.cos)])


def _splines(values, number):
    """Cubic B-splines (k, p) over the span of values, on equal intervals; none without a span."""
    low, high = values.min(), values.max()
    if not high - low > 1e-6 * max(1.0, abs(high)):
        return np.zeros((len(values), 0))
    inner = int(np.clip(number, 5, MOST)) - 3
    step = (high - low) / inner
    knots = low + step * np.arange(-3, inner + 4)
    inside = np.clip(values, low, high - 1e-9 * (high - low))
    return BSpline.design_matrix(inside, knots, 3).toarray()
