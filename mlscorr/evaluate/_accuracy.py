"""Positional accuracy of a corrected cloud in terms of the ASPRS standard.

Source: ASPRS Positional Accuracy Standards for Digital Geospatial Data, Edition 2 (2023), which
includes the error of the surveyed check points in that of the product, and requires at least 30
check points, twice as accurate as the product.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from mlscorr.evaluate._settings import SETTINGS
from mlscorr.evaluate.wording import ACCURACY
from mlscorr.survey import Statement

STANDARD = "ASPRS Positional Accuracy Standards for Digital Geospatial Data, Edition 2 (2023)"
AXES = ("horizontal", "vertical")


def positional_accuracy(
    residuals: np.ndarray, survey_sigma: np.ndarray, points: int, based_on: str | None = "check"
) -> dict[str, Any]:
    """Accuracy of a product from residuals at surveyed points, as in report.json.

    RMSE_H and RMSE_V of the product combine the fit to the points and the accuracy of the points:
    RMSE_H^2 = RMSE_H,fit^2 + RMSE_H,survey^2, where RMSE_H,fit^2 = RMSE_E^2 + RMSE_N^2; so for V.

    Parameters
    ----------
    residuals : (n, 3) array
        Surveyed - observed in E, N, H after the correction. Units: m.
    survey_sigma : (n, 3) array
        One sigma of the surveyed points. Units: m.
    points : int
        Number of different points.
    based_on : str
        ``check``: independent points; ``leave_one_out``: leave-one-out residuals of control points,
        which the standard does not accept as a test.

    >>> residuals, sigma = np.full((30, 3), 0.03), np.full((30, 3), 0.004)
    >>> accuracy = positional_accuracy(residuals, sigma, 30)
    >>> accuracy["rmse_horizontal"], accuracy["class_horizontal_cm"], accuracy["conformant"]
    (0.0428..., 5, True)
    """
    if len(residuals) == 0:
        based_on = None
    fit, survey = (
        {"rmse_horizontal": _rms(v, 2), "rmse_vertical": _rms(v[:, 2:], 1)}
        for v in (
            np.asarray(residuals, float).reshape(-1, 3),
            np.asarray(survey_sigma, float).reshape(-1, 3),
        )
    )
    both = {key: _joined(fit[key], survey[key]) for key in fit}
    accuracy = {
        "standard": STANDARD,
        "based_on": based_on,
        "points": points,
        "observations": len(residuals),
        "fit": fit,
        "survey": survey,
        **both,
        "rmse_3d": _joined(*both.values()),
        "class_horizontal_cm": _class(both["rmse_horizontal"]),
        "class_vertical_cm": _class(both["rmse_vertical"]),
        "conformant": based_on == "check" and points >= SETTINGS.check_points,
    }
    sentences = [statement.sentence(ACCURACY) for statement in accuracy_statements(accuracy)]
    return {**accuracy, "statement": sentences}


def _rms(values, axes):
    """Root mean square length of the first axes of vectors, None without any."""
    if len(values):
        return float(np.sqrt((values[:, :axes] ** 2).sum(axis=1).mean()))
    return None


def _joined(fit, survey):
    if fit is None or survey is None:
        return None
    return math.hypot(fit, survey)


def _class(rmse):
    """Smallest class of whole centimeters that an RMSE in m meets."""
    if rmse is None:
        return None
    return max(1, math.ceil(round(100 * rmse, 6)))


def accuracy_statements(accuracy: dict[str, Any]) -> Iterator[Statement]:
    """Yield statements on an accuracy: missing requirements of a test, then the classes.

    Parameters
    ----------
    accuracy : dict
        Result of positional_accuracy.
    """
    points = accuracy["points"]
    if accuracy["based_on"] is None:
        yield Statement("not determined")
        return
    if accuracy["based_on"] != "check":
        yield Statement("left out", values={"points": points})
    elif points < SETTINGS.check_points:
        yield Statement("too few", values={"points": points, "least": SETTINGS.check_points})
    else:
        yield Statement("tested", values={"points": points})
    for axis in AXES:
        values = {
            "axis": axis,
            "size": accuracy[f"class_{axis}_cm"],
            "is_conformant": accuracy["conformant"],
            "rmse": accuracy[f"rmse_{axis}"],
            "fit": accuracy["fit"][f"rmse_{axis}"],
            "survey": accuracy["survey"][f"rmse_{axis}"],
        }
        yield Statement("class", values=values)
    for axis in AXES:
        survey, product = (accuracy[part][f"rmse_{axis}"] for part in ("survey", "fit"))
        if SETTINGS.accuracy_ratio * survey > product:
            values = {"axis": axis, "survey": survey}
            yield Statement("inaccurate points", "warning", values)
