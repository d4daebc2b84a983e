"""Columns that a table has none for: which are meant by their spelling, and what to write."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import OpenPlace, OpenQuestion, listed, nearest, shown
from mlscorr.io.tables.column_names import plain, section_of
from mlscorr.io.tables.layouts import NUMBER
from mlscorr.survey import SurveyFileError


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


def missing_columns(
    path: str | Path,
    header: Sequence[str],
    missing: Sequence[str],
    meanings: Mapping[str, Sequence[int]],
    names: Mapping[str, Collection[str]],
    hints: Mapping[tuple[str, str], tuple[str, Sequence[OpenPlace]]] | None = None,
) -> OpenQuestion:
    """The error on a table without columns that are needed.

    Parameters
    ----------
    path : path
    header : sequence of str
        The likely one.
    missing : sequence of str
        Our names.
    meanings : mapping
        What the header has, as of find_meanings.
    names : mapping
        See find_meanings.
    hints : mapping, optional
        Name that is missing and one that is there to the sentence that says the way out, and to
        the places of survey.toml that are the way out.
    """
    used = {header[i] for positions in meanings.values() for i in positions}
    hinted = [
        hint
        for (name, other), hint in (hints or {}).items()
        if name in missing and other in meanings
    ]
    sentence = missing_sentence(path, header, missing, used, names)
    if hinted:
        places = [place for _, of_hint in hinted for place in of_hint]
    else:
        places = _likely_places(header, missing, used, names)
    return OpenQuestion(sentence + "".join(way_out for way_out, _ in hinted), places)


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
    names : mapping
        See find_meanings.
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
    has = listed(header, SETTINGS.named_columns) or "no header"
    return f"{path} has no column {', '.join(missing)}; it has {has}.{hint}"


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
