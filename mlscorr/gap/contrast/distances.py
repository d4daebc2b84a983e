"""Distances between distributions as used in other fields: energy, MMD and Chamfer distance.

Each is compared with its value between two halves of one simulation, which corresponds to zero. The
estimators of energy distance and MMD are unbiased, so they may be negative.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist, pdist

from mlscorr.gap.contrast._settings import SETTINGS
from mlscorr.gap.contrast.sample import ChannelSample, of_shared_moments, sampled
from mlscorr.gap.evidence import Inference, Observations
from mlscorr.gap.residuals import Background, Rows
from mlscorr.surfaces import chance

UNITS = {"points": "m", "intensity": "decades", "density": "decades"}  # of clouds; otherwise sigmas


@dataclass(frozen=True)
class DistributionDistance:
    """Distance between a real and a simulated sample.

    Parameters
    ----------
    channel : str
        Channel of the samples.
    figure : str
        energy_distance, mmd or chamfer.
    unit : str
    before, after : float
        With the original simulator, and with the cause in it; NaN without a second run. Mean over
        draws of halves.
    floor, floor_high : float
        Between halves of the simulation: mean over draws, and their 95 % quantile.
    drawn : int
        Largest size of each sample.
    """

    channel: str
    figure: str
    unit: str
    before: float
    after: float
    floor: float
    floor_high: float
    drawn: int

    def document(self) -> dict:
        """Return a row of ``distances`` in gap.json."""
        return vars(self) | {"halves": SETTINGS.halves}


def energy_distance(x: np.ndarray, y: np.ndarray) -> float:
    """2 E|X - Y| - E|X - X'| - E|Y - Y'| (Szekely and Rizzo 2013), unbiased.

    Parameters
    ----------
    x, y : (n, d) and (m, d) array
        Each with at least two rows.

    >>> energy_distance(np.array([[0.0], [2.0]]), np.array([[5.0], [7.0]]))
    6.0
    """
    return float(2 * cdist(x, y).mean() - pdist(x).mean() - pdist(y).mean())


def maximum_mean_discrepancy(x: np.ndarray, y: np.ndarray, bandwidth: float) -> float:
    """Squared maximum mean discrepancy (Gretton et al. 2012, Eq. 3), unbiased.

    Parameters
    ----------
    x, y : (n, d) and (m, d) array
        Each with at least two rows.
    bandwidth : float
        One sigma of the Gaussian kernel.

    >>> maximum_mean_discrepancy(np.zeros((3, 1)), np.full((3, 1), 9.0), 1.0)
    2.0
    """
    squares = pdist(x, "sqeuclidean"), pdist(y, "sqeuclidean"), cdist(x, y, "sqeuclidean")
    own, other, both = (np.exp(-0.5 * each / bandwidth**2).mean() for each in squares)
    return float(own + other - 2 * both)


def chamfer_distance(x: np.ndarray, y: np.ndarray) -> float:
    """Mean distance to the nearest point of the other cloud, in both directions.

    Parameters
    ----------
    x, y : (n, d) and (m, d) array

    >>> chamfer_distance(np.array([[0.0], [1.0]]), np.array([[0.0]]))
    0.25
    """
    there = cKDTree(y).query(x)[0]
    back = cKDTree(x).query(y)[0]
    return float(0.5 * (there.mean() + back.mean()))


def cloud_distances(
    real: ChannelSample,
    simulated: ChannelSample,
    following: ChannelSample | None,
    rng: np.random.Generator,
) -> tuple[DistributionDistance, ...]:
    """Distances of a cloud from the simulator's, and from those of its next run.

    Real pulses of one half are compared with simulated ones of the other half, like the simulated
    halves with each other, because two clouds of the same beams coincide point by point.

    Parameters
    ----------
    real, simulated : ChannelSample
    following : ChannelSample or None
    rng : numpy.random.Generator
        For draws of both.
    """
    clouds = of_shared_moments([c for c in (real, simulated, following) if c is not None])
    share = min(cloud.point_share for cloud in clouds)
    points = [sampled(cloud.points, share) for cloud in clouds]
    if len(points[0]):
        origin = points[0].xyz.mean(axis=0)
    else:
        origin = np.zeros(3)
    pulses = [part.gps_time.view(np.int64) for part in points]
    places = [_Sample(part.xyz - origin, pulse) for part, pulse in zip(points, pulses, strict=True)]
    distances = [*_of_samples("points", places, rng, {"chamfer": chamfer_distance})]
    distances += _of_samples("points", places, rng)
    if all(cloud.has_intensity for cloud in clouds):
        counts = [np.log10(np.maximum(part.intensity.astype(float), 1.0)) for part in points]
        distances += _of_samples(
            "intensity",
            [_Sample(c[:, None], pulse) for c, pulse in zip(counts, pulses, strict=True)],
            rng,
        )
    ground = min(cloud.share for cloud in clouds)
    cells = [cloud.cells[cloud.cells.chance < ground] for cloud in clouds]
    density = [_Sample(np.log10(part.points)[:, None], part.key.view(np.int64)) for part in cells]
    return (*distances, *_of_samples("density", density, rng))


def innovation_distances(
    channel: np.ndarray, innovation: np.ndarray, replicas: np.ndarray, rng: np.random.Generator
) -> tuple[DistributionDistance, ...]:
    """Distances of innovations from those of replicas of the survey without effects.

    Both are divided by their own scatter, that after the cause: stated noise that is too large is
    not a gap, and only the shape counts.

    Parameters
    ----------
    channel : (n,) str array
    innovation : (n, 2) array
        Before and after the cause is in the simulator.
    replicas : (n, r) array
    rng : numpy.random.Generator
        For draws of both.
    """
    distances: list[DistributionDistance] = []
    for name in dict.fromkeys(channel.tolist()):
        here = channel == name
        values = innovation[here] / max(innovation[here, 1].std(), 1e-300)
        others = replicas[here] / np.maximum(replicas[here].std(axis=0), 1e-300)
        number = min(int(here.sum()), SETTINGS.drawn)
        pairs = {
            "before": partial(_columns_of, values[:, :1], others),
            "after": partial(_columns_of, values[:, 1:], others),
            "floor": partial(_columns_of, others, others[:, ::-1]),
        }
        figures = _pairwise(others[:, :1])
        distances += _of_draws(name, figures, pairs, dict.fromkeys(figures, number), rng)
    return tuple(distances)


def _columns_of(values, replicas, number, rng):
    """Column of values (n, k), and another one of replicas, in random order."""
    columns = values[:, number % values.shape[1]], replicas[:, number % replicas.shape[1]]
    return tuple(rng.permutation(column)[:, None] for column in columns)


@dataclass(frozen=True)
class _Sample:
    """Values (n, d), and the pulse or cell (n,) of each, the same in all clouds."""

    values: np.ndarray
    identity: np.ndarray

    def half(self, salt, is_first, rng):
        """Return the values of one half in random order."""
        in_first = chance(self.identity, np.full(len(self.values), salt)) < 0.5
        return self.values[rng.permutation(np.flatnonzero(in_first == is_first))]


def _of_samples(channel, samples, rng, figures=None):
    """DistributionDistances of real items from those of one or two simulations."""
    real, simulated, *following = samples
    if figures is None:
        figures = _pairwise(simulated.values)
    smallest = min(len(sample.values) for sample in samples)
    half = smallest // 2 - smallest // 8  # halves are not exactly equal
    number = dict.fromkeys(figures, min(half, SETTINGS.drawn))  # all pairs are used
    if "chamfer" in number:
        number["chamfer"] = min(half, SETTINGS.distance_points)
    sides = {"before": (real, simulated), "floor": (simulated, simulated)}
    if following:
        sides["after"] = real, following[0]
    pairs = {when: partial(_halves, *both) for when, both in sides.items()}
    return _of_draws(channel, figures, pairs, number, rng)


def _halves(x, y, salt, rng):
    """Values of one half of a sample, and of the other half of another."""
    return x.half(salt, True, rng), y.half(salt, False, rng)


def _of_draws(channel, figures, pairs, number, rng):
    """DistributionDistance of each figure, if there are enough items."""
    for name, figure in figures.items():
        size = number[name]
        if size < SETTINGS.least_blocks:
            continue
        # the same draws before and after
        values = {}
        seed = int(rng.integers(2**63))
        for when, draw in pairs.items():
            stream = np.random.default_rng(seed)
            samples = (draw(salt, stream) for salt in range(SETTINGS.halves))
            values[when] = [figure(x[:size], y[:size]) for x, y in samples]
        mean = {when: float(np.mean(drawn)) for when, drawn in values.items()}
        yield DistributionDistance(
            channel,
            name,
            "" if name == "mmd" else UNITS.get(channel, "sigmas"),
            mean["before"],
            mean.get("after", np.nan),
            mean["floor"],
            float(np.percentile(values["floor"], 95)),
            size,
        )


def _pairwise(simulated) -> dict[str, Callable]:
    """Energy distance and MMD, with the median distance in the simulation as bandwidth."""
    some = simulated[:: max(1, len(simulated) // SETTINGS.drawn)]
    pairwise = pdist(some)
    pairwise = pairwise[pairwise > 0]
    bandwidth = float(np.median(pairwise)) if len(pairwise) else 1.0
    return {
        "energy_distance": energy_distance,
        "mmd": lambda x, y: maximum_mean_discrepancy(x, y, bandwidth),
    }


def replica_innovations(
    rows: Rows, background: Background, inference: Inference, rng: np.random.Generator
) -> np.ndarray:
    """Innovations (n, replicas) of surveys without effects.

    Their POS errors and noise tails are those of this survey after removal of its cause.

    Parameters
    ----------
    rows : Rows
    background : Background
        Of these.
    inference : Inference
        Inference of these rows; n is the number of its innovations.
    rng : numpy.random.Generator
    """
    observed = Observations.of(rows, background)
    model = inference.evidence.likely_model(inference.verdict.label)
    drawn = observed.whitener(model).draw(rng, SETTINGS.halves, inference.where.innovation[:, 1])
    return observed.whitener().innovations(drawn)[0][observed.second]
