"""Files that are whole and mean something else: the sentence that names it, for each kind of fault.

``make faults`` draws hundreds of magnitudes; ``make test`` tries those that are seen on reading.
"""

import csv
import re
import shutil
import warnings
from collections import Counter

import laspy
import numpy as np
import pytest

import mlscorr
from tests.faults.sizes import IS_FULL, tries

FOOT = 0.3048  # m
PLACE = ("easting", "northing", "height")
ANGLES = ("roll", "pitch", "heading")
OUTSIDE = "None of the sampled times .* are inside the trajectory .*(days|UTC)"
BESIDE = r"deg off the scan plane .*gps_time may be wrong"
HEADING = "heading of .*trajectory.csv differs from the course"
DATUM = "(below|above) the cloud .*vertical datum"
APART = "No point of the cloud is within .*same CRS"
HEIGHTS = "m (above|below) the trajectory.*heights"


def column(file, names, factor=1.0, added=0.0):
    "A fault: columns of a table times a factor, plus a constant"

    def change(folder):
        rows = rows_of(folder / file)
        for row in rows:
            row |= {name: f"{float(row[name]) * factor + added:.9f}" for name in names}
        write(folder / file, rows)

    return change


def exchanged(file, first, second):
    "A fault: two columns of a table exchanged"

    def change(folder):
        rows = rows_of(folder / file)
        write(folder / file, [row | {first: row[second], second: row[first]} for row in rows])

    return change


