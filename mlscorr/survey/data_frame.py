"""Rows and columns as data frames of pandas, which is loaded only then."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas

AXES = ("easting", "northing", "height")


def rows_frame(rows: Iterable[Mapping[str, Any]]) -> pandas.DataFrame:
    """A data frame of a document's rows, with a column for each number of a vector.

    Parameters
    ----------
    rows : iterable of mapping
        Vectors of three are E, N, H.

    Raises
    ------
    ModuleNotFoundError
        Without pandas; says the line that installs it.
    """
    frame = _pandas().DataFrame([dict(_cells(row)) for row in rows])
    # a vector that is not known is None in its row, and NaN in the columns that others have
    return frame.drop(columns=[name for name in frame if f"{name}_{AXES[0]}" in frame])


def columns_frame(columns: Mapping[str, Sequence | np.ndarray]) -> pandas.DataFrame:
    """A data frame of columns, with one for each number of a vector or matrix.

    Parameters
    ----------
    columns : mapping
        Arrays (n, ...) or sequences of n.

    Raises
    ------
    ModuleNotFoundError
        As rows_frame.
    """
    parts = [part for name, column in columns.items() for part in _parts(name, column)]
    return _pandas().DataFrame(dict(parts))


def _pandas():
    try:
        import pandas
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "A data frame needs pandas, which is not installed: pip install pandas"
        ) from error
    return pandas


def _cells(row: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Names and values of the columns of a row."""
    for key, value in row.items():
        is_vector = isinstance(value, list | tuple) and len(value) == len(AXES)
        if is_vector:
            parts = dict(zip(AXES, value, strict=True))
        else:
            parts = value
        if isinstance(parts, Mapping):
            yield from _cells(parts, f"{before}{key}_")
        else:
            yield f"{before}{key}", value


def _parts(name: str, column) -> Iterator[tuple[str, Any]]:
    """Names and values (n,) of the columns of an array (n, ...)."""
    if np.ndim(column) < 2:
        yield name, column
        return
    count = np.shape(column)[1]
    for i, end in enumerate(AXES if count == len(AXES) else range(1, count + 1)):
        yield from _parts(f"{name}_{end}", column[:, i])
