"""Replay of a survey's own pulses in the full simulator, and the resulting residuals.

Targets are fitted again by the extraction, and planes to their points, as in build_rows. The world
consists of the reference surface, the targets at their surveyed positions, and planes as observed;
a plane in an overlap is a single one.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np

from mlscorr.effects import Effect
from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.closure.beams import Beams
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import Rows, gate, log_roughness, rounding_sigma
from mlscorr.gap.signatures import check_mounting, expected, joined
from mlscorr.simulate.scan import Draws, Met, Planes, Replay, TargetWorld, true_targets
from mlscorr.surfaces import fit_planes
from mlscorr.survey import PointCloud, Survey
from mlscorr.targets import BY_EDGES, BrightRegion, ScannerPath, diameter, fit_targets
from mlscorr.targets import SETTINGS as TARGETS

ON_PATCHES = ("shared", "roughness", "return_rate")


def rerun(
    rows: Rows, survey: Survey, beams: Beams, effects: Iterable[Effect], rng: np.random.Generator
) -> np.ndarray:
    """Residuals (m,) of the rows in a simulated survey with some effects.

    Parameters
    ----------
    rows : Rows
        Rows for which the Beams were collected, or some of them.
    survey : Survey
        Recorded survey; its Scanner gives the noise of the simulator.
    beams : Beams
    effects : iterable of Effect
        Effects from truth to record. Random effects on the pose are not simulated: their variance
        belongs to the background.
    rng : numpy.random.Generator
        One seed draws the same noise for any effects, so the difference of two runs is due to the
        effects.

    Returns
    -------
    (m,) array
        As in Rows, in the same units; NaN without a comparison: beams on another surface, or a
        target that is not found or much less accurate than observed.

    Raises
    ------
    ValueError
        If effects act on the beams of a survey without a mounting, or rows do not match the Beams.
    """
    effects = tuple(effects)
    views = _views_of(rows, beams)
    check_mounting(survey, effects)
    residual = np.full(len(rows), np.nan)
    if len(rows) == 0:
        return residual
    run, dither, speckle, fit_rng = _drawn(rows, survey, beams, effects, rng)
    patches = _as_seen(residual, rows, beams, views, run, dither, speckle, fit_rng)
    on = np.flatnonzero((rows.channel == "surface") & (views[:, 0] >= 0))
    if len(on) and beams.reference is not None:
        spread = OBSERVE.trims[-1] * np.sqrt(patches.variance)
        residual[on] = _surface(rows, survey, beams, on, views[on, 0], run, dither, spread)
    return residual


def _as_seen(residual, rows, beams, views, run, dither, speckle, fit_rng):
    """Fill the residuals of targets at their surveyed positions, and of observed planes; return
    their _Patches.
    """
    boards = _boards(rows, beams, run.effects)
    met = _meet(rows, beams, views, run.beams, boards, speckle)
    xyz, kept = run.measure(met)
    xyz += dither
    patches = _Patches.of(beams, xyz, kept, np.isfinite(met.range))
    for channel, values in zip(ON_PATCHES, (_shared, _roughness, _return_rate), strict=True):
        on = np.flatnonzero(rows.channel == channel)
        residual[on] = values(patches, views[on], rows.assumed[on])
    simulated = xyz, kept, met, run.beams, boards
    refit_targets(residual, rows, run.survey, beams, views, simulated, fit_rng)
    return patches


@dataclass(frozen=True)
class BeamSimulator:
    """Simulator on a survey's own beams, with the same noise in each run.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    beams : Beams
        Of these.
    effects : tuple of Effect
        Effects already in the simulator.
    seed : int
    """

    rows: Rows
    survey: Survey
    beams: Beams
    effects: tuple[Effect, ...]
    seed: int

    def added(self, effects: Iterable[Effect]) -> np.ndarray:
        """Effect of further effects on each row (m,), to first order if no run covers it."""
        union = reduce(joined, effects, [*self.effects])
        added = self._run(tuple(union)) - self._plain
        linear = expected(self.rows, self.survey, effects).shift
        return np.where(np.isfinite(added) & self.rows.metric, added, linear)

    @cached_property
    def _plain(self):
        return self._run(self.effects)

    def _run(self, effects):
        return rerun(self.rows, self.survey, self.beams, effects, np.random.default_rng(self.seed))


def _drawn(rows, survey, beams, effects, rng):
    """All random data, independent of the effects: the Replay, rounding of the points (n, 3) in
    m, speckle of the pulses near targets, and a generator for the fits.
    """
    draws, dither, speckle, fit_rng = rng.spawn(4)
    n = len(beams.view)
    on_target = beams.target[beams.view] >= 0
    draws = Draws.of(n, draws)
    rounding = rounding_sigma() * dither.standard_normal((n, 3))
    run = Replay(survey, beams.pulses, effects, rows.reference, draws, beams.origin)
    return run, rounding, speckle.standard_normal(n)[on_target], fit_rng


def _views_of(rows, beams):
    """Indices (m, 2) of the first and second view of each row's item; -1 for none."""
    views = np.full((len(rows), 2), -1)
    for column in (0, 1):
        numbers = np.flatnonzero(beams.second == bool(column))
        of_item = dict(zip(beams.item[numbers].tolist(), numbers, strict=True))
        views[:, column] = [of_item.get(item, -1) for item in rows.item.tolist()]
    other = (views[:, 0] >= 0) & (beams.gps_time[views[:, 0]] != rows.gps_time)
    if other.any():
        raise ValueError(
            f"{other.sum()} of {len(rows)} residuals have other times than in the Beams. Collect "
            "the beams again for these residuals."
        )
    return views


