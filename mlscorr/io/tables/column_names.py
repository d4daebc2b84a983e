"""Foreign names and units of columns, and words in their cells.

All known words are in columns.toml in this folder, by language, for a surveyor to read and extend.
This module compares them with those of a table, and adds those that survey.toml states for it.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from importlib.resources import files
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from mlscorr.io.store import Column, Coordinate, Positive, TomlSection, shown

ANGLES = ("roll", "pitch", "heading")
_BRACKETS = re.compile(r"[\[(<]\s*([^\])>]*?)\s*[\])>]\s*$")


def plain(name: str) -> str:
    """Normalize a name: no case, width, final brackets, blanks or punctuation.

    Parameters
    ----------
    name : str

    Examples
    --------
    >>> plain("Pkt.-Nr."), plain("Höhe [m]"), plain("H-Ell"), plain("Nordwert (ETRS89/UTM)")
    ('pktnr', 'höhe', 'hell', 'nordwert')
    """
    words = _BRACKETS.sub("", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\s_.\-/:,'\"]+", "", words)


def _plain_words(*tables):
    """Our words with foreign ones, normalized; a word in several tables gets the words of all."""
    joined: dict[str, tuple[str, ...]] = {}
    for table in tables:
        for our, others in table.items():
            joined[our] = (*joined.get(our, ()), *map(plain, others))
    return joined


_KNOWN = tomllib.loads(files(__package__).joinpath("columns.toml").read_text(encoding="utf-8"))
CONTROL_NAMES = _plain_words(_KNOWN["place"], _KNOWN["control"])
TRAJECTORY_NAMES = _plain_words(_KNOWN["place"], _KNOWN["trajectory"])
WORDS = {column: _plain_words(words) for column, words in _KNOWN["words"].items()}  # of cells
UNITS = {  # to m, deg and s
    name: unit["size"] for our, unit in _KNOWN["units"].items() for name in (our, *unit["names"])
}
_REFUSED_UNITS = {name.casefold() for name in _KNOWN["refused"]["units"]}


def section_of(names: Collection[str]) -> str:
    """Section of survey.toml on a table with these names of columns.

    Parameters
    ----------
    names : collection of str
        CONTROL_NAMES or TRAJECTORY_NAMES.
    """
    if "name" in names:
        return "control"
    return "trajectory"


def unit_of(name: str) -> str | None:
    """Unit in brackets at the end of a name, known or foreign; None without one.

    Parameters
    ----------
    name : str

    Examples
    --------
    >>> unit_of("东坐标(m)"), unit_of("Elev [US survey ft]"), unit_of("Height (ellipsoidal)")
    ('m', 'us survey ft', None)
    """
    match = _BRACKETS.search(unicodedata.normalize("NFKC", name).casefold())
    unit = re.sub(r"^in\s+", "", match[1]) if match else ""  # as in: height (in m)
    if unit in UNITS or is_foreign(unit):
        return unit
    return None


def is_foreign(unit: str) -> bool:
    """True if a unit is not supported.

    Parameters
    ----------
    unit : str
    """
    return not _REFUSED_UNITS.isdisjoint(unit.split())


def find_meanings(
    cells: Sequence[str],
    names: Mapping[str, Collection[str]],
    chosen: Mapping[str, str | int] | None = None,
) -> dict[str, list[int]]:
    """Positions of the columns that each of our names may mean.

    A column with our own name has priority over others, and one chosen by the user over all.

    Parameters
    ----------
    cells : sequence of str
        A header.
    names : mapping
        Our name to normalized foreign names.
    chosen : mapping, optional
        Our name to the one in the header.

    Returns
    -------
    dict
        Without names that no column may mean.

    Examples
    --------
    >>> find_meanings(["Pkt", "X", "Y", "Elev", "H-Ell"], CONTROL_NAMES)
    {'x': [1], 'y': [2], 'height': [3, 4], 'name': [0]}
    """
    known = [plain(cell) for cell in cells]
    exact = [cell.strip().casefold() for cell in cells]
    meanings = {}
    for name, others in names.items():
        column = (chosen or {}).get(name)
        among = known
        words = others
        if column is not None:
            among = exact
            words = [str(column).strip().casefold()]
        elif plain(name) in known:
            words = [plain(name)]
        if positions := [i for i, cell in enumerate(among) if cell and cell in words]:
            meanings[name] = positions
    return meanings


class OfficeWord(NamedTuple):
    """Meaning of an office's own word for its points.

    Parameters
    ----------
    column : str
        One of WORDS.
    value : str
        Our word.
    size : float or None
        Of a target. Units: m.
    """

    column: str
    value: str
    size: float | None = None

    @classmethod
    def of(cls, text: str) -> OfficeWord:
        """Parse the meaning that survey.toml gives a word: a role, a kind, or a kind and its size.

        Parameters
        ----------
        text : str

        Raises
        ------
        ValueError
            For another text.

        Examples
        --------
        >>> OfficeWord.of("circle 0.6"), OfficeWord.of("check").column
        (OfficeWord(column='kind', value='circle', size=0.6), 'role')
        """
        word, _, size = text.strip().partition(" ")
        column = next((column for column in WORDS if meant(column, word) in WORDS[column]), None)
        try:
            number = float(size) if size else None
        except ValueError:
            column = None
        if column is None or (size and column != "kind"):
            kinds = ", ".join(WORDS["kind"])
            roles = " or ".join(WORDS["role"])
            raise ValueError(
                f"'{shown(text)}' is not a valid meaning: give a kind ({kinds}) and its size in "
                f'm, as "circle 0.6", or a role ({roles})'
            )
        return cls(column, meant(column, word), number)


def same_word(cell: str) -> str:
    """Normalize an office's word: no case, width or surplus blanks.

    Parameters
    ----------
    cell : str
    """
    return " ".join(unicodedata.normalize("NFKC", cell).casefold().split())


def meant(column: str, cell: str, words: Mapping[str, OfficeWord] | None = None) -> str:
    """Our word for the one in a cell of roles or kinds; otherwise the cell in lower case.

    Parameters
    ----------
    column : str
        One of WORDS.
    cell : str
    words : mapping, optional
        An office's own words, normalized by same_word, to their meanings.

    Examples
    --------
    >>> meant("role", "Check Point"), meant("role", "Kontrollpunkt"), meant("kind", "Kugel")
    ('check', 'check', 'kugel')
    """
    own = (words or {}).get(same_word(cell))
    if own is not None and own.column == column:
        return own.value
    known = (our for our, others in WORDS[column].items() if plain(cell) in (our, *others))
    return next(known, cell.casefold())


class PlaceColumns(TomlSection):
    """Our names of columns with those in a table, or with their numbers from 1."""

    easting: Column = None
    northing: Column = None
    height: Column = None

    @model_validator(mode="after")
    def _are_of_one_kind(self) -> Self:
        if len({type(column) for column in self.chosen.values()}) > 1:
            raise ValueError("give names or numbers of columns, not both")
        return self

    @property
    def chosen(self) -> dict[str, str | int]:
        """Columns that are given."""
        return {name: column for name, column in self if column is not None}


class _ControlColumns(PlaceColumns):
    """Columns of a control list."""

    name: Column = None
    sigma: Column = None
    sigma_horizontal: Column = None
    sigma_vertical: Column = None
    kind: Column = None
    size: Column = None
    role: Column = None


class ControlSection(TomlSection):
    """File of the surveyed points, and values for all of them that it does not state."""

    file: str
    kind: str | None = None
    size: Positive | None = None  # m
    sigma: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None  # m: E/N, H
    check: list[str] = Field(default_factory=list)  # names of check points, or patterns
    exclude: list[str] = Field(default_factory=list)  # names of points to exclude
    include: list[str] = Field(default_factory=list)  # names of points used in any case
    words: dict[str, str] = Field(default_factory=dict)  # of an office: to "circle 0.6", "check"
    columns: _ControlColumns = _ControlColumns()
    # Factor of eastings and northings; "ground": the map's own factor there
    scale_factor: Annotated[float, Field(ge=0.99, le=1.01)] | Literal["ground"] | None = None
    scale_origin: Annotated[list[Coordinate], Field(min_length=2, max_length=2)] | None = None  # m

    @model_validator(mode="after")
    def _scales_about_an_origin(self) -> Self:
        if self.scale_origin is not None and self.scale_factor is None:
            raise ValueError('scale_origin needs a scale_factor: a number, or "ground"')
        return self

    @model_validator(mode="after")
    def _are_words_known(self) -> Self:
        _ = self.meanings
        return self

    @property
    def meanings(self) -> dict[str, OfficeWord]:
        """Words of the office, normalized, with their meanings."""
        return {same_word(word): OfficeWord.of(text) for word, text in self.words.items()}
