"""What is wrong in the rows of control lists, and what is doubtful."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import OpenPlace, OpenQuestion, nearest, shown
from mlscorr.io.tables.column_names import WORDS
from mlscorr.io.tables.control_lists import NORMAL, SIGMAS
from mlscorr.survey import AXES

OWN_WORDS = "Say under [control] words in survey.toml what an office's own words mean."
AMBIGUOUS = {"cp": " It is short for control point and for check point alike: write gcp or check."}


class ListError(OpenQuestion):
    """Faults in the rows of a file, and their number.

    Parameters
    ----------
    sentence : str
    number : int
    places : sequence of OpenPlace
        What survey.toml must say, where that mends all of them.
    """

    def __init__(self, sentence: str, number: int, places: Sequence[OpenPlace] = ()):
        super().__init__(sentence, places)
        self.number = number


def refuse(
    path: str | Path, faults: Iterable[tuple[object, str]], places: Sequence[OpenPlace] = ()
) -> None:
    """Raise all that is wrong with the rows of a file at once, what is wrong alike as one.

    Parameters
    ----------
    path : path
    faults : iterable of (str, str)
        Who has it, and what is wrong: words that begin with has.
    places : sequence of OpenPlace
        As of ListError.

    Raises
    ------
    ListError
        Where anything is.
    """
    groups: dict[str, list[object]] = {}
    for who, what in faults:
        groups.setdefault(what, []).append(who)
    sentences = [
        f"{who} {what}" if not more else f"{who} and {len(more)} more have{what[len('has') :]}"
        for what, (who, *more) in groups.items()
    ]
    number = len(sentences)
    limit = SETTINGS.named_faults
    if number > 1:
        if number > limit:
            more = [f"And {number - limit} more like these."]
        else:
            more = []
        sentences = [f"{path} has {number} faults.", *sentences[:limit], *more]
    if places:
        sentences.append(OWN_WORDS)
    if sentences:
        raise ListError(" ".join(sentences), number, places)


def doubled_names(path: str | Path, rows: Sequence[dict[str, Any]]) -> Iterator[tuple[object, str]]:
    """The pair (file, what is wrong) of names that stand more than once.

    Parameters
    ----------
    path : path
    rows : sequence of dict
    """
    count = Counter(row.get("name", "") for row in rows)
    doubled = [name for name, number in count.items() if number > 1 and name]
    if doubled:
        names = shown(", ".join(doubled))
        yield path, f"names {names} more than once; every point needs a name of its own."


def row_faults(row: dict[str, Any]) -> Iterator[str]:
    """What is wrong with each value of a point's row that can't be meant.

    Parameters
    ----------
    row : dict
    """
    smallest, largest = SETTINGS.target_size
    for key, words in WORDS.items():
        if row[key] not in words:
            near = nearest(row[key], words) if key == "kind" else None  # words of roles are alike
            yield (
                f"has the unknown {key} '{shown(row[key])}'; known are {_known(words)}."
                f"{f' Is {near} meant?' if near else ''}{AMBIGUOUS.get(row[key], '')}"
            )
    if not smallest <= row["size"] <= largest:
        yield (
            f"has the size {row['size']:g} m, outside [{smallest:g}, {largest:g}] m: "
            f"{_likely_unit(row['size'])}"
        )
    for key in AXES:
        if abs(row[key]) > SETTINGS.largest_coordinate:
            yield (
                f"has the {key} {row[key]:g} m, beyond {SETTINGS.largest_coordinate:g} m: "
                "no map reaches that far (millimetres?)."
            )
    for key in SIGMAS:
        if row[key] <= 0:
            yield f"has the {key} {row[key]:g} m; it must be greater than zero."
    normal = [row.get(name, np.nan) for name in NORMAL]
    if np.isfinite(normal).any() and not (np.isfinite(normal).all() and np.any(normal)):
        yield f"has the normal {normal}; give three numbers, not all zero, or none."


def row_doubts(path: str | Path, rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """A sentence on sigmas with which points hardly count, and one on points at one place.

    Parameters
    ----------
    path : path
    rows : sequence of dict
    """
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


def _known(words):
    """Our words, each with those of others."""
    translated = [f"{our} ({', '.join(others)})" for our, others in words.items() if others]
    untranslated = [our for our, others in words.items() if not others]
    return ", ".join([*translated, *untranslated])


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
