"""The layout of tables as others write them.

Nothing is guessed in silence: what was understood is a sentence of its own, and what can be
understood in two ways is refused.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import OpenPlace, OpenQuestion, as_path, open_file, shown
from mlscorr.io.tables import layouts
from mlscorr.io.tables._sheets import SUFFIX, read_sheets
from mlscorr.io.tables.column_names import UNITS, find_meanings, is_foreign, section_of, unit_of
from mlscorr.survey import SurveyFileError

WORDS = ("name", "kind", "role")  # columns that hold no numbers
BRACKETED = re.compile(r"[(\[].*[)\]]")
THOUSANDS = re.compile(r"[+-]?\d{1,3}(['’\s]\d{3})+([.,]\d*)?")
NUMBER = re.compile(r"[+-]?\d+([.,]\d*)?(e[+-]?\d+)?", re.IGNORECASE)


def find_layout(
    path: str | Path,
    names: Mapping[str, Collection[str]],
    lacking: Callable[[Collection[str]], list[str]],
    chosen: Mapping[str, str | int] | None = None,
    unnamed: Callable[[Sequence[str]], Mapping[str, int]] = lambda _: {},
) -> layouts.TableLayout | None:
    """The layout of a table of others.

    Parameters
    ----------
    path : path
    names : mapping
        Our names of columns to those of others.
    lacking : function
        Names that these names leave missing.
    chosen : mapping, optional
        Our name to the name of a column, or to its number from 1.
    unnamed : function, optional
        The columns that the cells of a first row without a header mean, if any.

    Returns
    -------
    TableLayout or None
        None where no line names all that is needed.

    Raises
    ------
    ValueError
        For columns that stand for the same, units that are not metric, thousands marks, and two
        sheets that hold a table.
    """
    path = as_path(path)
    chosen = dict(chosen or {})
    is_numbered = any(isinstance(column, int) for column in chosen.values())
    if is_numbered:
        positions = {name: int(number) - 1 for name, number in chosen.items()}
        if missing := lacking(positions):
            raise SurveyFileError(
                f"{path} has numbers of columns in survey.toml, but none for {', '.join(missing)}: "
                "number all that are needed, or none."
            )
        unnamed = _numbered(positions)
    for encoding in (None,) if path.suffix.lower() == SUFFIX else _encodings(path):
        layouts = []
        for start, rows in _candidates(path, encoding):
            layout = _layout_of(replace(start, path=path), rows, names, lacking, chosen)
            layout = layout or _unnamed_layout(start, rows, is_numbered, unnamed)
            if layout is not None:
                layouts.append(layout)
                if layout.sheet is None:
                    break  # the surest separator
        if len({layout.sheet for layout in layouts}) > 1:
            sheets = ", ".join(shown(layout.sheet) for layout in layouts)
            raise ValueError(
                f"{path} has a table in {len(layouts)} sheets ({sheets}): keep one of them."
            )
        for layout in layouts[:1]:
            has_evidence = not "".join(layout.header).isascii() or _are_pairs(path)
            if encoding != "gb18030" or has_evidence:
                return layout
    return None


def _numbered(positions):
    """A function that gives these columns where the cells of a row there are numbers."""

    def columns(cells):
        numbers = [i for name, i in positions.items() if name not in WORDS]
        is_row = max(positions.values()) < len(cells)
        if is_row and all(NUMBER.fullmatch(cells[i]) for i in numbers):
            return positions
        return {}

    return columns


def _encodings(path):
    with open_file(path) as file:
        if file.read(2) in (b"\xff\xfe", b"\xfe\xff"):
            return ("utf-16",)
        return tuple(name for name in layouts.ENCODINGS if name != "utf-16")


def _are_pairs(path):
    """Whether letters beyond ASCII come in pairs of bytes, as Chinese ones do and umlauts don't."""
    with open_file(path) as file:
        start = file.read(SETTINGS.copied_bytes)
    return all(len(run) % 2 == 0 for run in re.findall(rb"[\x80-\xff]+", start))


def _candidates(path, encoding):
    """Pairs of a TableLayout without columns, and the first rows parted in its way."""
    if encoding is None:
        for sheet, rows in read_sheets(path):
            yield layouts.TableLayout(path, (), 0, {}, sheet=sheet), rows[: SETTINGS.sampled_lines]
        return
    lines = layouts.head(path, encoding)
    for separator in layouts.SEPARATORS if lines else ():
        layout = layouts.TableLayout(path, (), 0, {}, separator, encoding=encoding)
        yield layout, [(number, layouts.split(line, separator)) for number, line in lines]


def _layout_of(start, rows, names, lacking, chosen):
    """The layout by the first row that names all that is needed; None without one."""
    for place, (number, raw) in enumerate(rows):
        cells = _uncommented(raw)
        meanings = find_meanings(cells, names, chosen)
        if lacking(meanings):
            continue
        check_chosen(start.path, set(chosen) - set(meanings), chosen)
        columns = {name: positions[0] for name, positions in meanings.items()}
        layout = replace(start, header=tuple(cells), lines=number, columns=columns)
        below = [row for row in rows[place + 1 :] if not layouts.is_comment(row[1])]
        units = [unit_of(cell) for cell in cells]
        if below and _holds_units(below[0][1], columns):
            layout = replace(layout, lines=below[0][0])
            texts = [cell.strip("()[] ").casefold() or None for cell in below.pop(0)[1]]
            units = texts if len(texts) == len(cells) else []  # else of groups of columns, in words
        layout, parted = _parted(layout, [row for _, row in below])
        _check_doubled(layout, meanings, parted, section_of(names))
        return _with_numbers(layout, units, parted)
    return None


