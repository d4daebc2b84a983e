"""A street driven there and back as two drives of a project; the second is off, without control."""

import csv
import shutil

import laspy
import numpy as np

from mlscorr.simulate import Scenario, simulate

SHIFT = np.array([0.31, -0.24, 0.18])  # m, of the second drive's record
SIGMA = 0.3  # m, that it states
PLACE = 532_000.0, 3_374_000.0  # m, where the street begins
PROJECT = """name = "city"
crs = "EPSG:32650"

[control]
file = "control.csv"

[[drive]]
survey = "first"

[[drive]]
name = "second"
files = ["second/*.laz"]

[drive.trajectory]
file = "second/trajectory.csv"

[drive.mounting]
lever_arm = [0.1, -0.6, 0.4]
boresight = [90.0, 0.0, 35.0]
"""


def write_project(folder, duration=8.0, tiles=1):
    "A project.toml in a new folder: first/survey.toml with control, second/ off and without it"
    scenario = Scenario(
        drive={"duration": duration, "passes": [{}, {"direction": "back", "pause": 100.0}]},
        targets={"control": 4, "check": 1, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    )
    whole = folder / "whole"
    simulate(scenario, np.random.default_rng(4)).write(whole)
    header, *lines = (whole / "trajectory.csv").read_text().splitlines()
    rows = np.array([line.split(",") for line in lines])
    gap = int(np.argmax(np.diff(rows[:, 0].astype(float)))) + 1
    for name, part in (("first", rows[:gap]), ("second", rows[gap:].copy())):
        (folder / name).mkdir()
        if name == "second":
            part[:, 1:4] = np.char.mod("%.5f", part[:, 1:4].astype(float) + error(part))
            part[:, 7:10] = f"{SIGMA:.5f}"
        text = "\n".join([header, *(",".join(row) for row in part), ""])
        (folder / name / "trajectory.csv").write_text(text)
    shutil.copy(whole / "control.csv", folder / "control.csv")
    text = (whole / "survey.toml").read_text().replace('"pass-1.laz", "pass-2.laz"', '"*.laz"')
    head, tail = text.split("[control]")
    (folder / "first" / "survey.toml").write_text(head + tail[tail.index("[pos]") :])
    places = _targets(folder)
    for name, number in (("first", 1), ("second", 2)):
        cloud = laspy.read(whole / f"pass-{number}.laz")
        if name == "second":
            xyz = cloud.xyz
            far = np.linalg.norm(xyz[:, None, :2] - places, axis=2).min(axis=1) > 1.5
            cloud.points = cloud.points[far]
            xyz = xyz[far] + SHIFT
            cloud.x, cloud.y, cloud.z = xyz.T
        _write_tiles(cloud, folder / name, tiles)
    shutil.rmtree(whole)
    (folder / "project.toml").write_text(PROJECT)
    return folder / "project.toml"


def write_tiled(folder):
    "The project of two drives of 6 s, of two tiles each"
    write_project(folder, duration=6.0, tiles=2)


def share_tiles(folder):
    "The tiles of both drives as tiles of the project, whose points point_source_ids tell apart"
    names = sorted(path.name for path in (folder / "first").glob("*.laz"))
    (folder / "tiles").mkdir()
    for name in names:
        first, second = (laspy.read(folder / drive / name) for drive in ("first", "second"))
        points = np.concatenate([first.points.array, second.points.array])
        points["point_source_id"] = np.repeat([1, 2], [len(first), len(second)])
        number = np.concatenate([np.arange(len(first)), np.arange(len(second))])
        order = np.argsort(number // 1000, kind="stable")  # now of the one, now of the other
        whole = laspy.LasData(first.header)
        whole.points = laspy.ScaleAwarePointRecord(
            points[order],
            first.header.point_format,
            first.header.scales,
            first.header.offsets,
        )
        whole.write(folder / "tiles" / name)
        (folder / "first" / name).unlink()
        (folder / "second" / name).unlink()
    text = PROJECT.replace('survey = "first"', 'survey = "first"\npoint_source_ids = [1]')
    text = text.replace('["second/*.laz"]', '["tiles/*.laz"]\npoint_source_ids = [2]')
    (folder / "project.toml").write_text(text)
    survey = folder / "first" / "survey.toml"
    survey.write_text(survey.read_text().replace('"*.laz"', '"../tiles/*.laz"'))
    return folder / "project.toml"


def error(rows):
    "Error (n, 3) of the second drive's trajectory. Units: m"
    return np.broadcast_to(SHIFT, (len(rows), 3))


def _targets(folder):
    "Plan places (n, 2) of all targets. Units: m"
    with open(folder / "control.csv") as file:
        rows = list(csv.DictReader(file))
    return np.array([[float(row["easting"]), float(row["northing"])] for row in rows])


def _write_tiles(cloud, folder, tiles):
    "The points of a cloud in some files, one after the other in time"
    for number, part in enumerate(np.array_split(np.arange(len(cloud.points)), tiles), start=1):
        tile = laspy.LasData(cloud.header)
        tile.points = cloud.points[part]
        tile.write(folder / f"tile-{number}.laz")
