"""Tables in text or a workbook: layout, rows, and their numbers.

A layout describes where the rows start, how they are separated, and what their columns mean. With
it, a foreign table is read like one of our own.
"""

import csv
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.io.store import ENCODING, ENCODINGS, is_remote, open_file, shown
from mlscorr.io.tables.column_names import plain

SUFFIX = ".xlsx"
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}  # the surest first
NUMBER = re.compile(r"[+-]?\d+([.,]\d*)?(e[+-]?\d+)?", re.IGNORECASE)
COMMENT_MARKS = ("#", "%", "!", "//")
_DATE = re.compile(r"\d+[-/:.]\d+[-/:.]\d+")  # of a date or a time of day


@dataclass(frozen=True)
class TableLayout:
    """Layout of a table: start and separator of its rows, and its columns.

    Parameters
    ----------
    path : Path
    header : tuple of str
        As in the file; empty if columns have no names.
    lines : int
        Number of lines before the first row.
    columns : dict
        Our name of a column to its position.
    separator, decimal, encoding : str
    factors : dict
        Our name to the value of its unit in m, deg or s, if a unit is given.
    sheet : str, optional
        Sheet of a workbook.
    is_own : bool
        True if header and separator are our own, so that no interpretation was needed.
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
        """Interpretation of the table, without a full stop."""
        parts = []
        identical = []
        for name in sorted(self.columns, key=self.columns.__getitem__):
            if plain(self.name_of(name)) == plain(name):
                identical.append(name)
            else:
                parts.append(f"{name} = {self.name_of(name)}")
        if identical:
            parts.append(f"{', '.join(identical)} by name")
        if self.sheet:
            form = [f"sheet {shown(self.sheet)}"]
        else:
            form = [SEPARATORS[self.separator]]
        form.append("decimal comma" if self.decimal == "," else "decimal point")
        if self.encoding != ENCODING:
            form.append(f"letters of {ENCODINGS[self.encoding]}")
        return f"{self.path.name} was read as {', '.join(parts)} ({', '.join(form)})"

    @property
    def unused(self) -> list[int]:
        """Positions of the named columns that are not used."""
        used = self.columns.values()
        return [i for i, name in enumerate(self.header) if name and i not in used]

    @property
    def not_used(self) -> str:
        """Phrase on the columns that are not used; empty without any."""
        names = ", ".join(shown(self.header[i]) for i in self.unused)
        if names:
            return f"; not used: {names}"
        return ""

    def name_of(self, column: str) -> str:
        """Name of a column in the table, or its number from 1.

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
        """Return the number in a cell.

        Parameters
        ----------
        cell : str

        Raises
        ------
        ValueError
            For anything else, including points in numbers with decimal commas, and 1_000.
        """
        if "_" in cell or (self.decimal == "," and "." in cell):
            raise ValueError(cell)
        return float(cell.replace(self.decimal, "."))