def _parted(layout, rows):
    """The layout and its rows where these are parted otherwise than the names, as in POSPac's."""
    is_whole = not rows or len(rows[0]) > 1
    for separator in () if is_whole else layouts.SEPARATORS:
        parted = [layouts.split(row[0], separator) for row in rows]
        if len(parted[0]) == len(layout.header):
            return replace(layout, separator=separator), parted
    return layout, rows


def _check_doubled(layout, meanings, rows, section):
    """Refuse columns that may be the same, but for those of one name and the same values."""
    for name, positions in meanings.items():
        doubled = [shown(layout.header[i]) for i in positions]
        cells = [{row[i] for i in positions if i < len(row)} for row in rows]
        if len(set(doubled)) > 1 or (len(doubled) > 1 and max(map(len, cells), default=2) > 1):
            way_out = f'choose, as {name} = "{doubled[0]}"'
            if len(set(doubled)) < len(doubled):
                way_out = f"number all that are needed, as {name} = {positions[0] + 1},"
            is_named = len(set(doubled)) == len(doubled)
            place = OpenPlace((section, "columns", name), tuple(doubled), f"column of the {name}")
            raise OpenQuestion(
                f"{layout.path} has {len(doubled)} columns that may be the {name} "
                f"({', '.join(doubled)}): {way_out} under [{section}.columns] in survey.toml.",
                [place] if is_named else [],
            )


def check_chosen(path: Path, missing: Collection[str], chosen: Mapping[str, str | int]) -> None:
    """Refuse columns that survey.toml names and the table does not have.

    Parameters
    ----------
    path : Path
    missing : collection of str
        Our names.
    chosen : mapping
        See find_layout.

    Raises
    ------
    ValueError
        Names the first.
    """
    for name in sorted(set(missing) & set(chosen)):
        raise SurveyFileError(
            f"{path} has no column '{chosen[name]}', which survey.toml names the {name}."
        )


def _unnamed_layout(start, rows, is_numbered, unnamed):
    """The layout of a table without a header: its first row, or the first with what was chosen."""
    rows = [row for row in rows if not (row[1] and row[1][0].startswith(layouts.COMMENT_MARKS))]
    for place, (number, cells) in enumerate(rows if is_numbered else rows[:1]):
        columns = unnamed(cells)
        if columns:
            layout = replace(start, lines=number - 1, columns=dict(columns))
            return _with_numbers(layout, [], [row for _, row in rows[place:]])
    return None


def _uncommented(cells):
    """Cells of a header that may stand behind a comment mark."""
    if cells and cells[0].startswith(layouts.COMMENT_MARKS):
        first = cells[0].lstrip("".join(layouts.COMMENT_MARKS)).strip()
        if first:
            return [first, *cells[1:]]
        return cells[1:]
    return cells


def _holds_units(cells, columns):
    """Whether the row below a header has units in place of values: known ones, or in brackets."""
    texts = [cells[i].strip("()[] ").casefold() for i in columns.values() if i < len(cells)]
    are_units = all(not text or text in UNITS or is_foreign(text) for text in texts)
    return any(texts) and (are_units or bool(BRACKETED.fullmatch(" ".join(cells).strip())))


def _with_numbers(layout, units, rows):
    """The layout with its decimal sign and the factors of its units."""
    path = layout.path
    factors = {}
    for name, i in layout.columns.items():
        unit = units[i] if i < len(units) else None
        if unit is not None and unit not in UNITS:
            raise ValueError(
                f"{path} has the {name} in '{unit}', where m, mm, deg, rad or s belong: "
                "convert this column."
            )
        if unit is not None and UNITS[unit] != 1.0:
            factors[name] = UNITS[unit]
    places = [i for name, i in layout.columns.items() if name not in WORDS]
    cells = [row[i] for row in rows for i in places if i < len(row)]
    numbers = [cell for cell in cells if NUMBER.fullmatch(cell.replace(".", "").replace(",", ""))]
    if marked := [cell for cell in cells if THOUSANDS.fullmatch(cell)]:
        raise ValueError(f"{path} has thousands marks ('{shown(marked[0])}'): omit them.")
    commas, points = ([cell for cell in numbers if mark in cell] for mark in ",.")
    if commas and points:
        raise ValueError(
            f"{path} has numbers with commas ('{shown(commas[0])}') and with points "
            f"('{shown(points[0])}'): write decimals in one way, and leave out thousands marks."
        )
    return replace(layout, factors=factors, decimal="," if commas else ".")


def likely_header(path: str | Path, names: Mapping[str, Collection[str]]) -> list[str]:
    """The row among the first ones that holds the most names of columns; the longest without any.

    Parameters
    ----------
    path : path
    names : mapping
        See find_layout.

    Returns
    -------
    list of str
    """
    path = as_path(path)
    if path.suffix.lower() == SUFFIX:
        encodings = (None,)
    else:
        encodings = _encodings(path)
    tables = [rows for encoding in encodings for _, rows in _candidates(path, encoding)]
    rows = [_uncommented(cells) for table in tables for _, cells in table]
    return max(rows, key=lambda cells: (len(find_meanings(cells, names)), len(cells)), default=[])
