"""Surveyed targets from control.csv, and from foreign lists.

All faults in the rows of a list are reported together, and doubtful values cause warnings.
"""

import re
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import (
    ENCODING,
    OpenPlace,
    OpenQuestion,
    as_path,
    nearest,
    open_file,
    shown,
    warn_of_cut,
)
from mlscorr.io.tables.column_names import CONTROL_NAMES, WORDS, ControlSection, meant, same_word
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
from mlscorr.io.tables.table_rows import SUFFIX, read_rows
from mlscorr.survey import AXES, ControlPoints, Trajectory

_OWN_WORDS = "Define the list's own words under [control] words in survey.toml."
_AMBIGUOUS = {"cp": " It may mean control point or check point: write gcp or check."}
COLUMNS = ("name", *AXES, *SIGMAS, "kind", "size", "role")
_ROLES = tuple(WORDS["role"])
_SEXAGESIMAL = re.compile(r"-?\d{1,3}[°: ]\s*\d{1,2}['′: ]")  # degrees and minutes
_NOTHING_GIVEN = ControlSection(file="")


class ControlList(NamedTuple):
    """Points of a file, and the interpretation of its layout.

    Parameters
    ----------
    control, check : ControlPoints
        Either may be empty.
    layout : str or None
        A sentence; None for a file with only our own columns.
    """

    control: ControlPoints
    check: ControlPoints
    layout: str | None = None


def read_control(
    path: str | Path, section: ControlSection = _NOTHING_GIVEN, trajectory: Trajectory | None = None
) -> ControlList:
    """Read the points of control.csv, or of a list from total stations and offices.

    Parameters
    ----------
    path : path
        Text with any separator, or .xlsx.
    section : ControlSection, optional
        Values for all points, and columns, stated in survey.toml.
    trajectory : Trajectory, optional
        Determines which of X and Y is easting.

    Returns
    -------
    ControlList

    Raises
    ------
    ValueError
        For missing columns, missing or repeated names, cells that are not numbers, an unknown kind
        or role, sizes and sigmas that cannot be in meters, and ambiguous layouts.

    Warns
    -----
    UserWarning
        For sigmas so large that points hardly count, points at the same position, and an unused
        column that may contain roles.
    """
    chosen = section.columns.chosen
    layout = read_layout(
        path, COLUMNS, (NORMAL,), CONTROL_NAMES, lacking, chosen, unnamed_columns, HINTS
    )
    given = {}
    if not layout.is_own:
        layout, given = complete(layout, section, NORMAL)
    lines = list(read_rows(layout, exact=True))
    if not lines:
        raise ValueError(f"{path} has a header but no points.")
    meanings = section.meanings
    rows, faults = _values(layout, lines, meanings)
    rows = [given | row for row in rows]  # a word's own size has priority over that of all points
    _refuse(path, [*faults, *_doubled_names(path, rows)])
    all_cells = [cells for _, cells in lines]
    if not layout.is_own:
        check_unused(layout, all_cells, given, meanings)
        if not section.check:
            for doubt in role_doubts(layout, all_cells):
                warnings.warn(doubt, stacklevel=2)
    has_axes = "x" in layout.columns
    layout, rows = placed(layout, with_check_points(path, rows, section.check), trajectory)
    faults = [
        (f"{shown(row['name'])} of {path}", fault) for row in rows for fault in _row_faults(row)
    ]
    others = [row | {"kind": next(iter(WORDS["kind"])), "role": _ROLES[0]} for row in rows]
    places = []
    if not any(fault for row in others for fault in _row_faults(row)):  # only words are wrong
        places = word_places(unknown_words(layout, all_cells, meanings))
    _refuse(path, faults, places)
    for doubt in _row_doubts(path, rows):
        warnings.warn(doubt, stacklevel=2)
    control, check = (_points([row for row in rows if row["role"] == role]) for role in _ROLES)
    if layout.sheet is None and layout.encoding != "utf-16":
        warn_of_cut(path)
    sentence = None
    if not layout.is_own or layout.unused:
        sentence = sentence_on(layout, has_axes, given, section.check)
    return ControlList(control, check, sentence)


