"""The adjustment of a drive: its factors, the errors of its POS, and a polynomial trend.

All factors have the same trend and signals; a calibration has additional unknowns, the mountings,
which a correction has not.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mlscorr.collocation import (
    Collocation,
    SparseRows,
    collocate_rows,
    collocate_rows_dense,
    likelihood_changes,
    polynomial_design,
)
from mlscorr.estimate.factors import (
    PRIOR,
    REACQUISITION,
    TARGET,
    TIE,
    Factor,
    prior_factor,
    reacquisition_factor,
    target_columns,
    target_factor,
)
from mlscorr.estimate.settings import SETTINGS
from mlscorr.pos import PosErrors, SignalParameters, Steps, pose_signals
from mlscorr.survey import SAME_EPOCH, Matched, Mounting, Pos, Summary, Trajectory

NO_TREND = -1  # the order of a polynomial without any coefficient


@dataclass(frozen=True, repr=False)
class Adjustment(Summary):
    """Factors of one drive and their model: l = A x + B s + n.

    The columns of A are the unknowns other than the POS error, such as mountings, then the trend.

    Parameters
    ----------
    errors : PosErrors
        Source of the signals s.
    factors : tuple of Factor
        Targets first, then at most one of each further kind, except for priors.
    order : int
        Of the polynomial trend of the position (Eq. 11); NO_TREND for none.
    prior : function of an Adjustment
        Function that returns a Prior of the parameters.
    trend_span : (float, float), optional
        First and last time of the trend's polynomial; those of the targets by default. Units: s.
    tolerance : float
        Of knots, if there are ties; see ``collocate_rows``.
    """

    errors: PosErrors
    factors: tuple[Factor, ...]
    order: int
    prior: Callable
    trend_span: tuple[float, float] | None = None
    tolerance: float = SETTINGS.knot_tolerance

    @property
    def trajectory(self) -> Trajectory:
        """As recorded."""
        return self.errors.trajectory

    @property
    def targets(self) -> Factor:
        """The observed control points."""
        return self.factors[0]

    @property
    def ties(self) -> Factor | None:
        """Factor of ties between passes, None without any."""
        return self.of_kind(TIE)

    def of_kind(self, kind: str) -> Factor | None:
        """The factor of a kind, None without any.

        Parameters
        ----------
        kind : str
            One of KINDS.
        """
        return next((factor for factor in self.factors if factor.kind == kind), None)

    def with_factor(self, factor: Factor) -> Adjustment:
        """The same with a factor, which replaces the one of its kind if there is one.

        Parameters
        ----------
        factor : Factor
        """
        kinds = [part.kind for part in self.factors]
        if factor.kind not in kinds:
            return replace(self, factors=(*self.factors, factor))
        place = kinds.index(factor.kind)
        factors = (*self.factors[:place], factor, *self.factors[place + 1 :])
        return replace(self, factors=factors)

    def without_kind(self, kind: str) -> Adjustment:
        """The same without the factor of a kind.

        Parameters
        ----------
        kind : str
        """
        return replace(self, factors=tuple(f for f in self.factors if f.kind != kind))

    def with_some(self, kind: str, rows: np.ndarray) -> Adjustment:
        """The same with some observations of a kind, or without the kind if none are left.

        Parameters
        ----------
        kind : str
        rows : (n,) bool array
        """
        if rows.any():
            return self.with_factor(self.of_kind(kind).select(rows))
        return self.without_kind(kind)

    def with_starts(self, starts: np.ndarray) -> Adjustment:
        """The same with drift that grows from other times on.

        Parameters
        ----------
        starts : (k,) array
            One for each segment of the history. Units: s.
        """
        factors = tuple(factor.with_starts(starts) for factor in self.factors)
        return replace(self, errors=self.errors.with_starts(starts), factors=factors)

    def with_unknowns(
        self, columns: Mapping[str, np.ndarray], mean: np.ndarray, sigma: np.ndarray
    ) -> Adjustment:
        """The same with further unknowns other than the POS error, after the existing ones.

        Parameters
        ----------
        columns : dict
            Partial derivatives (n, r, u) of some factors' misclosures, by the factor's kind.
        mean, sigma : (u,) array
            Prior mean and sigma; an infinite sigma means no prior.
        """
        factors = []
        for factor in self.factors:
            rows = factor.misclosure.shape
            more = columns.get(factor.kind, np.zeros((*rows, len(sigma))))
            known = 0
            if factor.columns is not None:
                known = factor.columns.shape[2]
            gap = np.zeros(
                (*rows, self.unknowns - known)
            )  # of unknowns that do not affect the factor
            padded = np.concatenate([gap, more], axis=2)
            factors.append(factor.with_columns(padded))
        wider = replace(self, factors=tuple(factors))
        is_known = np.isfinite(sigma)
        if not is_known.any():
            return wider
        prior = prior_factor(mean[is_known], sigma[is_known])
        unit = np.eye(self.unknowns + len(sigma))[self.unknowns :][is_known]
        prior = replace(prior, columns=unit[:, None])
        return replace(wider, factors=(*wider.factors, prior))

    @property
    def unknowns(self) -> int:
        """Number of the unknowns other than the POS error."""
        widths = [f.columns.shape[2] for f in self.factors if f.columns is not None]
        return max(widths, default=0)

    @property
    def names(self) -> np.ndarray:
        """Names (n,) of the observed targets."""
        return self.targets.name

    @property
    def observed(self) -> np.ndarray:
        """Times (n,) of the observed targets. Units: s."""
        return self.targets.gps_time[:, 0]

    def select(self, rows: np.ndarray | Sequence[int]) -> Adjustment:
        """The same with some of the targets.

        Parameters
        ----------
        rows : (n,) bool or (k,) int array
        """
        return self.with_factor(self.targets.select(np.asarray(rows)))

    def without(self, names: Collection[str]) -> Adjustment:
        """The same with all targets but some.

        Parameters
        ----------
        names : collection of str
        """
        if names:
            return self.select(~np.isin(self.names, list(names)))
        return self

    def without_outer_steps(self) -> Adjustment:
        """The same without re-acquisitions outside the control span."""
        steps = self.of_kind(REACQUISITION)
        if steps is None:
            return self
        first, last = self.span
        is_inside = (steps.gps_time[:, 0] >= first) & (steps.gps_time[:, 1] <= last)
        return self.with_some(REACQUISITION, is_inside)

    @property
    def span(self) -> tuple[float, float]:
        """First and last control epoch; those of the trajectory without any. Units: s."""
        if self.trend_span is not None:
            return self.trend_span
        if len(self.observed) == 0:
            return tuple(self.trajectory.gps_time[[0, -1]].tolist())
        return float(self.observed.min()), float(self.observed.max())

    @property
    def interval(self) -> float:
        """Mean interval of the control epochs without the trajectory's gaps between them. Units: s.

        If there are none or effectively one, or if ties determine the time better than the spacing
        of targets, this is the prior correlation time in terms of the paper's rule.
        """
        control = np.sort(self.observed)
        recorded_time = self.trajectory.recorded_time
        is_short = len(control) == 0 or recorded_time(*control[[0, -1]]) < SAME_EPOCH
        if is_short or self.ties is not None:
            return self.errors.pos.correlation_time / SETTINGS.start_ratio
        return self.trajectory.control_interval(self.observed)

    @property
    def observing(self) -> tuple[Factor, ...]:
        """The factors that depend on a pose, in the order of their rows in a solution."""
        return tuple(factor for factor in self.factors if factor.kind != PRIOR)

    def rows_of(self, kind: str) -> np.ndarray:
        """Rows of a kind in a solution.

        Parameters
        ----------
        kind : str
        """
        kinds = np.repeat(
            [factor.kind for factor in self.observing],
            [factor.misclosure.size for factor in self.observing],
        )
        return np.flatnonzero(kinds == kind)

    @cached_property
    def target_rows(self) -> dict[str, np.ndarray]:
        """Rows of each target in a solution, all its passes together."""
        rows: dict[str, list[int]] = {}
        for row, name in enumerate(np.repeat(self.names, 3).tolist()):
            rows.setdefault(str(name), []).append(row)
        return {name: np.array(own) for name, own in rows.items()}

    def stacked(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Columns (m, k) of the rows of a solution, zero for other kinds.

        Parameters
        ----------
        columns : dict
            (n, r, k) by the factor's kind.
        """
        width = next(iter(columns.values())).shape[2]
        parts = [
            columns.get(factor.kind, np.zeros((*factor.misclosure.shape, width)))
            for factor in self.observing
        ]
        return np.concatenate([part.reshape(-1, width) for part in parts])

    def with_added(self, added: np.ndarray) -> Adjustment:
        """The same with an addition to the misclosures.

        Parameters
        ----------
        added : (m,) array
            To the rows of a solution. Units: m.
        """
        changed = self
        for factor in self.observing:
            own = added[self.rows_of(factor.kind)].reshape(factor.misclosure.shape)
            changed = changed.with_factor(replace(factor, misclosure=factor.misclosure + own))
        return changed

    def solve(
        self, parameters: SignalParameters | None, like: Collocation | None = None
    ) -> Collocation:
        """Collocation under given parameters.

        Parameters
        ----------
        parameters : SignalParameters or None
            None means least squares.
        like : Collocation, optional
            Of the same factors under similar parameters; its knots are reused, if it has any.
        """
        known = None
        if like is not None:
            known = like.solver
        tolerance = 0.0
        if self.ties is not None:  # few knots suffice with hundreds of them
            tolerance = self.tolerance
        rows = self.rows(parameters)
        return collocate_rows(rows, known, tolerance, self.prior_rows(parameters))

    def weigh(self, parameters: SignalParameters, like: Collocation | None = None) -> Collocation:
        """Collocation for the likelihood alone: few rows with ties are solved by covariances.

        Parameters
        ----------
        parameters : SignalParameters
        like : Collocation, optional
            Earlier result for the same factors under similar parameters: with its knots a
            difference is smooth, and costs half as much.
        """
        if self._is_dense:
            return collocate_rows_dense(self.rows(parameters), self.prior_rows(parameters))
        return self.solve(parameters, like)

    def likelihoods(
        self, near: Sequence[SignalParameters], parameters: SignalParameters, solved: Collocation
    ) -> np.ndarray:
        """Log-likelihoods (k,) of k similar parameter sets, accurate enough for differences.

        Parameters
        ----------
        near : sequence of SignalParameters
        parameters : SignalParameters
        solved : Collocation
            By ``weigh``, under these parameters.
        """
        if not self._is_dense:
            return np.array([self.weigh(each, solved).log_likelihood for each in near])
        rows = self.rows(parameters)
        changed = [self.rows(each) for each in near]
        prior_rows = [self.prior_rows(each) for each in near]
        return solved.log_likelihood + likelihood_changes(solved, rows, changed, prior_rows)

    @property
    def _is_dense(self):
        """True if the covariance matrix is the fastest route to a likelihood."""
        size = sum(factor.misclosure.size for factor in self.observing)
        return self.ties is not None and size <= SETTINGS.dense_rows

    def rows(self, parameters: SignalParameters | None) -> list[SparseRows]:
        """Rows of the factors that depend on a pose, for the solver.

        Parameters
        ----------
        parameters : SignalParameters or None
            None means no signals.
        """
        rows = []
        for factor, design in zip(self.observing, self._designs, strict=True):
            signals = ()
            if parameters is not None:
                n, e, r, _ = factor.partials.shape
                views = factor.partials.reshape(n * e, r, 6)
                signals = pose_signals(factor.stated, parameters, views)
            noise = factor.weighed_noise
            rows.append(SparseRows(factor.gps_time, factor.misclosure, noise, design, signals))
        return rows

    @cached_property
    def _designs(self):
        """A (n, r, p) of each factor that depends on a pose."""
        designs = []
        for factor in self.observing:
            n, e, r, _ = factor.partials.shape
            views = factor.partials.reshape(n * e, r, 6)
            by_view = views @ self.pose_design(factor.gps_time.ravel())
            design = by_view.reshape(n, e, r, by_view.shape[2]).sum(axis=1)
            if factor.columns is not None:
                design[:, :, : factor.columns.shape[2]] += factor.columns
            designs.append(design)
        return designs

    def prior_rows(self, parameters: SignalParameters | None) -> np.ndarray:
        """Prior of unknowns and trend, (k, p + 1), in the form of a Collocation.

        Parameters
        ----------
        parameters : SignalParameters or None
            None means no prior of the trend.
        """
        width = self.unknowns + 3 * (self.order + 1)
        parts = [np.zeros((0, width + 1))]
        for prior in (factor for factor in self.factors if factor.kind == PRIOR):
            rows = np.zeros((len(prior), width + 1))
            rows[:, : prior.columns.shape[2]] = prior.columns[:, 0]
            rows[:, -1] = prior.misclosure[:, 0]
            parts.append(rows / np.sqrt(prior.variance))
        if parameters is not None:
            parts.append(np.eye(width + 1)[self.unknowns : width] / parameters.trend_sigma)
        return np.concatenate(parts)

    def pose_design(self, gps_time: np.ndarray) -> np.ndarray:
        """A (q, 6, p) of the pose at any epochs; only the trend moves a pose.

        Parameters
        ----------
        gps_time : (q,) array
            Units: s.
        """
        pose = np.zeros((len(gps_time), 6, self.unknowns + 3 * (self.order + 1)))
        if self.order != NO_TREND:
            pose[:, :3, self.unknowns :] = polynomial_design(gps_time, self.span, self.order)
        return pose


