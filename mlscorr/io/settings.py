"""TOML files read into pydantic models, with one sentence on each thing that is wrong in them."""

import tomllib
from pathlib import Path

from pydantic import BaseModel, ValidationError

from mlscorr.io.tables import ENCODING, nearest


def read_settings_file(path, model):
    """The document of a TOML file as a pydantic model; no other file is opened.

    Raises ValueError that names the line of bad TOML, or every key that is unknown (with the
    nearest known one), missing, or of a value that can't be used.
    """
    try:
        document = tomllib.loads(Path(path).read_text(encoding=ENCODING))
    except UnicodeDecodeError:
        raise ValueError(f"{path} is not a text file in UTF-8.") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path} is not valid TOML: {error}.") from None
    try:
        return model.model_validate(document)
    except ValidationError as error:
        sentences = " ".join(_sentence(item, model) for item in _causes(error.errors()))
        raise ValueError(f"{path}: {sentences}") from None


def _causes(items):
    """pydantic's findings without those on a list or section that follow from its own items."""

    def follows(item):
        depth = len(item["loc"])
        return any(o["loc"][:depth] == item["loc"] and len(o["loc"]) > depth for o in items)

    return [item for item in items if not follows(item)]


def _sentence(item, model):
    """One sentence on one of pydantic's findings, with the dotted key."""
    key = ".".join(str(part) for part in item["loc"])
    if item["type"] == "extra_forbidden":
        name = ".".join(part for part in item["loc"] if isinstance(part, str))
        return f"{key} is an unknown key; the nearest known one is {nearest(name, _keys(model))}."
    if item["type"] == "missing":
        return f"{key} is missing."
    if item["type"] == "value_error":  # raised by a validator of ours, a sentence already
        message = str(item["ctx"]["error"]).rstrip(".")
        return f"{key}: {message}." if key else f"{message}."
    if item["type"] in ("tuple_type", "list_type") and isinstance(item["input"], dict):
        return f"{key} is a list of sections; write [[{key}]], not [{key}]."
    message = item["msg"]
    for kind in ("Input", "List", "Tuple"):
        message = message.replace(f"{kind} should", "it should")
    return f"{key} = {item['input']!r} can't be used: {message[0].lower()}{message[1:]}."


def _keys(model, prefix=""):
    """Every dotted key of a model, sections included."""
    keys = []
    for name, field in model.model_fields.items():
        keys.append(prefix + name)
        for kind in getattr(field.annotation, "__args__", (field.annotation,)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                keys += _keys(kind, f"{prefix}{name}.")
    return keys