def holds_points(path: str | Path) -> bool:
    """True if a file has more than a header; an empty one means no control.

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
    """Rows of values by column, and pairs (line, fault) of invalid cells."""
    rows = []
    faults = []
    for line, cells in lines:
        row = {}
        for name, i in layout.columns.items():
            try:
                row[name] = _value(layout, name, cells[i], meanings)
            except ValueError as fault:
                faults.append((line, str(fault)))
        word = None
        if "kind" in layout.columns:
            word = meanings.get(same_word(cells[layout.columns["kind"]]))
        if word is not None and word.size is not None:
            size = row.setdefault("size", word.size)
            if size != word.size:
                what = f"has the size {size:g} m, but its kind implies {word.size:g} m."
                faults.append((line, what))
        rows.append(row)
    return rows, faults


def _value(layout, name, cell, meanings):
    """Value of a cell: text, or the number of a numeric column."""
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
        remedy = ""
        if _SEXAGESIMAL.match(cell):
            remedy = " It looks like an angle: project it to m, in the crs of survey.toml."
        raise ValueError(
            f"has the {name} '{shown(cell)}', which is not a number.{remedy}"
        ) from None
    if not np.isfinite(number) and name not in NORMAL:
        raise ValueError(f"has the {name} '{shown(cell)}', which is not a finite number.")
    return number


def _points(rows):
    """ControlPoints of rows; empty without rows."""

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


class ListError(OpenQuestion):
    """Faults in the rows of a file, and their number.

    Parameters
    ----------
    sentence : str
    number : int
    places : sequence of OpenPlace
        Values to add to survey.toml if that corrects all of them.
    """

    def __init__(self, sentence: str, number: int, places: Sequence[OpenPlace] = ()):
        super().__init__(sentence, places)
        self.number = number


def _refuse(
    path: str | Path, faults: Iterable[tuple[object, str]], places: Sequence[OpenPlace] = ()
) -> None:
    """Raise all faults in the rows of a file together, with similar ones combined."""
    groups: dict[str, list[object]] = {}
    for who, what in faults:
        groups.setdefault(what, []).append(who)
    sentences = []
    for what, (who, *others) in groups.items():
        if others:
            sentences.append(f"{who} and {len(others)} more have{what.removeprefix('has')}")
        else:
            sentences.append(f"{who} {what}")
    number = len(sentences)
    limit = SETTINGS.named_faults
    if number > 1:
        sentences = [f"{path} has {number} faults.", *sentences[:limit]]
    if number > limit:
        sentences.append(f"And {number - limit} more of this kind.")
    if places:
        sentences.append(_OWN_WORDS)
    if sentences:
        raise ListError(" ".join(sentences), number, places)


def _doubled_names(path, rows):
    """Pair (file, fault) of repeated names."""
    count = Counter(row.get("name", "") for row in rows)
    doubled = [name for name, number in count.items() if number > 1 and name]
    if doubled:
        names = shown(", ".join(doubled))
        yield path, f"lists {names} more than once; every point needs its own name."


def _row_faults(row):
    """Faults of each implausible value in a point's row."""
    smallest, largest = SETTINGS.target_size
    for key, words in WORDS.items():
        if row[key] not in words:
            hint = _AMBIGUOUS.get(row[key], "")
            if key == "kind" and (near := nearest(row[key], words)):  # roles are similar
                hint = f" Did you mean {near}?{hint}"
            yield f"has the unknown {key} '{shown(row[key])}'; known are {_known(words)}.{hint}"
    if not smallest <= row["size"] <= largest:
        yield (
            f"has the size {row['size']:g} m, outside [{smallest:g}, {largest:g}] m: "
            f"{_likely_unit(row['size'])}"
        )
    for key in AXES:
        if abs(row[key]) > SETTINGS.largest_coordinate:
            yield (
                f"has the {key} {row[key]:g} m, beyond {SETTINGS.largest_coordinate:g} m, the "
                "largest on any map (millimeters?)."
            )
    for key in SIGMAS:
        if row[key] <= 0:
            yield f"has the {key} {row[key]:g} m; it must be greater than zero."
    normal = [row.get(name, np.nan) for name in NORMAL]
    if np.isfinite(normal).any() and not (np.isfinite(normal).all() and np.any(normal)):
        yield f"has the normal {normal}; give three numbers, not all zero, or none."


def _known(words):
    """Our words, each with foreign ones."""
    translated = [f"{our} ({', '.join(others)})" for our, others in words.items() if others]
    untranslated = [our for our, others in words.items() if not others]
    return ", ".join([*translated, *untranslated])


def _likely_unit(size):
    """Likely unit of a size that cannot be in meters."""
    if size <= 0:
        return "it must be positive."
    smallest, largest = SETTINGS.target_size
    sizes = {"centimeters": size / 100, "millimeters": size / 1000}
    usual = np.sqrt(smallest * largest)
    unit = min(sizes, key=lambda unit: abs(np.log(sizes[unit] / usual)))
    if smallest <= sizes[unit] <= largest:
        return f"{unit}? Then give {sizes[unit]:g}."
    return "sizes are in meters; the decimal point may be misplaced or the unit wrong."


def _row_doubts(path, rows):
    """Sentences on sigmas so large that points hardly count, and on points at the same position."""
    coarse = [(row, key) for row in rows for key in SIGMAS if row[key] > SETTINGS.coarse_sigma]
    if coarse:
        row, key = coarse[0]
        others = ""
        if len(coarse) > 1:
            others = f"; {len(coarse) - 1} more sigmas are as large"
        yield (
            f"{shown(row['name'])} of {path} has the {key} {row[key]:g} m and almost no weight "
            f"(millimeters?){others}."
        )
    smallest = SETTINGS.target_size[0]  # m: two targets cannot be closer together
    near = cKDTree([[row[axis] for axis in AXES] for row in rows]).query_pairs(smallest)
    pairs = [[rows[i] for i in pair] for pair in sorted(near)]
    twice = [f"{a['name']} and {b['name']}" for a, b in pairs if a["kind"] == b["kind"]]
    if twice:
        yield (
            f"{path} has two names for one position: {shown(', '.join(twice))}. Observations "
            "can't distinguish them, so neither is used: remove one of the two."
        )