def position_adjustment(
    trajectory: Trajectory, matched: Matched, pos: Pos, order: int, prior: Callable
) -> Adjustment:
    """The POS error by matched targets, with a polynomial trend of the position  (Eq. 7-12).

    Parameters
    ----------
    trajectory : Trajectory
    matched : Matched
    pos : Pos
    order : int
    prior : function of an Adjustment
    """
    errors = PosErrors.stated(trajectory, pos)
    return Adjustment(errors, (target_factor(errors, matched),), order, prior)


def with_reacquisitions(adjustment: Adjustment, steps: Steps) -> Adjustment:
    """The adjustment with steps of the recorded path.

    Parameters
    ----------
    adjustment : Adjustment
    steps : Steps
    """
    factor = reacquisition_factor(adjustment.errors, steps)
    if len(factor):
        return adjustment.with_factor(factor)
    return adjustment.without_kind(REACQUISITION)


def mounting_adjustment(
    adjustment: Adjustment,
    matched: Matched,
    mountings: Sequence[Mounting],
    corrected: np.ndarray,
    weak: np.ndarray,
) -> Adjustment:
    """Adjustment of k mountings  (Eq. 16-18), with the same POS error but without a trend.

    Parameters
    ----------
    adjustment : Adjustment
    matched : Matched
        As georeferenced with the mountings.
    mountings : sequence of Mounting
        Already corrected by ``corrected``; the estimate is added to them.
    corrected : (6 k,) array
        Units: m and rad.
    weak : (6 k,) array
        One sigma of prior knowledge of the mountings. Units: m and rad.
    """
    errors = adjustment.errors
    factor = target_factor(errors, matched)
    bare = Adjustment(errors, (factor,), NO_TREND, adjustment.prior)
    columns = target_columns(errors.trajectory, mountings, matched)
    return bare.with_unknowns({TARGET: columns}, -corrected, weak)
