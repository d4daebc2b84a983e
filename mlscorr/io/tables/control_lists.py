"""Control lists of others: what they lack, which axis is which, and what was understood."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import OpenPlace, OpenQuestion, listed, shown
from mlscorr.io.tables.column_names import (
    CONTROL_NAMES,
    WORDS,
    ControlSection,
    OfficeWord,
    meant,
    same_word,
)
from mlscorr.io.tables.layout_search import missing_sentence
from mlscorr.io.tables.nearness import distance_of
from mlscorr.io.tables.table_rows import NUMBER, TableLayout, read_rows
from mlscorr.survey import AXES, SurveyFileError, Trajectory

SIGMAS = ("sigma_horizontal", "sigma_vertical")
NORMAL = ("normal_e", "normal_n", "normal_h")
HINTS = {("easting", "latitude"): (" Project latitude and longitude first.", ())}
_EXAMPLES = {
    **dict.fromkeys(SIGMAS, "sigma = [0.003, 0.004] (horizontal, vertical)"),
    **{"kind": 'kind = "circle"', "size": "size = 0.6"},
}
_PLACES = {
    **dict.fromkeys(
        SIGMAS,
        OpenPlace(("control", "sigma"), ([0.003, 0.004],), "m, 1 sigma: E and N each, height"),
    ),
    "kind": OpenPlace(("control", "kind"), tuple(WORDS["kind"]), "shape of all targets"),
    "size": OpenPlace(("control", "size"), (0.6,), "m, diameter or edge of all targets"),
}
_UNNAMED_AXES = ("x", "y")  # either may point east


class AxesError(OpenQuestion):
    """The trajectory does not tell which of X and Y is easting."""


def lacking(names: Collection[str]) -> list[str]:
    """What names of columns leave missing of a point's name and place.

    Parameters
    ----------
    names : collection of str
    """
    present = set(names)
    if present.issuperset(_UNNAMED_AXES):
        present.update(AXES[:2])
    return [name for name in ("name", *AXES) if name not in present]


def unnamed_columns(cells: Sequence[str]) -> dict[str, int]:
    """Columns of a list without a header: name and three numbers, as total stations write them.

    Parameters
    ----------
    cells : sequence of str
        Of its first row.

    Returns
    -------
    dict
        Empty where they are something else.
    """
    if len(cells) < 4 or not cells[0] or not all(map(NUMBER.fullmatch, cells[1:4])):
        return {}
    return dict(zip(("name", *_UNNAMED_AXES, "height"), range(4), strict=True))


def complete(
    layout: TableLayout, section: ControlSection, group: Sequence[str]
) -> tuple[TableLayout, dict[str, Any]]:
    """The columns of a list that are used, and what survey.toml gives of all points instead.

    Without a column of roles all points are control points.

    Parameters
    ----------
    layout : TableLayout
    section : ControlSection
    group : sequence of str
        Names of columns that are used together or not.

    Returns
    -------
    layout : TableLayout
    given : dict
        Name of a column to the value of all points.

    Raises
    ------
    ValueError
        For what neither gives.
    """
    columns = dict(layout.columns)
    needless = set()
    if not set(group) <= set(columns):
        needless.update(group)
    if {"easting", "northing"} <= set(columns):
        needless.update(_UNNAMED_AXES)
    columns = {name: i for name, i in columns.items() if name not in needless}
    horizontal, vertical = section.sigma or (None, None)
    given = {
        "sigma_horizontal": horizontal,
        "sigma_vertical": vertical,
        "kind": section.kind and meant("kind", section.kind),
        "size": section.size,
        "role": "control",
    }
    present = set(columns)
    if "sigma" in columns:
        present.update(SIGMAS)
    given = {name: value for name, value in given.items() if name not in present}
    missing = [name for name, value in given.items() if value is None]
    if missing:
        layout = replace(layout, columns=columns)
        rows = [cells for _, cells in read_rows(layout)]
        if "size" in missing and _are_sized(layout, rows, section.meanings):
            missing.remove("size")
            del given["size"]
    if missing:
        raise _unstated(layout, rows, missing, section.meanings)
    return replace(layout, columns=columns), given


def _are_sized(layout, rows, meanings):
    """Whether the words in the column of kinds give each point its size."""
    if "kind" not in layout.columns:
        return False
    words = (meanings.get(same_word(cell)) for cell in _cells(rows, layout.columns["kind"]))
    return all(word is not None and word.size is not None for word in words)


def _unstated(layout, rows, missing, meanings):
    """The error on what neither a list nor survey.toml says of its points."""
    header = layout.header
    used = set()
    if header:
        used = {header[i] for i in layout.columns.values()}
    seeming = {
        name: header[i] for name, i in _columns_of_words(layout, rows, meanings) if name in missing
    }
    sentence = missing_sentence(layout.path, header, missing, used, CONTROL_NAMES, seeming)
    values = ", ".join(dict.fromkeys(_EXAMPLES[name] for name in missing))
    sentence += (
        f" Values for all points can be set under [control] in survey.toml, lengths in m: {values}."
    )
    places = []
    if "kind" in missing and "kind" not in seeming and (column := _likely_kinds(layout, rows)):
        seeming["kind"] = header[column]
        words = {same_word(cell): cell for cell in _cells(rows, column)}
        first_words = listed(list(words.values()), SETTINGS.named_faults)
        sentence += (
            f" The column {shown(header[column])} contains {first_words}: set it as "
            "columns.kind, and define each word under [control] words."
        )
        places = word_places([("kind", cell) for cell in words.values()])
    elif "kind" in layout.columns:  # whose words are not known either
        places = word_places(unknown_words(layout, rows, meanings))
    examples = [OfficeWord.of(place.examples[0]) for place in places]
    sizes = [word.size for word in examples if word.column == "kind"]
    are_sized = bool(sizes) and None not in sizes
    for name in missing:
        if name in seeming:
            key = ("control", "columns", name)
            places.insert(0, OpenPlace(key, (seeming[name],), f"column of the {name}"))
        elif not (name == "size" and are_sized) and _PLACES[name] not in places:
            places.append(_PLACES[name])
    return OpenQuestion(sentence, places)


def _likely_kinds(layout, rows):
    """Position of the one column that isn't used and holds few words, in all rows; else None."""
    candidates = []
    for i in layout.unused:
        words = {same_word(cell) for cell in _cells(rows, i)}
        is_in_all = all(i < len(row) for row in rows)
        are_words = all(any(c.isalpha() for c in word) for word in words)
        if is_in_all and are_words and 2 * len(words) <= len(rows):
            candidates.append(i)
    if len(candidates) == 1:
        return candidates[0]
    return None


