"""Records whose fields are columns with one row for each of n items; also as pandas data frames.

pandas is loaded only for a data frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    import pandas

AXES = ("easting", "northing", "height")


@dataclass(frozen=True, eq=False)
class Columns:
    """Base of dataclasses with columns: arrays (n, ...), tuples of n, mappings of these, Columns.

    Scalar fields apply to all rows. Raises ValueError if columns differ in length.
    """

    def __post_init__(self):
        check_lengths(self)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} rows)"

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def __getitem__(self, rows) -> Self:
        """Select rows by bool (n,), indices (k,), or a slice, which gives views."""
        return type(self)(*(_selected(getattr(self, field.name), rows) for field in fields(self)))

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with one row each, vectors in three columns; requires pandas."""
        return columns_frame(_named_columns(self))

    @classmethod
    def concatenate(cls, parts: Iterable[Self]) -> Self:
        """Concatenate the rows of several records in order."""
        names = [field.name for field in fields(cls)]
        columns = zip(*([getattr(part, name) for name in names] for part in parts), strict=True)
        return cls(*map(_joined, columns))


def check_lengths(record: Any) -> None:
    """Refuse a record whose columns have different numbers of rows.

    Parameters
    ----------
    record : dataclass
        Fields that are not columns are ignored.

    Raises
    ------
    ValueError
    """
    columns = [(field.name, getattr(record, field.name)) for field in fields(record)]
    for _, mapping in [pair for pair in columns if isinstance(pair[1], Mapping)]:
        columns += mapping.items()
    rows = {
        name: 1 if getattr(column, "single", False) else len(column)
        for name, column in columns
        if isinstance(column, np.ndarray | tuple | list | Columns | Rotation)
    }
    if len(set(rows.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in rows.items())
        raise ValueError(
            f"The columns of {type(record).__name__} have different numbers of rows ({counts}). "
            "Give all columns the same length."
        )


def _joined(columns):
    if isinstance(columns[0], tuple):
        return sum(columns, ())
    if isinstance(columns[0], Columns):
        return type(columns[0]).concatenate(columns)
    if isinstance(columns[0], Mapping):  # the keys that all of them have
        shared = [name for name in columns[0] if all(name in others for others in columns)]
        return {name: np.concatenate([column[name] for column in columns]) for name in shared}
    return np.concatenate(columns)


def _selected(column, rows):
    if isinstance(column, tuple):
        return tuple(np.array(column, object)[rows])
    if isinstance(column, np.ndarray | Columns):
        return column[rows]
    if isinstance(column, Mapping):
        return {name: values[rows] for name, values in column.items()}
    return column


def _named_columns(record):
    """Return columns by name; those of nested records get the field's name as prefix."""
    columns = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, Mapping):
            columns |= value
            continue
        if isinstance(value, Columns):
            nested = _named_columns(value)
        else:
            nested = {"": value}
        columns |= {f"{field.name}_{name}".rstrip("_"): part for name, part in nested.items()}
    return columns


def rows_frame(rows: Iterable[Mapping[str, Any]]) -> pandas.DataFrame:
    """Make a data frame from a document's rows, with a column for each component of a vector.

    Parameters
    ----------
    rows : iterable of mapping
        Vectors of length three are E, N, H.

    Raises
    ------
    ModuleNotFoundError
        If pandas is missing; the message has the command that installs it.
    """
    frame = _pandas().DataFrame([dict(_cells(row)) for row in rows])
    # an unknown vector is None in its row, and NaN in the columns of the other rows
    return frame.drop(columns=[name for name in frame if f"{name}_{AXES[0]}" in frame])


def columns_frame(columns: Mapping[str, Sequence | np.ndarray]) -> pandas.DataFrame:
    """Make a data frame from columns, with one for each component of a vector or matrix.

    Parameters
    ----------
    columns : mapping
        Arrays (n, ...) or sequences of n.

    Raises
    ------
    ModuleNotFoundError
        See rows_frame.
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
    """Yield names and values of the columns of a row."""
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
    """Yield names and values (n,) of the columns of an array (n, ...)."""
    if np.ndim(column) < 2:
        yield name, column
        return
    ends = range(1, np.shape(column)[1] + 1)
    if len(ends) == len(AXES):
        ends = AXES
    for i, end in enumerate(ends):
        yield from _parts(f"{name}_{end}", column[:, i])
