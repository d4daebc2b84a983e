"""The full simulator run again on a survey's own pulses: what the residuals would be in it.

Targets are fitted anew by the extraction, and planes anew to their points, as build_rows does
with the survey itself. The world is the reference surface, the targets where they were surveyed,
and planes as the survey shows them; a plane that was seen twice is one.
"""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.gap.assemble import gate
from mlscorr.gap.beams import INSIDE, Beams, collect_beams
from mlscorr.gap.changes import NEEDS_MOUNTING
from mlscorr.gap.channels import PARAMETERS, ROUNDING
from mlscorr.gap.patches import FEWEST, ROUGHEST, SAMPLES, moments
from mlscorr.gap.refit import refit_targets
from mlscorr.gap.surfaces import LEAST_HITS, PARALLEL
from mlscorr.simulate.replay import Draws, Replay, true_targets
from mlscorr.simulate.worlds import Met, Planes, TargetWorld

__all__ = ["Beams", "collect_beams", "rerun"]
LEAST_SHARE = LEAST_HITS / SAMPLES  # of a patch's beams that must meet the reference
ON_PATCHES = ("shared", "roughness", "return_rate")


def rerun(rows, survey, beams, effects, rng):
    """Residuals (m,) of the rows in a survey that the simulator makes with some effects.

    Parameters
    ----------
    rows : Rows
        Those that the Beams were collected for, or some of them.
    survey : Survey
        As recorded; its Scanner says what noise the simulator makes.
    beams : Beams
    effects : iterable of Effect
        Turn truth into record. Random ones on the pose are not realised: their variance is the
        background's.
    rng : numpy.random.Generator
        One seed draws the same noise whatever the effects are: the difference of two runs is what
        the effects do.

    Residuals are as in Rows, in the same units; NaN where nothing can be compared: beams that meet
    another surface, a target that isn't found or known much worse than as observed. Raises
    ValueError for effects on the beams of a survey without a mounting, and for rows that are not
    the Beams'.

    >>> import tempfile
    >>> from mlscorr.effects import make_effect
    >>> from mlscorr.gap.pairing import build_rows
    >>> from mlscorr.io.survey_file import read_survey
    >>> from mlscorr.pipeline.finding import find_targets
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 5.0},
    ...     targets={"control": 3, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = read_survey(folder)
    >>> finding = find_targets(survey)
    >>> rows = build_rows(survey, finding.matches.matched, finding.candidates, patches=20).rows
    >>> beams = collect_beams(survey, rows, finding)
    >>> datum = make_effect("vertical_datum", magnitude=0.1)
    >>> without, shifted = (
    ...     rerun(rows, survey, beams, effects, np.random.default_rng(2))
    ...     for effects in ((), (datum,))
    ... )
    >>> up = rows.covariates["axis"] == 2
    >>> float(np.nanmedian((shifted - without)[up]).round(2))
    -0.1
    """
    effects, looks = tuple(effects), _looks_of(rows, beams)
    _check_mounting(survey, effects)
    residual = np.full(len(rows), np.nan)
    if len(rows) == 0:
        return residual
    run, dither, speckle, fit_rng = _drawn(rows, survey, beams, effects, rng)

    # Targets where they were surveyed, and planes as they were seen.
    boards = _boards(rows, beams, effects)
    met = _meet(rows, beams, run.beams, boards, speckle)
    xyz, kept = run.measure(met)
    xyz += dither
    patches = _Patches.of(beams, xyz, kept, np.isfinite(met.range))
    for channel, values in zip(ON_PATCHES, (_shared, _roughness, _return_rate), strict=True):
        on = np.flatnonzero(rows.channel == channel)
        residual[on] = values(patches, looks[on], rows.believed[on])
    refit_targets(
        residual, rows, survey, beams, looks, (xyz, kept, met, run.beams, boards), fit_rng
    )

    # The reference surface.
    on = np.flatnonzero((rows.channel == "surface") & (looks[:, 0] >= 0))
    if len(on) and beams.reference is not None:
        spread = INSIDE * np.sqrt(patches.variance)
        residual[on] = _surface(rows, survey, beams, on, looks[on, 0], run, dither, spread)
    return residual


