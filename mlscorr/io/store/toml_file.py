"""TOML files read into pydantic models, with one sentence for each fault.

A value that only the user knows is an open value, marked by "?", until it is filled in.
"""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
)

from mlscorr.io.store.storage import as_path, is_folder, is_there, read_bytes
from mlscorr.io.store.text_files import ENCODING, nearest, shown, warn_of_cut
from mlscorr.survey import SurveyFileError
from mlscorr.wording import counted

MARK = "?"  # placeholder of an open value; no key can have it
Model = TypeVar("Model", bound=BaseModel)
# The same known keys as in the next sentence
_REPEATED = re.compile(r"; known are ([^.]+)\.(?= \S+ is an unknown key; known are \1\.)")
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Meters = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]
Coordinate = Annotated[float, Field(allow_inf_nan=False)]
Degrees = Annotated[float, Field(ge=-360, le=360, allow_inf_nan=False)]
Three = Field(min_length=3, max_length=3)
Six = Field(min_length=6, max_length=6)
Column = Annotated[str, Field(min_length=1)] | Annotated[int, Field(ge=1)] | None
PointSource = Annotated[int, Field(ge=0, le=65535)]  # 16 bits of a LAS point
Share = Annotated[float, Field(ge=-1, le=1, allow_inf_nan=False)]


class TomlSection(BaseModel):
    """Part of a TOML file: no unknown keys, no numbers as text."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


def read_toml(path: str | Path, model: type[Model], kind: str) -> Model:
    """Read a TOML file into a pydantic model; no other file is opened.

    Parameters
    ----------
    path : path
    model : class of pydantic
    kind : str
        Description of the file.

    Returns
    -------
    model

    Raises
    ------
    ValueError
        Names the line of invalid TOML, or every key that is unknown (with the most similar one),
        missing, or invalid.
    FileNotFoundError
        If there is no such file.
    """
    path = as_path(path)
    if not is_there(path):
        what = "is a folder" if is_folder(path) else "does not exist"
        raise FileNotFoundError(f"{path} {what}; {kind} is a TOML file.")
    try:
        document = tomllib.loads(read_bytes(path).decode(ENCODING))
    except UnicodeDecodeError:
        raise ValueError(
            f"{path} is not a TOML file in UTF-8. Save it in UTF-8, or create a new one with "
            "`mlscorr init FOLDER`."
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(
            f"{path} is not valid TOML: {error}. Put text and paths in quotation marks, write / "
            "instead of backslashes in paths, and use decimal points."
        ) from None
    except (RecursionError, ValueError):
        raise ValueError(
            f"{path} can't be read: brackets are nested too deeply, or a number has too many "
            "digits."
        ) from None
    _check_answered(path, document)
    validated = validate(str(path), document, model)
    warn_of_cut(path)
    return validated


def validate(source: str, document: dict[str, Any], model: type[Model]) -> Model:
    """Validate a document as a pydantic model.

    Parameters
    ----------
    source : str
        Description of its origin.
    document : dict
    model : class of pydantic

    Raises
    ------
    ValueError
        See ``read_toml``.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        sentences = " ".join(_sentence(item, model) for item in _causes(error.errors()))
        raise ValueError(f"{source}: {_REPEATED.sub('.', sentences)}") from None


def _causes(items):
    """Pydantic's findings without those on a list or section that follow from its own items."""

    def follows(item):
        depth = len(item["loc"])
        return any(o["loc"][:depth] == item["loc"] and len(o["loc"]) > depth for o in items)

    return [item for item in items if not follows(item)]


