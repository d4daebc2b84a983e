"""The observation equations l = A x + B s + n of the POS error or the mounting (Eq. 7-12, 16-19).

Both have the same misclosures, signals and noise; they differ in A, the trend.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mlscorr.collocation import (
    Collocation,
    Noise,
    SparseRows,
    collocate,
    collocate_rows,
    collocate_rows_dense,
    likelihood_changes,
    polynomial_design,
)
from mlscorr.estimate._tie_equations import TieEquations
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters, pose_signals
from mlscorr.frames import mounting_partials, partials_by_scanner, pose_partials
from mlscorr.pos import StatedSigma, Steps, stated_sigma
from mlscorr.survey import SAME_EPOCH, SEARCH_RADIUS, Matched, Mounting, Pos, Summary, Trajectory

NO_TREND = -1  # the order of a polynomial without any coefficient
PLACE = np.full(3, SEARCH_RADIUS)  # m; sigma of where the POS is, but for what control says of it


@dataclass(frozen=True, repr=False)
class Equations(Summary):
    """The observation equations of n observed targets, three rows each.

    Parameters
    ----------
    names : (n,) array of str
    gps_time : (n + h,) array
        The last h epochs observe no target: they are those before and after each fall-back of the
        POS, or hold the mounting weakly, so that what a site doesn't determine stays as it was
        recorded. Units: s.
    misclosure : (n + h, 3) array
        Surveyed - observed. Units: m.
    noise : Noise
        Survey and extraction (Eq. 19).
    partials : (n + h, 3, 6) array
        B by position and rotation (Eq. 7-9).
    stated : StatedSigma
        At the n + h epochs.
    order : int
        Of the polynomial trend of the position (Eq. 11).
    mounting : (n + h, 3, p) array, optional
        Further columns of A, before those of the trend: partial derivatives by lever arm (m) and
        boresight (rad) about the body axes (Eq. 16-18), of each mounting whose error is estimated.
    prior : function of Equations
        What is believed of the parameters before the misclosures: a Prior.
    trajectory : Trajectory
    pos : Pos
    fallbacks : int
        Number of the fall-backs, of which the last epochs are, two each.
    ties : TieEquations, optional
        Of what two passes both saw.
    trend_span : (float, float), optional
        First and last time of the trend's polynomial; those of the observed targets by default.
    tolerance : float
        Of knots, as of collocate_rows, where there are ties.
    """

    names: np.ndarray
    gps_time: np.ndarray
    misclosure: np.ndarray
    noise: Noise
    partials: np.ndarray
    stated: StatedSigma
    order: int
    prior: Callable
    trajectory: Trajectory
    pos: Pos
    mounting: np.ndarray | None = None
    fallbacks: int = 0
    ties: TieEquations | None = None
    trend_span: tuple[float, float] | None = None
    tolerance: float = SETTINGS.knot_tolerance

    @cached_property
    def stated_epochs(self) -> StatedSigma:
        """What the POS states at all epochs of the trajectory."""
        return stated_sigma(self.trajectory, self.pos, starts=self.stated.starts)

    def with_starts(self, starts: np.ndarray) -> Equations:
        """The same with drift that grows from other times on.

        Parameters
        ----------
        starts : (k,) array
            One for each segment. Units: s.
        """
        if self.ties is None:
            ties = None
        else:
            ties = self.ties.with_starts(starts)
        return replace(self, stated=replace(self.stated, starts=starts), ties=ties)

    @property
    def observed(self) -> np.ndarray:
        """Times (n,) of the observed targets, without those that hold the mounting. Units: s."""
        return self.gps_time[: len(self.names)]

    def select(self, rows: np.ndarray | Sequence[int]) -> Equations:
        """The equations of some targets.

        Parameters
        ----------
        rows : (n,) bool or (k,) int array
        """
        rows = np.asarray(rows)
        if rows.dtype == bool:
            rows = np.flatnonzero(rows)
        kept = np.append(rows, np.arange(len(self.names), len(self.gps_time)))
        return replace(self._rows(kept), names=self.names[rows])

    def _rows(self, kept):
        mounting = self.mounting
        if mounting is not None:
            mounting = mounting[kept]
        return replace(
            self,
            gps_time=self.gps_time[kept],
            misclosure=self.misclosure[kept],
            noise=self.noise.select(kept),
            partials=self.partials[kept],
            stated=self.stated.at(kept),
            mounting=mounting,
        )

    def without_fallbacks(self) -> Equations:
        """The equations of control points alone."""
        if len(self.names) == len(self.gps_time):
            return self
        return replace(self._rows(np.arange(len(self.names))), fallbacks=0)

    def without_outer_fallbacks(self) -> Equations:
        """The equations without fall-backs outside the control span."""
        n = len(self.gps_time)
        first = n - 2 * self.fallbacks
        ends = self.gps_time[first:].reshape(-1, 2)
        inside = (ends[:, 0] >= self.span[0]) & (ends[:, 1] <= self.span[1])
        kept = np.append(np.arange(first), np.arange(first, n)[np.repeat(inside, 2)])
        return replace(self._rows(kept), fallbacks=int(inside.sum()))

    def without(self, names: Collection[str]) -> Equations:
        """The equations of all targets but some.

        Parameters
        ----------
        names : collection of str
        """
        if names:
            return self.select(~np.isin(self.names, list(names)))
        return self

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

        Where they are none or as good as one, or where ties tell more of the time than how far
        apart targets stand, the believed correlation time as the paper's rule has it.
        """
        control = np.sort(self.observed)
        recorded_time = self.trajectory.recorded_time
        is_short = len(control) == 0 or recorded_time(*control[[0, -1]]) < SAME_EPOCH
        if is_short or self.ties is not None:
            return self.pos.correlation_time / SETTINGS.start_ratio
        return self.trajectory.control_interval(self.observed)

    @cached_property
    def target_rows(self) -> dict[str, np.ndarray]:
        """Rows of the observation equations of each target, all its passes together."""
        rows: dict[str, list[int]] = {}
        for row, name in enumerate(np.repeat(self.names, 3).tolist()):
            rows.setdefault(str(name), []).append(row)
        return {name: np.array(own) for name, own in rows.items()}

    def solve(
        self, parameters: SignalParameters | None, like: Collocation | None = None
    ) -> Collocation:
        """Collocation under given parameters.

        Parameters
        ----------
        parameters : SignalParameters or None
            Without any it is least squares.
        like : Collocation, optional
            Of the same equations under parameters near by; with ties its knots are used again.
        """
        control = self.gps_time, self.misclosure, self.noise, self.design
        if parameters is None:
            return collocate(*control, ())
        rows = self.rows(parameters)
        believed = self.believed(parameters)
        if self.ties is None:
            return self._without_places(collocate(*control, rows[0].signals, believed))
        known = None
        if like is not None:
            known = like.solver
        return self._without_places(collocate_rows(rows, known, self.tolerance, believed))

    def _without_places(self, solved):
        """A Collocation whose sigma0 counts no place of a fall-back as known."""
        redundancy = len(solved.misclosure) + len(solved.believed) - solved.design.shape[1]
        known = redundancy - 3 * self.fallbacks
        if self.fallbacks == 0 or known <= 0:
            return solved
        return replace(solved, sigma0=solved.sigma0 * np.sqrt(redundancy / known))

    def weigh(self, parameters: SignalParameters, like: Collocation | None = None) -> Collocation:
        """As solve, for the likelihood alone: few rows with ties by their covariance matrix.

        Parameters
        ----------
        parameters : SignalParameters
        like : Collocation, optional
            Of the same equations by this, under parameters near by: with its knots a difference
            is smooth, and costs half as much.
        """
        if self._is_dense:
            return collocate_rows_dense(self.rows(parameters), self.believed(parameters))
        return self.solve(parameters, like)

    def likelihoods(
        self, near: Sequence[SignalParameters], parameters: SignalParameters, solved: Collocation
    ) -> np.ndarray:
        """Log-likelihoods (k,) of k parameters near some, as differences need them.

        Parameters
        ----------
        near : sequence of SignalParameters
        parameters : SignalParameters
        solved : Collocation
            By weigh, under these.
        """
        if not self._is_dense:
            return np.array([self.weigh(each, solved).log_likelihood for each in near])
        rows = self.rows(parameters)
        changed = [self.rows(each) for each in near]
        believed = [self.believed(each) for each in near]
        return solved.log_likelihood + likelihood_changes(solved, rows, changed, believed)

    @property
    def _is_dense(self):
        """Whether the covariance matrix is the fastest way to a likelihood."""
        return (
            self.ties is not None and self.misclosure.size + len(self.ties) <= SETTINGS.dense_rows
        )

    def rows(self, parameters: SignalParameters) -> list[SparseRows]:
        """Rows of control, and of ties where there are any.

        Parameters
        ----------
        parameters : SignalParameters
        """
        signals = pose_signals(self.stated, parameters, self.partials)
        times = self.gps_time[:, None]
        control = SparseRows(times, self.misclosure, self.noise, self.design, signals)
        if self.ties is None:
            return [control]
        return [control, self.ties.rows(parameters, self.pose_design)]

    def believed(self, parameters: SignalParameters) -> np.ndarray:
        """What is believed of the trend, (3 (order + 1), p), as of a Collocation.

        Parameters
        ----------
        parameters : SignalParameters
        """
        columns = self.design.shape[2]
        return np.eye(columns)[columns - 3 * (self.order + 1) :] / parameters.trend_sigma

    @cached_property
    def design(self) -> np.ndarray:
        """A (n + h, 3, p) of the observations; no epoch without a target tells of a trend."""
        trend = self._trend(self.gps_time)
        trend[len(self.names) :] = 0.0
        if self.mounting is None:
            return trend
        return np.concatenate([self.mounting, trend], axis=2)

    def pose_design(self, gps_time: np.ndarray) -> np.ndarray:
        """A (q, 6, p) of position and rotation at any epochs; a mounting moves no pose.

        Parameters
        ----------
        gps_time : (q,) array
            Units: s.
        """
        position = self._trend(gps_time)
        columns = 0
        if self.mounting is not None:
            columns = self.mounting.shape[2]
        pose = np.zeros((len(gps_time), 6, columns + position.shape[2]))
        pose[:, :3, columns:] = position
        return pose

    def _trend(self, gps_time):
        """A (q, 3, p) of the position."""
        if self.order == NO_TREND:
            return np.zeros((len(gps_time), 3, 0))
        return polynomial_design(gps_time, self.span, self.order)


