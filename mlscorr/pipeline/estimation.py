"""From matched targets to the POS error and residuals: stages of ``correct``."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.estimate import (
    SETTINGS,
    Estimate,
    check_order,
    estimate_correction,
    find_mounting_error,
    mounting_warnings,
    prior_correction,
    scanner_warnings,
)
from mlscorr.evaluate import CheckSigmas, Score, misclosures
from mlscorr.evaluate import score as score_matched
from mlscorr.pipeline.finding import MatchedTargets, silent
from mlscorr.pipeline.ties import TiedSurvey
from mlscorr.survey import (
    Matched,
    Summary,
    Survey,
    TieFeatures,
    check_survey,
    columns_frame,
    rows_frame,
)
from mlscorr.ties import tie_passes

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

LOG = logging.getLogger(__name__)
LEFT_OUT = (
    'Tie features were not used, as requested: --no-ties, or use = "off" under [ties] in '
    "survey.toml."
)


class PosErrorEstimate(Estimate):
    """POS error over time, from control points and ties.

    ``correction`` moves points, ``left_out`` has the leave-one-out residuals of control, ``tests``
    and ``outliers`` show targets that the others contradict, ``parameters`` are those of the most
    probable covariance function, and ``warnings`` are sentences.
    """

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row per epoch: pose corrections with sigmas; requires pandas.

        Positions in m, angles in degrees.
        """
        correction = self.correction
        corrected = correction.corrected
        change = np.degrees(correction.attitude_change)
        return columns_frame(
            {
                "gps_time": corrected.gps_time,
                "shift": corrected.position - correction.recorded.position,
                "shift_sigma": corrected.position_sigma,
                **dict(zip(("roll", "pitch", "heading"), change.T, strict=True)),
                "angle_sigma": np.degrees(corrected.attitude_sigma),
            }
        )

    def plot(self) -> Figure:
        """Plot the position correction over time, with its sigma."""
        from mlscorr.report import pos_error_figure

        return pos_error_figure(self)

    def to_open3d(self, origin: np.ndarray | None = None, color: str = "correction") -> Any:
        """Convert the corrected trajectory to lines, broken at its gaps.

        Parameters
        ----------
        origin : (3,) array, optional
            See ``PointCloud.to_open3d``.
        color : str
            ``correction`` by its 3D length, or ``sigma`` by the 3D sigma after the estimate. The
            lines have an attribute of that name with the values, in m.

        Returns
        -------
        open3d.t.geometry.LineSet

        Raises
        ------
        ValueError
            If the color is unknown.
        """
        from mlscorr.report import correction_lines

        return correction_lines(self.correction, origin, color)

    def _overview(self):
        """Return size and sigma of the correction, and the observations used."""
        corrected = self.correction.corrected
        length = np.linalg.norm(corrected.position - self.correction.recorded.position, axis=1)
        sigma = np.linalg.norm(corrected.position_sigma, axis=1)
        rows = [
            ("control observations", f"{int(self.used.sum())} of {len(self.used)} used"),
            ("correction, 3D (m)", f"median {np.median(length):.3f}, largest {length.max():.3f}"),
            ("sigma, 3D (m)", f"median {np.median(sigma):.3f}, largest {sigma.max():.3f}"),
            ("order of the trend", self.order),
            ("sigma0", f"{self.sigma0:.2f}"),
        ]
        if self.ties is not None:
            rows.append(("ties", f"{int(self.ties.used.sum())} of {len(self.ties.used)} used"))
        rows += [("rejected", test.name) for test in self.outliers]
        return [*rows, *((sentence,) for sentence in self.warnings)]


