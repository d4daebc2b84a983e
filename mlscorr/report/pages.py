"""Pages: one HTML file each that holds its style, scripts and pictures, for reading offline."""

import base64
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from mlscorr.report import tables
from mlscorr.report.style import Figures, svg
from mlscorr.wording import millimetres, number

TEMPLATES = Path(__file__).parent / "page"  # each section is a file there
LIBRARIES = ("numpy", "scipy", "laspy", "lazrs", "numba", "pyproj", "matplotlib")


@dataclass(frozen=True)
class Page:
    """A self-contained page: the skeleton with a summary, sections, styles and scripts.

    Parameters
    ----------
    title : str
        Of the browser's window.
    summary : str
        The template that stands above the sections.
    sections : dict
        Titles of the sections by their names, in their order. A section is the template of its
        name, which holds a heading whose id is the name.
    content : dict
        What the templates show.
    prefix : str
        Before the sections' names in the names of their templates.
    styles, scripts : tuple of str
        Files beside those that all pages have.
    """

    title: str
    summary: str
    sections: dict[str, str]
    content: dict[str, object]
    prefix: str = ""
    styles: tuple[str, ...] = ()
    scripts: tuple[str, ...] = ()

    def html(self) -> str:
        """The text of the page, which says when and by which versions it was written.

        Raises
        ------
        jinja2.UndefinedError
            Where a template shows what the content doesn't have.
        """
        frame = {"versions": versions(), "written": now(), "window_title": self.title}
        frame |= {name: getattr(self, name) for name in ("summary", "sections", "prefix")}
        frame["styles"] = "style.css", *self.styles
        frame["scripts"] = "fit.js", "sort.js", *self.scripts
        return environment().get_template("skeleton.html").render(frame | self.content)

    def write(self, path: str | Path) -> None:
        """Write the page as a file."""
        Path(path).write_text(self.html(), encoding="utf-8")


def environment(folder: Path = TEMPLATES) -> Environment:
    """Templates of a folder, which escape what they are given and know how numbers are shown."""
    templates = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {"number": number, "norm": tables.norm, "show": show}
    templates.filters["millimetres"] = millimetres
    templates.globals |= {"raw": raw, "AXES": tables.AXES}
    return templates


def raw(name: str) -> Markup:
    """A file of the page as it is: style and scripts, which are our own."""
    return Markup((TEMPLATES / name).read_text(encoding="utf-8"))


def show(value: object) -> str:
    """Any value of a document in words, numbers with four figures.

    >>> show([0.25, None]), show(True), show({"E": 12.0}), show(357700.02)
    ('0.25, not determined', 'yes', 'E: 12', '357700.0')
    """
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return "not determined"
    if isinstance(value, bool):
        if value:
            return "yes"
        return "no"
    if isinstance(value, int | float):
        is_time = abs(value) >= 1e5  # of a week: four figures of it tell no day
        if isinstance(value, int):
            return f"{value:d}"
        return f"{value:{'.1f' if is_time else '.4g'}}"
    if isinstance(value, dict):
        return "; ".join(f"{key}: {show(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(show(item) for item in value) or "none"
    return str(value)


def data_uri(picture: bytes, kind: str = "svg+xml") -> str:
    """A picture as the address of an image that lies in the page itself."""
    return f"data:image/{kind};base64," + base64.b64encode(picture).decode()


def drawn(figures: Figures) -> dict[str, str]:
    """Figures by name, each as the address of an image.

    Parameters
    ----------
    figures : dict of functions
    """
    return {name: data_uri(svg(draw())) for name, draw in figures.items()}


def versions() -> list[tuple[str, str]]:
    """Names and versions of mlscorr and the libraries that made the numbers."""
    known = (next(iter(distributions(name=name)), None) for name in ("mlscorr", *LIBRARIES))
    return [(package.name, package.version) for package in known if package is not None]


def now() -> str:
    """The time of writing, as pages show it."""
    return f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC"
