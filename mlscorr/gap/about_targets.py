"""The pulses about observed targets, those too that nothing returned, and what lies behind."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.simulate.replay import RecordedPulses, aim, recorded_pulses
from mlscorr.simulate.worlds import BEFORE, FORMS, HOLE, Boards, paints

AROUND = 1.25  # sizes about the centre: a board's corner is 1.06 away
MARGIN = 0.3  # m more: by so much a target may move in a simulation
BESIDE = 1.0  # s before and after the observed points, in which their surroundings were scanned
GROWN = 1.05  # times a target's size: within that, what was recorded may be its edge
MOST = 40_000  # pulses about one target, those nearest in time: the vehicle may stand
REGULAR = 0.9  # of the short pauses, that must be of one pulse for others to be known
WHOLE = 0.7  # of all pauses: fewer tell of a thinned cloud
FEWEST = 100  # pulses that tell how others follow them
LEVEL = 0.01  # rad: elevations of one scan plane


@dataclass(frozen=True)
class Sighting:
    """An observed target that rows are of: their item, the FittedTarget, and where it was surveyed
    (3,) in m."""

    item: int
    fitted: object
    surveyed: np.ndarray


@dataclass(frozen=True)
class TargetLook:
    """Pulses about one target as observed (Boards of one); see Beams."""

    pulses: RecordedPulses
    board: Boards
    beyond: np.ndarray
    behind: np.ndarray

    @classmethod
    def join(cls, sighting, parts):
        """The look of a Sighting from pulses, in several chunks, about it."""
        pulses = RecordedPulses.concatenate([part for part, _, _, _ in parts])
        distance = np.concatenate([part for _, part, _, _ in parts])
        slant = np.concatenate([part for _, _, part, _ in parts])
        place = np.concatenate([part for _, _, _, part in parts])
        near = np.argsort(np.abs(pulses.gps_time - sighting.fitted.gps_time), kind="stable")[:MOST]
        near = near[np.argsort(pulses.gps_time[near], kind="stable")]
        pulses, place = pulses[near], place[near]
        beyond = pulses.range - distance[near]
        off = beyond * slant[near]
        form = FORMS.index(sighting.fitted.kind)
        shape = np.zeros(len(near), int), place / (1.0 if form == HOLE else GROWN)
        board = _board(sighting.fitted, np.zeros(3))
        own = (np.abs(off) <= BEFORE) & np.isfinite(board.paint(*shape))
        lit = (np.abs(off) <= BEFORE) & (board.paint(shape[0], place) == 1.0)
        if sighting.fitted.kind == "checkerboard":
            lit = own
        bright, dark, speckle = paints(sighting.fitted.kind, pulses.intensity[lit])
        board = _board(sighting.fitted, np.zeros(3), bright, dark, speckle)
        others = np.flatnonzero(~own & ~(off < -BEFORE))
        beyond, behind = beyond.copy(), pulses.intensity.copy()
        if own.any():
            nearest = _nearest(place, own, others)
            beyond[own] = np.nan if nearest is None else beyond[nearest]
            behind[own] = 0.0 if nearest is None else behind[nearest]
        return cls(pulses, board, beyond, behind)


def _nearest(place, own, others):
    if len(others) == 0:
        return None
    return others[cKDTree(place[others]).query(place[own])[1]]


def target_looks(rows, finding):
    """Sightings of the target rows."""
    on, sightings = rows.channel == "target", []
    matched = finding.matches.matched
    fitted = {
        (matched.name[i], matched.gps_time[i]): (matched.pass_number[i], matched.gps_time[i])
        for i in range(len(matched))
    }
    items, first = np.unique(rows.item[on], return_index=True)
    for item, row in zip(items, np.flatnonzero(on)[first], strict=True):
        name = rows.targets.name[rows.survey_item[row]]
        number, time = fitted.get((name, rows.gps_time[row]), (0, 0.0))
        target = finding.fitted.get((number, time))
        if target is not None:
            surveyed = rows.targets.position[rows.survey_item[row]]
            sightings.append(Sighting(int(item), target, surveyed))
    return sightings


def in_order(chunk):
    """A chunk in order of time."""
    if (np.diff(chunk.gps_time) >= 0).all():
        return chunk
    return chunk[np.argsort(chunk.gps_time, kind="stable")]


def about_target(platform, chunk, sighting, origin):
    """Pulses of a chunk about a target, whether they returned or not, with distance, cosine of
    incidence and place where they cross its plane: a list of one or no tuple.

    The chunk is in order of time and within the trajectory; the platform is the recorded one.
    """
    target = sighting.fitted
    span = target.cloud.gps_time.min() - BESIDE, target.cloud.gps_time.max() + BESIDE
    cloud = chunk[slice(*np.searchsorted(chunk.gps_time, span))]
    span = _within_pass(platform, cloud.gps_time, span)
    reach = AROUND * target.size + MARGIN
    reach += np.linalg.norm(target.position - sighting.surveyed)
    cloud, nearest = _passing(platform, cloud, origin, target.position, reach)
    if len(cloud) == 0:
        return []
    pulses = _first_returns(recorded_pulses(platform, cloud, origin, target.normal))
    pulses = RecordedPulses.concatenate([pulses, unreturned(pulses, span, reach / nearest)])
    beams = aim(platform, pulses.gps_time, pulses.angle, pulses.elevation)
    board = _board(target, origin)
    distance, slant, place = board.crossings(np.zeros(len(pulses), int), *beams)
    with np.errstate(invalid="ignore"):
        near = np.isfinite(distance) & (np.hypot(*place.T) <= reach)
    return [(pulses[near], distance[near], slant[near], place[near])] if near.any() else []


def _within_pass(platform, gps_time, span):
    """A span (s) cut to the epochs of the trajectory and to what a chunk may hold of it."""
    low, high = max(span[0], platform.epochs[0]), min(span[1], platform.epochs[-1])
    if len(gps_time):
        low, high = max(low, gps_time[0]), min(high, gps_time[-1])
    return low, high


def _passing(platform, cloud, origin, place, reach):
    """Points of a cloud whose beams pass a place (3,) within a reach, and the least distance of
    the scanner from the place. Units: m."""
    level = np.zeros(len(cloud))
    start = platform.place(cloud.gps_time, level, level, level, origin)
    sight, towards = cloud.xyz - start, place - start
    along = np.einsum("ni,ni->n", sight, towards) / np.linalg.norm(sight, axis=1)
    squared = np.einsum("ni,ni->n", towards, towards)
    passing = (along > 0) & (squared - along**2 <= reach**2)
    return cloud[passing], np.sqrt(squared[passing].min(initial=np.inf))


def _first_returns(pulses):
    """Pulses in order of time without later echoes: the same time and direction, farther away."""
    apart = np.abs(np.diff(pulses.angle)) + np.abs(np.diff(pulses.elevation))
    same = (np.diff(pulses.gps_time) == 0) & (
        apart * np.minimum(pulses.range[1:], pulses.range[:-1]) < 5e-3
    )
    group = np.append(0, np.cumsum(~same))
    order = np.lexsort((pulses.range, group))
    return pulses[order[np.unique(group[order], return_index=True)[1]]]


def unreturned(pulses, span, opening):
    """Pulses that were fired between recorded ones, and beside them, and met nothing.

    Parameters
    ----------
    pulses : RecordedPulses
        About one place, in order of time.
    span : (float, float)
        Times between which they are wanted. Units: s.
    opening : float
        Angle about the recorded ones. Units: rad.

    Times and angles go on in the steps of those recorded. None where these are not regular (rings
    of beams, jitter, a thinned cloud): then a target before the sky has only the beams that met
    it.
    """
    none, start, pause = pulses[:0], pulses.gps_time[0], np.diff(pulses.gps_time)
    if len(pause) < FEWEST or np.ptp(pulses.elevation) > LEVEL:
        return none
    step = np.percentile(pause, 25)
    single = np.abs(pause - step) < 0.1 * step
    if single.sum() < max(REGULAR * (pause < 1.5 * step).sum(), WHOLE * len(pause)):
        return none
    number = np.append(0, np.cumsum(np.round(pause / pause[single].mean()).astype(int)))
    first, step = _line(number, pulses.gps_time - start)
    if np.abs(pulses.gps_time - start - first - step * number).max() > 0.3 * step:
        return none
    turned = np.mod(np.diff(pulses.angle) + np.pi, 2 * np.pi) - np.pi
    rate = turned[single].mean()
    left = np.unwrap(np.mod(pulses.angle - rate * number, 2 * np.pi))
    zero, more = _line(number, left)
    if np.std(left - zero - more * number) > max(0.5 * abs(rate), 1e-3):
        return none
    every = np.arange(*np.ceil((np.array(span) - start - first) / step).astype(int))
    angle = np.mod(zero + (rate + more) * every + np.pi, 2 * np.pi) - np.pi
    middle = np.angle(np.exp(1j * pulses.angle).mean())
    width = np.abs(np.mod(pulses.angle - middle + np.pi, 2 * np.pi) - np.pi).max() + opening
    beside = np.abs(np.mod(angle - middle + np.pi, 2 * np.pi) - np.pi) <= width
    lost = np.flatnonzero(beside & ~np.isin(every, number))
    n = len(lost)
    return RecordedPulses(
        gps_time=start + first + step * every[lost],
        angle=angle[lost],
        elevation=np.full(n, np.median(pulses.elevation)),
        range=np.full(n, np.nan),
        intensity=np.zeros(n),
        incidence=np.ones(n),
    )


def _line(x, y):
    """Value at 0 and slope of the straight line through points (n,), by least squares."""
    slope = np.cov(x, y)[0, 1] / np.var(x, ddof=1)
    return y.mean() - slope * x.mean(), slope


def _board(target, origin, bright=1.0, dark=0.0, speckle=0.0):
    """Boards of one FittedTarget, about an origin (3,) in m."""
    view = target.view
    u, v = view.axes
    cos, sin = np.cos(view.turn), np.sin(view.turn)
    if target.kind == "circle":  # nobody knows how its board is turned: upright
        normal = np.cross(u, v)
        side = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
        u = np.cross(side, normal)
        u /= np.linalg.norm(u)
        v, cos, sin = np.cross(normal, u), 1.0, 0.0
    edges = np.array([cos * u + sin * v, cos * v - sin * u])
    return Boards(
        centre=(target.position - origin)[None],
        axes=np.vstack([edges, np.cross(*edges)])[None],
        form=np.array([FORMS.index(target.kind)]),
        size=np.array([target.size]),
        inner=np.array([view.inner]),
        bright=np.array([bright]),
        dark=np.array([dark]),
        speckle=np.array([speckle]),
    )
