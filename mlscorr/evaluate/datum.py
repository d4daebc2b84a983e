"""Detection of a linear difference between control and cloud: shift, scale, rotation, tilt.

The corrected cloud follows the control, and check points of the same survey do, too, so they do not
show that a network is in ground distances or in another datum. Two explanations of the misclosures
are compared by their marginal likelihoods (Kass and Raftery 1995): POS errors as in the estimate,
with their scales and correlation times; and the same errors plus a linear term of the control with
a wide prior. POS errors of several stated sigmas are possible, but rarely linear.

A shift is not separable from a constant POS error by its shape, only by its size, so the stated
sigma is trusted there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

from mlscorr.collocation import FAMILIES, INTEGRATED
from mlscorr.estimate import SETTINGS as ESTIMATE
from mlscorr.estimate import (
    TARGET,
    Adjustment,
    Objective,
    filled_sigmas,
    position_adjustment,
    position_prior,
    with_drift_history,
)
from mlscorr.evaluate._settings import SETTINGS
from mlscorr.evaluate.wording import DATUM
from mlscorr.io.trajectories import MapFactors, map_factors
from mlscorr.pos import SETTINGS as POS
from mlscorr.pos import PosErrors, SignalParameters
from mlscorr.survey import Matched, Pos, Statement, Trajectory

SHIFT, HEIGHT, SCALE, TURN, TILT = TERMS = ("shift", "height", "scale", "turn", "tilt")
UNITS = {SHIFT: "m", HEIGHT: "m", SCALE: "ratio", TURN: "rad", TILT: "m/m"}
COLUMNS = {SCALE: [0], TURN: [1], TILT: [2, 3]}  # columns of linear_columns
SETS = [tuple(s) for k in range(4) for s in combinations(COLUMNS, k)]  # of terms, empty first


@dataclass(frozen=True)
class DatumDifference:
    """Linear term by which all control points together differ from the cloud.

    Parameters
    ----------
    term : str
        One of TERMS.
    size, sigma : (k,) array
        Estimate and its one sigma: E and N (shift), height, scale minus one, rotation to the left
        (rad), rise of the control toward E and N (tilt). Units: those of UNITS.
    log_evidence : float
        Log Bayes factor of the term against a POS error.
    observations : int
        Number of control observations used.
    extent : float
        RMS distance of the control points from their middle, in plan. Units: m.
    ground : MapFactors, optional
        Factors of the survey's CRS at the control; None without a CRS.
    assumed_sigma : float, optional
        Sigma of the POS if it was not stated; used only for a shift and a height. Units: m.
    """

    term: str
    size: np.ndarray
    sigma: np.ndarray
    log_evidence: float
    observations: int
    extent: float
    ground: MapFactors | None = None
    assumed_sigma: float | None = None

    @property
    def length(self) -> float:
        """Size of the shift, or effect of the term at the extent. Units: m."""
        size = float(np.linalg.norm(self.size))
        if self.term in (SHIFT, HEIGHT):
            return size
        return size * self.extent

    def document(self) -> dict[str, object]:
        """Return the row of ``datum[]`` in report.json."""
        ground = None
        if self.ground is not None:
            ground = self.ground.document()
        return {
            "term": self.term,
            "unit": UNITS[self.term],
            "size": self.size.tolist(),
            "sigma": self.sigma.tolist(),
            "length_m": self.length,
            "extent_m": self.extent,
            "log_evidence": self.log_evidence,
            "observations": self.observations,
            "map_factor": ground,
            "sentence": self.sentence,
        }

    @property
    def statement(self) -> Statement:
        """Term with its size, evidence, and data on its likely cause."""
        values = {"size": self.size, "log_evidence": self.log_evidence}
        values["observations"] = self.observations
        if self.term in (SHIFT, HEIGHT):
            values["assumed_sigma"] = self.assumed_sigma
        else:
            values |= {"sigma": self.sigma, "extent": self.extent}
        if self.term != HEIGHT:
            values["length"] = self.length
        if self.term in (SCALE, TURN):
            values["ground"] = self.ground
        if self.term == SCALE:
            values["is_ground"] = self._has_ground_scale()
        return Statement(self.term, "warning", values)

    def _has_ground_scale(self):
        """True if the scale is that of ground distances; False if the map's is unknown."""
        if self.ground is None:
            return False
        expected = 1 / self.ground.combined - 1
        return bool(abs(self.size[0] - expected) <= 3 * self.sigma[0])

    @property
    def sentence(self) -> str:
        """Warning used by check, correct and the page."""
        return self.statement.sentence(DATUM)


