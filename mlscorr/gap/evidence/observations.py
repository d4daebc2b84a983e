"""Rows as scalar observations in order of time, and V, their covariance if nothing is wrong.

V = position and attitude of the POS + survey errors + noise of each row. Residuals of one drive are
not white: without V every error-free survey would be "explained" by some effect, and with one fixed
V nearly half of those whose drift has another shape. Position errors are one process with the
stated sigma(t), attitude errors another one. Scale, shape, and the excess over sigma in each
interval of increased sigma are unknown. V is thus a family of ErrorModels with prior weights, over
which results are averaged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np

from mlscorr.collocation import Covariance, Signal, Whitener, factor
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Background, Rows
from mlscorr.pos import SETTINGS as POS
from mlscorr.pos import excursion_profile, stated_processes
from mlscorr.survey import Columns

FACTORS = 128  # kept of V0: those used repeatedly, less than 100 MB


@dataclass(frozen=True)
class ErrorModel:
    """One covariance V: factors on the stated sigmas, and additions.

    Parameters
    ----------
    scale : float
        On the sigmas of the position.
    family : str
        Of the position's error.
    time : float
        On its correlation time.
    attitude : tuple of (scale, family, time)
        The same of the attitude.
    increased : tuple of float
        Further factor on the position's sigma in each interval in which it is increased; one in
        intervals not listed.
    noise : float
        Factor on the sigma of each row's own noise.
    fixes : float
        Noise sigma of GNSS fixes, in E, N and H. Units: m.
    weight : float
        Prior probability.
    windows : tuple of (start, length, factor, shape)
        Intervals (s) in which the POS has an additional error with a sigma of at most factor times
        the stated one of the position. It increases with time, or is largest in the middle.
    """

    scale: float = 1.0
    family: str = "matern32"
    time: float = 1.0
    attitude: tuple[float, str, float] = (1.0, "matern32", 1.0)
    increased: tuple[float, ...] = ()
    noise: float = 1.0
    fixes: float = 0.0
    weight: float = 1.0
    windows: tuple[tuple[float, float, float, str], ...] = ()


STATED = ErrorModel()


def shares(score: np.ndarray) -> np.ndarray:
    """Normalized probabilities (n,) from their logs up to any constant.

    Parameters
    ----------
    score : (n,) array
    """
    share = np.exp(score - score.max())
    return share / share.sum()


def window_growth(
    windows: Sequence[tuple[float, float, float, str]], gps_time: np.ndarray
) -> np.ndarray:
    """Sigma added by windows of a worse POS, over the stated one of the position.

    Parameters
    ----------
    windows : sequence of (start, length, factor, shape)
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    growth : (n, 1) array
    """
    growth = np.zeros(len(gps_time))
    for start, length, largest, shape in windows:
        profile = excursion_profile(gps_time, start, start + length, shape)
        growth = np.where(profile > 0, largest * profile, growth)
    return growth[:, None]


def error_models() -> tuple[ErrorModel, ...]:
    """Models within the prior with equal scale of attitude and position; weights sum to one."""
    return tuple(
        ErrorModel(scale, family, time, (scale, family, time), weight=weight)
        for scale, family, time, weight in stated_processes()
    )


def shaped_models(scale: float = 1.0, fixes: float = 0.0) -> list[ErrorModel]:
    """Make one model of each shape.

    Parameters
    ----------
    scale : float
        Scale on the POS's sigmas.
    fixes : float
        Sigma of noise of GNSS fixes. Units: m.
    """
    return [
        ErrorModel(scale, family, time, (scale, family, time), fixes=fixes, weight=weight)
        for family, time, weight in POS.process_shapes
    ]


def _varied_models(intervals: int) -> Iterator[Callable]:
    """Yield functions that vary a model: attitude, noise, increased sigmas, and finer steps.

    Each takes the current best model and returns models to try.

    Parameters
    ----------
    intervals : int
        Number of intervals with increased sigma.
    """
    yield lambda best: [
        replace(best, attitude=process[:3], weight=best.weight * process.weight)
        for process in stated_processes()
    ]
    yield lambda best: [
        replace(best, noise=noise, weight=best.weight * share)
        for noise, share in SETTINGS.noise_scales
    ]
    for number in range(intervals):
        yield lambda best, number=number: [
            replace(
                best,
                increased=(
                    *(*best.increased, *[1.0] * number)[:number],
                    factor,
                    *best.increased[number + 1 :],
                ),
                weight=best.weight * share,
            )
            for factor, share in POS.increased_scales
        ]
    yield _nearby_models


def _nearby_models(model: ErrorModel) -> tuple[ErrorModel, ...]:
    """Models close to one, because the steps between scales and shapes are coarser than the
    data allow.
    """
    steps = (0.8, 1.0, 1.25), (0.7, 1.0, 1.4), (0.9, 1.0, 1.15)
    return tuple(
        replace(
            model,
            scale=model.scale * scale,
            time=model.time * time,
            noise=model.noise * noise,
            weight=model.weight / 27,
        )
        for scale, time, noise in product(*steps)
        if model.scale * scale <= SETTINGS.scale_limit
    )


@dataclass(frozen=True, eq=False, repr=False)
class Errors(Columns):
    """Errors of n observations, as sigmas in m.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    clock : (n,) array
        Clock of the position, which jumps where its error restarts. Units: s.
    own : (n,) array
        Variance of its noise. Units: m^2.
    position, attitude, place : (n, 3) array
        Mixings; place is the derivative by the position.
    correlation_time : float
        Prior correlation time. Units: s.
    growth : (n, 1) array
        Factor added by prior windows; see ``window_growth``.
    increased : (n,) int array
        Interval with increased stated sigma; -1 outside.
    """

    gps_time: np.ndarray
    clock: np.ndarray
    own: np.ndarray
    position: np.ndarray
    attitude: np.ndarray
    place: np.ndarray
    correlation_time: float
    growth: np.ndarray
    increased: np.ndarray

    @property
    def position_variance(self) -> np.ndarray:
        """Stated variance from the POS position: (n,), m^2."""
        return (self.position**2).sum(axis=1)

    def scaled_position(self, factors: tuple[float, ...]) -> np.ndarray:
        """Mixing (n, 3) of the position with a factor on each interval of increased sigma.

        Parameters
        ----------
        factors : tuple of float
            For the first intervals; one for others.
        """
        known = np.ones(max(self.increased.max(initial=-1) + 1, len(factors)) + 1)
        known[: len(factors)] = factors
        return self.position * known[self.increased][:, None]  # -1, the last, is outside of them


@dataclass(frozen=True, repr=False)
class Observations(Columns):
    """Metric rows as n scalar observations in order of time, one for each view.

    A row of two times is two observations, half of it each, that share the unknown height of
    their plane.

    Parameters
    ----------
    rows : int
        Number of Rows, m.
    row : (n,) int array
        Row of each observation.
    half : (n,) array
        Share of the row's value.
    errors : Errors
    shared : (n, c) array
        Errors shared by several observations. Units: m.
    second : (n,) bool array
        False for the first of two views, which only defines the plane.
    """

    rows: int
    row: np.ndarray
    half: np.ndarray
    errors: Errors
    shared: np.ndarray
    second: np.ndarray

    def __len__(self) -> int:
        return len(self.row)

    @classmethod
    def of(cls, rows: Rows, background: Background) -> Observations:
        """Make observations of the metric rows; two-time rows are thinned evenly in time.

        Parameters
        ----------
        rows : Rows
        background : Background
            Of these rows.

        Raises
        ------
        ValueError
            If no row has a unit of length.
        """
        if not rows.metric.any():
            raise ValueError(
                f"None of {len(rows)} residuals is in m: roughness and return rate alone can't "
                "identify an error. Survey targets, or set scene.reference in survey.toml."
            )
        leg = np.flatnonzero(_affordable(rows)[background.row])
        leg = leg[np.argsort(background.gps_time[leg], kind="stable")]
        row = background.row[leg]
        time = background.gps_time[leg]
        double = rows.two_times[row]
        first = double & (time == rows.gps_time[row])
        half = np.where(double, 0.5, 1.0)
        partials = np.where((first | ~double)[:, None], rows.partials[row], rows.partials_2[row])
        survey = rows.survey_design()[row]
        often = np.diff(survey.tocsc().indptr) > 1  # columns
        own = half * rows.noise[row]
        own += np.asarray(survey[:, np.flatnonzero(~often)].power(2).sum(axis=1)).ravel()
        errors = Errors(
            gps_time=time,
            clock=time if background.clock is None else background.clock[leg],
            own=own,
            position=background.position[leg],
            attitude=background.attitude[leg],
            place=partials[:, :3],
            correlation_time=background.correlation_time,
            growth=window_growth(background.windows, time),
            increased=np.full(len(leg), -1)
            if background.increased is None
            else background.increased[leg],
        )
        survey = survey[:, np.flatnonzero(often)].toarray()
        shared = np.hstack([survey, _plane_heights(row, double, first)])
        return cls(len(rows), row, half, errors, shared, ~first)

    def columns(self, values: np.ndarray) -> np.ndarray:
        """Return columns (n, c) of values (m, c) of the rows."""
        return np.asarray(values, dtype=float)[self.row] * self.half[:, None]

    @property
    def sigma(self) -> np.ndarray:
        """Stated sigma (m,) of the rows due to the POS position. Units: m."""
        return np.sqrt(np.bincount(self.row, self.errors.position_variance, self.rows))

    def with_shared(self, columns: np.ndarray) -> Observations:
        """Add accepted causes as nuisance: columns (n, k) of free size."""
        return replace(self, shared=np.hstack([self.shared, SETTINGS.free_sigma * columns]))

    def with_own(self, own: np.ndarray) -> Observations:
        """Replace the variances (n,) of the observations' own noise."""
        return replace(self, errors=replace(self.errors, own=own))

    def whitener(self, model: ErrorModel = STATED, extra: np.ndarray | float = 0.0) -> Whitener:
        """Return the factored V under a model.

        Parameters
        ----------
        model : ErrorModel
        extra : (n,) array, optional
            Added to the variance of the observations' own noise; not cached. Units: m^2.

        Raises
        ------
        ValueError
            If V is not positive definite.
        """
        plain = np.ndim(extra) == 0 and extra == 0.0
        if plain:
            separate = _factored(self.errors, model)
        else:
            separate = _factor(self.errors, model, extra)
        return separate.with_common(self.shared)