def estimate_pos_error(
    survey: Survey,
    matches: MatchedTargets,
    ties: TiedSurvey | TieFeatures | None = None,
    order: int = SETTINGS.order,
    progress: Callable | None = None,
) -> PosErrorEstimate:
    """Estimate the POS error over time from matched control points, and from ties of passes.

    Least squares collocation: l = A x + B s + n, with a polynomial trend x and a signal s that is
    correlated over time  (Mao et al. 2015, Eq. 13-15).

    Parameters
    ----------
    survey : Survey
    matches : MatchedTargets
        Check points among them are not used.
    ties : TiedSurvey or TieFeatures, optional
        From ``find_ties``, or the ``features`` of ``find_targets(..., with_ties=True)``.
    order : int
        Order of the polynomial trend of the position error.
    progress : function, optional
        ``progress(title)`` is called at the start of a stage.

    Returns
    -------
    PosErrorEstimate

    Raises
    ------
    ValueError
        If there are neither control points nor ties, or the order is invalid.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = mlscorr.read_survey(folder)
    >>> matches = mlscorr.match_targets(mlscorr.find_targets(survey), survey)
    >>> estimate = mlscorr.estimate_pos_error(survey, matches)
    >>> float(np.abs(estimate.left_out).max()) < 0.1
    True
    """
    check_survey(survey)
    check_order(order)
    control = matches.control
    if len(control) == 0 and ties is None:
        raise ValueError(
            "No control point was matched and no ties are given, so the POS error can't be "
            "estimated. Match some control points, or give the result of mlscorr.find_ties."
        )
    features = ties.features if isinstance(ties, TiedSurvey) else ties
    scanned = matches.as_scanned(survey)
    estimate = estimate_together(scanned, control, features, order, progress)
    return PosErrorEstimate(**vars(estimate))


@threadpool_limits.wrap(limits=1, user_api="blas")  # more threads change the last digits
def estimate_together(
    survey: Survey,
    control: Matched,
    features: TieFeatures | None,
    order: int,
    progress: Callable | None = None,
) -> Estimate:
    """Estimate the POS error from matched control points and tie features.

    Parameters
    ----------
    survey : Survey
    control : Matched
        Without any, ties align the passes to the positions of the POS.
    features : TieFeatures or None
        None without ties.
    order : int
        Order of the trend.
    progress : function, optional
        See ``estimate_pos_error``.
    """
    stage = progress or silent
    stage("Estimating the POS error")
    if len(control):
        estimate = estimate_correction(
            survey.trajectory, control, survey.pos, order, survey.included
        )
    else:
        estimate = prior_correction(survey.trajectory, survey.pos)
    _log_estimate(estimate)
    if features is None:
        LOG.info("%s", LEFT_OUT)
        return replace(estimate, untied=LEFT_OUT)
    stage("Tying passes")
    estimate = tie_passes(survey, estimate, features)
    _log_ties(estimate)
    wrong = ()  # mountings that the ties contradict
    if estimate.adjustment.unknowns:
        wrong = tuple(scanner_warnings(estimate, list(survey.by_scanner)))
    if not wrong and None not in survey.mountings:  # all of them may have the same error
        error = find_mounting_error(estimate, control, survey.mountings)
        wrong = mounting_warnings(error, len(survey.mountings))
    return replace(estimate, notes=(*estimate.notes, *wrong))


def _log_estimate(estimate):
    """Log the parameters, the observations used, and contradicted control points."""
    LOG.info(
        "POS error estimated by %d of %d control observations, trend of order %d, sigma0 %.2f",
        int(estimate.used.sum()),
        len(estimate.used),
        estimate.order,
        estimate.sigma0,
    )
    for parameters, probability in estimate.families:
        numbers = (
            f"{name} {value:.4g}" if isinstance(value, float) else str(value)
            for name, value in vars(parameters).items()
        )
        LOG.info("covariance, probability %.3f: %s", probability, ", ".join(numbers))
    for test in estimate.outliers:
        LOG.info(
            "%s not used: contradicted by the others, statistic %.1f, critical value %.1f",
            test.name,
            test.statistic,
            test.critical,
        )
    for test in estimate.tests:
        LOG.debug("%s: statistic %.1f of %.1f", test.name, test.statistic, test.critical)


def _log_ties(estimate):
    """Log the number of ties, or the reason why there are none."""
    if estimate.ties is None:
        LOG.info("no ties: %s", estimate.untied)
        return
    is_used = estimate.ties.used
    LOG.info("%d of %d ties used", int(is_used.sum()), len(is_used))


def control_score(estimate: Estimate, control: Matched) -> Score:
    """Score the control points, without contradicted ones.

    Parameters
    ----------
    estimate : Estimate
        Estimate from these points.
    control : Matched
    """
    used = estimate.used
    sigma = np.vstack([np.empty((0, 3)), *(test.sigma for test in estimate.tests)])
    return score_matched(control[used], estimate.correction, estimate.left_out[used], sigma)