def _boards(rows, beams, effects):
    """Boards of the views at targets, at their true positions."""
    targets = true_targets(rows.targets, effects, rows.reference)
    of_item = dict(zip(rows.item.tolist(), rows.survey_item, strict=True))
    items = beams.item[beams.target >= 0].tolist()
    surveyed = np.array([of_item.get(item, -1) for item in items], dtype=int)
    if len(targets):
        centre = targets.position[surveyed] - beams.origin
    else:
        centre = np.empty((0, 3))
    return replace(beams.boards, centre=centre)


def _meet(rows, beams, views, shot, boards, speckle):
    """Met of all pulses, with the planes of patches and with targets."""
    point = beams.point.copy()
    normal = beams.normal.copy()
    shared, second = np.nonzero((views >= 0) & (rows.channel == "shared")[:, None])
    both = views[shared, second]  # one plane for both views
    point[both] = rows.position[shared] - beams.origin
    normal[both] = rows.direction[shared]
    offset = np.einsum("li,li->l", normal, point)
    on_target = beams.target[beams.view] >= 0
    flat, (start, direction) = ~on_target, shot
    view = beams.view[flat]
    planes = Planes(normal[view], offset[view], beams.pulses.intensity[flat])
    number = beams.target[beams.view[on_target]]
    world = TargetWorld(boards, number, beams.beyond[on_target], beams.behind[on_target], speckle)
    met = ((planes, flat), (world, on_target))  # patches have priority over targets
    return Met.concatenate([what.meet(start[on], direction[on]) for what, on in met])


@dataclass(frozen=True)
class _Patches:
    """Planes through the simulated points of each view of a patch; NaN or 0 for other views.

    centre, normal (l, 3); variance (l,) in m^2; number (l,) of points and of pulses that met it.
    """

    centre: np.ndarray
    normal: np.ndarray
    variance: np.ndarray
    points: np.ndarray
    fired: np.ndarray

    @classmethod
    def of(cls, beams, xyz, kept, met):
        flat = beams.target[beams.view] < 0
        count = int((beams.target < 0).sum())
        fired = np.bincount(beams.view[flat & met], minlength=len(beams))
        measured = flat & kept & met
        view = beams.view[measured]
        points = np.bincount(view, minlength=len(beams))
        local = xyz[measured] - beams.origin - beams.point[view]
        planes = fit_planes(local, np.searchsorted(view, np.arange(count + 1)))
        full = planes.points >= OBSERVE.plane_points
        centre, normal = np.full((2, len(beams), 3), np.nan)
        centre[:count] = np.where(full[:, None], planes.mean + beams.point[:count], np.nan)
        turned = np.sign(np.einsum("li,li->l", planes.normal, beams.normal[:count]))
        normal[:count] = planes.normal * turned[:, None]
        variance = np.full(len(beams), np.nan)
        variance[:count] = np.where(full, planes.variance, np.nan)
        return cls(centre, normal, variance, points, fired)


def _shared(patches, views, _assumed):
    first, second = views.T
    normal = patches.normal[first] + patches.normal[second]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    separation = patches.centre[first] - patches.centre[second]
    return np.where((views >= 0).all(axis=1), np.einsum("mi,mi->m", normal, separation), np.nan)


def _roughness(patches, views, assumed):
    view = views[:, 0]
    variance = np.maximum(patches.variance[view], 1e-12)
    ratio, _ = log_roughness(variance, assumed, patches.points[view])
    return np.where(view >= 0, ratio, np.nan)


def _return_rate(patches, views, _assumed):
    view = views[:, 0]
    share = patches.points[view] / np.maximum(patches.fired[view], 1)
    return np.where((view >= 0) & (patches.fired[view] > 0), share - 1.0, np.nan)


