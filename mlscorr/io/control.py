"""Surveyed targets from control.csv, and from lists as others write them."""

import re
import warnings
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.io.column_names import AXES, CONTROL_NAMES, WORDS, meant
from mlscorr.io.control_lists import (
    HINTS,
    SIGMAS,
    check_unused,
    complete,
    lacking,
    placed,
    sentence_on,
    unnamed_columns,
    with_check_points,
)
from mlscorr.io.nearness import check_together
from mlscorr.io.opening import open_file
from mlscorr.io.settings import SETTINGS
from mlscorr.io.sheets import SUFFIX
from mlscorr.io.storage import as_path
from mlscorr.io.survey_sections import ControlSection
from mlscorr.io.table_rows import read_rows
from mlscorr.io.tables import read_layout
from mlscorr.io.text_files import ENCODING, nearest, shown, warn_of_cut
from mlscorr.survey import ControlPoints, Trajectory

COLUMNS = ("name", *AXES, *SIGMAS, "kind", "size", "role")
NORMAL = ("normal_e", "normal_n", "normal_h")
ROLES = tuple(WORDS["role"])
AMBIGUOUS = {"cp": " It is short for control point and for check point alike: write gcp or check."}
NOTHING_GIVEN = ControlSection(file="")


class ControlList(NamedTuple):
    """The points of a file, and what was understood of it.

    Parameters
    ----------
    control, check : ControlPoints
        Either may be empty.
    layout : str or None
        A sentence; None for a file in our own columns, of which nothing had to be understood.
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
        Of sigmas with which points hardly count, and of points at one place.
    """
    rules = CONTROL_NAMES, lacking, section.columns.chosen, unnamed_columns, HINTS
    layout = read_layout(path, COLUMNS, (NORMAL,), *rules)
    layout, given = (layout, {}) if layout.is_own else complete(layout, section, NORMAL)
    lines = list(read_rows(layout, exact=True))
    if not lines:
        raise ValueError(f"{path} has a header but no points.")
    rows, faults = _values(layout, lines)
    rows = [row | given for row in rows]
    _refuse(path, [*faults, *_doubled(path, rows)])
    if not layout.is_own:
        check_unused(layout, [cells for _, cells in lines], given)
    has_axes = "x" in layout.columns
    layout, rows = placed(layout, with_check_points(path, rows, section.check), trajectory)
    _refuse(path, [fault for row in rows for fault in _faults(path, row)])
    for doubt in _doubts(path, rows):
        warnings.warn(doubt, stacklevel=2)
    control, check = (_points([row for row in rows if row["role"] == role]) for role in ROLES)
    if layout.sheet is None and layout.encoding != "utf-16":
        warn_of_cut(path)
    sentence = None if layout.is_own else sentence_on(layout, has_axes, given, section.check)
    return ControlList(control, check, sentence)


def read_surveyed(
    path: Path | None, section: ControlSection, trajectory: Trajectory
) -> ControlList:
    """Points of a list that lies near a trajectory; none of none, and of an empty file.

    Parameters
    ----------
    path : Path or None
    section : ControlSection
    trajectory : Trajectory

    Raises
    ------
    ValueError
        As of read_control and check_together.
    """
    if path is None or not holds_points(path):
        return NOTHING_SURVEYED
    points = read_control(path, section, trajectory)
    check_together(path, points.control + points.check, trajectory)
    return points


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


def _values(layout, lines):
    """Rows of values by column, and a sentence on each cell that holds none."""
    rows, faults = [], []
    for line, cells in lines:
        row = {}
        for name, i in layout.columns.items():
            try:
                row[name] = _value(layout, line, name, cells[i])
            except ValueError as fault:
                faults.append(str(fault))
        rows.append(row)
    return rows, faults


def _refuse(path, faults):
    """Raise all that is wrong with the rows of a file at once, if anything is."""
    number, limit = len(faults), SETTINGS.named_faults
    if number > 1:
        more = [f"And {number - limit} more like these."] if number > limit else []
        faults = [f"{path} has {number} faults.", *faults[:limit], *more]
    if faults:
        raise ValueError(" ".join(faults))