def datum_differences(
    control: Matched, trajectory: Trajectory, pos: Pos, crs: str | None = None
) -> tuple[DatumDifference, ...]:
    """Find terms of the control that explain its misclosures better than a POS error.

    Parameters
    ----------
    control : Matched
        Control points used in the estimate.
    trajectory : Trajectory
        Recorded trajectory.
    pos : Pos
    crs : str, optional
        CRS of the survey, whose scale and convergence are stated with the estimated ones.

    Returns
    -------
    tuple of DatumDifference
        Terms with strong evidence (a Bayes factor of 20); empty for fewer than three observations.
    """
    if len(control) < 3:
        return ()
    filled, _ = filled_sigmas(trajectory)
    linear = _linear_terms(_spread(control), filled, pos)
    place = control.surveyed.position
    columns = linear_columns(place)
    rest = control.misclosure - sum(
        (columns[:, :, COLUMNS[term]] @ size for term, size, _, _ in linear), np.zeros(3)
    )
    sigma = PosErrors.stated(filled, pos).at(control.gps_time).position
    shifts = (
        *_shift(rest[:, :2], sigma[:, :2], SHIFT),
        *_shift(rest[:, 2:], sigma[:, 2:], HEIGHT),
    )
    middle = place.mean(axis=0)
    about = {"observations": len(control), "extent": _extent(place)}
    if crs is not None:
        about["ground"] = map_factors(crs, middle)
    if trajectory.position_sigma is None and "position_sigma" in pos.assumed:
        about["assumed_sigma"] = pos.position_sigma
    return tuple(DatumDifference(*terms, **about) for terms in chain(shifts, linear))


def linear_columns(place: np.ndarray) -> np.ndarray:
    """Partial derivatives (n, 3, 4) of positions by scale, rotation to the left, rise to E and N.

    Parameters
    ----------
    place : (n, 3) array
        Units: m.
    """
    east, north, _ = (place - place.mean(axis=0)).T
    columns = np.zeros((len(place), 3, 4))
    columns[:, 0, 0] = east
    columns[:, 1, 0] = north
    columns[:, 0, 1] = -north
    columns[:, 1, 1] = east
    columns[:, 2, 2] = east
    columns[:, 2, 3] = north
    return columns


@threadpool_limits.wrap(limits=1, user_api="blas")
def _linear_terms(control, trajectory, pos):
    """Pairs (term, size, sigma, log evidence) of each linear term in the most probable set."""
    adjustment = position_adjustment(trajectory, control, pos, ESTIMATE.order, position_prior)
    adjustment = with_drift_history(adjustment)
    columns = linear_columns(control.surveyed.position)
    prior = np.array([SETTINGS.datum_scale, SETTINGS.datum_turn, *2 * [SETTINGS.datum_tilt]])
    evidence = _Evidence(adjustment, columns, prior)
    best = max(SETS, key=evidence.of)
    terms = []
    for term in best:
        others = tuple(other for other in best if other != term)
        gain = evidence.of(best) - evidence.of(others)
        if gain > np.log(ESTIMATE.strong_evidence):
            terms.append((term, *evidence.size(best, term), gain))
    return terms