def _surface(rows, survey, beams, on, view, run, dither, spread):
    """Mean distance (k,) of simulated points from the facets that the recorded beams meet.

    Points farther from the median than the spread (l,) and any roughness belong to another surface.
    """
    fired = np.flatnonzero(np.isin(beams.view, view))  # other pulses are not compared
    of = beams.view[fired]
    facet = beams.facet[fired]
    start, beam = (values[fired] for values in run.beams)
    part, triangle = beams.reference.meet(start, beam, beams.pulses.intensity[fired])
    met = Met(np.full(len(dither), np.nan), np.ones(len(dither)), beams.pulses.intensity)
    met.range[fired] = part.range
    met.incidence[fired] = part.incidence
    xyz, kept = (values[fired] for values in run.measure(met))
    normal = beams.reference.mesh.normal
    offset = beams.reference.mesh.offset
    direction = np.zeros((len(beams), 3))
    largest = np.zeros(len(beams))
    direction[view] = rows.direction[on]
    largest[view] = np.abs(rows.residual[on]) + gate(survey, rows.gps_time[on])
    cosine = np.einsum("ni,ni->n", normal[triangle], direction[of])
    used = kept & (triangle >= 0) & (np.abs(cosine) >= np.cos(OBSERVE.parallel))
    cosine = np.einsum("ni,ni->n", normal[facet], direction[of])
    used &= (facet >= 0) & (np.abs(cosine) >= np.cos(OBSERVE.parallel))
    away = np.einsum("ni,ni->n", normal[facet], xyz + dither[fired] - beams.origin)
    away = (away - offset[facet]) * np.sign(cosine)
    used &= np.abs(away) <= largest[of]
    middle = _median(np.where(used, away, np.nan), of, len(beams))
    limit = np.fmax(spread, OBSERVE.roughest)
    with np.errstate(invalid="ignore"):
        used &= np.abs(away - middle[of]) <= limit[of]

    def count(which):
        return np.bincount(of, which, len(beams))[view]

    number = count(used)
    lost = count(np.isfinite(part.range) & ~kept)
    known = number >= np.maximum(1, OBSERVE.facet_share * (count(of >= 0) - lost))
    return np.where(known, count(np.where(used, away, 0.0)) / np.maximum(number, 1), np.nan)


def _median(values, view, count):
    """Median (l,) of each view's values (n,) that are not NaN."""
    order = np.lexsort((values, view))  # NaN last
    first = np.searchsorted(view, np.arange(count))
    number = np.bincount(view, np.isfinite(values), count).astype(int)
    return values[order[np.minimum(first + number // 2, len(view) - 1)]]


def refit_targets(
    residual: np.ndarray,
    rows: Rows,
    survey: Survey,
    beams: Beams,
    views: np.ndarray,
    simulated: tuple,
    rng: np.random.Generator,
) -> None:
    """Fill the residuals of target rows from the simulated targets found by the extraction.

    Parameters
    ----------
    residual : (m,) array
        Unchanged if a target cannot be compared. Units: m.
    rows : Rows
    survey : Survey
    beams : Beams
    views : (m, 2) int array
        Numbers of the views of each row.
    simulated : tuple
        Points (n, 3) on the map and flags (n,) of kept ones, Met, the true beams, and Boards at the
        true positions.
    rng : numpy.random.Generator
        Generator for the extraction.
    """
    xyz, kept, met, (start, direction), boards = simulated
    seed = rng.integers(2**63)
    fitted = {}
    for row in np.flatnonzero((rows.channel == "target") & (views[:, 0] >= 0)):
        view = views[row, 0]
        if view not in fitted:
            first, last = np.searchsorted(beams.view, [view, view + 1])
            points = first + np.flatnonzero(kept[first:last])
            true = start[points] + met.range[points, None] * direction[points]
            if len(points):
                moved = (xyz[points] - beams.origin - true).mean(axis=0)
            else:
                moved = 0.0
            place = boards.centre[beams.target[view]] + moved + beams.origin
            cloud = PointCloud(xyz[points], beams.pulses.gps_time[points], met.intensity[points])
            number = rows.survey_item[row]
            shape = rows.targets.kind[number], float(rows.targets.size[number])
            bright = boards.bright[beams.target[view]]
            same_rng = np.random.default_rng(seed)  # the same for each target
            fitted[view] = _fitted(cloud, shape, survey, place, bright, same_rng)
        target = fitted[view]
        along = rows.direction[row]
        # a plate with edges along the scan lines is well determined at one position, but not next
        # to it
        worst = max(SETTINGS.worst**2 * rows.noise[row], SETTINGS.least_worst**2)
        if target is None or along @ target.covariance @ along > worst:
            continue
        residual[row] = along @ (target.position - rows.targets.position[rows.survey_item[row]])


def _fitted(cloud, shape, survey, place, bright, rng):
    """FittedTarget near its expected position, or None.

    Points brighter than half way from background to paint are tried first, which usually suffices.
    """
    kind, size = shape
    distance = np.linalg.norm(cloud.xyz - place, axis=1)
    if (distance <= SETTINGS.largest_offset * size).sum() < TARGETS.smallest_count:
        return None
    path = ScannerPath.of(survey, cloud.gps_time)
    surroundings = cloud.intensity[distance > SETTINGS.background * size]
    dark = np.percentile(surroundings, 90) if len(surroundings) else 0.0
    spot = BrightRegion(place, SETTINGS.extent * diameter(kind, size), (bright + dark) / 2)
    lit = (cloud.intensity >= spot.threshold) & (distance <= spot.radius)
    if kind in BY_EDGES or lit.sum() < TARGETS.smallest_count:
        spots = [None]
    else:
        spots = [spot, None]
    for spot in spots:
        targets = fit_targets(cloud, path, [shape], survey.scanner, rng, spot)
        away = [np.linalg.norm(target.position - place) for target in targets]
        if away and min(away) <= SETTINGS.largest_offset * size:
            return targets[int(np.argmin(away))]
    return None