def rows_of(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def write(path, rows):
    with open(path, "w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def text(old, new):
    "A fault: other words in survey.toml"

    def change(folder):
        words = (folder / "survey.toml").read_text()
        assert old in words
        (folder / "survey.toml").write_text(words.replace(old, new))

    return change


def cloud(change_of):
    "A fault: a cloud changed as a whole"

    def change(folder):
        points = laspy.read(folder / "pass-1.las")
        change_of(points)
        points.write(folder / "pass-1.las")

    return change


def later(seconds):
    return cloud(lambda points: points.__setitem__("gps_time", points["gps_time"] + seconds))


def moved(matrix, shift=(0.0, 0.0, 0.0)):
    def change_of(points):
        place = np.array(points.xyz) @ np.asarray(matrix, float).T + shift
        corner = np.floor(place.min(axis=0))
        points.header.offsets = points.points.offsets = corner
        for name, values, scale in zip(
            "XYZ", (place - corner).T, points.header.scales, strict=True
        ):
            points[name] = np.round(values / scale).astype(np.int32)

    return cloud(change_of)


def any_of(rng, *values):
    return values[rng.integers(len(values))]


# What is seen on reading: a function of rng that gives the fault, and what must be said of it
READ = {
    "cloud in UTC": (lambda r: later(any_of(r, -18.0, 18.0, 37.0)), OUTSIDE),
    "cloud of another hour": (lambda r: later(3600.0 * r.integers(1, 13)), OUTSIDE),
    "cloud of another day": (lambda r: later(86_400.0 * r.integers(1, 7)), OUTSIDE),
    "drive of another day": (
        lambda r: column("trajectory.csv", ["gps_time"], 1.0, 86_400.0 * r.integers(1, 7)),
        OUTSIDE,
    ),
    "drive in UTC": (lambda r: column("trajectory.csv", ["gps_time"], 1.0, -18.0), OUTSIDE),
    "axes of control": (lambda r: exchanged("control.csv", *PLACE[:2]), "to be swapped"),
    "axes of the drive": (lambda r: exchanged("trajectory.csv", *PLACE[:2]), "to be swapped"),
    "control in feet": (lambda r: column("control.csv", PLACE, 1 / FOOT), "different CRS or zones"),
    "drive in feet": (
        lambda r: column("trajectory.csv", PLACE, 1 / FOOT),
        "different CRS or zones|340 m/s",
    ),
    "control in millimetres": (lambda r: column("control.csv", PLACE, 1000.0), "millimeters"),
    "drive in millimetres": (lambda r: column("trajectory.csv", PLACE, 1000.0), "340 m/s.*units"),
    "control with a zone before": (
        lambda r: column("control.csv", ["easting"], 1.0, 1e6 * r.integers(1, 61)),
        "different CRS or zones|no map",
    ),
    "false northing": (
        lambda r: column("control.csv", ["northing"], 1.0, any_of(r, -1e6, 1e6, 1e7)),
        "different CRS or zones",
    ),
    "heights of control in feet": (lambda r: column("control.csv", ["height"], 1 / FOOT), HEIGHTS),
    "heights over another ellipsoid or geoid": (
        lambda r: column("control.csv", ["height"], 1.0, any_of(r, -1, 1) * r.uniform(15, 60)),
        HEIGHTS,
    ),
    "cloud axes": (lambda r: moved([[0, 1, 0], [1, 0, 0], [0, 0, 1]]), BESIDE),
    "cloud in local coordinates": (lambda r: moved(np.zeros((3, 3)) + np.eye(3) * 1e-6), BESIDE),
    "cloud of another datum": (
        lambda r: moved(np.eye(3), [*r.uniform(60.0, 300.0, 2), 0.0]),
        BESIDE,
    ),
    "angles in radians": (
        lambda r: column("trajectory.csv", ANGLES, np.pi / 180),
        "seem to be in radians",
    ),
    "sizes in centimetres": (lambda r: column("control.csv", ["size"], 100.0), "centimeters"),
    "sigmas of zero": (
        lambda r: column("control.csv", ["sigma_vertical"], 0.0),
        "must be greater than zero",
    ),
    "a lever arm in millimetres": (
        lambda r: text("[0.1, -0.6, 0.4]", "[100.0, -600.0, 400.0]"),
        "lever_arm.*is invalid",
    ),
    "a geographic CRS": (lambda r: text("EPSG:32650", "EPSG:4326"), "projected CRS is needed"),
    "a CRS in feet": (lambda r: text("EPSG:32650", "EPSG:2263"), "foot, not in meters"),
}
ESTIMATED = {
    "cloud late by a second": (lambda r: later(any_of(r, -1.0, 1.0)), BESIDE),
    "drive late by a second": (
        lambda r: column("trajectory.csv", ["gps_time"], 1.0, any_of(r, -1.0, 1.0)),
        BESIDE,
    ),
    "heading from east": (lambda r: column("trajectory.csv", ["heading"], -1.0, 90.0), HEADING),
    "heading to the left": (lambda r: column("trajectory.csv", ["heading"], -1.0), HEADING),
    "heading backwards": (lambda r: column("trajectory.csv", ["heading"], 1.0, 180.0), HEADING),
    "another vertical datum": (
        lambda r: column("control.csv", ["height"], 1.0, any_of(r, -1, 1) * r.uniform(0.25, 5.0)),
        DATUM,
    ),
    "another horizontal datum": (
        lambda r: column("control.csv", PLACE[:2], 1.0, any_of(r, -1, 1) * r.uniform(0.25, 4.0)),
        "offset from the cloud .*horizontal datum",
    ),
    "radii for sizes": (
        lambda r: column("control.csv", ["size"], 0.5),
        "None of the 5 surveyed targets .*check kind and size",
    ),
    "sigmas in millimetres": (
        lambda r: column("control.csv", ["sigma_horizontal", "sigma_vertical"], 1000.0),
        "millimetres",
    ),
    "a boresight in radians": (
        lambda r: text("[90.0, 0.0, 35.0]", "[1.5708, 0.0, 0.6109]"),
        BESIDE,
    ),
    "a boresight of another sign": (lambda r: text("35.0]", "-35.0]"), BESIDE),
    "a boresight in another order": (
        lambda r: text("[90.0, 0.0, 35.0]", "[35.0, 0.0, 90.0]"),
        BESIDE,
    ),
}

CHECKED = {  # what a check says in words of its own
    "heights over another ellipsoid or geoid": "height systems of control and cloud differ",
    "heights of control in feet": "or feet",
    "radii for sizes": "seem to be radii",
}


def said(folder):
    "All that a correction says, in refusing or doing its work"
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            mlscorr.correct(mlscorr.read_survey(folder))
            error = ""
        except ValueError as refusal:
            error = str(refusal)
    return "\n".join([error, *(str(warning.message) for warning in told)])


def checked(folder):
    "All that a check says"
    result = mlscorr.check(folder)
    return "\n".join([*(fault.sentence for fault in result.faults), *result.warnings])


@pytest.mark.skipif(not IS_FULL, reason="in make faults")
def test_a_check_names_them_before(tiny, tmp_path, record_property):
    "A check reports the same as a correction on the meaning of a file, or the cause in its words"
    rng = np.random.default_rng(19)
    number = 0
    unnamed = Counter()
    for kind, (draw, expected) in (READ | ESTIMATED).items():
        shutil.rmtree(tmp_path / "survey", ignore_errors=True)
        folder = shutil.copytree(tiny, tmp_path / "survey")
        draw(rng)(folder)
        number += 1
        if (
            re.search(f"{expected}|{CHECKED.get(kind, expected)}", checked(folder), re.DOTALL)
            is None
        ):
            unnamed[kind] += 1
    record_property("faults of meaning named by a check", f"{number}, unnamed {dict(unnamed)}")
    assert not unnamed


@pytest.mark.parametrize("kinds", [READ, ESTIMATED], ids=["read", "estimated"])
def test_what_a_file_means_is_named(kinds, tiny, tmp_path, record_property):
    "Times, axes, units, frames, heights: the sentence says which of them is likely wrong"
    if kinds is ESTIMATED and not IS_FULL:
        pytest.skip("in make faults; the sentences have tests of their own")
    rng = np.random.default_rng(18)
    number = 0
    unnamed = Counter()
    for _ in range(tries(1, 700 // (len(READ) + len(ESTIMATED)))):
        for kind, (draw, expected) in kinds.items():
            shutil.rmtree(tmp_path / "survey", ignore_errors=True)
            folder = shutil.copytree(tiny, tmp_path / "survey")
            draw(rng)(folder)
            number += 1
            if re.search(expected, said(folder), re.DOTALL) is None:
                unnamed[kind] += 1
    record_property(f"faults of meaning, {len(kinds)} kinds", f"{number}, unnamed {dict(unnamed)}")
    assert unnamed.total() <= 0.05 * number, unnamed