class _Evidence:
    """Marginal likelihood of sets of linear terms together with the POS error.

    For given parameters of the POS, the terms' coefficients x ~ N(0, D^2) are integrated out in
    closed form: with r = M'P l and N = M'P M the likelihood is that without terms times exp(r'(N +
    D^-2)^-1 r / 2) / sqrt(det(I + D N D)). The parameters are the most probable ones of each
    covariance family, without any term and with all of them; the better of the two counts.

    Parameters
    ----------
    adjustment : Adjustment
    columns : (n, 3, k) array
        M of the n observations.
    prior : (k,) array
        D, one sigma of each coefficient.
    """

    def __init__(self, adjustment: Adjustment, columns: np.ndarray, prior: np.ndarray):
        self.prior = prior
        everything = adjustment.with_unknowns({TARGET: columns}, np.zeros(len(prior)), prior)
        matrix = adjustment.stacked({TARGET: columns})
        objective = Objective.of(adjustment)
        complete = Objective.of(everything)
        self.modes = []  # (family, log posterior without terms, N, r)
        for family in (*FAMILIES, INTEGRATED):
            plain, _ = objective.maximum(family, objective.initial)
            # From the same start: from the mode of a POS that explains everything, the search would
            # not move
            refitted, _ = complete.maximum(family, complete.initial)
            for logarithms in (plain, refitted):
                value = objective(family, logarithms)
                parameters = objective.parameters(family, logarithms)
                self.modes.append((family, value, *_normal(adjustment, parameters, matrix)))

    def of(self, terms: Iterable[str]) -> float:
        """Log evidence of a set of terms, up to a constant.

        Parameters
        ----------
        terms : iterable of str
        """
        best = {family: -np.inf for family, *_ in self.modes}
        for family, value, normal, right in self.modes:
            best[family] = max(best[family], value + self._gain(terms, normal, right))
        return float(logsumexp(list(best.values())))

    def size(self, terms: Iterable[str], term: str) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients and one sigma of a term among others, with the most probable parameters.

        Parameters
        ----------
        terms : iterable of str
        term : str
        """
        mode = max(self.modes, key=lambda mode: mode[1] + self._gain(terms, *mode[2:]))
        numbers, covariance, size = self._solved(terms, *mode[2:])
        rows = np.isin(numbers, COLUMNS[term])
        return size[rows], np.sqrt(np.diag(covariance))[rows]

    def _gain(self, terms, normal, right):
        """Increase of the log-likelihood by the terms."""
        numbers, covariance, size = self._solved(terms, normal, right)
        if len(numbers) == 0:
            return 0.0
        spread = np.linalg.slogdet(covariance)[1] - 2 * np.log(self.prior[numbers]).sum()
        return 0.5 * float(right[numbers] @ size + spread)

    def _solved(self, terms, normal, right):
        """Indices of the coefficients, their covariance and their values."""
        numbers = np.array([number for term in terms for number in COLUMNS[term]], dtype=int)
        information = normal[np.ix_(numbers, numbers)] + np.diag(self.prior[numbers] ** -2.0)
        covariance = np.linalg.inv(information)
        return numbers, covariance, covariance @ right[numbers]


def _normal(adjustment: Adjustment, parameters: SignalParameters, matrix: np.ndarray):
    """N = M'P M and r = M'P l, where P eliminates the trend."""
    solved = adjustment.solve(parameters)
    white = solved.solver.whiten(np.column_stack([solved.design, matrix, solved.misclosure]))
    known = solved.design.shape[1]
    prior_rows = np.zeros((len(solved.prior_rows), white.shape[1]))
    prior_rows[:, :known] = solved.prior_rows[:, :known]
    white = np.vstack([white, prior_rows])
    trend, rest = np.split(white, [solved.design.shape[1]], axis=1)
    basis = np.linalg.qr(trend)[0]
    rest = rest - basis @ (basis.T @ rest)
    product = rest.T @ rest
    return product[:-1, :-1], product[:-1, -1]


def _spread(control):
    """Select observations up to the limit of one likelihood, spread along the drive."""
    names = list(dict.fromkeys(np.array(control.name)[np.argsort(control.gps_time)].tolist()))
    passes = max(1.0, len(control) / len(names))
    count = min(len(names), max(3, int(ESTIMATE.block / passes)))
    kept = {names[i] for i in np.rint(np.linspace(0, len(names) - 1, count)).astype(int)}
    return control[np.array([name in kept for name in control.name])]


def _shift(misclosure, sigma, term):
    """Result (term, size, sigma, log evidence) of a shift common to all misclosures (n, k).

    Two hypotheses have the same, well determined mean: N(0, s^2) of a POS error that is constant
    throughout, and N(0, D^2) of a datum.
    """
    weights = sigma**-2
    shift = np.sum(weights * misclosure, axis=0) / np.sum(weights, axis=0)
    scatter = float(np.std(misclosure - shift, axis=0).max())
    size = float(np.linalg.norm(shift))
    limit = _common_sigma(sigma.max(axis=1))
    ratio = SETTINGS.datum_shift / limit
    gain = 0.5 * (size / limit) ** 2 * (1 - ratio**-2) - len(shift) * np.log(ratio)
    # Scatter as large as the shift indicates a POS that drifts by more than it states
    if gain > np.log(ESTIMATE.strong_evidence) and 3 * scatter < size:
        known = scatter / np.sqrt(len(misclosure))
        yield term, shift, np.full(len(shift), known), float(gain)


def _common_sigma(sigma):
    """Sigma of a mean of POS errors that may be fully correlated, with a good mounting. Units:
    m.
    """
    mean = np.sum(1.0 / sigma) / np.sum(sigma**-2)
    return float(np.hypot(mean, POS.unstated_sigmas[0]))


def _extent(place):
    """RMS distance of positions (n, 3) from their middle, in plan. Units: m."""
    local = place[:, :2] - place[:, :2].mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(local**2, axis=1))))
