"""Tables and survey.toml as accidents and attackers leave them: one sentence, within a second."""

import time
import warnings

import numpy as np
import pytest
from pydantic import Field

from mlscorr.io.store import TomlSection, read_toml
from mlscorr.io.tables import read_control, write_targets_csv
from mlscorr.io.trajectories import read_trajectory
from tests.faults.sizes import IS_FULL

HEADER = "gps_time,easting,northing,height,roll,pitch,heading\n"
CONTROL = "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role\n"
POINT = "T01,532009.2473,3373996.6938,44.2644,0.003,0.003,circle,0.6,control\n"
LIMIT = 1.0  # s of the processor, until a file is refused


def epochs(change=lambda position: None, step=0.01, speed=10.0):
    "Lines of a drive to the north at 100 Hz"
    time_ = 357_700.0 + step * np.arange(400)
    position = np.column_stack([np.full(400, 532e3), 3374e3 + speed * (time_ - time_[0])])
    change(position)
    return [
        f"{t:.6f},{e:.4f},{n:.4f},40.0,0,0,0\n" for t, (e, n) in zip(time_, position, strict=True)
    ]


def refused(read, path, text, match):
    "Read a file that must be refused in time"
    path.write_text(text) if isinstance(text, str) else path.write_bytes(text)
    start = time.process_time()
    with pytest.raises(ValueError, match=match) as raised:
        read(path)
    assert not IS_FULL or time.process_time() - start < LIMIT
    assert len(str(raised.value)) < 600 and str(raised.value).endswith((".", "?"))


def moved(rows, metres):
    def change(position):
        position[rows, 0] += metres

    return change


@pytest.mark.parametrize(
    "lines",
    [
        epochs(moved(200, 1e6)),
        epochs(moved(0, 50.0)),
        epochs(moved(399, 50.0)),
        epochs(moved(200, 10.0)),
        epochs(moved(slice(200, None), 1e6)),
        epochs(speed=1e3),
        epochs(speed=1e7),
    ],
    ids=["far", "first", "last", "spike", "leap", "1 km/s", "10 000 km/s"],
)
def test_what_no_vehicle_does_is_said(lines, tmp_path):
    "An epoch far away, a leap, or the speed of a rocket: how many, how fast, when, and why"
    path = tmp_path / "trajectory.csv"
    refused(read_trajectory, path, HEADER + "".join(lines), "faster than 340 m/s")


def test_a_pos_that_falls_back_by_metres_is_taken(tmp_path):
    "5 m at once, as after an outage, is what a POS does"
    path = tmp_path / "trajectory.csv"
    path.write_text(HEADER + "".join(epochs(moved(slice(200, None), 5.0))))
    assert len(read_trajectory(path)) == 400


def test_a_decimal_comma_is_said(tmp_path):
    "1,5 in a cell makes a column too many, which nobody may take for the next value"
    lines = epochs()
    lines[7] = lines[7].replace("40.0", "40,0")
    match = "Line 9 of.*has 8 columns where the header has 7"
    refused(read_trajectory, tmp_path / "trajectory.csv", HEADER + "".join(lines), match)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (CONTROL + POINT + '"' + "x" * 5_000_000, "unterminated|columns"),
        (CONTROL + POINT + '"' + "x\n" * 2_000_000, "unterminated|columns"),
        ("n" * 5_000_000, "or more characters"),
        ("," * 9_000 + "\n" + POINT, "no column name"),
        (CONTROL.replace("name", "n" * 5_000) + POINT, "no column name"),
        (CONTROL + POINT.replace("0.6", "6" * 100_000 + "x"), "not a number"),
        (CONTROL + POINT.replace("circle", "c" * 50_000), "unknown kind"),
        (b"\x00" * 1_000_000, "no column|or more characters"),
    ],
    ids=["field", "lines", "header", "commas", "long name", "digits", "kind", "zeros"],
)
def test_a_crafted_table_does_not_hang(text, match, tmp_path):
    "Cells and lines of megabytes are refused within a second, in few words"
    with warnings.catch_warnings(action="ignore"):
        refused(read_control, tmp_path / "control.csv", text, match)


class Section(TomlSection):
    "A file with one number"

    number: float = Field(default=1.0)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("number = " + "[" * 1000 + "]" * 1000, "nested too deep|not valid TOML|is invalid"),
        ("number = " + "9" * 5_000, "too many digits"),
        ("n" * 500_000 + " = 1", "unknown key"),
        ("number = '" + "x" * 500_000 + "'", "is invalid"),
    ],
    ids=["nested", "digits", "key", "text"],
)
def test_a_crafted_toml_is_refused_in_a_sentence(text, match, tmp_path):
    "Deep nesting and long numbers are told in our words, not in the parser's"
    with warnings.catch_warnings(action="ignore"):
        refused(lambda path: read_toml(path, Section, "it"), tmp_path / "a.toml", text, match)


@pytest.mark.parametrize("cut", [1, 2, 4])
def test_a_table_cut_in_its_last_cell_is_told(cut, tmp_path):
    "A last line without its end may be half of one: a warning names the file"
    path = tmp_path / "trajectory.csv"
    path.write_text((HEADER + "".join(epochs()) + "357704.5,532000,3374045,40,0,0,1.25\n")[:-cut])
    with pytest.warns(UserWarning, match=r"last line of.*trajectory\.csv has no"):
        read_trajectory(path)
    (tmp_path / "a.toml").write_text("number = 12")
    with pytest.warns(UserWarning, match=r"last line of .*a\.toml has no"):
        read_toml(tmp_path / "a.toml", Section, "it")


def test_rows_of_empty_cells_are_left_out(tmp_path):
    "A spreadsheet leaves rows of commas alone at the end of a table; its epochs are read"
    path = tmp_path / "trajectory.csv"
    path.write_text(HEADER + "".join(epochs()) + 2 * ",,,,,,\n")
    assert len(read_trajectory(path)) == 400
    path.write_text(HEADER + "".join(epochs()) + "357704.5,,,,,,\n")
    with pytest.raises(ValueError, match=r"Line 402 of .*trajectory\.csv has '' where a number"):
        read_trajectory(path)


def test_no_cell_of_a_result_is_a_formula(tmp_path):
    "A point named as a formula is text in a spreadsheet; negative numbers stay numbers"
    vectors = ("surveyed", "observed", "sigma", "before", "after", "left_out")
    row = {name: [-1.0, 0.0, 1.0] for name in vectors}
    row |= {"pass": 1, "gps_time": -1.5, "role": "control", "used": True, "reason": None}
    row["scanned"] = True
    names = ["=cmd|' /C calc'!A0", "+1+1", "@SUM(A1)", "-x", "T01"]
    write_targets_csv(tmp_path / "a.csv", [{"name": name} | row for name in names])
    lines = (tmp_path / "a.csv").read_text().splitlines()[1:]
    assert [line[0] for line in lines] == ["'", "'", "'", "'", "T"]
    assert all(",-1.500000,control,-1.0000," in line for line in lines)
