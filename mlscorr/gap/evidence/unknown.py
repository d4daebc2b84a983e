"""General blocks for errors that no known effect explains.

They describe an error in some direction that varies with a covariate, and give a hint in words.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import displacements
from mlscorr.survey import Survey

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
    "clock": "time error",
}
PLACES = ("east", "north", "height")
BODY = ("right", "forward", "height")
TURNS = ("roll", "pitch", "yaw")
BEAMS = ("beam", "scan", "across")
ANY = tuple(DIRECTIONS)  # smooth functions of any covariate may act in any direction
FUNCTIONS = {  # name: words, directions
    "constant": ("that is constant", (*BODY, *BEAMS, *TURNS, "clock")),
    "pass": ("that differs between passes", (*PLACES, *BODY[:2], "beam", "scan", *TURNS, "clock")),
    "elapsed": ("that grows with time", (*PLACES, *BODY[:2], *BEAMS, *TURNS, "clock")),
    "warming": ("that grows with time and settles", ("beam", "scan", *TURNS)),
    "elapsed in the pass": ("that grows in each pass", (*TURNS, "clock")),
    "time": ("that comes and goes with time", PLACES),
    "slow time": ("that changes slowly with time", ANY),
    "location": ("that depends on the place along the drive", PLACES),
    "map": ("that depends on the place on the map", PLACES),
    "range": ("in proportion to the range", ("height", "beam", "right")),
    "range squared": ("that grows with the range squared", ("height", "beam")),
    "smooth range": ("that depends on the range", ANY),
    "cyclic range": ("that repeats with the range", ("beam",)),
    "incidence": ("that depends on the incidence angle", BEAMS),
    "intensity": ("that grows with the intensity", ("beam",)),
    "smooth intensity": ("that depends on the intensity", ("beam", "scan")),
    "scan angle": ("in proportion to the scan angle", ("scan", "across", "beam")),
    "once or twice a turn": ("that repeats once or twice a turn of the scanner", ANY),
    "often a turn": ("that repeats several times a turn of the scanner", BEAMS),
    "speed": ("that grows with speed", (*BODY, "beam", *TURNS)),
    "speed squared": ("that grows with speed squared", (*BODY, "pitch")),
    "smooth speed": ("that depends on speed", ANY),
    "turn rate": ("that grows with the turn rate", (*BODY, *TURNS)),
    "turning": ("that grows with the turn rate to either side", ("height", "pitch")),
    "lateral acceleration": ("that grows with speed times turn rate", ("right", "height", "roll")),
    "acceleration": ("that grows with acceleration", ("forward", "height", "pitch")),
    "roll rate": ("that grows with the roll rate", ("roll",)),
    "pitch rate": ("that grows with the pitch rate", ("pitch",)),
    "heading": ("that depends on the heading", ANY),
    "slow place": ("that changes slowly with the place", ANY),
    "smooth turn rate": ("that depends on the turn rate", ANY),
    "smooth acceleration": ("that depends on acceleration", ANY),
    "smooth roll": ("that depends on the roll of the vehicle", ANY),
    "smooth pitch": ("that depends on the pitch of the vehicle", ANY),
    "fine range": ("that varies with the range", ANY),
    "fine speed": ("that varies with speed", ANY),
    "fine heading": ("that varies with the heading", ANY),
    "fine turn rate": ("that varies with the turn rate", ANY),
    "fine acceleration": ("that varies with acceleration", ANY),
    "fine roll": ("that varies with the roll of the vehicle", ANY),
    "fine pitch": ("that varies with the pitch of the vehicle", ANY),
    "fine time": ("that varies with time", (*BEAMS, *TURNS, "clock")),
}
DRIFT_FUNCTIONS = ("time", "slow time", "location", "slow place", "pass", "elapsed")


@dataclass(frozen=True)
class UnknownBlock:
    """One direction times one function: columns (m, p) of the rows, and the hint in words.

    is_drift is True if the POS's own drift may appear the same.
    """

    hint: str
    columns: np.ndarray
    is_drift: bool


def unknown_blocks(rows: Rows, survey: Survey) -> tuple[UnknownBlock, ...]:
    """Make blocks of functions for errors that no effect explains.

    Directions and functions whose covariate is constant or unknown in the survey are omitted.
    Position-dependent errors appear once for all rows and, if there are other rows, once for the
    surveyed targets only, as errors of the control.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    """
    views = displacements(rows, survey)
    functions = _functions(views)
    metric = np.flatnonzero(rows.metric)
    order = np.argsort(views.item, kind="stable")
    first = np.searchsorted(views.item[order], rows.item[metric])
    last = np.searchsorted(views.item[order], rows.item[metric], side="right")
    of_target = rows.survey_item >= 0
    mixed = of_target[metric].any() and not of_target[metric].all()
    blocks = []

    def add(name, direction, values, only=None):
        along = np.zeros((len(rows), values.shape[1]))
        for step in range(2):
            has = metric[first + step < last]
            view = order[(first + step)[first + step < last]]
            unit = views.sign[view, None] * views.directions[direction][view]
            projected = np.einsum("mi,mi->m", rows.direction[has], unit)
            along[has] += projected[:, None] * values[view]
        if only is not None:
            along[~only] = 0.0
        if np.abs(along).max(initial=0.0) > 1e-6:  # otherwise it is not visible
            what = DIRECTIONS[direction] + ("" if only is None else " of the surveyed targets")
            drift = only is None and direction in PLACES + BODY and name in DRIFT_FUNCTIONS
            blocks.append(UnknownBlock(f"{what} {FUNCTIONS[name][0]}", along, drift))

    for name, values in functions.items():
        for direction in FUNCTIONS[name][1]:
            if direction in views.directions:
                add(name, direction, values)
    for direction in PLACES if mixed else ():
        for name in ("constant", "map"):
            if name in functions:
                add(name, direction, functions[name], of_target)
    return tuple(blocks)


def _functions(views):
    """Values (k, p) of the functions of each name at the views."""
    c = views.covariates
    parts = (_of_time, _of_place, _of_beam, _of_motion, _of_pass, _of_scan_angle)
    values: dict[str, np.ndarray] = {}
    for part in parts:
        values |= part(c)
    values["map"] = np.column_stack([_centred(v) for v in views.xyz[:, :2].T])
    return {name: values[name] for name in FUNCTIONS if name in values and values[name].shape[1]}


def _of_time(c):
    since = c["time"] - c["time"].min()
    time = _without_gaps(c["time"])
    return {
        "constant": np.ones((len(time), 1)),
        "elapsed": _centred(c["time"])[:, None],
        "warming": 1 - np.exp(-3 * since / max(np.ptp(since), 1e-9))[:, None],
        "elapsed in the pass": c["elapsed"][:, None],
        "time": _splines(time, np.ptp(time) / SETTINGS.knots),
        "slow time": _splines(time, 5),
    } | _smooth("time", time)


def _of_place(c):
    place = c["location"]
    return {
        "location": _splines(place, np.ptp(place) / SETTINGS.knots_place),
        "slow place": _splines(place, 5),
    }


def _of_beam(c):
    away = c["range"]
    return {
        "range": away[:, None] / away.mean(),
        "range squared": (away[:, None] / away.mean()) ** 2,
        "cyclic range": _waves(2 * np.pi * away / max(np.ptp(away), 1e-9), range(1, 7)),
        "incidence": _splines(c["incidence"], 5),
        "intensity": _centred(c["intensity"])[:, None],
        "smooth intensity": _splines(c["intensity"], 5),
    } | _smooth("range", np.log(away))


def _of_motion(c):
    speed = c["speed"]
    turn = c["turn_rate"]
    values = {
        "speed": speed[:, None] / max(speed.mean(), 1e-9),
        "speed squared": (speed[:, None] / max(speed.mean(), 1e-9)) ** 2,
        "turn rate": turn[:, None],
        "turning": np.abs(turn)[:, None],
        "lateral acceleration": (speed * turn)[:, None],
        "acceleration": c["acceleration"][:, None],
        "roll rate": c["roll_rate"][:, None],
        "pitch rate": c["pitch_rate"][:, None],
        "heading": _waves(c["heading"], (1, 2)),
        "fine heading": _waves(c["heading"], range(3, 7)),
    }
    for name in ("speed", "turn rate", "acceleration", "roll", "pitch"):
        values |= _smooth(name, c[name.replace(" ", "_")])
    return values


def _of_pass(c):
    number = c["pass"][:, None] == np.unique(c["pass"])
    return {"pass": number[:, 1:] - number[:, 1:].mean(axis=0)}


def _of_scan_angle(c):
    angle = c["scan_angle"]
    if not np.isfinite(angle).all():
        return {}
    return {
        "scan angle": angle[:, None],
        "once or twice a turn": _waves(angle, (1, 2)),
        "often a turn": _waves(angle, (3, 4, 5, 6)),
    }


def _centred(values):
    """Values scaled to -1 to 1 over their span."""
    low = values.min()
    high = values.max()
    return (2 * values - low - high) / max(high - low, 1e-9)


def _without_gaps(time):
    """Times (k,) with long unobserved steps reduced to the spacing of knots."""
    order = np.argsort(time)
    steps = np.minimum(np.diff(time[order], prepend=time[order][:1]), SETTINGS.knots)
    short = np.empty_like(time)
    short[order] = np.cumsum(steps)
    return short


def _waves(angle, orders):
    return np.column_stack([f(n * angle) for n in orders for f in (np.sin, np.cos)])


def _smooth(name, values):
    """Smooth functions of a covariate (k,), as fine as half of a block's size."""
    fine = SETTINGS.functions // 2
    return {f"smooth {name}": _splines(values, 5), f"fine {name}": _splines(values, fine)}


def _splines(values, number):
    """Cubic B-splines (k, p) over the span of values, on equal intervals; none without a span."""
    low = values.min()
    high = values.max()
    if not high - low > 1e-6 * max(1.0, abs(high)):
        return np.zeros((len(values), 0))
    inner = int(np.clip(number, 5, SETTINGS.functions)) - 3
    step = (high - low) / inner
    knots = low + step * np.arange(-3, inner + 4)
    inside = np.clip(values, low, high - 1e-9 * (high - low))
    return BSpline.design_matrix(inside, knots, 3).toarray()
