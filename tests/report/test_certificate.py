"""The certificate of a correction: two pages to sign."""

import json
import re
import zlib
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from mlscorr.cli import app
from mlscorr.evaluate import CheckSigmas, TargetRow
from mlscorr.report import FileRow, write_certificate
from mlscorr.report.correction_report import array
from mlscorr.survey import ProjectNames
from mlscorr.wording import number
from tests.beds.reports import because, drive, fabricate


def document(**changes):
    "report.json of a made-up correction"
    _, _, report = fabricate(drive())
    names = ProjectNames("Ring road", "City of Wuhan", "2024-017", "Scanner 7", "J. Meyer")
    checks = [row for row in report.targets if row.role == "check"]
    sigmas = CheckSigmas.of(array(checks, "after"), np.full((len(checks), 3), 0.03), len(checks))
    filled = {"project": names, "check_sigmas": sigmas, "well_determined": 0.87}
    return json.loads(json.dumps(replace(report, **filled | changes).document()))


def letters(path):
    "The text of a PDF by sheets, without blanks: letters are stored as letters"
    pdf = path.read_bytes()
    sheets = []
    for start in (match.end() for match in re.finditer(rb"stream\r?\n", pdf)):
        try:
            content = zlib.decompressobj().decompress(pdf[start:])
        except zlib.error:
            continue
        if b" Tf" in content:
            parts = re.findall(rb"\(((?:\\.|[^\\)])*)\)", content)
            text = b"".join(parts).decode("latin-1").replace("\0", "")  # of two bytes a letter
            sheets.append(re.sub(r"\\(.)", r"\1", text).replace(" ", ""))
    return pdf, sheets


def test_two_sheets_of_a4_hold_the_numbers_of_the_report(tmp_path):
    "Names, control, RMSE, intervals and SHA-256 as text, equal to report.json"
    report = document()
    write_certificate(tmp_path / "certificate.pdf", report)
    pdf, sheets = letters(tmp_path / "certificate.pdf")
    assert len(re.findall(rb"/Type /Page\b(?!s)", pdf)) == len(sheets) == 2
    width, height = map(float, re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", pdf).groups())
    assert abs(width / 72 * 25.4 - 210) < 0.5 and abs(height / 72 * 25.4 - 297) < 0.5
    first, second = sheets
    for name in ("Ringroad", "CityofWuhan", "2024-017", "Scanner7", "J.Meyer", "EPSG:32650"):
        assert name in first
    for section, state in (("check", "before"), ("check", "after"), ("control", "leave_one_out")):
        statistics = report[section][state]
        assert "".join(number(value) for value in statistics["rmse"]) in first
        assert number(statistics["rmse_3d"]) in first
    assert "ab12" * 16 in second and "87%" in second and "signature" in second
    for row in report["weak"]:
        assert number(row["from"], 1) + number(row["to"], 1) in second


def test_the_class_and_whether_the_test_conforms_are_stated(tmp_path):
    "By the accuracy of report.json; without one, the certificate says so"
    path = tmp_path / "certificate.pdf"
    write_certificate(path, document())
    assert "Notdetermined" in letters(path)[1][0]
    accuracy = {
        "based_on": "check",
        "class_horizontal_cm": 3,
        "class_vertical_cm": 2,
        "conformant": True,
        "standard": "ASPRS",
        "statement": ["Tested to meet the class."],
    }
    write_certificate(path, document(accuracy=accuracy))
    first = letters(path)[1][0]
    assert "3cmhorizontal,2cmvertical" in first and "conformstotheASPRS" in first
    write_certificate(path, document(accuracy=accuracy | {"conformant": False}))
    assert "doesnotconformtotheASPRS" in letters(path)[1][0]


def test_many_files_and_targets_never_make_a_third_sheet(tmp_path):
    "500 tiles and long names: the first stand there, and the others are counted"
    files = tuple(FileRow(f"{'tile' * 20}-{k}.laz", "ab12" * 16, points=1) for k in range(500))
    lost = TargetRow.unobserved("$x_{", None, "control", np.zeros(3), because("not seen"))
    report = document(files=files)
    report["targets"].append(lost.document())
    report["model"]["warnings"] = ["a long warning " * 40] * 20
    write_certificate(tmp_path / "certificate.pdf", report)
    _, sheets = letters(tmp_path / "certificate.pdf")
    assert len(sheets) == 2
    assert "and488more" in sheets[1] and "signature" in sheets[1]


@pytest.mark.long
def test_the_command_writes_the_certificate_with_the_other_results(street, tmp_path):
    "--pdf alone adds one file; its numbers are those of the document that is printed"
    out = tmp_path / "out"
    arguments = ["correct", str(street), "-o", str(out), "--no-report", "--pdf", "--json"]
    ended = CliRunner().invoke(app, arguments)
    assert ended.exit_code == 0, ended.stderr
    report = json.loads(ended.stdout)
    first = letters(out / "certificate.pdf")[1][0]
    assert number(report["check"]["after"]["rmse_3d"]) in first
    assert not (out / "report.html").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
