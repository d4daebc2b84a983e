"""Tables: their header, what their columns are, and what is wrong in them."""

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import ENCODING, OpenPlace, OpenQuestion, as_path, nearest, open_file, shown
from mlscorr.io.tables._sheets import SUFFIX
from mlscorr.io.tables.column_names import find_meanings, listed, plain, section_of
from mlscorr.io.tables.layout_search import NUMBER, check_chosen, find_layout, likely_header
from mlscorr.io.tables.layouts import TableLayout, head, not_text


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
    path = as_path(path)
    longest = SETTINGS.longest_line
    try:
        with open_file(path, ENCODING) as file:
            for number, line in enumerate(iter(lambda: file.readline(longest), ""), start=1):
                if len(line) == longest:
                    raise ValueError(
                        f"Line {number} of {path} has {longest} characters or more, where the "
                        "names of columns belong: it is no table of comma-separated values."
                    )
                if line.strip():
                    return [cell.strip().strip('"').casefold() for cell in line.split(",")], number
    except UnicodeDecodeError:
        raise ValueError(not_text(path)) from None
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
        All that are required are there.
    groups : sequence of sequences of str
        Columns that only make sense together.

    Returns
    -------
    dict
        Column name to position.

    Raises
    ------
    ValueError
        For columns that are doubled, or a group that is there in part.
    """
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


def read_layout(
    path: str | Path,
    required: Sequence[str],
    groups: Sequence[Sequence[str]],
    names: Mapping[str, Collection[str]],
    lacking: Callable[[Collection[str]], list[str]],
    chosen: Mapping[str, str | int] | None = None,
    unnamed: Callable[[Sequence[str]], Mapping[str, int]] = lambda _: {},
    hints: Mapping[tuple[str, str], str] | None = None,
    hint_places: Mapping[tuple[str, str], OpenPlace] | None = None,
) -> TableLayout:
    """The layout of a table in our own columns, or of one as others write them.

    Parameters
    ----------
    path : path
    required, groups : sequence
        See find_columns: a table in UTF-8 with all required names in a first line with commas is
        our own.
    names, lacking, chosen, unnamed
        See find_layout.
    hints : mapping, optional
        Name that is missing and one that is there to the sentence that says the way out.
    hint_places : mapping, optional
        The same to the place of survey.toml that is the way out.

    Returns
    -------
    TableLayout

    Raises
    ------
    ValueError
        For a table whose columns are missing or can be understood in two ways, and for no text.
    """
    path = as_path(path)
    refusal = None
    if path.suffix.lower() != SUFFIX:
        try:
            header, lines = read_header(path)
        except ValueError as error:
            header = []
            refusal = error
        if not chosen and set(required) <= set(header) and head(path):
            columns = find_columns(path, header, required, groups)
            return TableLayout(path, tuple(header), lines, columns, is_own=True)
    layout = find_layout(path, names, lacking, chosen, unnamed)
    if layout is None:
        header = likely_header(path, names)
        meanings = find_meanings(header, names, chosen)
        used = {header[i] for positions in meanings.values() for i in positions}
        missing = lacking(meanings)
        check_chosen(path, missing, chosen or {})
        ways_out = "".join(
            way_out
            for (name, other), way_out in (hints or {}).items()
            if name in missing and other in meanings
        )
        if refusal and not meanings:  # names that are known are those of a table
            raise refusal
        places = [
            place
            for (name, other), place in (hint_places or {}).items()
            if name in missing and other in meanings
        ]
        if places or ways_out:
            columns = []
        else:
            columns = _likely_places(header, missing, used, names)
        sentence = missing_sentence(path, header, missing, used, names) + ways_out
        raise OpenQuestion(sentence, [*places, *columns])
    return layout


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


def _near_columns(others, missing, names):
    """Our names with the column of others whose name is spelt like each."""
    known = {name: our for our, words in names.items() for name in (plain(our), *words)}
    near = {known.get(nearest(plain(cell), known) or ""): cell for cell in others}
    near |= {name: cell for name in missing if (cell := nearest(name, others))}
    if in_utc := [cell for cell in others if "utc" in cell.casefold()]:
        near["gps_time"] = in_utc[0]
    return near


def _likely_places(header, missing, used, names):
    """Places that name columns, where one of the header is spelt like each that is missing."""
    others = [cell for cell in header if cell and cell not in used]
    near = _near_columns(others, missing, names)
    if not set(missing) <= set(near) or len({near[name] for name in missing}) < len(missing):
        return []
    keys = [(section_of(names), "columns", name) for name in missing]
    return [OpenPlace(key, (near[key[-1]],), f"column of the {key[-1]}") for key in keys]


def missing_sentence(
    path: str | Path,
    header: Sequence[str],
    missing: Sequence[str],
    used: Collection[str],
    names: Mapping[str, Collection[str]],
    seeming: Mapping[str, str] | None = None,
) -> str:
    """A sentence on columns that are missing, and on the one that may be meant, if one is like it.

    Parameters
    ----------
    path : path
    header : sequence of str
    missing : sequence of str
        Our names.
    used : collection of str
        Names in the header that mean something else.
    names
        See find_layout.
    seeming : mapping, optional
        Our name to the column whose cells are like it.
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
        hint = " It holds no coordinates: is another file meant?"
        if numbers == 2:
            hint = " It seems to hold a plan without heights: each point needs its own."
    elif candidates:
        name = candidates[0]
        column = shown(near[candidates[0]])
        hint = (
            f" {name} may be meant by '{column}': if so, say under [{section}] in survey.toml, as "
            f"columns.{name} = '{column}'."
        )
    elif others:
        hint = (
            f" If another one of these is meant, say which under [{section}] in survey.toml, as "
            f"columns.{missing[0]} = '...'."
        )
    if "gps_time" in missing and "utc" in near.get("gps_time", "").casefold():
        hint += " Times in UTC need trajectory.time_constant, too: 18 s since 2017."
    has = listed(header) or "no header"
    return f"{path} has no column {', '.join(missing)}; it has {has}.{hint}"
