"""Positional accuracy of a corrected cloud in the terms of the ASPRS standard.

Source: ASPRS Positional Accuracy Standards for Digital Geospatial Data, Edition 2 (2023), which
counts the error of the surveyed check points into that of the product, calls for at least 30 of
them, and for points twice as accurate as the product.
"""

import math

import numpy as np

from mlscorr.evaluate._settings import SETTINGS

STANDARD = "ASPRS Positional Accuracy Standards for Digital Geospatial Data, Edition 2 (2023)"
AXES = ("horizontal", "vertical")


def positional_accuracy(
    residuals: np.ndarray, survey_sigma: np.ndarray, points: int, based_on: str | None = "check"
) -> dict[str, object]:
    """Accuracy of a product from what remains at surveyed points, as report.json has it.

    RMSE_H and RMSE_V of the product join those of its fit to the points and those of the points:
    RMSE_H^2 = RMSE_H,fit^2 + RMSE_H,survey^2, where RMSE_H,fit^2 = RMSE_E^2 + RMSE_N^2; so for V.

    Parameters
    ----------
    residuals : (n, 3) array
        Surveyed - observed in E, N, H after the correction. Units: m.
    survey_sigma : (n, 3) array
        One sigma of the surveyed points. Units: m.
    points : int
        How many different points these are.
    based_on : str
        ``check``: points that took no part in the correction; ``leave_one_out``: control points,
        each left out in turn, which the standard doesn't accept as a test.

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
    return {**accuracy, "statement": _statement(accuracy)}


def _rms(values, axes):
    """Root of the mean square length of the first axes of vectors, None without any."""
    if len(values):
        return float(np.sqrt((values[:, :axes] ** 2).sum(axis=1).mean()))
    return None


def _joined(fit, survey):
    if fit is None or survey is None:
        return None
    return math.hypot(fit, survey)


def _class(rmse):
    """The smallest class of whole centimetres that an RMSE in m meets."""
    if rmse is None:
        return None
    return max(1, math.ceil(round(100 * rmse, 6)))


def _statement(accuracy):
    """The accuracy in sentences, what is missing to a test by the standard before the classes."""
    if accuracy["based_on"] is None:
        return [
            "Not determined: no check point was scored, and too few control points to leave one "
            "out in turn."
        ]
    return [_test(accuracy), *(_classes(accuracy, axis) for axis in AXES), *_doubts(accuracy)]


def _test(accuracy):
    points = accuracy["points"]
    plural = "point was" if points == 1 else "points were"
    if accuracy["based_on"] != "check":
        return (
            f"No check point was scored. {points} control {plural} left out in turn and predicted "
            "from the others: an estimate of the accuracy, and not a conformant test, as these "
            "points took part in the correction."
        )
    if points < SETTINGS.check_points:
        return (
            f"The standard calls for at least {SETTINGS.check_points} check points and {points} "
            f"{plural} used: fewer than {SETTINGS.check_points} check points are not a conformant "
            "test."
        )
    return f"This data set was tested with {points} independent check points."


def _classes(accuracy, axis):
    rmse = accuracy[f"rmse_{axis}"]
    name = f"RMSE_{axis[0].upper()}"
    if accuracy["conformant"]:
        tested = "It meets"
    else:
        tested = "It would meet"
    return (
        f"{tested} the {accuracy[f'class_{axis}_cm']}-cm {axis} accuracy class: {name} is "
        f"{100 * rmse:.1f} cm ({100 * accuracy['fit'][f'rmse_{axis}']:.1f} cm fit to the points, "
        f"{100 * accuracy['survey'][f'rmse_{axis}']:.1f} cm survey of the points)."
    )


def _doubts(accuracy):
    """Where the surveyed points aren't accurate enough to test such a product."""
    for axis in AXES:
        survey, product = (accuracy[part][f"rmse_{axis}"] for part in ("survey", "fit"))
        if SETTINGS.accuracy_ratio * survey > product:
            yield (
                f"The {axis} survey error of the points, {100 * survey:.1f} cm, is more than half "
                "of what they found: points for a test should be twice as accurate as the product."
            )