def _drawn(rows, survey, beams, effects, rng):
    """All that is random, whatever the effects are: the Replay, rounding of the points (n, 3) in
    m, speckle of the pulses about targets, and a generator for the fits."""
    draws, dither, speckle, fit_rng = rng.spawn(4)
    n, on_target = len(beams.look), beams.target[beams.look] >= 0
    draws, rounding = Draws.of(n, draws), ROUNDING * dither.standard_normal((n, 3))
    run = Replay(survey, beams.pulses, effects, rows.reference, draws, beams.origin)
    return run, rounding, speckle.standard_normal(n)[on_target], fit_rng


def _check_mounting(survey, effects):
    for effect in effects:
        if survey.mounting is None and effect.stage in NEEDS_MOUNTING:
            raise ValueError(
                f"{effect.name} acts on the {effect.stage}, and {survey.path} has no [mounting]: "
                "without it nobody knows the beams."
            )


def _looks_of(rows, beams):
    """Numbers (m, 2) of the first and second look of each row's item; -1 for none."""
    looks = np.full((len(rows), 2), -1)
    for column in (0, 1):
        numbers = np.flatnonzero(beams.second == bool(column))
        numbers = numbers[np.argsort(beams.item[numbers])]
        if len(numbers) == 0:
            continue
        place = np.minimum(np.searchsorted(beams.item[numbers], rows.item), len(numbers) - 1)
        here = beams.item[numbers[place]] == rows.item
        looks[here, column] = numbers[place[here]]
    known = looks[:, 0] >= 0
    other = known & (beams.gps_time[looks[:, 0]] != rows.gps_time)
    if other.any():
        raise ValueError(
            f"{other.sum()} of {len(rows)} rows have another time than in the Beams: collect the "
            "beams anew for these rows."
        )
    return looks


def _boards(rows, beams, effects):
    """Boards of the looks at targets, where these truly are."""
    targets = true_targets(rows.targets, effects, rows.reference)
    item = beams.item[beams.target >= 0]
    known, row = np.unique(rows.item, return_index=True)
    place = np.minimum(np.searchsorted(known, item), max(len(known) - 1, 0))
    surveyed = np.where(known[place] == item, rows.survey_item[row[place]], -1)
    centre = targets.position[surveyed] - beams.origin if len(targets) else np.empty((0, 3))
    return replace(beams.boards, centre=centre)


def _meet(rows, beams, shot, boards, speckle):
    """Met of all pulses: with the planes of patches, and with targets."""
    point, normal = beams.point.copy(), beams.normal.copy()
    shared = np.flatnonzero(rows.channel == "shared")
    order = shared[np.argsort(rows.item[shared])]
    if len(order):  # one plane for both looks
        place = np.minimum(np.searchsorted(rows.item[order], beams.item), len(order) - 1)
        both = rows.item[order[place]] == beams.item
        point[both] = rows.position[order[place[both]]] - beams.origin
        normal[both] = rows.direction[order[place[both]]]
    offset = np.einsum("li,li->l", normal, point)
    on_target = beams.target[beams.look] >= 0
    flat, (start, direction) = ~on_target, shot
    look = beams.look[flat]
    parts = [
        Planes(normal[look], offset[look], beams.pulses.intensity[flat]).meet(
            start[flat], direction[flat]
        )
    ]
    number = beams.target[beams.look[on_target]]
    behind = beams.beyond[on_target], beams.behind[on_target]
    world = TargetWorld(boards, number, *behind, speckle)
    parts.append(world.meet(start[on_target], direction[on_target]))
    # patches stand before targets
    names = ("range", "incidence", "intensity")
    return Met(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True)