def check_score(estimate: Estimate, check: Matched) -> Score:
    """Score the check points, with the expected sigma.

    Parameters
    ----------
    estimate : Estimate
    check : Matched
    """
    return score_matched(check, estimate.correction, sigma=_check_sigma(estimate, check))


def check_sigmas(estimate: Estimate, check: Matched) -> CheckSigmas | None:
    """Test the stated sigmas with the check points; None without any.

    Parameters
    ----------
    estimate : Estimate
    check : Matched
    """
    if not len(check):
        return None
    residuals = misclosures(check, estimate.correction)
    return CheckSigmas.of(residuals, _check_sigma(estimate, check), len(set(check.name)))


def _check_sigma(estimate, check):
    """One sigma (n, 3) of check point residuals: target, survey and correction. Units: m."""
    there = estimate.correction.corrected.at(check.gps_time).position_sigma
    return np.sqrt(check.variance + there**2)


@dataclass(frozen=True, repr=False)
class Scores(Summary):
    """Scores at surveyed points: RMSE of misclosures before and after the correction.

    ``scores.check.after.rmse`` are the five numbers E, N, H, horizontal and 3D, in m.

    Parameters
    ----------
    control, check : Score
        ``before``, ``after``, and for control points ``left_out`` (leave-one-out).
    by_kind : mapping
        Score by (role, kind of target).
    """

    control: Score
    check: Score
    by_kind: Mapping[tuple[str, str], Score]

    def _rows(self):
        """Yield role, kind, state and Statistics of all known scores."""
        scores = {("control", "all"): self.control, ("check", "all"): self.check, **self.by_kind}
        for (role, kind), score_of in scores.items():
            states = {
                "before": score_of.before,
                "after": score_of.after,
                "leave-one-out": score_of.left_out,
            }
            for state, statistics in states.items():
                if statistics is not None and statistics.n:
                    yield role, kind, state, statistics

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row per role, kind of target and state; requires pandas. m."""
        return rows_frame(
            {"role": role, "kind": kind, "state": state, "n": statistics.n, **statistics.document()}
            for role, kind, state, statistics in self._rows()
        )

    def plot(self) -> Figure:
        """Plot RMSE before, after and leave-one-out, axis by axis."""
        from mlscorr.report import score_figure

        return score_figure({"Control points": self.control, "Check points": self.check})

    def _overview(self):
        """Return the RMSE of each role, and of kinds if there are several."""
        has_kinds = len({kind for _, kind in self.by_kind}) > 1
        rows = [("RMSE (m)", "kind", "state", "n", "east", "north", "height", "3D")]
        for role, kind, state, statistics in self._rows():
            if kind == "all" or has_kinds:
                rmse = (f"{value:.4f}" for value in statistics.rmse[[0, 1, 2, 4]])
                rows.append((role, kind, state, statistics.n, *rmse))
        return rows


def score(estimate: Estimate, matches: MatchedTargets) -> Scores:
    """Compare observed targets with their surveyed positions, before and after a correction.

    Parameters
    ----------
    estimate : Estimate
        From ``estimate_pos_error`` for these matches.
    matches : MatchedTargets

    Returns
    -------
    Scores
        Scores by role, kind of target and component.

    Raises
    ------
    ValueError
        If the estimate belongs to other control observations.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = mlscorr.read_survey(folder)
    >>> matches = mlscorr.match_targets(mlscorr.find_targets(survey), survey)
    >>> scores = mlscorr.score(mlscorr.estimate_pos_error(survey, matches), matches)
    >>> bool((scores.check.after.rmse < scores.check.before.rmse).all())
    True
    """
    control = matches.control
    check = matches.check
    if len(control) != len(estimate.used):
        raise ValueError(
            f"The estimate uses {len(estimate.used)} control observations, but the matches have "
            f"{len(control)}. Give the matches that were passed to mlscorr.estimate_pos_error."
        )
    by_kind = {}
    for kind in dict.fromkeys(control.surveyed.kind):
        rows = np.array(control.surveyed.kind) == kind
        of_kind = rows & estimate.used
        left_out = estimate.left_out[of_kind]
        by_kind["control", kind] = score_matched(control[of_kind], estimate.correction, left_out)
    for kind in dict.fromkeys(check.surveyed.kind):
        rows = np.array(check.surveyed.kind) == kind
        by_kind["check", kind] = check_score(estimate, check[rows])
    return Scores(control_score(estimate, control), check_score(estimate, check), by_kind)
