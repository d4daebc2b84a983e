"""What all pages share: templates, style and scripts that lie in the page, pictures, versions."""

import base64
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from mlscorr.report import tables

PAGE = Path(__file__).parent / "page"  # each section is a file there
LIBRARIES = ("numpy", "scipy", "laspy", "lazrs", "numba", "pyproj", "matplotlib")


def environment(folder=PAGE):
    """Templates of a folder, which escape what they are given and know how numbers are shown."""
    made = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {"number": tables.number, "show": show}
    made.globals["raw"] = raw
    return made


def raw(name):
    """A file of the page as it is: style and scripts, which are our own."""
    return Markup((PAGE / name).read_text(encoding="utf-8"))


def show(value):
    """Any value of a document in words, numbers with four figures.

    >>> show([0.25, None]), show(True), show({"E": 12.0})
    ('0.25, not determined', 'yes', 'E: 12')
    """
    if value is None:
        return "not determined"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:d}" if isinstance(value, int) else f"{value:.4g}"
    if isinstance(value, dict):
        return "; ".join(f"{key}: {show(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(show(item) for item in value) or "none"
    return str(value)


def data_uri(picture, kind="svg+xml"):
    """A picture (bytes) as the address of an image that lies in the page itself."""
    return f"data:image/{kind};base64," + base64.b64encode(picture).decode()


def versions():
    """Pairs (name, version) of mlscorr and the libraries that made the numbers."""
    pairs = []
    for name in ("mlscorr", *LIBRARIES):
        try:
            pairs.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return pairs


def now():
    """The time of writing, as pages show it."""
    return f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC"
