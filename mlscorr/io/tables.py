"""Tables in text files: their header, their rows, their numbers, and what is wrong in them."""

import csv
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.io.settings import SETTINGS
from mlscorr.io.text_files import ENCODING, nearest, shown


def read_header(path: str | Path) -> tuple[list[str], int]:
    """Column names of a CSV file in lower case, and the number of lines down to the header.

    Parameters
    ----------
    path : path

    Returns
    -------
    header : list of str
    lines : int

    Raises
    ------
    ValueError
        When the file holds nothing but blank lines or is not text.
    """
    path, longest = Path(path), SETTINGS.longest_line
    try:
        with path.open(encoding=ENCODING) as file:
            for number, line in enumerate(iter(lambda: file.readline(longest), ""), start=1):
                if len(line) == longest:
                    raise ValueError(
                        f"Line {number} of {path} has {longest} characters or more, where the "
                        "names of columns belong: it is no table of comma-separated values."
                    )
                if line.strip():
                    return [cell.strip().strip('"').casefold() for cell in line.split(",")], number
    except UnicodeDecodeError:
        raise ValueError(_not_text(path)) from None
    raise ValueError(f"{path} is empty.")


def find_columns(
    path: str | Path,
    header: Sequence[str],
    required: Sequence[str],
    groups: Sequence[Sequence[str]] = (),
) -> dict[str, int]:
    """Position of every required column, and of the optional groups that are there.

    Parameters
    ----------
    path : path
        For messages.
    header, required : sequence of str
    groups : sequence of sequences of str
        Columns that only make sense together.

    Returns
    -------
    dict
        Column name to position.

    Raises
    ------
    ValueError
        For columns that are missing, doubled, or a group that is there in part.
    """
    missing = [name for name in required if name not in header]
    if missing:
        raise ValueError(_missing(path, header, missing))
    names = list(required)
    for group in groups:
        present = [name for name in group if name in header]
        if present and len(present) < len(group):
            absent = [name for name in group if name not in header]
            raise ValueError(
                f"{path} has {', '.join(present)} but not {', '.join(absent)}: "
                f"give all of {', '.join(group)}, or none."
            )
        names += present
    doubled = [name for name in names if header.count(name) > 1]
    if doubled:
        raise ValueError(f"{path} has the column {doubled[0]} {header.count(doubled[0])} times.")
    return {name: header.index(name) for name in names}


def read_rows(
    path: str | Path, lines: int, columns: Collection[int], width: int, exact: bool = False
) -> Iterator[tuple[str, list[str]]]:
    """Rows of a CSV file behind its header, blank ones left out.

    Parameters
    ----------
    path : path
    lines : int
        Number of lines down to the header.
    columns : collection of int
        Those that every row needs.
    width : int
        Number of columns of the header.
    exact : bool
        Whether each row has to have that many.

    Yields
    ------
    line : str
        Which line it is of what file, for messages.
    cells : list of str

    Raises
    ------
    ValueError
        For a row that is too short, and a file that is not text.
    """
    with Path(path).open(encoding=ENCODING, newline="") as file:
        try:
            for _ in range(lines):
                next(file)
            reader = csv.reader(file, skipinitialspace=True)
            for row in reader:
                cells = [cell.strip() for cell in row]
                if not any(cells):
                    continue
                line = f"Line {lines + reader.line_num} of {path}"
                if len(cells) <= max(columns) or (exact and len(cells) != width):
                    raise ValueError(
                        f"{line} has {len(cells)} columns where the header has {width}: "
                        "the file may have been cut off, or a comma may be missing."
                    )
                yield line, cells
        except UnicodeDecodeError:
            raise ValueError(_not_text(path)) from None
        except csv.Error as error:
            raise ValueError(
                f"{path} has a cell in line {lines + reader.line_num} or behind it that never ends "
                f"({error}): a quotation mark may be missing."
            ) from None


