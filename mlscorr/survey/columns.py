"""Records whose fields are columns, one row for each of n things."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.survey.data_frame import columns_frame

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class Columns:
    """What dataclasses of arrays (n, ...), tuples of n and Columns have in common.

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
        return cls(*(sum(c, ()) if isinstance(c[0], tuple) else np.concatenate(c) for c in columns))


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
    columns = ((field.name, getattr(record, field.name)) for field in fields(record))
    rows = {
        name: 1 if getattr(column, "single", False) else len(column)
        for name, column in columns
        if isinstance(column, np.ndarray | tuple | list | Columns | Rotation)
    }
    if len(set(rows.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in rows.items())
        raise ValueError(
            f"The columns of {type(record).__name__} have unlike numbers of rows ({counts}): "
            "a row of each belongs to the same thing. Give all of them the same length."
        )


def _selected(column, rows):
    if isinstance(column, tuple):
        return tuple(np.array(column, object)[rows])
    if isinstance(column, np.ndarray | Columns):
        return column[rows]
    return column


def _named_columns(record):
    """Name -> column, those of records among the fields with the field's name before."""
    columns = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, Columns):
            nested = _named_columns(value)
        else:
            nested = {"": value}
        columns |= {f"{field.name}_{name}".rstrip("_"): part for name, part in nested.items()}
    return columns