def _doubled(path, rows):
    """A sentence on names that stand more than once."""
    count = Counter(row.get("name", "") for row in rows)
    doubled = [name for name, number in count.items() if number > 1 and name]
    if doubled:
        yield (
            f"{path} names {shown(', '.join(doubled))} more than once; every control or check "
            "point needs a name of its own."
        )


def _value(layout, line, name, cell):
    """Value of a cell: text, or the number of a column that holds numbers."""
    if name in WORDS:
        return meant(name, cell)
    if name == "name":
        if not cell:
            raise ValueError(f"{line} has no name.")
        return cell
    if name in NORMAL and not cell:
        return np.nan
    try:
        number = layout.number(cell) * layout.factors.get(name, 1.0)
    except ValueError:
        raise ValueError(f"{line} has the {name} '{shown(cell)}', which is not a number.") from None
    if not np.isfinite(number) and name not in NORMAL:
        raise ValueError(f"{line} has the {name} '{shown(cell)}', which is not a finite number.")
    return number


def _faults(path, row):
    """A sentence on each value of a row that can't be meant."""
    who, (smallest, largest) = f"{shown(row['name'])} of {path}", SETTINGS.target_size
    for key, words in WORDS.items():
        if row[key] not in words:
            near = nearest(row[key], words) if key == "kind" else None  # words of roles are alike
            yield (
                f"{who} has the unknown {key} '{shown(row[key])}'; known are {_known(words)}."
                f"{f' Is {near} meant?' if near else ''}{AMBIGUOUS.get(row[key], '')}"
            )
    if not smallest <= row["size"] <= largest:
        yield (
            f"{who} has the size {row['size']:g} m, outside [{smallest:g}, {largest:g}] m: "
            f"{_likely_unit(row['size'])}"
        )
    for key in AXES:
        if abs(row[key]) > SETTINGS.largest_coordinate:
            yield (
                f"{who} has the {key} {row[key]:g} m, beyond {SETTINGS.largest_coordinate:g} m: "
                "no map reaches that far (millimetres?)."
            )
    for key in SIGMAS:
        if row[key] <= 0:
            yield f"{who} has the {key} {row[key]:g} m; it must be greater than zero."
    normal = [row.get(name, np.nan) for name in NORMAL]
    if np.isfinite(normal).any() and not (np.isfinite(normal).all() and np.any(normal)):
        yield f"{who} has the normal {normal}; give three numbers, not all zero, or none."


def _known(words):
    """Our words, each with those of others."""
    listed = [f"{our} ({', '.join(others.split())})" for our, others in words.items() if others]
    return ", ".join([*listed, *(our for our, others in words.items() if not others)])


def _doubts(path, rows):
    """A sentence on sigmas with which points hardly count, and one on points at one place."""
    coarse = [(row, key) for row in rows for key in SIGMAS if row[key] > SETTINGS.coarse_sigma]
    for row, key in coarse[:1]:
        yield (
            f"{shown(row['name'])} of {path} has the {key} {row[key]:g} m and will hardly count "
            f"(millimetres?){f', nor will {len(coarse) - 1} more sigmas' * (len(coarse) > 1)}."
        )
    smallest = SETTINGS.target_size[0]  # m: nearer to one another two targets can't be
    near = cKDTree([[row[axis] for axis in AXES] for row in rows]).query_pairs(smallest)
    pairs = [[rows[i] for i in pair] for pair in sorted(near)]
    twice = [f"{a['name']} and {b['name']}" for a, b in pairs if a["kind"] == b["kind"]]
    if twice:
        yield (
            f"{path} gives one place two names: {shown(', '.join(twice))}. No observation tells "
            "them apart, so neither counts: leave one of the two out."
        )


def _likely_unit(size):
    """What may be meant by a size that can't be metres."""
    if size <= 0:
        return "a diameter or edge is positive."
    smallest, largest = SETTINGS.target_size
    sizes = {"centimetres": size / 100, "millimetres": size / 1000}
    usual = np.sqrt(smallest * largest)
    unit = min(sizes, key=lambda unit: abs(np.log(sizes[unit] / usual)))
    if smallest <= sizes[unit] <= largest:
        return f"{unit}? Then give {sizes[unit]:g}."
    return "sizes are in metres; is the decimal point misplaced, or another unit meant?"


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
