"""Certificate of a correction: two A4 pages to sign, made only from report.json."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from mlscorr.report.pages import now, versions
from mlscorr.report.style import STYLE
from mlscorr.report.wording import CERTIFICATE
from mlscorr.survey import Statement
from mlscorr.wording import number, thousands

A4 = (8.27, 11.69)  # inch, ISO 216
POINTS = 72.0  # per inch
MARGIN = 57.0  # pt, 20 mm
LETTERS = 8.5  # pt
LEADING = 1.45  # of the letters, from line to line
MONOSPACE = 5.9  # pt: 64 digits of a SHA-256 next to the name of a file
SOFT = "#555555"
LINE = "#9a9a9a"
FILES = 12  # rows of files; more would fill the page, and report.json has all
INTERVALS = 10  # rows of poorly constrained intervals, for the same reason
WARNINGS = 3  # maximum; the report has all
NAME = 38  # letters of a file's name next to its digits
NUMBERS = (0.52, 0.64, 0.76, 0.88, 1.0)  # right ends of columns, as shares of the width
ROLES = ("control", "check")
TESTED = ("verdict", "statistic", "degrees_of_freedom", "limits", "significance")


def write_certificate(path: str | Path, report: Mapping[str, Any]) -> None:
    """Write the certificate of a correction as a PDF of two A4 pages with searchable text.

    Parameters
    ----------
    path : path
    report : mapping
        Document of report.json.
    """
    fonts: Any = {"pdf.fonttype": 42}  # TrueType: text remains text
    title = f"Certificate of correction: {_title(report)}"
    written = now()
    with (
        matplotlib.rc_context({**STYLE, **fonts}),
        PdfPages(path, metadata={"Title": title}) as pdf,
    ):
        for number_of_page, draw in enumerate((_first_page, _second_page), start=1):
            sheet = _Sheet()
            draw(sheet, report)
            named = {"time": written, "software": _software(), "page": number_of_page}
            sheet.foot(_words("foot", **named))
            pdf.savefig(sheet.figure)


class _Sheet:
    """A4 page written from top to bottom."""

    def __init__(self):
        self.figure = Figure(A4)
        self._width, self._height = (POINTS * length for length in A4)
        self._at = MARGIN  # pt below the upper edge

    def text(self, words, share=0.0, size=LETTERS, **style):
        """Write words at a share of the width between margins, on the current line."""
        x = (MARGIN + share * (self._width - 2 * MARGIN)) / self._width
        y = 1 - self._at / self._height
        self.figure.text(x, y, words, fontsize=size, va="top", **style)

    def down(self, lines=1.0, size=LETTERS):
        """Move down by lines of a font size."""
        self._at += lines * LEADING * size

    def rule(self, start=0.0, end=1.0):
        """Draw a line between shares of the width."""
        between = self._width - 2 * MARGIN
        x = [(MARGIN + share * between) / self._width for share in (start, end)]
        y = 1 - (self._at - 2) / self._height
        self.figure.add_artist(matplotlib.lines.Line2D(x, [y, y], color=LINE, linewidth=0.6))

    def heading(self, words):
        """Write the heading of a section."""
        self.down(0.8)
        self.text(words, size=11, fontweight="bold")
        self.down(1.25, 11)

    def paragraph(self, words, letters=104, **style):
        """Write words wrapped into lines."""
        for line in textwrap.wrap(words, letters):
            self.text(line, **style)
            self.down()

    def pairs(self, items, start=0.27):
        """Write names with their values next to them, wrapped into lines."""
        for name, value in items:
            self.text(name, color=SOFT)
            for line in textwrap.wrap(str(value), 80) or [""]:
                self.text(line, start)
                self.down()

    def row(self, name, values, ends=NUMBERS, **style):
        """Write a row of a table: a name, and values that end at shares of the width."""
        self.text(name, **style)
        for value, end in zip(values, ends, strict=True):
            self.text(value, end, ha="right", **style)
        self.down(1.1)

    def foot(self, words):
        """Write a line at the lower margin."""
        self._at = self._height - 0.75 * MARGIN
        self.text(words, size=7, color=SOFT)


def _first_page(sheet, report):
    """Names, corrected data, control, and accuracy."""
    sheet.text("Certificate of correction", size=9, color=SOFT)
    sheet.down(1.3, 9)
    for line in textwrap.wrap(_title(report), 42, max_lines=2, placeholder=" …"):
        sheet.text(line, size=17, fontweight="bold")
        sheet.down(1.1, 17)
    sheet.rule()
    sheet.down(0.4)
    project = report["project"]
    names = {name.capitalize(): project[name] for name in project if name != "title"}
    recorded = (report["recorded"] or {}).get("text", "not known")
    crs = report["crs"] or "not stated"
    survey = {"Survey": report["name"], "Recorded": recorded, "Coordinate system": crs}
    sheet.pairs([(name, value or "–") for name, value in (names | survey).items()])

    sheet.heading("What was corrected")
    points = sum(row.get("points", 0) for row in report["files"])
    coverage = report["coverage"]
    outside = coverage["points_outside_trajectory"]
    files = len(report["files"])
    sheet.paragraph(_words("corrected points", points=points, files=files, outside=outside))

    sheet.heading("Control")
    sheet.row("", ("surveyed", "observed", "used"), NUMBERS[:3], color=SOFT)
    for role in ROLES:
        rows = [row for row in report["targets"] if row["role"] == role]
        observed = {row["name"] for row in rows if row["observed"] is not None}
        used = {row["name"] for row in rows if row["used"]}
        values = (len({row["name"] for row in rows}), len(observed), len(used))
        words = {"control": "Control points (make the correction)"}
        name = words.get(role, "Check points (only test it)")
        sheet.row(name, [str(value) for value in values], NUMBERS[:3])

    sheet.heading("Residuals")
    sheet.row("RMSE in m", ("East", "North", "Height", "Horizontal", "3D"), color=SOFT)
    sheet.rule()
    for words, section, state in (
        ("Check points, before", "check", "before"),
        ("Check points, after", "check", "after"),
        ("Control points, before", "control", "before"),
        ("Control points, leave-one-out", "control", "leave_one_out"),
        ("Control points, after (fit)", "control", "after"),
    ):
        statistics = report[section].get(state)
        if statistics is None or statistics["rmse"] is None:
            continue
        is_independent = (section, state) in (("check", "after"), ("control", "leave_one_out"))
        weight = "bold" if is_independent else "normal"
        values = [*statistics["rmse"], statistics["rmse_horizontal"], statistics["rmse_3d"]]
        sheet.row(words, [number(value) for value in values], fontweight=weight)
    sheet.down(0.3)
    sheet.paragraph(_words("residuals"), color=SOFT)

    sheet.heading("Accuracy")
    for sentence in _accuracy(report["accuracy"]):
        sheet.paragraph(sentence)
    sigmas = report["check_sigmas"]
    if sigmas is not None:
        sheet.paragraph(_words("sigmas tested", **{key: sigmas[key] for key in TESTED}))


def _accuracy(accuracy):
    """Sentences on the accuracy class of the standard, and on conformance of the test."""
    if not accuracy or accuracy["based_on"] is None:
        return [_words("no accuracy")]
    values = {axis: accuracy[f"class_{axis}_cm"] for axis in ("horizontal", "vertical")}
    values |= {"standard": accuracy["standard"], "conforms": bool(accuracy["conformant"])}
    return [_words("accuracy class", **values), *accuracy["statement"]]


def _second_page(sheet, report):
    """Poorly constrained intervals, files with their digits, software and signatures."""
    sheet.text("Poorly constrained intervals", size=11, fontweight="bold")
    sheet.down(1.25, 11)
    weak = report["weak"]
    share = report["well_determined"]
    if share is not None:
        sheet.paragraph(_words("well determined", share=share))
    if weak:
        _intervals(sheet, weak)
    else:
        sheet.paragraph(_words("all constrained"))

    sheet.heading("Files")
    groups = {"Corrected": report["files"], "Read": report["inputs"], "Written": report["outputs"]}
    room = FILES
    for title, rows in groups.items():
        if not rows:
            continue
        shown = rows[: max(room, 1)]
        room -= len(shown)
        sheet.text(f"{title} ({len(rows)})", color=SOFT)
        sheet.down(1.1)
        for row in shown:
            _file(sheet, row)
        if len(shown) < len(rows):
            sheet.text(_words("more files", count=len(rows) - len(shown)), color=SOFT)
            sheet.down()

    sheet.heading("Software")
    sheet.paragraph(", ".join(f"{name} {version}" for name, version in versions()))
    for words in (report["model"].get("warnings") or ())[:WARNINGS]:
        text = textwrap.shorten(words, 220, placeholder=" …")
        sheet.paragraph(_words("warning", text=text))

    sheet.heading("Signatures")
    sheet.down(3.2)
    for words, start in (("Operator", 0.0), ("Responsible surveyor", 0.53)):
        sheet.rule(start, start + 0.47)
        sheet.text(f"{words}: name, date, signature", start, size=7.5, color=SOFT)


def _intervals(sheet, weak):
    """Table of the poorly constrained intervals, sorted by decreasing sigma."""
    ends = (0.16, 0.32, 0.46, 0.6)
    sheet.row("", ("From (s)", "To (s)", "Length (m)", "Sigma (m)"), ends, color=SOFT)
    sheet.rule()
    worst = sorted(weak, key=lambda row: -(row["sigma"] or 0.0))[:INTERVALS]
    for row in sorted(worst, key=lambda row: row["from"]):
        sheet.text(textwrap.shorten(row["why"], 48, placeholder=" …"), 0.63, size=7.5)
        values = (number(row[key], digits) for key, digits in COLUMNS.items())
        sheet.row("", list(values), ends)
    if len(worst) < len(weak):
        sheet.text(_words("more intervals", count=len(weak) - len(worst)), color=SOFT)
        sheet.down()


COLUMNS = {"from": 1, "to": 1, "length_m": 0, "sigma": 3}  # of an interval, with number of decimals


def _file(sheet, row):
    """Write the line of a file: name, size and digits."""
    name = row["name"]
    if len(name) > NAME:
        name = f"{name[: NAME - 1]}…"
    size = "–"
    if row.get("points") is not None:
        size = f"{thousands(row['points'])} points"
    elif row.get("bytes") is not None:
        size = f"{thousands(row['bytes'])} bytes"
    sheet.text(name, size=7.5)
    sheet.text(size, 0.505, size=7, ha="right")
    digits: Sequence[str] = row.get("sha256") or "–"
    sheet.text(digits, 0.52, size=MONOSPACE, family="DejaVu Sans Mono")
    sheet.down(1.0)


def _words(key, **values):
    """A sentence of the certificate."""
    return Statement(key, values=values).sentence(CERTIFICATE)


def _title(report):
    """Title of the project, or the survey's name."""
    return report["project"]["title"] or report["name"]


def _software():
    """Name and version of this package."""
    return " ".join(versions()[0])
