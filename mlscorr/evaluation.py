"""Misclosures before and after a correction, of control and of check points."""

import numpy as np

from mlscorr.accuracy import positional_accuracy
from mlscorr.correction import COMPONENTS
from mlscorr.survey import PointCloud
from mlscorr.targets.candidates import search_radius

CHECK_REASON = "check point"  # why it took no part in the estimate


def accuracy(check_observations, check, control_observations, control, correction, left_out):
    """Accuracy by the check points; without any, by the control points left out in turn.

    left_out (n, 3) are the misclosures of the control points once the others alone have corrected
    them, NaN where that isn't known. Units: m.
    """
    if len(check_observations):
        residuals, kind = misclosures(check_observations, check, correction), "check"
        observations, points = check_observations, check
    else:
        known = np.isfinite(left_out).all(axis=1)
        residuals, kind = left_out[known], "leave_one_out"
        observations, points = control_observations[known], control
    sigma = points.sigma[_rows(observations, points)]
    return positional_accuracy(residuals, sigma, len(set(observations.name)), kind)


def misclosures(observations, control, correction=None):
    """Surveyed - observed (n, 3) of matched observations, after a correction if one is given.

    A correction is anything with ``apply(cloud) -> cloud``. Units: m.
    """
    surveyed = control.position[_rows(observations, control)]
    observed = observations.position
    if correction is not None:
        centres = PointCloud(observed, observations.gps_time, np.zeros(len(observations)))
        observed = correction.apply(centres).xyz
    return surveyed - observed


def _rows(observations, control):
    return np.array([control.name.index(name) for name in observations.name], dtype=int)


def statistics(residuals):
    """Statistics per axis of (n, 3) residuals in m, as lists of three, and of their lengths.

    rmse, mean, std (of the sample), min and max are E, N, H; those that end in _horizontal and
    _3d are of the distances in plan and in space. None stands for what so few residuals do not
    have.

    >>> found = statistics(np.array([[0.3, 0.0, -0.1], [-0.4, 0.0, 0.1]]))
    >>> found["rmse"], found["max_horizontal"]
    ([0.3535..., 0.0, 0.1], 0.4)
    """
    found = _of(residuals)
    for name, axes in (("horizontal", 2), ("3d", 3)):
        lengths = np.linalg.norm(residuals[:, :axes], axis=1)
        found |= {f"{what}_{name}": value for what, value in _of(lengths).items()}
    return found


def _of(values):
    """Statistics over the first axis of values, None for what so few do not have."""
    if len(values) == 0:
        return dict.fromkeys(("rmse", "mean", "std", "min", "max"))
    return {
        "rmse": np.sqrt(np.mean(values**2, axis=0)).tolist(),
        "mean": values.mean(axis=0).tolist(),
        "std": values.std(axis=0, ddof=1).tolist() if len(values) > 1 else None,
        "min": values.min(axis=0).tolist(),
        "max": values.max(axis=0).tolist(),
    }


def before_and_after(observations, control, correction):
    """Number of observations, and their statistics before and after a correction."""
    return {
        "n": len(observations),
        "before": statistics(misclosures(observations, control)),
        "after": statistics(misclosures(observations, control, correction)),
    }


def target_rows(observations, control, correction, role, reasons, left_out=None):
    """One row for each observation of these surveyed points, as report.json has them.

    reasons (n,) say why an observation took no part in the estimate; None where it did. sigma is
    that of the misclosure: survey and extraction together (Eq. 19). left_out (n, 3) is what
    remains once the other points alone have corrected it; NaN and None where that isn't known.
    """
    surveyed = _rows(observations, control)
    before = misclosures(observations, control)
    after = misclosures(observations, control, correction)
    extraction = np.einsum("nii->ni", observations.covariance)
    sigma = np.sqrt(control.sigma[surveyed] ** 2 + extraction)
    left_out = np.full_like(before, np.nan) if left_out is None else left_out
    return [
        {
            "name": name,
            "pass": int(observations.pass_number[i]),
            "gps_time": float(observations.gps_time[i]),
            "role": role,
            "surveyed": control.position[surveyed[i]].tolist(),
            "observed": observations.position[i].tolist(),
            "sigma": sigma[i].tolist(),
            "before": before[i].tolist(),
            "after": after[i].tolist(),
            "left_out": left_out[i].tolist() if np.isfinite(left_out[i]).all() else None,
            "used": reasons[i] is None,
            "reason": reasons[i],
        }
        for i, name in enumerate(observations.name)
    ]


