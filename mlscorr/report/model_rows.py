"""The model of a correction as a table: value, unit and meaning of each parameter."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from mlscorr.report.wording import MEANINGS


class ModelRow(NamedTuple):
    """A parameter of the model.

    Parameters
    ----------
    name : str
    value : object
    unit, meaning : str
        Empty where there is none.
    """

    name: str
    value: Any
    unit: str
    meaning: str


def model_rows(model: Mapping[str, Any]) -> list[ModelRow]:
    """Rows of the parameters of a model, those in sections one by one.

    Parameters
    ----------
    model : mapping
        Of report.json, without its tables.

    >>> model_rows({"covariance": {"correlation_time": 28.4}})[0][:3]
    ('Correlation time of the drift', 28.4, 's')
    """
    return [_row(key, value) for key, value in _entries(model.items())]


def _entries(pairs: Iterable[tuple[str, Any]]) -> Iterator[tuple[str, Any]]:
    """Keys and values; those of a section that has meanings of its own follow one by one."""
    for key, value in pairs:
        inside = isinstance(value, Mapping) and key not in MEANINGS
        if inside and value:
            yield from ((f"{key}.{below}", item) for below, item in value.items())
        else:
            yield key, value


def _row(key, value):
    """Row of a key; one without a meaning of its own is named by the key."""
    if key in MEANINGS:
        name, unit, meaning = MEANINGS[key]
        return ModelRow(name, value, unit, meaning)
    words = key.replace(".", ": ").replace("_", " ")
    return ModelRow(words[:1].upper() + words[1:], value, "", "")