def _affordable(rows):
    """Rows (m,) that are observed, because each two-time row costs a column of shared error."""
    double = np.flatnonzero(rows.two_times)
    keep = np.ones(len(rows), dtype=bool)
    if len(double) > SETTINGS.double_rows:
        double = double[np.argsort(rows.gps_time[double], kind="stable")]
        keep[double] = False
        keep[double[np.linspace(0, len(double) - 1, SETTINGS.double_rows).astype(int)]] = True
    return keep


def _plane_heights(row, double, first):
    """Heights of planes in overlaps, as free as the largest amplitude: (n, k), positive for the
    first view, negative for the second.
    """
    planes, number = np.unique(row[double], return_inverse=True)
    heights = np.zeros((len(row), len(planes)))
    free = max(SETTINGS.amplitudes)
    heights[np.flatnonzero(double), number] = np.where(first[double], free, -free)
    return heights


@lru_cache(maxsize=FACTORS)
def _factored(errors, model):
    return _factor(errors, model)


def _factor(errors, model, extra=0.0):
    """Whitener of V0, of signals and own noise."""
    growth = np.hypot(window_growth(model.windows, errors.gps_time), errors.growth)
    position = errors.scaled_position(model.increased)
    turn_scale, turn_family, turn_time = model.attitude
    tau = errors.correlation_time
    signals = [
        Signal(scale * mixing[:, None], covariance, clock)
        for scale, mixing, covariance, clock in (
            (model.scale, position, Covariance(model.family, model.time * tau), errors.clock),
            (turn_scale, errors.attitude, Covariance(turn_family, turn_time * tau), None),
            (
                model.fixes,
                errors.place,
                Covariance("exponential", SETTINGS.fix_correlation_time),
                None,
            ),
            (1.0, growth * errors.position, Covariance("matern32", SETTINGS.window_time), None),
        )
        if scale > 0 and mixing.any()
    ]
    return factor(errors.gps_time, signals, model.noise**2 * errors.own + extra)