def unknown_words(
    layout: TableLayout, rows: Sequence[Sequence[str]], meanings: Mapping[str, OfficeWord]
) -> list[tuple[str, str]]:
    """Pairs (column, word) of a list's roles and kinds that are not known, each once, in order.

    Parameters
    ----------
    layout : TableLayout
    rows : sequence of sequences of str
        All cells.
    meanings : mapping
        As of ControlSection.
    """
    unknown: dict[tuple[str, str], str] = {}
    for name, words in WORDS.items():
        if name not in layout.columns:
            continue
        for row in rows:
            cell = row[layout.columns[name]]
            if meant(name, cell, meanings) not in words:
                unknown.setdefault((name, same_word(cell)), cell)
    return [(name, cell) for (name, _), cell in unknown.items()]


def word_places(words: Iterable[tuple[str, str]]) -> list[OpenPlace]:
    """Places of survey.toml that give words of an office their meanings.

    Parameters
    ----------
    words : iterable of (column, word)
    """
    places = []
    for name, word in words:
        examples = _likely_meanings(name, word)
        places.append(OpenPlace(("control", "words", word), examples, f"{name} of such points"))
    return places


def _likely_meanings(name, word):
    """Meanings that a word may have, the likeliest first."""
    kinds = list(WORDS[name])
    if name != "kind":
        return tuple(kinds)
    text = ""
    smallest, largest = SETTINGS.target_size
    if number := re.search(r"\d+(?:[.,]\d+)?", word):
        size = float(number[0].replace(",", "."))
        if smallest <= size <= largest:
            text = f" {size:g}"
    named = [kind for kind in kinds if any(meant("kind", part) == kind for part in word.split())]
    return tuple(f"{kind}{text}" for kind in dict.fromkeys([*named, *kinds]))


def check_unused(
    layout: TableLayout,
    rows: Sequence[Sequence[str]],
    given: Mapping[str, Any],
    meanings: Mapping[str, OfficeWord],
) -> None:
    """Refuse a column that isn't used but holds roles or kinds, and others than are given.

    Parameters
    ----------
    layout : TableLayout
    rows : sequence of sequences of str
        All cells.
    given : mapping
        Name of a column to the value of all points.
    meanings : mapping
        As of ControlSection.

    Raises
    ------
    OpenQuestion
        Names column and name.
    """
    for name, i in _columns_of_words(layout, rows, meanings):
        cells = {cell.casefold() for cell in _cells(rows, i)}
        if {meant(name, cell, meanings) for cell in cells} != {given.get(name)}:
            column = shown(layout.header[i])
            key = ("control", "columns", name)
            raise OpenQuestion(
                f"The column {column} of {layout.path} seems to be the {name}, because it "
                f"contains {', '.join(sorted(cells))}. Rename it {name}, or set columns.{name} = "
                f"'{column}' under [control] in survey.toml.",
                [OpenPlace(key, (layout.header[i],), f"column of the {name}")],
            )