def read_numbers(
    path: str | Path,
    lines: int,
    columns: Collection[int],
    width: int,
    converters: Mapping[int, Callable[[str], float]] | None = None,
) -> np.ndarray:
    """The wanted columns of a CSV file of numbers.

    Parameters
    ----------
    path : path
    lines : int
        Number of lines down to the header.
    columns : collection of int
        Positions of the wanted columns.
    width : int
        Number of columns of the header.
    converters : dict, optional
        Position of a column to the function that reads its cells, float for others.

    Returns
    -------
    (n, k) array

    Raises
    ------
    ValueError
        Names the first line that is no row of numbers; also for a file without rows.
    """
    columns = tuple(columns)
    _check_width(path, lines, width)
    read: Any = dict(converters or {})
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*input contained no data")
        try:
            table = np.loadtxt(
                path,
                delimiter=",",
                skiprows=lines,
                usecols=columns,
                encoding=ENCODING,
                ndmin=2,
                converters=read,
            )
        except ValueError:
            rows = read_rows(path, lines, columns, width)
            raise ValueError(_first_bad(path, rows, columns, converters or {})) from None
    if not len(table):
        raise ValueError(f"{path} has a header but no epochs.")
    return table


def _check_width(path, lines, width):
    """Refuse rows with more cells than the header, as decimal commas make them."""
    with Path(path).open("rb") as file:
        for number, line in enumerate(file, start=1):
            if line.count(b",") >= width and number > lines and not line.startswith(b"#"):
                raise ValueError(
                    f"Line {number} of {path} has {line.count(b',') + 1} columns where the header "
                    f"has {width}: decimals must be separated by points, not by commas."
                )


def check_finite(path: str | Path, table: np.ndarray, row: str) -> None:
    """Refuse a table with values that are not numbers.

    Parameters
    ----------
    path : path
        For messages.
    table : (n, k) array
    row : str
        What a row of it is called.

    Raises
    ------
    ValueError
        Counts them and names the first.
    """
    bad = ~np.isfinite(table).all(axis=1)
    if bad.any():
        raise ValueError(
            f"{bad.sum()} of {len(table)} {row}s of {path} hold values that are not numbers "
            f"(first: {row} {np.argmax(bad) + 1})."
        )


def check_increasing(path: str | Path, gps_time: np.ndarray, row: str) -> None:
    """Refuse times that don't increase.

    Parameters
    ----------
    path : path
        For messages.
    gps_time : (n,) array
    row : str
        What holds a time.

    Raises
    ------
    ValueError
        Counts the steps back and names the first.
    """
    back = np.diff(gps_time) <= 0
    if back.any():
        raise ValueError(
            f"The times of {path} must increase: {back.sum()} {row}s do not come after the one "
            f"before (first: {row} {np.argmax(back) + 2})."
        )


def _not_text(path):
    return (
        f"{path} is not a text file in UTF-8. Save it anew as comma-separated values in UTF-8; "
        "letters such as umlauts are the likely cause."
    )


def _first_bad(path, rows, columns, converters):
    """A sentence on the first row that is none of numbers."""
    for line, cells in rows:
        if cells[0].startswith("#"):
            continue
        for column in columns:
            cell = cells[column].split("#")[0].strip()
            try:
                converters.get(column, float)(cell)
            except ValueError:
                return f"{line} has '{shown(cell)}' where a number belongs (column {column + 1})."
    return f"{path} is not a table of numbers."


def _missing(path, header, missing):
    if len(header) == 1 and any(mark in header[0] for mark in ";\t "):
        return (
            f"{path} seems to be separated by semicolons, tabs or blanks; "
            "columns must be separated by commas, decimals by points."
        )
    others = [name for name in header if name]
    hint = (
        f" {missing[0]} may be meant by '{shown(nearest(missing[0], others))}'." if others else ""
    )
    return f"{path} has no column {', '.join(missing)}; it has {shown(', '.join(header))}.{hint}"
