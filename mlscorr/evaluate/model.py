"""Sections of report.json and calibration.json on the estimate: its model, and its ties."""

import numpy as np

from mlscorr.estimate import COMPONENTS, Estimate, TieResiduals, tie_value
from mlscorr.pos import PosErrors
from mlscorr.survey import TIE_KINDS, Survey, Trajectory


def model_section(estimate: Estimate, warnings: tuple[str, ...] = ()) -> dict[str, object]:
    """Section on the model: estimated quantities, parameters, and their uncertainty.

    ``alternatives`` are the covariance families that the correction averages over; ``orders``
    compares other orders of the trend with the one in use; ``tests`` has one row per used target,
    with w, redundancy and detectable error for each pass; ``determined`` states which components of
    the pose the control points determine, by the ratio of posterior to prior variance.

    Parameters
    ----------
    estimate : Estimate
    warnings : tuple of str
        Warnings on its input, in addition to its own.
    """
    guards = estimate.guards
    return {
        "method": "lsc",
        "order": estimate.order,
        "covariance": _covariance(estimate.parameters),
        "estimated_by": f"restricted maximum likelihood of {_observations(estimate)}",
        "log_likelihood": estimate.log_likelihood,
        "sigma0": estimate.sigma0,
        "outliers": [outlier.document() for outlier in estimate.outliers],
        "alternatives": [
            {**_covariance(parameters), "probability": probability}
            for parameters, probability in estimate.families
        ],
        "warnings": [*warnings, *estimate.warnings],
        "global_test": _global_test(guards.global_test),
        "orders": [_order(alternative) for alternative in estimate.alternatives],
        "tests": [_test(test) for test in estimate.tests],
        "determined": _by_component(guards.determined),
        "variance_ratio": _by_component(guards.variance_ratio),
        "longest_gap": list(guards.longest_gap),
        "passes_without_control": [list(span) for span in guards.passes_without_control],
    }


def largest_sigma(trajectory: Trajectory, survey: Survey | None = None) -> dict[str, float]:
    """3D sigma of a trajectory's position in m: ``median``, ``largest``, and the latter's ``time``.

    It refers to epochs with points of the clouds.

    Parameters
    ----------
    trajectory : Trajectory
        The result is empty without sigmas.
    survey : Survey, optional
        Recorded survey; adds ``stated``, the median stated by its POS, if there is one.
    """
    scanned = trajectory.scanned_rows
    sigma = np.linalg.norm(trajectory.position_sigma[scanned], axis=1)
    time = float(trajectory.gps_time[scanned[sigma.argmax()]])
    result = {"median": float(np.median(sigma)), "largest": float(sigma.max()), "time": time}
    if survey is not None and not survey.has_assumed_position:
        stated = PosErrors.stated(survey.trajectory, survey.pos).epochs.position[scanned]
        result["stated"] = float(np.median(np.linalg.norm(stated, axis=1)))
    return result


def _observations(estimate):
    """Observations from which the parameters were chosen."""
    if estimate.ties is None or not estimate.ties.used.any():
        return "the control points"
    if len(estimate.adjustment.names):
        return "control points and ties"
    return "ties"


def _covariance(parameters):
    return {
        "family": parameters.family,
        "correlation_time": parameters.drift_time,
        "scale": parameters.drift_scale,
        "jitter_correlation_time": parameters.jitter_time,
        "jitter_scale": parameters.jitter_scale,
        "bias_correlation_time": parameters.bias_time,
        "bias_scale": parameters.bias_scale,
        "level_scale": parameters.level_scale,
        "attitude_scale": parameters.attitude_scale,
    }


def _global_test(test):
    if test is None:
        return None
    return {
        "statistic": test.statistic,
        "redundancy": test.redundancy,
        "limits": [0.0, test.upper],
        "passed": test.passed,
    }


def _order(alternative):
    return {
        "order": alternative.order,
        "family": alternative.parameters.family,
        "log_likelihood": alternative.log_likelihood,
        "probability": alternative.probability,
        "leave_one_out_rmse": alternative.leave_one_out.tolist(),
    }


def _test(test):
    return {
        **test.document(),
        "w": test.w.tolist(),
        "redundancy": test.redundancy.tolist(),
        "detectable": test.detectable.tolist(),
    }


def _by_component(values):
    return dict(zip(COMPONENTS, values.tolist(), strict=True))


def tie_section(estimate: Estimate) -> dict[str, object] | None:
    """Section on ties: their effect, or the reason why there are none; None without a search.

    ``pairs`` has the misclosures of each two passes before and after, for the used ties; ``share``
    the information from control and from ties; ``sufficient_control`` the number of control points
    that would give about the same accuracy.

    Parameters
    ----------
    estimate : Estimate
    """
    residuals = estimate.ties
    if residuals is None:
        if estimate.untied:
            return {"n": 0, "used": 0, "reason": estimate.untied}
        return None
    value = tie_value(estimate)
    return {
        **tie_residual_section(residuals),
        "share": value.share,
        "sufficient_control": value.sufficient,
    }


def tie_residual_section(residuals: TieResiduals | None) -> dict[str, object] | None:
    """Numbers and misclosures of ties before and after; None without ties.

    Parameters
    ----------
    residuals : TieResiduals or None
    """
    if residuals is None:
        return None
    ties = residuals.ties
    used = residuals.used
    return {
        "n": len(ties),
        "used": int(used.sum()),
        "kinds": {kind: int((ties.kind == kind).sum()) for kind in TIE_KINDS},
        "before": misclosure_statistics(ties.misclosure[used]),
        "after": misclosure_statistics(residuals.after[used]),
        "pairs": pair_rows(residuals),
    }


def pair_rows(residuals: TieResiduals) -> list[dict[str, object]]:
    """Numbers of ties of each two passes, and their misclosures before and after.

    Passes are numbered separately for each scanner; scanners are numbered from 1, as in
    survey.toml.

    Parameters
    ----------
    residuals : TieResiduals
    """
    ties = residuals.ties
    rows = []
    for passes in np.unique(ties.pass_number, axis=0):
        inside = (ties.pass_number == passes).all(axis=1)
        both = inside & residuals.used
        row = {
            "passes": passes.tolist(),
            "scanners": (ties.scanner[inside][0] + 1).tolist(),
            "n": int(inside.sum()),
            "used": int(both.sum()),
            "before": misclosure_statistics(ties.misclosure[both]),
            "after": misclosure_statistics(residuals.after[both]),
        }
        rows.append(row)
    return rows


def misclosure_statistics(misclosure: np.ndarray) -> dict[str, float | None]:
    """Median size and root mean square of misclosures. Units: m.

    Parameters
    ----------
    misclosure : (n,) array
        Units: m.
    """
    if len(misclosure) == 0:
        return {"median": None, "rms": None}
    rms = np.sqrt(np.mean(misclosure**2))
    return {"median": float(np.median(np.abs(misclosure))), "rms": float(rms)}