def position_equations(
    trajectory: Trajectory, matched: Matched, pos: Pos, order: int, prior: Callable
) -> Equations:
    """The equations of the POS error, with a polynomial trend of the position  (Eq. 7-12).

    A target that was seen in the middle of a step has the step in its noise.

    Parameters
    ----------
    trajectory : Trajectory
    matched : Matched
    pos : Pos
    order : int
    prior : function of Equations
    """
    position = matched.observations.position
    times = matched.gps_time
    stated = stated_sigma(trajectory, pos, times)
    return Equations(
        names=np.array(matched.name),
        gps_time=times,
        misclosure=matched.misclosure,
        noise=_noise(matched, stated.history.steps),
        partials=pose_partials(trajectory, position, times),
        stated=stated,
        order=order,
        prior=prior,
        trajectory=trajectory,
        pos=pos,
    )


def with_fallbacks(equations: Equations, steps: Steps) -> Equations:
    """The equations, and below them two epochs for each fall-back of the POS.

    The recorded position steps by as much as its error does, whatever parts the error has. So the
    epochs before and after a step are two views of one place that nobody surveyed: what each says
    of the error by itself is unknown, by how much it differs is the step.

    Parameters
    ----------
    equations : Equations
        Without fall-backs.
    steps : Steps
    """
    steps = steps[np.linalg.norm(steps.size, axis=1) < SEARCH_RADIUS]
    if len(steps) == 0:
        return equations
    number = np.repeat(np.arange(len(steps)), 2)
    times = np.column_stack([steps.before, steps.after]).ravel()
    misclosure = np.stack([steps.size, np.zeros_like(steps.size)], axis=1).reshape(-1, 3)
    variance = steps.sigma[number, None, None] ** 2 / 2 * np.eye(3)
    partials = np.tile(np.eye(3, 6), (len(times), 1, 1))
    inserted = times, misclosure, variance, partials
    complete = _insert(equations, len(equations.gps_time), *inserted)
    noise = complete.noise.share(len(equations.gps_time) + np.arange(len(times)), number, PLACE)
    return replace(complete, noise=noise, fallbacks=len(steps))


