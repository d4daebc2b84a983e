"""How a table is laid out: letters, separator, decimal sign, header, and what its columns mean."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mlscorr.io.store import ENCODING, ENCODINGS, shown
from mlscorr.io.tables.column_names import plain

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}  # the surest first
NUMBER = re.compile(r"[+-]?\d+([.,]\d*)?(e[+-]?\d+)?", re.IGNORECASE)
COMMENT_MARKS = ("#", "%", "!", "//")


@dataclass(frozen=True)
class TableLayout:
    """Where the rows of a table start, how they are parted, and what their columns are.

    Parameters
    ----------
    path : Path
    header : tuple of str
        As it stands there; empty where columns have no names.
    lines : int
        Number of lines down to the first row.
    columns : dict
        Our name of a column to its position.
    separator, decimal, encoding : str
    factors : dict
        Our name to what its unit is in m, deg or s, where a unit is given.
    sheet : str, optional
        Of a workbook.
    is_own : bool
        Whether header and separator are our own, so that there was nothing to understand.
    """

    path: Path
    header: tuple[str, ...]
    lines: int
    columns: dict[str, int]
    separator: str = ","
    decimal: str = "."
    encoding: str = ENCODING
    factors: dict[str, float] = field(default_factory=dict)
    sheet: str | None = None
    is_own: bool = False

    def __str__(self) -> str:
        """What was understood, without a full stop."""
        places = sorted(self.columns.items(), key=lambda item: item[1])
        names = {name: self.name_of(name) for name, _ in places}
        parts = [
            f"{name} = {other}" for name, other in names.items() if plain(other) != plain(name)
        ]
        identical = [name for name, other in names.items() if plain(other) == plain(name)]
        parts += [f"{', '.join(identical)} by name"] * bool(identical)
        if self.sheet:
            parted = f"sheet {shown(self.sheet)}"
        else:
            parted = SEPARATORS[self.separator]
        if self.encoding == ENCODING:
            letters = ""
        else:
            letters = f", letters of {ENCODINGS[self.encoding]}"
        sign = "comma" if self.decimal == "," else "point"
        form = f"{parted}, decimal {sign}{letters}"
        return f"{self.path.name} was read as {', '.join(parts)} ({form})"

    @property
    def unused(self) -> list[int]:
        """Positions of the columns that have a name and aren't used."""
        used = self.columns.values()
        return [i for i, name in enumerate(self.header) if name and i not in used]

    @property
    def not_used(self) -> str:
        """Words on the columns that aren't used; nothing without such."""
        names = ", ".join(shown(self.header[i]) for i in self.unused)
        if names:
            return f"; not used: {names}"
        return ""

    def name_of(self, column: str) -> str:
        """What a column is called in the table, or its number from 1.

        Parameters
        ----------
        column : str
            Our name.
        """
        place = self.columns[column]
        if self.header:
            return shown(self.header[place])
        return f"column {place + 1}"

    def number(self, cell: str) -> float:
        """The number in a cell.

        Parameters
        ----------
        cell : str

        Raises
        ------
        ValueError
            For anything else: points in numbers with decimal commas too, and 1_000.
        """
        if any(mark in cell for mark in ("_" if self.decimal == "." else "_.")):
            raise ValueError(cell)
        return float(cell.replace(self.decimal, "."))


def split(line: str, separator: str) -> list[str]:
    """Cells of a line, stripped; blanks in a row part as one does.

    Parameters
    ----------
    line : str
    separator : str

    Examples
    --------
    >>> split('P1   532012,49 "at the gate"', " "), split("P1; 1,5 ;", ";")
    (['P1', '532012,49', 'at the gate'], ['P1', '1,5', ''])
    """
    text = " ".join(line.split()) if separator == " " else line
    try:
        cells = next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:
        return [text]
    return [cell.strip() for cell in cells]


def is_comment(cells: Sequence[str]) -> bool:
    """Whether a row holds nothing, or starts as a comment does.

    Parameters
    ----------
    cells : sequence of str
    """
    return not any(cells) or cells[0].startswith(COMMENT_MARKS)


def not_text(path: Path) -> str:
    """The sentence on a file that is no text.

    Parameters
    ----------
    path : Path
    """
    return (
        f"{path} is not a text file in UTF-8. Save it anew as comma-separated values in UTF-8; "
        "letters such as umlauts are the likely cause, or a workbook that is not .xlsx."
    )
