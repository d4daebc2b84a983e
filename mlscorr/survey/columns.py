"""Records whose fields are columns, one row for each of n things; as data frames of pandas, too.

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
    """What dataclasses of arrays (n, ...), tuples of n, mappings of these and Columns share.

    Numbers among their fields hold for all rows. Raises ValueError for columns of unlike lengths.
    """

    def __post_init__(self):
        check_lengths(self)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} rows)"

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def __getitem__(self, rows) -> Self:
        """Some rows: bool (n,), numbers (k,), or a slice, which gives views."""
        return type(self)(*(_selected(getattr(self, field.name), rows) for field in fields(self)))

    def to_frame(self) -> pandas.DataFrame:
        """A data frame with a row each, vectors in three columns; pandas is needed for it."""
        return columns_frame(_named_columns(self))

    @classmethod
    def concatenate(cls, parts: Iterable[Self]) -> Self:
        """All rows of some records, in their order."""
        names = [field.name for field in fields(cls)]
        columns = zip(*([getattr(part, name) for name in names] for part in parts), strict=True)
        return cls(*map(_joined, columns))


def check_lengths(record: Any) -> None:
    """Refuse a record whose columns have unlike numbers of rows: one would borrow from another.

    Parameters
    ----------
    record : dataclass
        Fields that are no columns take no part.

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
    if isinstance(columns[0], Mapping):  # what all of them have
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
    """Name -> column, those of records among the fields with the field's name before."""
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
    ends = range(1, np.shape(column)[1] + 1)
    if len(ends) == len(AXES):
        ends = AXES
    for i, end in enumerate(ends):
        yield from _parts(f"{name}_{end}", column[:, i])
