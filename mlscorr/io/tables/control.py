"""Surveyed targets from control.csv, and from lists as others write them."""

import re
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mlscorr.io.store import ENCODING, as_path, open_file, shown, warn_of_cut
from mlscorr.io.tables._sheets import SUFFIX
from mlscorr.io.tables.column_names import CONTROL_NAMES, WORDS, meant, same_word
from mlscorr.io.tables.control_faults import doubled_names, refuse, row_doubts, row_faults
from mlscorr.io.tables.control_lists import (
    HINTS,
    NORMAL,
    SIGMAS,
    check_unused,
    complete,
    lacking,
    placed,
    role_doubts,
    sentence_on,
    unknown_words,
    unnamed_columns,
    with_check_points,
    word_places,
)
from mlscorr.io.tables.layout_search import read_layout
from mlscorr.io.tables.table_rows import read_rows
from mlscorr.io.tables.table_sections import ControlSection
from mlscorr.survey import AXES, ControlPoints, Trajectory

COLUMNS = ("name", *AXES, *SIGMAS, "kind", "size", "role")
ROLES = tuple(WORDS["role"])
SEXAGESIMAL = re.compile(r"-?\d{1,3}[°: ]\s*\d{1,2}['′: ]")  # degrees and minutes
NOTHING_GIVEN = ControlSection(file="")


class ControlList(NamedTuple):
    """The points of a file, and what was understood of it.

    Parameters
    ----------
    control, check : ControlPoints
        Either may be empty.
    layout : str or None
        A sentence; None for a file in our own columns alone, of which nothing had to be understood.
    """

    control: ControlPoints
    check: ControlPoints
    layout: str | None = None


def read_control(
    path: str | Path, section: ControlSection = NOTHING_GIVEN, trajectory: Trajectory | None = None
) -> ControlList:
    """Points of control.csv, or of a list as total stations and offices write it.

    Parameters
    ----------
    path : path
        Text with any separator, or .xlsx.
    section : ControlSection, optional
        What survey.toml says of all points, and of columns.
    trajectory : Trajectory, optional
        Tells which of X and Y is easting.

    Returns
    -------
    ControlList

    Raises
    ------
    ValueError
        For missing columns, names that are missing or doubled, cells that are no numbers, an
        unknown kind or role, sizes and sigmas that can't be metres, and what can be understood in
        two ways.

    Warns
    -----
    UserWarning
        Of sigmas with which points hardly count, of points at one place, and of a column that isn't
        used and may be that of the roles.
    """
    rules = CONTROL_NAMES, lacking, section.columns.chosen, unnamed_columns, HINTS
    layout = read_layout(path, COLUMNS, (NORMAL,), *rules)
    layout, given = (layout, {}) if layout.is_own else complete(layout, section, NORMAL)
    lines = list(read_rows(layout, exact=True))
    if not lines:
        raise ValueError(f"{path} has a header but no points.")
    meanings = section.meanings
    rows, faults = _values(layout, lines, meanings)
    rows = [given | row for row in rows]  # of a word's own size before that of all points
    refuse(path, [*faults, *doubled_names(path, rows)])
    if not layout.is_own:
        check_unused(layout, [cells for _, cells in lines], given, meanings)
        for doubt in () if section.check else role_doubts(layout, [cells for _, cells in lines]):
            warnings.warn(doubt, stacklevel=2)
    has_axes = "x" in layout.columns
    layout, rows = placed(layout, with_check_points(path, rows, section.check), trajectory)
    points = [(f"{shown(row['name'])} of {path}", row) for row in rows]
    faults = [(who, fault) for who, row in points for fault in row_faults(row)]
    unknown = unknown_words(layout, [cells for _, cells in lines], meanings)
    others = [row | {"kind": next(iter(WORDS["kind"])), "role": ROLES[0]} for row in rows]
    is_mended = not any(fault for row in others for fault in row_faults(row))
    refuse(path, faults, word_places(unknown) if is_mended else ())
    for doubt in row_doubts(path, rows):
        warnings.warn(doubt, stacklevel=2)
    control, check = (_points([row for row in rows if row["role"] == role]) for role in ROLES)
    if layout.sheet is None and layout.encoding != "utf-16":
        warn_of_cut(path)
    is_plain = layout.is_own and not layout.unused
    if is_plain:
        sentence = None
    else:
        sentence = sentence_on(layout, has_axes, given, section.check)
    return ControlList(control, check, sentence)


def holds_points(path: str | Path) -> bool:
    """Whether a file holds more than a header; an empty one stands for no control at all.

    Parameters
    ----------
    path : path

    Returns
    -------
    bool
    """
    if as_path(path).suffix.lower() == SUFFIX:
        return True
    with open_file(path, ENCODING, errors="replace") as file:
        lines = (line for line in file if line.strip(" \t\r\n,;"))
        first = [*zip(range(2), lines, strict=False)]
    return len(first) > 1 or any(len(re.findall(r"\d+[.,]\d", line)) > 1 for _, line in first)


def _values(layout, lines, meanings):
    """Rows of values by column, and pairs (line, what is wrong) of each cell that holds none."""
    rows = []
    faults = []
    for line, cells in lines:
        row = {}
        for name, i in layout.columns.items():
            try:
                row[name] = _value(layout, name, cells[i], meanings)
            except ValueError as fault:
                faults.append((line, str(fault)))
        kind = layout.columns.get("kind")
        if kind is None:
            word = None
        else:
            word = meanings.get(same_word(cells[kind]))
        if word is not None and word.size is not None:
            size = row.setdefault("size", word.size)
            if size != word.size:
                what = f"has the size {size:g} m, and the word for its kind means {word.size:g} m."
                faults.append((line, what))
        rows.append(row)
    return rows, faults


def _value(layout, name, cell, meanings):
    """Value of a cell: text, or the number of a column that holds numbers."""
    if name in WORDS:
        return meant(name, cell, meanings)
    if name == "name":
        if not cell:
            raise ValueError("has no name.")
        return cell
    if name in NORMAL and not cell:
        return np.nan
    try:
        number = layout.number(cell) * layout.factors.get(name, 1.0)
    except ValueError:
        angle = " It looks like an angle: project it to m, in the crs of survey.toml."
        way_out = angle * bool(SEXAGESIMAL.match(cell))
        raise ValueError(
            f"has the {name} '{shown(cell)}', which is not a number.{way_out}"
        ) from None
    if not np.isfinite(number) and name not in NORMAL:
        raise ValueError(f"has the {name} '{shown(cell)}', which is not a finite number.")
    return number


def _points(rows):
    """ControlPoints of rows; no row gives an empty one."""

    def numbers(*names):
        table = [[row.get(name, np.nan) for name in names] for row in rows]
        return np.array(table, dtype=float).reshape(len(rows), len(names))

    normal = numbers(*NORMAL)
    return ControlPoints(
        name=tuple(row["name"] for row in rows),
        position=numbers(*AXES),
        sigma=numbers("sigma_horizontal", "sigma_horizontal", "sigma_vertical"),
        kind=tuple(row["kind"] for row in rows),
        size=numbers("size")[:, 0],
        normal=normal / np.linalg.norm(normal, axis=1, keepdims=True),
    )


NO_POINTS = _points([])
NOTHING_SURVEYED = ControlList(NO_POINTS, NO_POINTS)
