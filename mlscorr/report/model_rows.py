"""The model of a correction as a table: value, unit and meaning of each parameter."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

MEANINGS = {  # key of the model in report.json -> name, unit, meaning
    "method": ("Method", "", "lsc: least squares collocation (Mao et al. 2015)"),
    "order": (
        "Order of the trend",
        "",
        "degree of the polynomial in time on each axis; none: the drift alone",
    ),
    "estimated_by": ("Parameters estimated by", "", "criterion and data that chose them"),
    "log_likelihood": (
        "Log-likelihood",
        "",
        "of the observations under this model; only differences between models count",
    ),
    "sigma0": ("sigma0", "1", "square root of the variance of unit weight; 1: stated sigmas hold"),
    "covariance.family": (
        "Covariance function",
        "",
        "process of the position's drift: exponential, Matérn 3/2 or 5/2, or integrated walk",
    ),
    "covariance.correlation_time": (
        "Correlation time of the drift",
        "s",
        "time after which the position error has forgotten most of its value",
    ),
    "covariance.scale": (
        "Scale of the drift",
        "1",
        "factor on the stated sigma of the position; 1: the POS states it correctly",
    ),
    "covariance.jitter_correlation_time": (
        "Correlation time of the fast part",
        "s",
        "of position errors that change faster than the drift",
    ),
    "covariance.jitter_scale": (
        "Scale of the fast part",
        "1",
        "factor on the stated sigma of the position for this part",
    ),
    "covariance.bias_correlation_time": (
        "Correlation time of the slow part",
        "s",
        "of position errors that last longer than the drift",
    ),
    "covariance.bias_scale": (
        "Scale of the slow part",
        "1",
        "factor on the stated sigma of the position for this part",
    ),
    "covariance.level_scale": (
        "Scale of the level",
        "1",
        "factor on the stated sigma for an offset that stays within a segment",
    ),
    "covariance.attitude_scale": (
        "Scale of the attitude",
        "1",
        "factor on the stated sigmas of roll, pitch and heading",
    ),
    "global_test.statistic": (
        "Global test: statistic",
        "1",
        "weighted sum of squared residuals of the adjustment",
    ),
    "global_test.redundancy": (
        "Global test: redundancy",
        "1",
        "observations that are not needed to determine the correction",
    ),
    "global_test.limits": ("Global test: limits", "1", "the statistic must lie between them"),
    "global_test.passed": ("Global test: passed", "", "whether model and sigmas fit the residuals"),
    "determined": ("Determined by control", "", "components of the pose that control determines"),
    "variance_ratio": (
        "Variance ratio",
        "1",
        "posterior over prior variance: near 0 control determines the component, near 1 the POS",
    ),
    "longest_gap": ("Longest interval without control", "s", "its start and end, gps_time"),
    "passes_without_control": (
        "Passes without control",
        "s",
        "start and end of each, gps_time",
    ),
    "warnings": ("Warnings", "", "of the estimate"),
}


class ModelRow(NamedTuple):
    """Parameter of the model.

    Parameters
    ----------
    name : str
    value : object
    unit, meaning : str
        Empty without one.
    """

    name: str
    value: Any
    unit: str
    meaning: str


def model_rows(model: Mapping[str, Any]) -> list[ModelRow]:
    """Make rows of the parameters of a model, including those in sections.

    Parameters
    ----------
    model : mapping
        Model of report.json, without its tables.

    >>> model_rows({"covariance": {"correlation_time": 28.4}})[0][:3]
    ('Correlation time of the drift', 28.4, 's')
    """
    return [_row(key, value) for key, value in _entries(model.items())]


def _entries(pairs: Iterable[tuple[str, Any]]) -> Iterator[tuple[str, Any]]:
    """Yield keys and values, including those in sections with their own meanings."""
    for key, value in pairs:
        inside = isinstance(value, Mapping) and key not in MEANINGS
        if inside and value:
            yield from ((f"{key}.{below}", item) for below, item in value.items())
        else:
            yield key, value


def _row(key, value):
    """Row of a key; without a meaning of its own, the name is the key."""
    if key in MEANINGS:
        name, unit, meaning = MEANINGS[key]
        return ModelRow(name, value, unit, meaning)
    words = key.replace(".", ": ").replace("_", " ")
    return ModelRow(words[:1].upper() + words[1:], value, "", "")
