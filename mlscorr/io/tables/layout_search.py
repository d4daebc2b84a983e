"""Layout of a table: our own columns, or foreign ones found by their names.

Nothing is guessed silently: the interpretation is reported in a sentence, an ambiguous layout is
refused, and for a missing column the message states what to write in survey.toml. The separator is
the one that splits a row into all required names; csv.Sniffer mistakes decimal commas for
separators, and finds none below comment lines.
"""

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import (
    ENCODING,
    OpenPlace,
    OpenQuestion,
    as_path,
    encoding_of,
    listed,
    nearest,
    open_file,
    shown,
)
from mlscorr.io.tables.column_names import (
    UNITS,
    find_meanings,
    is_foreign,
    plain,
    section_of,
    unit_of,
)
from mlscorr.io.tables.table_rows import (
    COMMENT_MARKS,
    NUMBER,
    SEPARATORS,
    SUFFIX,
    TableLayout,
    is_comment,
    not_text,
    read_sheets,
    split,
)
from mlscorr.survey import SurveyFileError

_TEXT_COLUMNS = ("name", "kind", "role")  # columns without numbers
_BRACKETED = re.compile(r"[(\[].*[)\]]")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(['’\s]\d{3})+([.,]\d*)?")


def read_layout(
    path: str | Path,
    required: Sequence[str],
    groups: Sequence[Sequence[str]],
    names: Mapping[str, Collection[str]],
    lacking: Callable[[Collection[str]], list[str]],
    chosen: Mapping[str, str | int] | None = None,
    unnamed: Callable[[Sequence[str]], Mapping[str, int]] = lambda _: {},
    hints: Mapping[tuple[str, str], tuple[str, Sequence[OpenPlace]]] | None = None,
) -> TableLayout:
    """Read the layout of a table with our own columns, or with foreign ones.

    Parameters
    ----------
    path : path
    required : sequence of str
        A UTF-8 table with all of these in a comma-separated first line is our own.
    groups : sequence of sequences of str
        Our own columns that are only used together.
    names, lacking, chosen, unnamed
        See find_layout.
    hints : mapping, optional
        See missing_columns.

    Returns
    -------
    TableLayout

    Raises
    ------
    ValueError
        If columns are missing or ambiguous, or the file is not text.
    """
    path = as_path(path)
    refusal = None
    if path.suffix.lower() != SUFFIX:
        try:
            header, lines = read_header(path)
        except ValueError as error:
            header = []
            refusal = error
        is_own = not chosen and set(required) <= set(header)
        if is_own and encoding_of(path) == ENCODING:
            columns = _own_columns(path, header, required, groups)
            return TableLayout(path, tuple(header), lines, columns, is_own=True)
    layout = find_layout(path, names, lacking, chosen, unnamed)
    if layout is not None:
        return layout
    header = likely_header(path, names)
    meanings = find_meanings(header, names, chosen)
    missing = lacking(meanings)
    _check_chosen(path, missing, chosen or {})
    if refusal and not meanings:  # known names belong to a table
        raise refusal
    raise _missing_columns(path, header, missing, meanings, names, hints)


def read_header(path: str | Path) -> tuple[list[str], int]:
    """Column names of a CSV file in lower case, and the number of lines up to the header.

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
        If the file has only blank lines or is not text.
    """
    path = as_path(path)
    longest = SETTINGS.longest_line
    try:
        with open_file(path, ENCODING) as file:
            for number, line in enumerate(iter(lambda: file.readline(longest), ""), start=1):
                if len(line) == longest:
                    raise ValueError(
                        f"Line {number} of {path} has {longest} or more characters where column "
                        "names are expected: the file is not a table of comma-separated values."
                    )
                if line.strip():
                    return [cell.strip().strip('"').casefold() for cell in line.split(",")], number
    except UnicodeDecodeError:
        raise ValueError(not_text(path)) from None
    raise ValueError(f"{path} is empty.")


def _own_columns(path, header, required, groups):
    """Position of every required column, and of the optional groups that exist."""
    names = list(required)
    for group in groups:
        present = [name for name in group if name in header]
        if present and len(present) < len(group):
            absent = [name for name in group if name not in header]
            raise ValueError(
                f"{path} has {', '.join(present)} but not {', '.join(absent)}: give all of "
                f"{', '.join(group)}, or none."
            )
        names += present
    doubled = [name for name in names if header.count(name) > 1]
    if doubled:
        raise ValueError(f"{path} has the column {doubled[0]} {header.count(doubled[0])} times.")
    return {name: header.index(name) for name in names}


def find_layout(
    path: str | Path,
    names: Mapping[str, Collection[str]],
    lacking: Callable[[Collection[str]], list[str]],
    chosen: Mapping[str, str | int] | None = None,
    unnamed: Callable[[Sequence[str]], Mapping[str, int]] = lambda _: {},
) -> TableLayout | None:
    """Find the layout of a foreign table.

    Parameters
    ----------
    path : path
    names : mapping
        Our names of columns to foreign ones.
    lacking : function
        Returns the names still missing.
    chosen : mapping, optional
        Our name to the name of a column, or to its number from 1.
    unnamed : function, optional
        Returns the columns of the cells of a first row without a header, if any.

    Returns
    -------
    TableLayout or None
        None if no line has all required names.

    Raises
    ------
    ValueError
        For columns with the same meaning, non-metric units, thousands separators, and two sheets
        with a table.
    """
    path = as_path(path)
    chosen = dict(chosen or {})
    is_numbered = any(isinstance(column, int) for column in chosen.values())
    if is_numbered:
        positions = {name: int(number) - 1 for name, number in chosen.items()}
        if missing := lacking(positions):
            raise SurveyFileError(
                f"{path} has column numbers in survey.toml, but none for {', '.join(missing)}: "
                "number all needed columns, or none."
            )
        unnamed = _numbered(positions)
    sheets = []
    for start, rows in _parted_tables(path):
        layout = _named_layout(start, rows, names, lacking, chosen)
        layout = layout or _unnamed_layout(start, rows, is_numbered, unnamed)
        if layout is not None and layout.sheet is None:
            return layout
        if layout is not None:
            sheets.append(layout)
    if len(sheets) > 1:
        titles = ", ".join(shown(layout.sheet) for layout in sheets)
        raise ValueError(f"{path} has tables in {len(sheets)} sheets ({titles}). Keep only one.")
    return next(iter(sheets), None)


def _numbered(positions):
    """Function that returns these columns if the cells of a row there are numbers."""

    def columns(cells):
        numbers = [i for name, i in positions.items() if name not in _TEXT_COLUMNS]
        is_row = max(positions.values()) < len(cells)
        if is_row and all(NUMBER.fullmatch(cells[i]) for i in numbers):
            return positions
        return {}

    return columns


def _parted_tables(path) -> Iterator[tuple[TableLayout, list[tuple[int, list[str]]]]]:
    """Yield layouts without columns, the most likely first, each with the first rows split by
    it.
    """
    if path.suffix.lower() == SUFFIX:
        for sheet, rows in read_sheets(path):
            yield TableLayout(path, (), 0, {}, sheet=sheet), rows[: SETTINGS.sampled_lines]
        return
    encoding = encoding_of(path)
    if encoding is None:
        return
    lines = _first_lines(path, encoding)
    if not lines:
        return
    for separator in SEPARATORS:
        layout = TableLayout(path, (), 0, {}, separator, encoding=encoding)
        yield layout, [(number, split(line, separator)) for number, line in lines]


def _first_lines(path, encoding):
    """Yield pairs of a number from 1 and a non-blank line, up to one too long for a table."""
    lines = []
    with open_file(path, encoding) as file:
        for number in range(1, SETTINGS.sampled_lines + 1):
            line = file.readline(SETTINGS.longest_line)
            if not line or len(line) == SETTINGS.longest_line:
                break
            if line.strip(" \t\r\n-=_"):
                lines.append((number, line))
    return lines


def _named_layout(start, rows, names, lacking, chosen):
    """Layout by the first row with all required names; None without one."""
    for place, (number, raw) in enumerate(rows):
        cells = _uncommented(raw)
        meanings = find_meanings(cells, names, chosen)
        if lacking(meanings):
            continue
        _check_chosen(start.path, set(chosen) - set(meanings), chosen)
        columns = {name: positions[0] for name, positions in meanings.items()}
        layout = replace(start, header=tuple(cells), lines=number, columns=columns)
        below = [row for row in rows[place + 1 :] if not is_comment(row[1])]
        units = [unit_of(cell) for cell in cells]
        if below and _holds_units(below[0][1], columns):
            layout = replace(layout, lines=below[0][0])
            texts = [cell.strip("()[] ").casefold() or None for cell in below.pop(0)[1]]
            units = texts if len(texts) == len(cells) else []  # otherwise group names, in words
        layout, parted = _parted(layout, [row for _, row in below])
        _check_doubled(layout, meanings, parted, section_of(names))
        return _with_units_and_decimals(layout, units, parted)
    return None


def _uncommented(cells):
    """Cells of a header, without a comment mark."""
    if cells and cells[0].startswith(COMMENT_MARKS):
        first = cells[0].lstrip("".join(COMMENT_MARKS)).strip()
        if first:
            return [first, *cells[1:]]
        return cells[1:]
    return cells


def _holds_units(cells, columns):
    """True if the row below a header has units instead of values: known ones, or in brackets."""
    texts = [cells[i].strip("()[] ").casefold() for i in columns.values() if i < len(cells)]
    are_units = all(not text or text in UNITS or is_foreign(text) for text in texts)
    return any(texts) and (are_units or bool(_BRACKETED.fullmatch(" ".join(cells).strip())))


def _parted(layout, rows):
    """Layout and rows if these are separated differently from the names, as in POSPac's files."""
    if not rows or len(rows[0]) > 1:
        return layout, rows
    for separator in SEPARATORS:
        parted = [split(row[0], separator) for row in rows]
        if len(parted[0]) == len(layout.header):
            return replace(layout, separator=separator), parted
    return layout, rows


def _check_doubled(layout, meanings, rows, section):
    """Refuse columns that may mean the same, unless they have one name and the same values."""
    for name, positions in meanings.items():
        doubled = [shown(layout.header[i]) for i in positions]
        cells = [{row[i] for i in positions if i < len(row)} for row in rows]
        has_one_value = bool(rows) and all(len(values) <= 1 for values in cells)
        if len(doubled) == 1 or (len(set(doubled)) == 1 and has_one_value):
            continue
        places = []
        if len(set(doubled)) == len(doubled):
            key = (section, "columns", name)
            places.append(OpenPlace(key, tuple(doubled), f"column of the {name}"))
            remedy = f'choose, as {name} = "{doubled[0]}"'
        else:
            remedy = f"number all needed columns, as {name} = {positions[0] + 1},"
        raise OpenQuestion(
            f"{layout.path} has {len(doubled)} columns that may be the {name} "
            f"({', '.join(doubled)}): {remedy} under [{section}.columns] in survey.toml.",
            places,
        )


def _unnamed_layout(start, rows, is_numbered, unnamed):
    """Layout of a table without a header: its first row, or the first with the chosen columns."""
    rows = [row for row in rows if not (row[1] and row[1][0].startswith(COMMENT_MARKS))]
    for place, (number, cells) in enumerate(rows):
        columns = unnamed(cells)
        if columns:
            layout = replace(start, lines=number - 1, columns=dict(columns))
            return _with_units_and_decimals(layout, [], [row for _, row in rows[place:]])
        if not is_numbered:
            return None
    return None


def _with_units_and_decimals(layout, units, rows):
    """Add the decimal sign and the factors of units to the layout."""
    path = layout.path
    factors = {}
    for name, i in layout.columns.items():
        unit = units[i] if i < len(units) else None
        if unit is not None and unit not in UNITS:
            raise ValueError(
                f"{path} has the {name} in '{unit}'; supported units are m, mm, deg, rad and s. "
                "Convert this column."
            )
        if unit is not None and UNITS[unit] != 1.0:
            factors[name] = UNITS[unit]
    places = [i for name, i in layout.columns.items() if name not in _TEXT_COLUMNS]
    cells = [row[i] for row in rows for i in places if i < len(row)]
    numbers = [cell for cell in cells if NUMBER.fullmatch(cell.replace(".", "").replace(",", ""))]
    if marked := [cell for cell in cells if _THOUSANDS.fullmatch(cell)]:
        raise ValueError(f"{path} has thousands separators ('{shown(marked[0])}'). Remove them.")
    commas, points = ([cell for cell in numbers if mark in cell] for mark in ",.")
    if commas and points:
        raise ValueError(
            f"{path} has numbers with commas ('{shown(commas[0])}') and with points "
            f"('{shown(points[0])}'). Use one decimal separator and no thousands separators."
        )
    return replace(layout, factors=factors, decimal="," if commas else ".")


def likely_header(path: str | Path, names: Mapping[str, Collection[str]]) -> list[str]:
    """Row among the first ones with the most known names; the longest if there are none.

    Parameters
    ----------
    path : path
    names : mapping
        See find_layout.

    Returns
    -------
    list of str
    """
    tables = [rows for _, rows in _parted_tables(as_path(path))]
    rows = [_uncommented(cells) for table in tables for _, cells in table]
    return max(rows, key=lambda cells: (len(find_meanings(cells, names)), len(cells)), default=[])


def _check_chosen(path: Path, missing: Collection[str], chosen: Mapping[str, str | int]) -> None:
    """Refuse columns that survey.toml names but the table does not have."""
    for name in sorted(set(missing) & set(chosen)):
        raise SurveyFileError(
            f"{path} has no column '{chosen[name]}', which survey.toml sets as the {name}."
        )


def _missing_columns(
    path: str | Path,
    header: Sequence[str],
    missing: Sequence[str],
    meanings: Mapping[str, Sequence[int]],
    names: Mapping[str, Collection[str]],
    hints: Mapping[tuple[str, str], tuple[str, Sequence[OpenPlace]]] | None = None,
) -> OpenQuestion:
    """Error on a table without required columns."""
    used = {header[i] for positions in meanings.values() for i in positions}
    hinted = [
        hint
        for (name, other), hint in (hints or {}).items()
        if name in missing and other in meanings
    ]
    sentence = missing_sentence(path, header, missing, used, names)
    if hinted:
        places = [place for _, of_hint in hinted for place in of_hint]
    else:
        places = _likely_places(header, missing, used, names)
    return OpenQuestion(sentence + "".join(remedy for remedy, _ in hinted), places)


def missing_sentence(
    path: str | Path,
    header: Sequence[str],
    missing: Sequence[str],
    used: Collection[str],
    names: Mapping[str, Collection[str]],
    seeming: Mapping[str, str] | None = None,
) -> str:
    """Sentence on missing columns, and on a similar one that may be meant.

    Parameters
    ----------
    path : path
    header : sequence of str
    missing : sequence of str
        Our names.
    used : collection of str
        Names in the header with another meaning.
    names : mapping
        See find_meanings.
    seeming : mapping, optional
        Our name to the column with matching cells.
    """
    others = [cell for cell in header if cell and cell not in used]
    near = _near_columns(others, missing, names) | dict(seeming or {})
    candidates = [name for name in missing if name in near]
    hint = ""
    section = section_of(names)
    numbers = sum(NUMBER.fullmatch(cell) is not None for cell in header)
    if numbers > 2:
        hint = (
            f" It has no header: number its columns under [{section}.columns] in survey.toml, as "
            "easting = 2."
        )
    elif {"easting", "northing", "height"} <= set(missing):
        hint = " It has no coordinates; it may be the wrong file."
        if numbers == 2:
            hint = " It seems to be a plan without heights: each point needs a height."
    elif candidates:
        name = candidates[0]
        column = shown(near[candidates[0]])
        hint = (
            f" '{column}' may be the {name}: if so, set columns.{name} = '{column}' under "
            f"[{section}] in survey.toml."
        )
    elif others:
        hint = (
            f" If one of these is meant, set columns.{missing[0]} = '...' under [{section}] in "
            "survey.toml."
        )
    if "gps_time" in missing and "utc" in near.get("gps_time", "").casefold():
        hint += " Times in UTC also need trajectory.time_constant: 18 s since 2017."
    has = listed(header, SETTINGS.named_columns) or "no header"
    return f"{path} has no column {', '.join(missing)}; it has {has}.{hint}"


def _near_columns(others, missing, names):
    """Our names with the foreign column of the most similar spelling."""
    known = {name: our for our, words in names.items() for name in (plain(our), *words)}
    near = {known.get(nearest(plain(cell), known) or ""): cell for cell in others}
    near |= {name: cell for name in missing if (cell := nearest(name, others))}
    if in_utc := [cell for cell in others if "utc" in cell.casefold()]:
        near["gps_time"] = in_utc[0]
    return near


def _likely_places(header, missing, used, names):
    """Keys that name columns, if one in the header is spelled like each missing one."""
    others = [cell for cell in header if cell and cell not in used]
    near = _near_columns(others, missing, names)
    if not set(missing) <= set(near) or len({near[name] for name in missing}) < len(missing):
        return []
    keys = [(section_of(names), "columns", name) for name in missing]
    return [OpenPlace(key, (near[key[-1]],), f"column of the {key[-1]}") for key in keys]
