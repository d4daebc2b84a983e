"""The model of a correction as a table: value, unit and meaning of each parameter."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from mlscorr.report.wording import MEANINGS


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