def split(line: str, separator: str) -> list[str]:
    """Split a line into stripped cells; consecutive blanks count as one.

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
    """True if a row is empty, or starts like a comment.

    Parameters
    ----------
    cells : sequence of str
    """
    return not any(cells) or cells[0].startswith(COMMENT_MARKS)


def not_text(path: Path) -> str:
    """Sentence on a file that is not text.

    Parameters
    ----------
    path : Path
    """
    return (
        f"{path} is not a text file in UTF-8; it may contain letters such as umlauts in another "
        "encoding, or be a workbook other than .xlsx. Save it as comma-separated values in "
        "UTF-8."
    )


def read_sheets(path: str | Path) -> list[tuple[str, list[tuple[int, list[str]]]]]:
    """Read name and non-empty rows of each sheet, each row with its number from 1.

    Parameters
    ----------
    path : path

    Returns
    -------
    list of (str, list of (int, list of str))
        Numbers with a decimal point and all their digits, dates as ISO 8601.

    Raises
    ------
    ValueError
        If the file is not a workbook.
    """
    import zipfile
    from xml.etree.ElementTree import ParseError

    try:
        from openpyxl import load_workbook
        from openpyxl.utils.exceptions import InvalidFileException
    except ImportError:
        raise ValueError(
            f"{path} is a workbook, and openpyxl, which reads it, is not installed: pip install "
            "'mlscorr[excel]', or save it as comma-separated values."
        ) from None

    with warnings.catch_warnings(action="ignore"):  # of styles and rules, which are not read
        try:
            book = load_workbook(path, read_only=True, data_only=True)
        except (zipfile.BadZipFile, InvalidFileException, ParseError, KeyError, ValueError):
            raise ValueError(
                f"{path} is not an Excel workbook, or it is damaged. Save it again as .xlsx or "
                "as comma-separated values."
            ) from None
        sheets = []
        try:
            for sheet in book.worksheets:
                rows = []
                for number, values in enumerate(sheet.iter_rows(values_only=True), start=1):
                    cells = [_text(value) for value in values]
                    if any(cells):
                        rows.append((number, cells))
                sheets.append((sheet.title, rows))
        finally:
            book.close()
    return sheets


def _text(value):
    if value is None:
        return ""
    if hasattr(value, "isoformat"):
        return value.isoformat(" ")
    return str(value).strip()


def read_rows(layout: TableLayout, exact: bool = False) -> Iterator[tuple[str, list[str]]]:
    """Yield rows of a table after its header, without blank ones and comments.

    Parameters
    ----------
    layout : TableLayout
    exact : bool
        True if each row must have as many columns as the header; otherwise fewer are allowed.

    Yields
    ------
    line : str
        Line number and file, for messages.
    cells : list of str

    Raises
    ------
    ValueError
        If a row is too short or too long, or the file is not text.
    """
    is_parted_by_blanks = layout.separator == " " and not layout.sheet
    is_strict = exact or not layout.is_own
    if not layout.is_own:
        exact = is_parted_by_blanks
    width = len(layout.header)
    least = max(layout.columns.values()) + 1
    for number, cells in _all_rows(layout):
        if not any(cells):
            continue
        if not layout.is_own:
            is_rule = not "".join(cells).strip("-=_")
            if is_rule or is_comment(cells):
                continue
            if is_parted_by_blanks and not width:
                width = len(cells)  # of the first row, without a header
            while width and len(cells) > width and not cells[-1]:
                del cells[-1]
        line = f"Line {number} of {layout.path}"
        if is_strict and layout.separator != " " and 0 < width < len(cells):
            raise ValueError(_too_wide(line, len(cells), width))
        if len(cells) < least or (exact and len(cells) != width):
            cause = (
                "the file may be truncated, a separator may be missing, or a name may contain one"
            )
            if "latitude" in layout.columns and len(cells) > width:
                cause = "angles may be in degrees, minutes and seconds: export decimal degrees"
            raise ValueError(
                f"{line} has {len(cells)} columns where {width or least} are expected: {cause} "
                f"(columns are separated by {SEPARATORS[layout.separator]})."
            )
        yield line, cells


def _all_rows(layout):
    """Yield the last line number of each row after the header, and its cells."""
    if layout.sheet is not None:
        rows = dict(read_sheets(layout.path))[layout.sheet]
        yield from ((number, cells) for number, cells in rows if number > layout.lines)
        return
    with open_file(layout.path, layout.encoding, newline="") as file:
        try:
            for _ in range(layout.lines):
                next(file)
            if layout.separator == " ":
                lines = (" ".join(line.split()) for line in file)
            else:
                lines = file
            reader = csv.reader(lines, delimiter=layout.separator, skipinitialspace=True)
            for row in reader:
                cells = (cell.strip() for cell in row)
                signed = ["-" + cell[1:] if cell[:1] == "−" else cell for cell in cells]  # U+2212
                yield layout.lines + reader.line_num, signed
        except UnicodeDecodeError:
            raise ValueError(not_text(layout.path)) from None
        except csv.Error as error:
            raise ValueError(
                f"{layout.path} has an unterminated cell in or after line "
                f"{layout.lines + reader.line_num} ({error}): a quotation mark may be missing."
            ) from None


def read_numbers(
    layout: TableLayout, converters: Mapping[int, Callable[[str], float]] | None = None
) -> np.ndarray:
    """Read the columns of a table of numbers, in m, deg and s if units are given.

    Parameters
    ----------
    layout : TableLayout
    converters : dict, optional
        Position of a column to the function that reads its cells; float by default.

    Returns
    -------
    (n, k) array

    Raises
    ------
    ValueError
        Names the first line that is not a row of numbers; also if there are no rows.
    """
    path = layout.path
    if layout.header and layout.separator == ",":
        _check_width(path, layout.lines, len(layout.header))
    read: Any = dict(converters or {})
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*input contained no data")
        try:
            table = _loaded(layout, read, is_plain=not layout.is_own)
        except ValueError:
            if bad := _first_bad(layout, read):
                raise ValueError(bad) from None
            table = _loaded(layout, read, is_plain=True)  # without the rows of empty cells
    if not len(table):
        raise ValueError(f"{path} has a header but no epochs.")
    return table * [layout.factors.get(name, 1.0) for name in layout.columns]


def _loaded(layout, converters, is_plain):
    """Table of numbers, from its plain lines or, which is faster, from the file directly."""
    if is_plain:
        source = _plain_lines(layout)
        form = {"delimiter": "\t"}
    else:
        if is_remote(layout.path):
            source = open_file(layout.path, ENCODING)
        else:
            source = layout.path
        form = {"delimiter": ",", "skiprows": layout.lines}
    columns = tuple(layout.columns.values())
    try:
        return np.loadtxt(
            source, usecols=columns, encoding=ENCODING, ndmin=2, converters=converters, **form
        )
    except ValueError:
        raise ValueError(f"{layout.path} is not a table of numbers.") from None


def _plain_lines(layout):
    """Rows of numbers in any layout, with tabs and decimal points."""
    for _, cells in read_rows(layout):
        yield "\t".join(cells).replace(layout.decimal, ".")


def _check_width(path, lines, width):
    """Refuse rows with more cells than the header, which decimal commas cause."""
    with open_file(path) as file:
        for number, line in enumerate(file, start=1):
            if line.count(b",") >= width and number > lines and not line.startswith(b"#"):
                raise ValueError(_too_wide(f"Line {number} of {path}", line.count(b",") + 1, width))


def _too_wide(line, cells, width):
    return (
        f"{line} has {cells} columns where the header has {width}. Use decimal points, not "
        "commas, and put names with a comma in quotation marks."
    )


def _first_bad(layout, converters):
    """Sentence on the first row that is not numeric; empty without such a row."""
    for line, cells in read_rows(layout):
        if cells[0].startswith("#"):
            continue
        for column in layout.columns.values():
            cell = cells[column].split("#")[0].strip()
            try:
                converters.get(column, layout.number)(cell)
            except ValueError:
                sentence = (
                    f"{line} has '{shown(cell)}' where a number is expected (column {column + 1})."
                )
                if _DATE.match(cell):
                    sentence += " It seems to be a date or time of day: give seconds."
                return sentence
    return ""


def check_finite(path: str | Path, table: np.ndarray, row: str) -> None:
    """Refuse a table with values that are not numbers.

    Parameters
    ----------
    path : path
        For messages.
    table : (n, k) array
    row : str
        Name of a row.

    Raises
    ------
    ValueError
        With their number and the first one.
    """
    bad = ~np.isfinite(table).all(axis=1)
    if bad.any():
        raise ValueError(
            f"{bad.sum()} of {len(table)} {row}s of {path} have values that are not numbers "
            f"(first: {row} {np.argmax(bad) + 1})."
        )


def check_increasing(path: str | Path, gps_time: np.ndarray, row: str) -> None:
    """Refuse times that do not increase.

    Parameters
    ----------
    path : path
        For messages.
    gps_time : (n,) array
    row : str
        Name of a row.

    Raises
    ------
    ValueError
        With the number of backward steps and the first one.
    """
    back = np.diff(gps_time) <= 0
    if back.any():
        raise ValueError(
            f"The times of {path} must increase: {back.sum()} {row}s are not later than the one "
            f"before (first: {row} {np.argmax(back) + 2})."
        )
