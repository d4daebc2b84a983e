"""Foreign control lists: missing columns, order of axes, and interpretation."""

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
    """Error: the trajectory does not show which of X and Y is easting."""


def lacking(names: Collection[str]) -> list[str]:
    """Parts of a point's name and position that the columns do not give.

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
        Cells of its first row.

    Returns
    -------
    dict
        Empty for other rows.
    """
    if len(cells) < 4 or not cells[0] or not all(map(NUMBER.fullmatch, cells[1:4])):
        return {}
    return dict(zip(("name", *_UNNAMED_AXES, "height"), range(4), strict=True))


def complete(
    layout: TableLayout, section: ControlSection, group: Sequence[str]
) -> tuple[TableLayout, dict[str, Any]]:
    """Used columns of a list, and values for all points from survey.toml.

    Without a column of roles, all points are control points.

    Parameters
    ----------
    layout : TableLayout
    section : ControlSection
    group : sequence of str
        Names of columns that are only used together.

    Returns
    -------
    layout : TableLayout
    given : dict
        Name of a column to the value for all points.

    Raises
    ------
    ValueError
        If neither gives a value.
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
    """True if the words in the column of kinds give each point's size."""
    if "kind" not in layout.columns:
        return False
    words = (meanings.get(same_word(cell)) for cell in _cells(rows, layout.columns["kind"]))
    return all(word is not None and word.size is not None for word in words)


def _unstated(layout, rows, missing, meanings):
    """Error on values that neither a list nor survey.toml gives."""
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
    elif "kind" in layout.columns:  # its words are also unknown
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
    """Position of the single unused column with few different words in all rows, otherwise None."""
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
    """Pairs (column, word) of a list's unknown roles and kinds, each once, in order.

    Parameters
    ----------
    layout : TableLayout
    rows : sequence of sequences of str
        Rows with all cells.
    meanings : mapping
        See ControlSection.
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
    """Keys of survey.toml that give words of an office their meanings.

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
    """Possible meanings of a word, the most likely first."""
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
    """Refuse an unused column with roles or kinds that differ from the given ones.

    Parameters
    ----------
    layout : TableLayout
    rows : sequence of sequences of str
        Rows with all cells.
    given : mapping
        Name of a column to the value for all points.
    meanings : mapping
        See ControlSection.

    Raises
    ------
    OpenQuestion
        Names the column.
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
    """Yield a sentence on each unused column with few different words, if none is the roles.

    Parameters
    ----------
    layout : TableLayout
    rows : sequence of sequences of str
        Rows with all cells.
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
    """Pairs (role or kind, position) of unused columns that contain only such words."""
    for name in (name for name in WORDS if name not in layout.columns):
        for i in layout.unused:
            words = {meant(name, cell, meanings) for cell in _cells(rows, i)}
            if words and words <= set(WORDS[name]):
                yield name, i


def _cells(rows, i):
    """Different cells of a column, in rows that have it."""
    return {row[i] for row in rows if i < len(row)}


def with_check_points(
    path: str | Path, rows: Sequence[dict[str, Any]], patterns: Sequence[str]
) -> list[dict[str, Any]]:
    """Return rows with the points that survey.toml names as check points.

    Parameters
    ----------
    path : path
    rows : sequence of dict
    patterns : sequence of str
        Names, or patterns of names.

    Raises
    ------
    ValueError
        If a pattern matches no point.
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
    """Return a list with X and Y as easting and northing, from the trajectory, and two sigmas.

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
        If the trajectory does not determine them.
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
    """X and Y in the order easting, northing."""
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
    """Sentence on the interpretation of a list, and on values for all points from survey.toml.

    Parameters
    ----------
    layout : TableLayout
    has_axes : bool
        True if the trajectory determined easting and northing.
    given : mapping
    patterns : sequence of str
        Patterns of check points.
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
