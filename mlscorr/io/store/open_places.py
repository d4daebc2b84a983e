"""Open places of a survey.toml: keys whose values only the user knows."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mlscorr.survey import SurveyFileError

MARK = "?"  # stands for a value that is still open; no key can have it


@dataclass(frozen=True)
class OpenPlace:
    """A key of survey.toml whose value only the user knows.

    Parameters
    ----------
    keys : tuple of str
        Sections and key, from the outermost.
    examples : tuple
        Values that it may have, the likeliest first; empty where none can be named.
    about : str
        Meaning of the value, in a few words.
    """

    keys: tuple[str, ...]
    examples: tuple[Any, ...] = ()
    about: str = ""

    @property
    def key(self) -> str:
        """The dotted key, as TOML has it.

        Examples
        --------
        >>> OpenPlace(("control", "words", "Tafel 0,6")).key
        'control.words."Tafel 0,6"'
        """
        return ".".join(map(_quoted, self.keys))

    @property
    def option(self) -> str:
        """The option of init that gives the value.

        Examples
        --------
        >>> OpenPlace(("control", "size"), (0.6,)).option
        "--set 'control.size = 0.6'"
        """
        if self.examples:
            value = json.dumps(self.examples[0], ensure_ascii=False)
        else:
            value = "..."
        return f"--set '{self.key} = {value}'"

    def __str__(self) -> str:
        values = ", ".join(json.dumps(value, ensure_ascii=False) for value in self.examples)
        if self.about and values:
            return f"{self.about}: {values}"
        return self.about or values


PLACE_OF_CRS = OpenPlace(("crs",), (), 'projected CRS of cloud and control, as "EPSG:32650"')


class OpenQuestion(ValueError):
    """A fault of the input that values in survey.toml can mend.

    Parameters
    ----------
    sentence : str
    places : sequence of OpenPlace
        What survey.toml must say; empty where it can't mend the fault.
    """

    def __init__(self, sentence: str, places: Sequence[OpenPlace] = ()):
        super().__init__(sentence)
        self.places = tuple(places)


def places_of(error: BaseException) -> tuple[OpenPlace, ...]:
    """Places whose values can mend what an error names.

    Parameters
    ----------
    error : exception
    """
    if isinstance(error, OpenQuestion):
        return error.places
    return ()


def check_answered(path: Path, document: Mapping[str, Any]) -> None:
    """Refuse a TOML document with open places.

    Parameters
    ----------
    path : Path
        For the message.
    document : mapping

    Raises
    ------
    SurveyFileError
        Names all of them.
    """
    keys = [OpenPlace(keys).key for keys in _open_keys(document, ())]
    if keys:
        if len(keys) == 1:
            number = "1 open place"
        else:
            number = f"{len(keys)} open places"
        raise SurveyFileError(
            f'{path} has {number}: {", ".join(keys)}. Replace each "{MARK}" with the value; the '
            "comment behind it names what is possible."
        )


def _open_keys(value, keys):
    """Keys of the values that are still open, sections in lists numbered from 1."""
    if value == MARK:
        return [keys]
    if isinstance(value, Mapping):
        return [path for key, part in value.items() for path in _open_keys(part, (*keys, key))]
    if isinstance(value, list):
        numbered = enumerate(value, start=1)
        return [path for n, part in numbered for path in _open_keys(part, (*keys, str(n)))]
    return []


def _quoted(key):
    """A key as TOML has it: bare where it can be."""
    is_bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    if is_bare:
        return key
    return json.dumps(key, ensure_ascii=False)