def _sentence(item, model):
    """One sentence on a finding of pydantic, with the dotted key."""
    key = ".".join(filter(str.strip, map(str, item["loc"])))
    if item["type"] == "extra_forbidden":
        name = ".".join(part for part in item["loc"] if isinstance(part, str) and part.strip())
        keys = _keys(model)
        near = nearest(name, keys)
        tail = name.rpartition(".")[2]
        if "." in name and tail in keys and not _sections(model.model_fields[tail].annotation):
            return f"{shown(key)} is an unknown key; {tail} belongs above the first [section]."
        if near == name:
            section = name.split(".")[0]
            return (
                f"{key} belongs to one of several sections: write [[{section}]], not [{section}]."
            )
        if near is None:  # nothing similar: the keys of the same section
            path = name.rpartition(".")[0]
            known = [k.rpartition(".")[2] for k in keys if k.rpartition(".")[0] == path]
            return f"{shown(key)} is an unknown key; known are {', '.join(known)}."
        return f"{shown(key)} is an unknown key; the nearest known one is {near}."
    if item["type"] == "missing":
        return f"{key} is missing."
    if item["type"] == "value_error":  # raised by a validator of this package, already a sentence
        message = str(item["ctx"]["error"]).rstrip(".")
        if key:
            return f"{key}: {message}."
        return f"{message}."
    if item["type"] in ("tuple_type", "list_type") and isinstance(item["input"], dict):
        return f"{key} is a list of sections; write [[{key}]], not [{key}]."
    message = item["msg"].replace("valid string", "valid string in quotation marks")
    message = re.sub(r"valid dictionary or instance of \w+", "section, in brackets", message)
    message = re.sub("(Input|List|Tuple) should", "it should", message)
    message = message.replace(" after validation", "")
    return f"{key} = {shown(repr(item['input']))} is invalid: {message[0].lower()}{message[1:]}."


def _keys(model, prefix=""):
    """All dotted keys of a model, including sections."""
    keys = []
    for name, field in model.model_fields.items():
        keys.append(prefix + name)
        for section in _sections(field.annotation):
            keys += _keys(section, f"{prefix}{name}.")
    return keys


def _sections(annotation):
    """Models among the types of an annotation, including lists and alternatives."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [section for part in get_args(annotation) for section in _sections(part)]


@dataclass(frozen=True)
class OpenPlace:
    """Key of survey.toml whose value only the user knows.

    Parameters
    ----------
    keys : tuple of str
        Sections and key, from the outermost.
    examples : tuple
        Possible values, the most likely first; empty if unknown.
    about : str
        Meaning of the value, in a few words.
    """

    keys: tuple[str, ...]
    examples: tuple[Any, ...] = ()
    about: str = ""

    @property
    def key(self) -> str:
        """Dotted key, as in TOML.

        Examples
        --------
        >>> OpenPlace(("control", "words", "Tafel 0,6")).key
        'control.words."Tafel 0,6"'
        """
        return ".".join(map(_quoted, self.keys))

    @property
    def option(self) -> str:
        """Option of init that sets the value.

        Examples
        --------
        >>> OpenPlace(("control", "size"), (0.6,)).option
        "--set 'control.size = 0.6'"
        """
        value = "..."
        if self.examples:
            value = json.dumps(self.examples[0], ensure_ascii=False)
        return f"--set '{self.key} = {value}'"

    def __str__(self) -> str:
        values = ", ".join(json.dumps(value, ensure_ascii=False) for value in self.examples)
        if self.about and values:
            return f"{self.about}: {values}"
        return self.about or values


def _quoted(key):
    """Key as in TOML: bare if possible."""
    is_bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    if is_bare:
        return key
    return json.dumps(key, ensure_ascii=False)


PLACE_OF_CRS = OpenPlace(("crs",), (), 'projected CRS of cloud and control, as "EPSG:32650"')


class OpenQuestion(ValueError):
    """Fault of the input that values in survey.toml can correct.

    Parameters
    ----------
    sentence : str
    places : sequence of OpenPlace
        Values to add to survey.toml; empty if it cannot correct the fault.
    """

    def __init__(self, sentence: str, places: Sequence[OpenPlace] = ()):
        super().__init__(sentence)
        self.places = tuple(places)


def places_of(error: BaseException) -> tuple[OpenPlace, ...]:
    """Open values that can correct the cause of an error.

    Parameters
    ----------
    error : exception
    """
    if isinstance(error, OpenQuestion):
        return error.places
    return ()


def _check_answered(path: Path, document: Mapping[str, Any]) -> None:
    """Refuse a TOML document with open values."""
    keys = [OpenPlace(keys).key for keys in _open_keys(document, ())]
    if keys:
        number = counted(len(keys), "open place")
        raise SurveyFileError(
            f'{path} has {number}: {", ".join(keys)}. Replace each "{MARK}" with the value; the '
            "comment after it lists the choices."
        )


def _open_keys(value, keys):
    """Keys of open values, with sections in lists numbered from 1."""
    if value == MARK:
        return [keys]
    if isinstance(value, Mapping):
        return [path for key, part in value.items() for path in _open_keys(part, (*keys, key))]
    if isinstance(value, list):
        numbered = enumerate(value, start=1)
        return [path for n, part in numbered for path in _open_keys(part, (*keys, str(n)))]
    return []
