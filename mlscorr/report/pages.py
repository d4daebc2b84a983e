"""HTML pages with embedded style, scripts and pictures, for offline reading."""

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
    """Self-contained page: the skeleton with a summary, sections, styles and scripts.

    Parameters
    ----------
    title : str
        Title of the browser's window.
    summary : str
        Template above the sections.
    sections : dict
        Titles of the sections by name, in order. A section is the template of its name, with a
        heading whose ID is the name.
    content : dict
        Content of the templates.
    prefix : str
        Prefix of the sections' names in the names of their templates.
    styles, scripts : tuple of str
        Files in addition to those of all pages.
    """

    title: str
    summary: str
    sections: dict[str, str]
    content: dict[str, object]
    prefix: str = ""
    styles: tuple[str, ...] = ()
    scripts: tuple[str, ...] = ()

    def html(self) -> str:
        """Return the text of the page, with its time and versions.

        Raises
        ------
        jinja2.UndefinedError
            If a template uses content that is missing.
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
    """Make templates of a folder, with escaping and number formatting."""
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
    """Return a file of the page unescaped: our own style and scripts."""
    return Markup((TEMPLATES / name).read_text(encoding="utf-8"))


def show(value: object) -> str:
    """Format any value of a document in words, numbers with four figures.

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
        is_time = abs(value) >= 1e5  # of a week: four figures of it do not show the day
        if isinstance(value, int):
            return f"{value:d}"
        return f"{value:{'.1f' if is_time else '.4g'}}"
    if isinstance(value, dict):
        return "; ".join(f"{key}: {show(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(show(item) for item in value) or "none"
    return str(value)


def data_uri(picture: bytes, kind: str = "svg+xml") -> str:
    """Encode a picture as a data URI."""
    return f"data:image/{kind};base64," + base64.b64encode(picture).decode()


def drawn(figures: Figures) -> dict[str, str]:
    """Draw figures by name, each as a data URI.

    Parameters
    ----------
    figures : dict of functions
    """
    return {name: data_uri(svg(draw())) for name, draw in figures.items()}


def versions() -> list[tuple[str, str]]:
    """Names and versions of mlscorr and the libraries behind the numbers."""
    known = (next(iter(distributions(name=name)), None) for name in ("mlscorr", *LIBRARIES))
    return [(package.name, package.version) for package in known if package is not None]


def now() -> str:
    """Time of writing, as shown on pages."""
    return f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC"