def role_doubts(layout: TableLayout, rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """A sentence on each column that isn't used and holds few words, where none is the roles.

    Parameters
    ----------
    layout : TableLayout
    rows : sequence of sequences of str
        All cells.
    """
    if "role" in layout.columns:
        return
    for i in layout.unused:
        words = _cells(rows, i) - {""}
        column = shown(layout.header[i])
        is_few = 1 < len(words) <= len(WORDS["role"]) < len(rows)
        is_check = any(meant("role", word) == "check" for word in words)
        if is_check or (is_few and all(word.isalpha() for word in words)):
            yield (
                f"The column {column} of {layout.path} is not used, so all points are control "
                f"points, but it contains {shown(', '.join(sorted(words)))} and may identify "
                f"check points. If so, set columns.role = '{column}' under [control]."
            )


def _columns_of_words(layout, rows, meanings):
    """Pairs (role or kind, position of a column that isn't used and holds nothing but these)."""
    for name in (name for name in WORDS if name not in layout.columns):
        for i in layout.unused:
            words = {meant(name, cell, meanings) for cell in _cells(rows, i)}
            if words and words <= set(WORDS[name]):
                yield name, i


def _cells(rows, i):
    """The different cells of a column, in rows that reach it."""
    return {row[i] for row in rows if i < len(row)}


def with_check_points(
    path: str | Path, rows: Sequence[dict[str, Any]], patterns: Sequence[str]
) -> list[dict[str, Any]]:
    """Rows in which those points are check points that survey.toml names.

    Parameters
    ----------
    path : path
    rows : sequence of dict
    patterns : sequence of str
        Names, or patterns of names.

    Raises
    ------
    ValueError
        For a pattern that fits no point.
    """
    rows = list(rows)
    for pattern in patterns:
        places = [i for i, row in enumerate(rows) if fnmatchcase(row["name"], pattern)]
        if not places:
            raise SurveyFileError(
                f"control.check lists '{shown(pattern)}', but {path} has no such point."
            )
        for i in places:
            rows[i] = rows[i] | {"role": "check"}
    return rows


def placed(
    layout: TableLayout, rows: list[dict[str, Any]], trajectory: Trajectory | None
) -> tuple[TableLayout, list[dict[str, Any]]]:
    """A list whose columns X and Y are easting and northing by the trajectory, and its sigmas two.

    Parameters
    ----------
    layout : TableLayout
    rows : list of dict
    trajectory : Trajectory or None

    Returns
    -------
    layout : TableLayout
    rows : list of dict

    Raises
    ------
    ValueError
        Where the trajectory does not tell.
    """
    columns = dict(layout.columns)
    sources = {}
    if "x" in columns:
        sources = dict(zip(AXES, _axes_east_and_north(layout, rows, trajectory), strict=False))
        columns |= {name: columns.pop(axis) for name, axis in sources.items()}
    if "sigma" in columns:
        sources |= dict.fromkeys(SIGMAS, "sigma")
    rows = [row | {name: row[source] for name, source in sources.items()} for row in rows]
    return replace(layout, columns=columns), rows


def _axes_east_and_north(layout, rows, trajectory):
    """X and Y in the order in which they are easting and northing."""
    position = np.array([[row[axis] for axis in _UNNAMED_AXES] for row in rows])
    is_near = is_swapped_near = False
    if trajectory is not None:
        is_near = distance_of(position, trajectory) < SETTINGS.near
        is_swapped_near = distance_of(position[:, ::-1], trajectory) < SETTINGS.near
    if is_near and not is_swapped_near:
        return _UNNAMED_AXES
    if is_swapped_near and not is_near:
        return _UNNAMED_AXES[::-1]
    x, y = (layout.name_of(axis) for axis in _UNNAMED_AXES)
    places = []
    orders = "neither order is"
    if is_near:
        orders = "both orders are"
        if layout.header:
            places = [
                OpenPlace(("control", "columns", our), (x, y), f"column of the {our}")
                for our in AXES[:2]
            ]
    raise AxesError(
        f"{layout.path} does not state which of {x} and {y} is easting (X is east in some "
        f"countries and north in others), and {orders} within {SETTINGS.near / 1e3:g} km of the "
        "trajectory. Rename them easting and northing, or set them under [control.columns] in "
        "survey.toml.",
        places,
    )


def sentence_on(
    layout: TableLayout, has_axes: bool, given: Mapping[str, Any], patterns: Sequence[str]
) -> str:
    """What was understood of a list, and what survey.toml says of all points.

    Parameters
    ----------
    layout : TableLayout
    has_axes : bool
        Whether the trajectory told easting from northing.
    given : mapping
    patterns : sequence of str
        Of check points.
    """
    parts = [str(layout)]
    if has_axes:
        parts.append(", easting and northing identified by the trajectory")
    values = []
    for name, value in given.items():
        if isinstance(value, str):
            values.append(f"{name} {shown(value)}")
        else:
            values.append(f"{name} {value:g} m")
    if patterns:
        values.append(f"except check for {shown(', '.join(patterns))}")
    if values:
        parts.append(f"; for all points: {', '.join(values)}")
    return f"{''.join(parts)}{layout.not_used}."
