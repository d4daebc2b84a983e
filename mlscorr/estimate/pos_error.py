"""Estimation of the corrected trajectory from misclosures (Mao et al. 2015, section 2.4.2).

Control points alone are used first, then ties; other orders of the trend are compared with the one
in use.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.collocation import Collocation
from mlscorr.correction import Correction
from mlscorr.estimate._prediction import GridPredictions, pose_rows, predict_pose_error
from mlscorr.estimate._wording import sentences_of
from mlscorr.estimate.adjustment import (
    NO_TREND,
    Adjustment,
    position_adjustment,
    with_reacquisitions,
)
from mlscorr.estimate.factors import TIE, tie_factor
from mlscorr.estimate.guards import Guards, find_guards, guard_warnings, sparse_warnings
from mlscorr.estimate.inputs import checked_inputs, filled_sigmas
from mlscorr.estimate.judgement import doubtful_drift, doubts, judge, with_drifts
from mlscorr.estimate.mounting import prior_sigma
from mlscorr.estimate.outages import with_drift_history
from mlscorr.estimate.posterior import (
    Objective,
    choose_parameters,
    drifting_prior,
    most_probable,
    position_prior,
)
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.support import Support, find_support
from mlscorr.estimate.target_tests import Screening, TargetTest, all_tests, screen
from mlscorr.estimate.tied import TieResiduals, robust_ties, screen_with_ties
from mlscorr.pos import SignalParameters
from mlscorr.survey import (
    Matched,
    Mounting,
    Pos,
    Statement,
    Summary,
    Ties,
    Trajectory,
    control_epochs,
)


@dataclass(frozen=True)
class Alternative:
    """A trend's order and a covariance family with its most probable parameters.

    Parameters
    ----------
    order : int
    parameters : SignalParameters
    log_likelihood : float
    probability : float
        Among all alternatives.
    leave_one_out : (3,) array
        RMSE. Units: m.
    """

    order: int
    parameters: SignalParameters
    log_likelihood: float
    probability: float
    leave_one_out: np.ndarray


@dataclass(frozen=True, repr=False)
class Estimate(Summary):
    """The estimated POS error.

    Parameters
    ----------
    correction : Correction
        An average over all parameters.
    adjustment : Adjustment
        Of the used targets, and of the accepted ties.
    screening : Screening
    used : (n,) bool array
        Mask of observations in use.
    left_out : (n, 3) array
        Leave-one-out misclosures of the used ones, without their target; NaN at a single target.
        Units: m.
    log_likelihood, sigma0 : float
    guards : Guards
    support : Support
        Parts of the drive in which control points and ties support the correction, and extrapolated
        ones.
    notes : tuple of Statement
        On the inputs.
    ties : TieResiduals, optional
        Residuals of the given ties.
    untied : str
        Reason that none were found, if they were sought.
    """

    correction: Correction
    adjustment: Adjustment
    screening: Screening
    used: np.ndarray
    left_out: np.ndarray
    log_likelihood: float
    sigma0: float
    guards: Guards
    support: Support
    notes: tuple[Statement, ...]
    ties: TieResiduals | None = None
    untied: str = ""

    @property
    def order(self) -> int:
        """Order of the trend; without control points a shift, limited by the POS sigmas."""
        return self.adjustment.order

    @property
    def parameters(self) -> SignalParameters:
        """The most probable parameters."""
        return self.families[0][0]

    @property
    def families(self) -> tuple[tuple[SignalParameters, float], ...]:
        """Parameters of each covariance family with its probability."""
        return self.screening.posterior.modes

    @property
    def outliers(self) -> tuple[TargetTest, ...]:
        """Targets that contradict the others."""
        return self.screening.outliers

    @property
    def tests(self) -> tuple[TargetTest, ...]:
        """Test of each used target against the others."""
        return self.screening.tests

    @property
    def span(self) -> tuple[float, float]:
        """First and last control epoch, in s."""
        return self.adjustment.span

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for the user."""
        return sentences_of(self.statements)

    @property
    def statements(self) -> tuple[Statement, ...]:
        """Statements on doubts."""
        statements = [
            *self.notes,
            *guard_warnings(self.guards, self.adjustment, self.parameters),
            *self.screening.warnings,
        ]
        if self.ties is not None:
            statements += self.ties.statements
        return tuple(statements)

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Other orders of the trend besides the one in use; none without control."""
        if len(self.adjustment.names) == 0:
            return ()
        with threadpool_limits(limits=1, user_api="blas"):
            return compare_orders(self.adjustment, self.families)


# The matrices are small: on a busy machine synchronizing threads takes longer than the work
@threadpool_limits.wrap(limits=1, user_api="blas")
def estimate_correction(
    trajectory: Trajectory,
    matched: Matched,
    pos: Pos | None = None,
    order: int = SETTINGS.order,
    kept_in: Collection[str] = (),
) -> Estimate:
    """Estimate the POS error from matched targets  (Mao et al. 2015, section 2.4.2).

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    matched : Matched
        Observed control points.
    pos : Pos, optional
        Assumptions, used if the trajectory has no sigmas.
    order : int
        Of the polynomial trend; lowered if there are too few control points.
    kept_in : collection of str
        Names of control points that are never rejected.

    Raises
    ------
    ValueError
        Without any observation, and for invalid sigmas.
    """
    pos = pos or Pos()
    filled, notes = checked_inputs(trajectory, matched, pos, order)
    adjustment, screening, probability, drifts = _judged(filled, matched, pos, order, kept_in)
    kept = adjustment.without({outlier.name for outlier in screening.outliers})
    notes = (*notes, *(drift.statement for drift in drifts), *sparse_warnings(kept, order))
    doubt = doubtful_drift(adjustment, screening, probability)
    screening = replace(
        screening,
        warnings=(*screening.warnings, *doubts(adjustment, screening, probability)),
    )
    return _estimate(trajectory, matched.name, GridPredictions(kept), screening, notes, doubt)


def _judged(trajectory, matched, pos, order, kept_in):
    """Adjustment of all targets, its Screening, the probability that each rejected target is
    correct, and the unstated drifts near others.
    """
    drifts = ()
    adjustment = plain = _adjusted(trajectory, matched, pos, order)
    while True:
        screening = screen(adjustment, kept_in)
        judgement = judge(adjustment, screening, len(drifts))
        known = {name for drift in drifts for name in drift.names}
        new = [drift for drift in judgement.drifts if not known.issuperset(drift.names)]
        if not new:
            break
        drifts = (*drifts, *new)
        adjustment = _adjusted(with_drifts(trajectory, drifts), matched, pos, order)
    if len(drifts) > 1 and not screening.outliers:  # it may drift unstated between the points, too
        adjustment = replace(plain, prior=drifting_prior)
        posterior = choose_parameters(adjustment)
        screening = Screening(posterior, (), tuple(all_tests(adjustment, posterior)), ())
    return adjustment, screening, judgement.probability, drifts


def _adjusted(trajectory, matched, pos, order):
    """Adjustment of all targets with the order that they allow, and the history of the drift."""
    adjustment = position_adjustment(trajectory, matched, pos, order, position_prior)
    adjustment = replace(adjustment, order=affordable_order(order, adjustment))
    return with_drift_history(adjustment)


@threadpool_limits.wrap(limits=1, user_api="blas")
def prior_correction(trajectory: Trajectory, pos: Pos | None = None) -> Estimate:
    """Prior estimate of the POS error without control, from re-acquisitions and sigmas alone.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    pos : Pos, optional
        Assumptions, used if the trajectory has no sigmas.

    Returns
    -------
    Estimate
        Ties can be added to it: then passes agree with each other, at the position given by the
        POS.
    """
    pos = pos or Pos()
    filled, notes = filled_sigmas(trajectory)
    adjustment = position_adjustment(filled, Matched.none(), pos, 0, position_prior)
    adjustment = with_reacquisitions(adjustment, adjustment.errors.history.steps)
    screening = Screening.untested(adjustment)
    return _estimate(trajectory, (), GridPredictions(adjustment), screening, notes)


@threadpool_limits.wrap(limits=1, user_api="blas")
def with_ties(
    estimate: Estimate,
    ties: Ties,
    mountings: Sequence[Mounting] = (),
    kept_in: Collection[str] = (),
) -> Estimate:
    """Return the estimate by control points and by ties between two passes, or two scanners.

    Parameters
    ----------
    estimate : Estimate
        By control points alone.
    ties : Ties
    mountings : sequence of Mounting
        Of all scanners, if some ties are between two of them: errors relative to the first are
        estimated with the drift, so that they don't appear as drift. Of a single scanner with
        repeated views of one visit: its errors likewise.
    kept_in : collection of str
        See ``estimate_correction``.
    """
    tied = _tied_adjustment(estimate.adjustment, ties, mountings)
    predictions, screening, is_used = screen_with_ties(tied, estimate.screening, kept_in)
    names = np.full(len(estimate.used), "", dtype=object)
    names[estimate.used] = tied.names
    trajectory = estimate.correction.recorded
    changed = _estimate(trajectory, names, predictions, screening, estimate.notes)
    return replace(changed, ties=TieResiduals.of(ties, is_used, changed.correction))


@threadpool_limits.wrap(limits=1, user_api="blas")
def previewed_correction(
    estimate: Estimate, ties: Ties, mountings: Sequence[Mounting] = (), with_sigmas: bool = False
) -> Correction:
    """Return the correction with the ties paired so far, under parameters from control alone.

    Parameters
    ----------
    estimate : Estimate
        By control points alone.
    ties, mountings : Ties, sequence of Mounting
        See ``with_ties``.
    with_sigmas : bool
        True for sigmas of the trajectory, which need the inverse of the normal equations.
    """
    tied = _tied_adjustment(estimate.adjustment, ties, mountings)
    tied = replace(tied, tolerance=SETTINGS.coarse_tolerance)
    weighed = robust_ties(tied, estimate.parameters)
    asked = pose_rows(weighed.adjustment, weighed.parameters)
    solved = weighed.solved
    if with_sigmas:
        pose = solved.predict(*asked)
    else:
        pose = (solved.predict_mean(*asked),)
    return Correction.by_pose_error(estimate.correction.recorded, *pose)


def _tied_adjustment(adjustment, ties, mountings):
    """The adjustment with ties, and with all mountings but the first, or the only one."""
    free = dict(enumerate(mountings))
    if len(free) > 1:
        del free[0]  # the reference of all others
    factor = tie_factor(adjustment.errors, ties, free)
    if not free:
        return adjustment.with_factor(factor)
    columns = factor.columns
    sigma = np.array([prior_sigma(mounting) for mounting in mountings])
    if 0 in free:  # differences between two visits of one scanner are drift
        columns = columns * ties.is_of_visit[:, None, None]
    else:
        sigma = np.hypot(sigma[1:], sigma[0])
    sigma = sigma.ravel()
    tied = adjustment.with_factor(replace(factor, columns=None))
    return tied.with_unknowns({TIE: columns}, np.zeros(len(sigma)), sigma)


def _estimate(trajectory, names, predictions, screening, notes, doubt=None):
    """The Estimate by adjustment, as predictions have them, and the parameters chosen for them.

    A doubt (n, 3; m) adds to the position's covariance; see ``doubtful_drift``.
    """
    kept = predictions.adjustment
    posterior = screening.posterior
    used = np.isin(np.asarray(names, dtype=object), kept.names)
    parameters = posterior.modes[0][0]
    solved = predictions.take(parameters)
    left_out = np.full((len(names), 3), np.nan)
    if len(kept.target_rows) > 1:
        left_out[used] = leave_targets_out(kept, solved)
    pose, covariance = predict_pose_error(kept, posterior, predictions, solved)
    if doubt is not None:
        covariance[:, :3, :3] += doubt[:, :, None] * doubt[:, None, :]
    correction = Correction.by_pose_error(trajectory, pose, covariance)
    return Estimate(
        correction=correction,
        adjustment=kept,
        screening=screening,
        used=used,
        left_out=left_out,
        log_likelihood=solved.log_likelihood,
        sigma0=solved.sigma0,
        guards=find_guards(kept, parameters, correction.corrected),
        support=find_support(kept, solved, parameters, correction.corrected),
        notes=notes,
    )


def compare_orders(
    adjustment: Adjustment, families: Sequence[tuple[SignalParameters, float]]
) -> tuple[Alternative, ...]:
    """Alternatives of all families, without a trend and for all orders up to the next one.

    Parameters
    ----------
    adjustment : Adjustment
    families : sequence of (SignalParameters, float)
        Most probable parameters of each family at the order in use.
    """
    order = adjustment.order
    # Blocks have trends of their own, which can't be compared; ties determine none
    is_alone = len(adjustment.names) > SETTINGS.block or adjustment.ties is not None
    orders = [order] if is_alone else range(NO_TREND, order + 2)
    start = [chosen for chosen, _ in families]
    rows = []
    for tried in orders:
        with_order = replace(adjustment, order=tried)
        objective = Objective.of(with_order)
        if tried == order:
            modes = families
        else:
            modes = most_probable(with_order, start)
        for chosen, _ in modes:
            value = objective(chosen.family, objective.logarithms(chosen))
            solved = with_order.solve(chosen)
            left = np.sqrt(np.mean(leave_targets_out(with_order, solved) ** 2, axis=0))
            rows.append((tried, chosen, solved.log_likelihood, value, left))
    share = np.exp([row[3] - max(row[3] for row in rows) for row in rows])
    share /= share.sum()
    return tuple(
        Alternative(tried, chosen, float(likelihood), float(probability), left)
        for (tried, chosen, likelihood, _, left), probability in zip(rows, share, strict=True)
    )


def affordable_order(order: int, adjustment: Adjustment) -> int:
    """Order that leaves one control epoch more than the trend needs.

    Parameters
    ----------
    order : int
        Requested order.
    adjustment : Adjustment
    """
    sizes = len(adjustment.target_rows), len(control_epochs(adjustment.observed))
    return max(min(order, min(sizes) - 2), 0)


def leave_targets_out(adjustment: Adjustment, solved: Collocation) -> np.ndarray:
    """Leave-one-out misclosures (n, 3) of each target in turn. Units: m.

    Parameters
    ----------
    adjustment : Adjustment
    solved : Collocation

    Returns
    -------
    (n, 3) array
    """
    residuals = np.empty(3 * len(adjustment.names))
    for rows in adjustment.target_rows.values():
        residuals[rows] = solved.leave_out(rows)[0]
    return residuals.reshape(-1, 3)