class _Patches:
    """Planes through the simulated points of each look at a patch; NaN or 0 for other looks.

    centre, normal (l, 3); variance (l,) in m^2; number (l,) of points and of pulses that met it.
    """

    centre: np.ndarray
    normal: np.ndarray
    variance: np.ndarray
    points: np.ndarray
    fired: np.ndarray

    @classmethod
    def of(cls, beams, xyz, kept, met):
        flat = beams.target[beams.look] < 0
        look, count = beams.look[flat], int((beams.target < 0).sum())
        several = len(beams)
        centre, normal = np.full((several, 3), np.nan), np.full((several, 3), np.nan)
        variance = np.full(several, np.nan)
        points, fired = np.zeros(several), np.zeros(several)
        if count:
            first = np.searchsorted(look, np.arange(count))
            local = xyz[flat] - beams.origin - beams.point[look]
            weight = (kept & met)[flat].astype(float)
            local[weight == 0] = 0.0
            mean, values, axes = moments(local, weight, first, look)
            points[:count] = np.add.reduceat(weight, first)
            fired[:count] = np.add.reduceat(met[flat].astype(float), first)
            told = points[:count] >= FEWEST
            centre[:count] = np.where(told[:, None], mean + beams.point[:count], np.nan)
            turned = np.sign(np.einsum("li,li->l", axes[:, :, 0], beams.normal[:count]))
            normal[:count] = axes[:, :, 0] * turned[:, None]
            freedom = np.maximum(points[:count] - PARAMETERS, 1)
            variance[:count] = np.where(told, values[:, 0] * points[:count] / freedom, np.nan)
        return cls(centre, normal, variance, points, fired)


def _shared(patches, looks, believed):
    first, second = looks.T
    normal = patches.normal[first] + patches.normal[second]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    apart = patches.centre[first] - patches.centre[second]
    return np.where((looks >= 0).all(axis=1), np.einsum("mi,mi->m", normal, apart), np.nan)


def _roughness(patches, looks, believed):
    look = looks[:, 0]
    freedom = np.maximum(patches.points[look] - PARAMETERS, 1)
    ratio = np.log(np.maximum(patches.variance[look], 1e-12) / believed) + 1 / freedom
    return np.where(look >= 0, ratio, np.nan)


def _return_rate(patches, looks, believed):
    look = looks[:, 0]
    share = patches.points[look] / np.maximum(patches.fired[look], 1)
    return np.where((look >= 0) & (patches.fired[look] > 0), share - 1.0, np.nan)


def _surface(rows, survey, beams, on, look, run, dither, spread):
    """Mean distance (k,) of simulated points from the facets that the recorded beams meet.

    Points farther than the spread (l,) and ROUGHEST from the middle one are of another surface.
    """
    met, triangle = beams.reference.meet(*run.beams, beams.pulses.intensity)
    xyz, kept = run.measure(met)
    normal, offset = beams.reference.planes
    direction, reach = np.zeros((len(beams), 3)), np.zeros(len(beams))
    direction[look], reach[look] = rows.direction[on], gate(survey, rows.gps_time[on])
    towards = direction[beams.look]
    cosine = np.einsum("ni,ni->n", normal[beams.facet], towards)
    true_cosine = np.einsum("ni,ni->n", normal[triangle], towards)
    away = np.einsum("ni,ni->n", normal[beams.facet], xyz + dither - beams.origin)
    away = (away - offset[beams.facet]) * np.sign(cosine)
    used = kept & (beams.facet >= 0) & (triangle >= 0) & (np.abs(away) <= reach[beams.look])
    used &= (np.abs(cosine) >= PARALLEL) & (np.abs(true_cosine) >= PARALLEL)

    middle = _median(np.where(used, away, np.nan), beams.look, len(beams))
    limit = np.fmax(spread, ROUGHEST)
    with np.errstate(invalid="ignore"):
        used &= np.abs(away - middle[beams.look]) <= limit[beams.look]

    def count(which):
        return np.bincount(beams.look, which, len(beams))[look]

    number, lost = count(used), count(np.isfinite(met.range) & ~kept)
    enough = number >= np.maximum(1, LEAST_SHARE * (count(beams.look >= 0) - lost))
    mean = count(np.where(used, away, 0.0)) / np.maximum(number, 1)
    return np.where(enough, mean, np.nan)


def _median(values, look, count):
    """Median (l,) of each look's values (n,) that are not NaN."""
    order = np.lexsort((values, look))  # NaN last
    first = np.searchsorted(look, np.arange(count))
    number = np.bincount(look, np.isfinite(values), count).astype(int)
    return values[order[np.minimum(first + number // 2, len(look) - 1)]]