def mounting_equations(
    equations: Equations,
    matched: Matched,
    mountings: Sequence[Mounting],
    corrected: np.ndarray,
    weak: np.ndarray,
) -> Equations:
    """The equations of what k mountings lack  (Eq. 16-18), from those of the POS error.

    Below the targets two epochs of three rows hold each mounting weakly.

    Parameters
    ----------
    equations : Equations
    matched : Matched
        As georeferenced with the mountings.
    mountings : sequence of Mounting
        Corrected by ``corrected`` already; what is estimated adds to them.
    corrected : (6 k,) array
        Units: m and rad.
    weak : (6 k,) array
        One sigma of what is known of the mountings without the survey. Units: m and rad.
    """
    times = matched.gps_time
    position = matched.observations.position
    bare = replace(
        equations,
        gps_time=times,
        misclosure=matched.misclosure,
        noise=_noise(matched, equations.stated.history.steps),
        partials=pose_partials(equations.trajectory, position, times),
        order=NO_TREND,
    )
    columns = partials_by_scanner(
        mounting_partials,
        equations.trajectory,
        dict(enumerate(mountings)),
        position,
        times,
        matched.scanner,
    )
    return with_mountings(bare, columns, -corrected, weak)


def with_mountings(
    equations: Equations, columns: np.ndarray, lacking: np.ndarray, sigma: np.ndarray
) -> Equations:
    """The equations with mountings beside the trend, and below the targets what is known of them.

    Parameters
    ----------
    equations : Equations
        Of n targets, and of fall-backs.
    columns : (n, 3, 6 k) array
        Partial derivatives of the targets by k mountings (Eq. 16-18).
    lacking, sigma : (6 k,) array
        What is believed to be missing in each lever arm and boresight, and how well. Units: m, rad.
    """
    n = len(equations.names)
    number = len(sigma) // 3
    if n:
        held = equations.gps_time[0]
    else:
        held = equations.trajectory.gps_time[0]
    mounting = np.zeros((len(equations.gps_time) + number, 3, len(sigma)))
    mounting[:n] = columns
    mounting[n : n + number] = np.eye(len(sigma)).reshape(number, 3, -1)
    variance = sigma.reshape(-1, 3, 1) ** 2 * np.eye(3)
    inserted = np.full(number, held), lacking.reshape(-1, 3), variance, np.zeros((number, 3, 6))
    return replace(_insert(equations, n, *inserted), mounting=mounting)


def _insert(equations, place, gps_time, misclosure, variance, partials):
    """The equations with epochs (k,), their misclosures and noise before the epoch of a number."""
    times = np.insert(equations.gps_time, place, gps_time)
    return replace(
        equations,
        gps_time=times,
        misclosure=np.insert(equations.misclosure, place, misclosure, axis=0),
        noise=equations.noise.insert(place, variance),
        partials=np.insert(equations.partials, place, partials, axis=0),
        stated=_stated(equations, times),
    )


def _stated(equations, gps_time):
    stated = stated_sigma(equations.trajectory, equations.pos, gps_time, equations.stated.starts)
    return replace(stated, history=equations.stated.history)


def _noise(matched, steps):
    """Extraction, the step inside which it was seen, and the survey error, which all passes of a
    target share  (Eq. 19).
    """
    number = matched.point_number
    times = matched.gps_time[:, None]
    shared = matched.surveyed.sigma[np.unique(number, return_index=True)[1]]
    inside = ((times >= steps.before) & (times <= steps.after)).astype(float)
    stepped = np.einsum("ns,si,sj->nij", inside, steps.size, steps.size)
    return Noise(matched.observations.covariance + stepped, number, shared)
