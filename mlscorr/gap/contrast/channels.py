"""Channels of a real and a simulated cloud, compared by range, incidence and reflectance.

Cells of both are paired, and range, incidence and brightness of a cell are those of both together.
Selections by these apply equally to both, so that twins differ only by chance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.gap.contrast._edges import Edges
from mlscorr.gap.contrast._settings import SETTINGS
from mlscorr.gap.contrast._words import SILENT, sentence
from mlscorr.gap.contrast.sample import ChannelSample, of_shared_moments
from mlscorr.gap.contrast.tables import Binning, Contrast, Measure, block_of, weights_of
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import Patches, scanner_origin
from mlscorr.survey import Columns, Survey

CLASSES = ("dark", "medium", "bright")


@dataclass(frozen=True, repr=False)
class PairedCells(Columns):
    """Cells in which at least one cloud has points.

    Parameters
    ----------
    points : (c, 2) array
        Of the real and of the simulated cloud.
    brightness : (c, 2) array
        Mean log10 of the intensity; NaN if either has too few points.
    range : (c,) array
        Units: m.
    incidence : (c,) array
        NaN if the cell is not flat. Units: deg.
    block : (c,) int array
    """

    points: np.ndarray
    brightness: np.ndarray
    range: np.ndarray
    incidence: np.ndarray
    block: np.ndarray


def contrast_clouds(
    survey: Survey, real: ChannelSample, simulated: ChannelSample, rng: np.random.Generator
) -> tuple[Contrast, ...]:
    """Compare each channel of two clouds.

    Parameters
    ----------
    survey : Survey
    real, simulated : ChannelSample
    rng : numpy.random.Generator
        For replicas of the bootstrap.
    """
    real, simulated = of_shared_moments((real, simulated))
    pairs = paired_cells(survey, real, simulated)
    return _judged(
        [
            _intensity(pairs, real, simulated, rng),
            _density(pairs, rng),
            _dropout(survey, real.patches, simulated.patches, None, rng),
            _edge_width(real, simulated, rng),
        ]
    )


def contrast_returns(
    survey: Survey, patches: Patches | None, loss: float | None, rng: np.random.Generator
) -> tuple[Contrast, ...]:
    """Compare a cloud with the assumptions: only lost returns can be compared.

    Parameters
    ----------
    survey : Survey
    patches : Patches or None
    loss : float or None
        Share of returns that the simulator loses; None if unknown.
    rng : numpy.random.Generator
        For replicas of the bootstrap.
    """
    silent = [Contrast(name, SILENT[name]) for name in ("intensity", "density", "edge_width")]
    return _judged([silent[0], silent[1], _dropout(survey, patches, None, loss, rng), silent[2]])


def _judged(channels: Sequence[Contrast | Measure]) -> tuple[Contrast, ...]:
    """Contrasts with significant differences, corrected for the number of tests."""
    tables = [
        [measure.table(split) for split in measure.splits] if isinstance(measure, Measure) else []
        for measure in channels
    ]
    tests = sum(int(np.isfinite(table.value).sum()) + 1 for part in tables for table, _ in part)
    return tuple(
        _contrast(each, part, tests) if isinstance(each, Measure) else each
        for each, part in zip(channels, tables, strict=True)
    )


def _contrast(measure, tables, tests):
    """Contrast of a Measure: its clearest table first, then the others after its removal.

    Distant objects are often observed obliquely, so a difference by range also appears by
    incidence.
    """
    judged = [table.judged(tests) for table, _ in tables]
    clear = [_explained(table, sums) for table, (_, sums) in zip(judged, tables, strict=True)]
    whole, sums_of_all = measure.whole()
    whole = whole.judged(tests)
    sentences = []
    if max(clear) == 0.0:  # too few blocks in each bin, but enough in total
        sentences.append(sentence(measure, whole, sums_of_all))
    else:
        best = int(np.argmax(clear))
        first = judged[best]
        split = measure.splits[best]
        sentences.append(sentence(measure, first, tables[best][1]))
        number = split.number(first.edges)
        change = np.where(number >= 0, np.nan_to_num(first.value)[number], 0.0)
        rest = measure.without(change)
        for other in measure.splits:
            if other is not split:
                table, sums = rest.table(other)
                sentences.append(sentence(rest, table.judged(tests), sums, is_further=True))
    return Contrast(measure.channel, "", whole, tuple(judged), tuple(filter(None, sentences)))


def _explained(table, sums):
    """Mean square of the significant values, weighted by bins."""
    weight = sums[..., -1].sum(axis=0)
    squares = np.where(table.differs, np.nan_to_num(table.value) ** 2, 0.0)
    return float((weight * squares).sum() / max(weight.sum(), 1e-300))


def _by_sight(away, incidence):
    """Splits by range (n,) in m and angle of incidence (n,) in deg."""
    return (
        Binning("range", away, SETTINGS.ranges),
        Binning("incidence", incidence, SETTINGS.incidences),
    )


def _intensity(
    pairs: PairedCells, real: ChannelSample, simulated: ChannelSample, rng: np.random.Generator
) -> Contrast | Measure:
    """Ratio of intensities relative to the median, which depends on units."""
    for name, cloud in (("survey's", real), ("simulated", simulated)):
        if not cloud.has_intensity:
            return Contrast(
                "intensity", f"The {name} cloud has no intensity: all values are equal."
            )
    known = pairs[np.isfinite(pairs.brightness).all(axis=1)]
    if len(known) == 0:
        return Contrast("intensity", SILENT["apart"])
    ratio = np.log(10.0) * (known.brightness[:, 0] - known.brightness[:, 1])
    classes = Binning("reflectance", _classes(known), bins=CLASSES)
    splits = (*_by_sight(known.range, known.incidence), classes)
    return _of_ratio(known, ratio, weights_of(known.block.max() + 1, rng), splits)


def _of_ratio(pairs, ratio, weights, splits):
    """Measure of the intensity from log ratios (n,)."""
    medians = _medians(ratio, pairs.block, weights)

    def figure(sums):
        mean = sums[..., 0] / sums[..., 3]
        if sums.ndim > 2:  # replicas, not only bins and columns
            return mean - medians[1:, None]
        return mean - medians[0]

    return Measure(
        "intensity",
        pairs.block,
        [ratio, *pairs.brightness.T, np.ones(len(pairs))],
        figure,
        lambda s: (10 ** (s[:, 1] / s[:, 3]), 10 ** (s[:, 2] / s[:, 3])),
        weights,
        lambda change: _of_ratio(pairs, ratio - change, weights, splits),
        splits,
    )


def _medians(ratio, block, weights):
    """Median of ratios (n,), and of each replica of the blocks."""
    order = np.argsort(ratio)
    medians = [np.median(ratio)]
    for each in weights:
        total = np.cumsum(each[block[order]])
        medians.append(ratio[order][np.searchsorted(total, 0.5 * total[-1])])
    return np.array(medians)


def _classes(pairs):
    """Third (n,) of brightness among cells with the same range and incidence; -1 if unknown."""
    brightness = pairs.brightness.mean(axis=1)
    splits = _by_sight(pairs.range, pairs.incidence)
    bins = np.column_stack([split.number(split.edges) for split in splits])
    group = np.unique(bins, axis=0, return_inverse=True)[1].reshape(len(pairs))
    excess = np.full(len(pairs), np.nan)
    for number in np.unique(group[(bins >= 0).all(axis=1)]):
        rows = np.flatnonzero(group == number)
        excess[rows] = brightness[rows] - np.median(brightness[rows])
    if not np.isfinite(excess).any():
        return np.full(len(pairs), -1)
    thirds = np.nanquantile(excess, [1 / 3, 2 / 3])
    return np.where(np.isfinite(excess), np.searchsorted(thirds, excess), -1)


def _density(pairs: PairedCells, rng: np.random.Generator) -> Contrast | Measure:
    """Ratio of points in the real and the simulated cloud."""
    if len(pairs) == 0 or not pairs.points.any(axis=0).all():
        return Contrast("density", SILENT["apart"])
    splits = _by_sight(pairs.range, pairs.incidence)
    return _of_points(pairs.block, *pairs.points.T, weights_of(pairs.block.max() + 1, rng), splits)


def _of_points(block, real, simulated, weights, splits):
    """Measure of the density from numbers of points (n,)."""
    return Measure(
        "density",
        block,
        [real, simulated, real + simulated],
        lambda sums: np.log(sums[..., 0] / sums[..., 1]),
        lambda s: (s[:, 0], s[:, 1]),
        weights,
        lambda change: _of_points(block, real, simulated * np.exp(change), weights, splits),
        splits,
    )


def _of_means(channel, block, real, simulated, splits, weights):
    """Measure of the difference of two means, from pairs of sums and numbers (n,) of items."""
    (a, m), (b, n) = real, simulated

    def without(change):
        return _of_means(channel, block, real, (b + n * change, n), splits, weights)

    return Measure(
        channel,
        block,
        [a, m, b, n, m + n],
        lambda sums: sums[..., 0] / sums[..., 1] - sums[..., 2] / sums[..., 3],
        lambda s: (s[:, 0] / s[:, 1], s[:, 2] / s[:, 3]),
        weights,
        without,
        splits,
    )


def _dropout(
    survey: Survey,
    patches: Patches | None,
    simulated: Patches | None,
    loss: float | None,
    rng: np.random.Generator,
) -> Contrast | Measure:
    """Beams without a return between those of a scan line with one."""
    known = [part for part in (patches, simulated) if part is not None]
    if patches is None or not all(part.fired.any() for part in known):
        return Contrast("dropout", SILENT["pulses"])
    if simulated is None and loss is None:
        return Contrast("dropout", SILENT["dropout"])
    joined = Patches.concatenate(known)
    sight = joined.centre - scanner_origin(survey, joined.gps_time)
    away = np.linalg.norm(sight, axis=1)
    slant = np.abs(np.einsum("pi,pi->p", sight, joined.normal)) / away
    fired = joined.fired.astype(float)
    is_real = np.arange(len(joined)) < len(patches)
    lost = fired - joined.returned
    real = (lost * is_real, fired * is_real)
    other = (lost * ~is_real, fired * ~is_real)
    if simulated is None:
        other = loss * fired, fired
    splits = _by_sight(away, np.degrees(np.arccos(np.clip(slant, 0.0, 1.0))))
    block = block_of(joined.centre)
    return _of_means("dropout", block, real, other, splits, weights_of(block.max() + 1, rng))


def _edge_width(
    real: ChannelSample, simulated: ChannelSample, rng: np.random.Generator
) -> Contrast | Measure:
    """Angle over which depth edges are blurred. Units: mrad."""
    share = min(real.edge_share, simulated.edge_share)
    sides = [each.edges[each.edges.chance < share] for each in (real, simulated)]
    if min(map(len, sides)) < SETTINGS.least_blocks:
        return Contrast("edge_width", SILENT["edges"])
    joined = Edges.concatenate(sides)
    is_real = np.arange(len(joined)) < len(sides[0])
    width = 1e3 * joined.width
    sums = [(width * which, which.astype(float)) for which in (is_real, ~is_real)]
    splits = (Binning("range", joined.range, SETTINGS.ranges),)
    block = block_of(joined.place)
    return _of_means("edge_width", block, *sums, splits, weights_of(block.max() + 1, rng))


def paired_cells(survey: Survey, real: ChannelSample, simulated: ChannelSample) -> PairedCells:
    """Pair the cells of the ground blocks for which both samples have all cells.

    Parameters
    ----------
    survey : Survey
    real, simulated : ChannelSample
    """
    share = min(real.share, simulated.share)
    clouds = [each.cells[each.cells.chance < share] for each in (real, simulated)]
    key = np.union1d(*(cells.key for cells in clouds))
    places = [np.searchsorted(key, cells.key) for cells in clouds]

    def spread(values):
        table = np.zeros((2, len(key), *values[0].shape[1:]))
        for side, (place, of_cells) in enumerate(zip(places, values, strict=True)):
            table[side, place] = of_cells
        return table

    points = spread([cells.points for cells in clouds])
    total = np.maximum(points.sum(axis=0), 1.0)

    def mean(values):
        return (points[..., None] * spread(values)).sum(axis=0) / total[:, None]

    sight = mean([_sight(survey, cells) for cells in clouds])
    scatter = spread([_scatter(cells) for cells in clouds]).sum(axis=0)
    brightness = spread([cells.value for cells in clouds])
    brightness[:, (points < OBSERVE.samples).any(axis=0)] = np.nan
    return PairedCells(
        points=points.T,
        brightness=brightness.T,
        range=np.linalg.norm(sight, axis=1),
        incidence=_incidence(sight, scatter, total),
        block=block_of(mean([cells.centre for cells in clouds])),
    )


def _sight(survey, cells):
    """Vectors from the scanner to the centers of cells (c, 3), at the mean time of the points.
    m.
    """
    segment = survey.trajectory.segment(cells.gps_time)
    first, last = survey.trajectory.passes[np.maximum(segment, 0)].T
    return cells.centre - scanner_origin(survey, np.clip(cells.gps_time, first, last))


def _scatter(cells):
    """Sums of products (c, 3, 3) about the means of cells. Units: m^2."""
    return cells.covariance * cells.points[:, None, None]


def _incidence(sight, scatter, points):
    """Angle (c,) between beams and normals, in deg; NaN for cells that are not flat."""
    values, axes = np.linalg.eigh(scatter / points[:, None, None])
    cosine = np.abs(np.einsum("ci,ci->c", sight, axes[:, :, 0]))
    cosine /= np.maximum(np.linalg.norm(sight, axis=1), 1e-9)
    is_flat = (values[:, 0] <= OBSERVE.roughest**2) & (values[:, 1] >= OBSERVE.narrowest_patch**2)
    is_flat &= points >= 2 * OBSERVE.plane_points
    return np.where(is_flat, np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))), np.nan)
