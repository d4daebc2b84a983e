"""Data location, pictures and page shared by the studies on real data."""

import io
import os
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from mlscorr.effects import lowered, titles
from mlscorr.report.pages import data_uri, environment, now, versions
from mlscorr.report.style import STYLE

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("MLSCORR_SHARED") or ROOT.parent / "shared") / "data"


def needed(folder, names, source):
    """End the study with one sentence if a required file is missing."""
    missing = [name for name in names if not (folder / name).exists()]
    if missing:
        print(
            f"Nothing to show: {' and '.join(missing)} (from {source}) not found in "
            f"{folder.resolve()}, so put the data there, or set MLSCORR_SHARED to the folder that "
            f"has data/{folder.name}."
        )
        raise SystemExit(0)


def words(label):
    """A diagnosis' label in words.

    >>> words("boresight+position_noise")
    'boresight and noisy positions'
    """
    return lowered(titles(label.split("+")))


def counted(count):
    """Counts of labels in words.

    >>> counted({"boresight": 2, "none": 1})
    'boresight 2, nothing 1'
    """
    return ", ".join(f"{words(label)} {number}" for label, number in count.items())


def write_page(path, title, subtitle, sentences, real, parts):
    """Write one self-contained HTML file.

    Parameters
    ----------
    path : path
    title, subtitle : str
    sentences : list of str
        Results, the main one first.
    real : list of (head, list of str)
        Lists of real, simulated and unknown things.
    parts : list of dict
        title; text, list of str; pictures, list of (PNG file, caption); tables, list of
        (column names, rows, caption).
    """
    parts = [{"text": [], "tables": [], "pictures": [], **part} for part in parts]
    for part in parts:
        part["tables"] = [table for table in part["tables"] if table[1]]
        part["pictures"] = [(data_uri(f.read_bytes(), "png"), c) for f, c in part["pictures"]]
    template = environment(Path(__file__).parent).get_template("page.html")
    content = {"title": title, "subtitle": subtitle, "sentences": sentences, "real": real}
    text = template.render(content | {"parts": parts, "versions": versions(), "written": now()})
    Path(path).write_text(text, encoding="utf-8")


def picture(path, draw, size, *arguments):
    """Write the picture that draw(figure, ...) draws as a PNG, and return its path."""
    with rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure, *arguments)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=150, metadata={"Software": "mlscorr"})
    Path(path).write_bytes(stream.getvalue())
    return Path(path)