def unseen_rows(survey, refusals, candidates):
    """One row for each surveyed point without an observation, with the reason.

    Parameters
    ----------
    survey : Survey
    refusals : sequence of Refusal
        What the matching gave as reasons.
    candidates : Candidates
        Their points without a pose are a better reason.
    """
    rows = []
    for refusal in refusals:
        role = "control" if refusal.name in survey.control.name else "check"
        points = survey.control if role == "control" else survey.check
        reason = _no_pose(points, refusal.name, survey.trajectory, candidates) or refusal.reason
        rows.append(_unseen_row(refusal.name, refusal.pass_number, points, role, reason))
    return rows


def _no_pose(points, name, trajectory, candidates):
    """Why a target was not seen, when points near it have no pose; else None."""
    row = points.name.index(name)
    near = candidates.unplaced.xyz - points.position[row]
    times = candidates.unplaced.gps_time[
        np.linalg.norm(near, axis=1) <= search_radius(trajectory, points)[row]
    ]
    if len(times) == 0:
        return None
    return (
        f"{len(times)} points near it, at {times.min():.1f} to {times.max():.1f} s, were measured "
        "in a gap of the trajectory or outside it, and nothing is interpolated there."
    )


def _unseen_row(name, pass_number, control, role, reason):
    return {
        "name": name,
        "pass": pass_number,
        "gps_time": None,
        "role": role,
        "surveyed": control.position[control.name.index(name)].tolist(),
        "observed": None,
        "sigma": None,
        "before": None,
        "after": None,
        "left_out": None,
        "used": False,
        "reason": reason,
    }


def model_section(estimate):
    """The model section of report.json.

    ``alternatives`` are the covariance families that the correction averages over; ``orders`` sets
    other orders of the trend beside the one in use; ``tests`` has one row per used target, with w,
    redundancy and detectable error for each pass; ``determined`` says which components of the pose
    the control points tell, by the ratio of posterior to prior variance.
    """
    section = {
        "method": "lsc",
        "order": estimate.order,
        "covariance": _covariance(estimate.parameters),
        "estimated_by": "restricted maximum likelihood of the control points",
        "log_likelihood": estimate.log_likelihood,
        "sigma0": estimate.sigma0,
        "outliers": [
            {"name": o.name, "statistic": o.statistic, "critical": o.critical}
            for o in estimate.outliers
        ],
        "alternatives": [
            {**_covariance(parameters), "probability": probability}
            for parameters, probability in estimate.families
        ],
        "warnings": list(estimate.warnings),
    }
    return {
        **section,
        "global_test": _global_test(estimate.guards.global_test),
        "orders": [_order(alternative) for alternative in estimate.alternatives],
        "tests": [_test(test) for test in estimate.tests],
        "determined": _by_component(estimate.guards.determined),
        "variance_ratio": _by_component(estimate.guards.variance_ratio),
        "longest_gap": list(estimate.guards.gap),
        "passes_without_control": [list(one) for one in estimate.guards.passes_without_control],
    }


def _covariance(parameters):
    return {
        "family": parameters.family,
        "correlation_time": parameters.drift_time,
        "scale": parameters.drift_scale,
        "jitter_correlation_time": parameters.jitter_time,
        "jitter_scale": parameters.jitter_scale,
        "bias_correlation_time": parameters.bias_time,
        "bias_scale": parameters.bias_scale,
        "attitude_scale": parameters.attitude_scale,
    }


def _global_test(test):
    if test is None:
        return None
    return {
        "statistic": test.statistic,
        "redundancy": test.redundancy,
        "limits": [test.lower, test.upper],
        "passed": test.passed,
    }


def _order(alternative):
    return {
        "order": alternative.order,
        "family": alternative.parameters.family,
        "log_likelihood": alternative.log_likelihood,
        "probability": alternative.probability,
        "leave_one_out_rmse": _numbers(alternative.leave_one_out),
    }


def _test(test):
    statistic = float(test.statistic)
    return {
        "name": test.name,
        "statistic": statistic if np.isfinite(statistic) else None,
        "critical": test.critical,
        "w": [_numbers(row) for row in test.w],
        "redundancy": [_numbers(row) for row in test.redundancy],
        "detectable": [_numbers(row) for row in test.detectable],
    }


def _by_component(values):
    return dict(zip(COMPONENTS, values.tolist(), strict=True))


def _numbers(values):
    """A list of floats, or None where they are not numbers, which JSON can't hold."""
    return values.tolist() if np.isfinite(values).all() else None
