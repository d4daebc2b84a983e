"""Display of values in a notebook: a line or a short table instead of millions of numbers."""

from collections.abc import Iterable, Sequence
from dataclasses import Field, fields, is_dataclass
from html import escape
from typing import Any, ClassVar

import numpy as np

LONGEST = 60  # characters of a field: three of them fill a line of a notebook


class Summary:
    """Dataclasses (``repr=False``) whose repr shows the sizes of arrays, not their numbers.

    >>> import numpy as np
    >>> from mlscorr.frames import attitude_from_angles
    >>> from mlscorr.survey import Trajectory
    >>> seconds, still = np.arange(413200.0, 413210.0), np.zeros(10)
    >>> Trajectory(seconds, np.zeros((10, 3)), attitude_from_angles(still, still, still))
    Trajectory(gps_time=array (10,), position=array (10, 3), attitude=Rotation, \
position_sigma=None, attitude_sigma=None, session=None, scanned=None, weeks=None)
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __repr__(self) -> str:
        rows = self._overview()
        if rows is not None:
            return text_table(type(self).__name__, rows)
        parts = (f"{field.name}={_short(getattr(self, field.name))}" for field in fields(self))
        return f"{type(self).__name__}({', '.join(parts)})"

    def _repr_html_(self) -> str:
        rows = self._overview()
        if rows is None:
            rows = [(field.name, _short(getattr(self, field.name))) for field in fields(self)]
        return html_table(type(self).__name__, rows)

    def _overview(self) -> Iterable[Sequence[object]] | None:
        """Rows of a table for terminal and notebook; a row of one cell is a sentence.

        None if the fields are shown instead.

        """
        return None


def _short(value):
    """Describe a field's value in a few words."""
    if isinstance(value, np.ndarray):
        if value.size > 3:
            return f"array {value.shape}"
        return repr(value)
    if is_dataclass(value) and hasattr(value, "__len__"):
        return f"{type(value).__name__}({len(value)} rows)"
    if isinstance(value, tuple | list | dict) and len(repr(value)) > LONGEST:
        return f"{type(value).__name__} of {len(value)}"
    text = repr(value)
    if len(text) <= LONGEST:
        return text
    return type(value).__name__


def text_table(caption: str, rows: Iterable[Sequence[object]]) -> str:
    """Format a table as plain text, below its caption.

    Parameters
    ----------
    caption : str
    rows : iterable of sequences
        A row of one cell is a sentence and does not affect the widths of columns.

    >>> print(text_table("Survey", [("street",), ("points", 12), ("crs", "EPSG:32650")]))
    Survey
      street
      points  12
      crs     EPSG:32650
    """
    cells = [[str(cell) for cell in row] for row in rows]
    columns = max(map(len, cells), default=0)
    widths = [
        max((len(line[i]) for line in cells if 1 < len(line) > i), default=0)
        for i in range(columns)
    ]
    lines = [caption]
    for line in cells:
        if len(line) == 1:
            lines.append(line[0])
        else:
            padded = (cell.ljust(width) for cell, width in zip(line, widths, strict=False))
            lines.append("  ".join(padded).rstrip())
    return "\n  ".join(lines)


def html_table(caption: str, rows: Iterable[Sequence[object]]) -> str:
    """Format a table as HTML, escaping all text that comes from files.

    Parameters
    ----------
    caption : str
    rows : iterable of sequences
        A row of one cell spans all columns.

    >>> html_table("Survey", [("name", "A & B")])
    '<table><caption>Survey</caption><tr><td>name</td><td>A &amp; B</td></tr></table>'
    """
    lines = [[escape(str(cell)) for cell in row] for row in rows]
    columns = max(map(len, lines), default=1)
    cells = [
        f'<td colspan="{columns}">{line[0]}</td>'
        if len(line) < columns
        else f"<td>{'</td><td>'.join(line)}</td>"
        for line in lines
    ]
    body = "".join(f"<tr>{line}</tr>" for line in cells)
    return f"<table><caption>{escape(caption)}</caption>{body}</table>"