def model_likelihood(
    observations: Observations,
    model: ErrorModel,
    residual: np.ndarray,
    extra: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Log of a model's weight times the likelihood of residuals (n, k): (k,).

    Parameters
    ----------
    observations : Observations
    model : ErrorModel
    residual : (n, k) array
        Units: m.
    extra : (n,) array, optional
        See ``Observations.whitener``.
    """
    return np.log(model.weight) + observations.whitener(model, extra).log_likelihood(residual)


def relevant_models(
    observations: Observations,
    models: Iterable[ErrorModel],
    residual: np.ndarray,
    nuisances: Sequence[np.ndarray],
) -> tuple[ErrorModel, ...]:
    """Select models, and some near the best, that explain the residuals with any nuisance.

    Parameters
    ----------
    observations : Observations
    models : iterable of ErrorModel
    residual : (n, 1) array
    nuisances : sequence of (n, q) arrays
        Possible effects: a model counts if it explains the residuals with any of them.
    """
    cases = [observations.with_shared(nuisance) for nuisance in nuisances]

    def scores(model, numbers):
        return [
            model_likelihood(case, model, residual)[0] if number in numbers else -np.inf
            for number, case in enumerate(cases)
        ]

    known = {model: scores(model, range(len(cases))) for model in models}
    intervals = observations.errors.increased.max(initial=-1) + 1
    for number in range(len(cases)):
        for variation in _varied_models(int(intervals)):
            for model in variation(max(known, key=lambda model: known[model][number])):
                if model not in known or known[model][number] == -np.inf:
                    known[model] = np.maximum(scores(model, [number]), known.get(model, -np.inf))
    score = np.array(list(known.values()))
    below = (score - score.max(axis=0)).max(axis=1)
    order = np.argsort(-below, kind="stable")[: SETTINGS.shortlist]
    models = tuple(known)
    return tuple(models[i] for i in order if below[i] > np.log(SETTINGS.negligible))
