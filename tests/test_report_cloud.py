"""What the report shows of the cloud, and the accuracy that it states."""

import base64
import hashlib
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_report import drive, fabricate, words

from mlscorr.accuracy import positional_accuracy
from mlscorr.georeference import Correction
from mlscorr.report import write_report
from mlscorr.report.cloud import PANEL, SMALL, CloudViews, close_ups
from mlscorr.report.render import Picture
from mlscorr.report.render.camera import Camera
from mlscorr.report.render.views import View
from mlscorr.report.sample import gather
from mlscorr.report.scene import thin_evenly, turnable
from mlscorr.survey import PointCloud, Trajectory

ORIGIN = np.array([532000.0, 3374000.0, 42.0])  # m
START = 357881.0  # s


def street(points, rng, length=200.0):
    "Points of a street of 20 m width at UTM size, in time along it"
    along = np.sort(rng.uniform(0, length, points))
    xyz = ORIGIN + np.column_stack([along, rng.uniform(-10, 10, points), rng.uniform(0, 8, points)])
    return PointCloud(xyz, START + along / 5.0, rng.uniform(0, 1000, points))


def pieces(cloud, size):
    for first in range(0, len(cloud), size):
        yield cloud[first : first + size]


def target(name, place, moved=(0.3, 0.0, 0.0), gps_time=START + 20.0, left_out=None):
    "A row of report.json that was scanned at a place and surveyed beside it"
    return {
        "name": name,
        "pass": 1,
        "gps_time": gps_time,
        "role": "control",
        "surveyed": (np.array(place) + moved).tolist(),
        "observed": list(place),
        "before": list(moved),
        "after": [0.0, 0.0, 0.001],
        "left_out": left_out,
        "used": True,
        "reason": None,
    }


def shifted(shift, seconds=41.0):
    "A correction that moves all points by the same"
    times = START + np.arange(-1.0, seconds, 0.5)
    still = Rotation.identity(len(times))
    old = Trajectory(times, np.tile(ORIGIN, (len(times), 1)), still)
    return Correction(old, Trajectory(times, old.position + shift, still))


def unpacked(text, kind="<f4"):
    return np.frombuffer(base64.b64decode(text), kind)


# ---- the sample


def test_a_small_cloud_is_gathered_whole_and_a_large_one_evenly():
    "All of 10 000 points where there is room; else every 2^k-th, and all near the targets"
    cloud = street(10_000, np.random.default_rng(1))
    whole = gather(pieces(cloud, 700), [])
    assert whole.step == 1
    np.testing.assert_array_equal(whole.cloud.xyz, cloud.xyz)
    row = target("T1", np.add(ORIGIN, [100.0, 0.0, 2.0]))
    thinned = gather(pieces(cloud, 700), [row], most=1000)
    assert thinned.step == 8
    np.testing.assert_array_equal(thinned.cloud.xyz[:1250], cloud.xyz[::8])
    near = np.linalg.norm(cloud.xyz - row["observed"], axis=1) < 2.0
    assert near.sum() > 5
    kept = {tuple(place) for place in thinned.cloud.xyz[1250:]}
    assert all(tuple(place) in kept for place in cloud.xyz[near])
    assert len(thinned.cloud) <= 4000


def test_the_sample_does_not_depend_on_the_chunks():
    "Chunks of 300 or of 4000 points give the same sample"
    cloud = street(10_000, np.random.default_rng(2))
    rows = [target("T1", np.add(ORIGIN, [40.0, 3.0, 2.0]))]
    samples = [gather(pieces(cloud, size), rows, most=2000) for size in (300, 4000)]
    np.testing.assert_array_equal(*(sample.cloud.xyz for sample in samples))
    assert samples[0].step == samples[1].step == 4


# ---- the scene


def test_the_scene_is_thinned_evenly_in_space():
    "9 of 10 points in one corner don't crowd out the rest: each place is as dense as any other"
    rng = np.random.default_rng(3)
    corner = ORIGIN + rng.uniform(0, 1, (90_000, 3)) * [20.0, 20.0, 0.1]
    ground = ORIGIN + rng.uniform(0, 1, (10_000, 3)) * [200.0, 20.0, 0.1]
    rows, edge = thin_evenly(np.vstack([corner, ground]), most=1000)
    assert 400 < len(rows) <= 1000 and 1.0 < edge < 4.0
    in_corner = (np.vstack([corner, ground])[rows, 0] < ORIGIN[0] + 20.0).mean()
    assert 0.05 < in_corner < 0.25  # its share of the area is a tenth


def test_the_scene_holds_the_cloud_before_and_after():
    "At UTM size each point is where it was recorded and where it was moved to, within 0.1 mm"
    cloud, shift = street(20_000, np.random.default_rng(4)), np.array([0.31, -0.12, 0.07])
    row = target("T1", np.add(ORIGIN, [100.0, 0.0, 2.0]), shift)
    lost = target("T2", ORIGIN) | {"observed": None, "before": None, "after": None, "used": False}
    scene = turnable(shifted(shift), cloud, [row, lost], [row])
    assert len(json.dumps(scene)) < 3e6
    before, after = (unpacked(scene[key]).reshape(-1, 3) for key in ("before", "after"))
    assert scene["even"] < len(before) <= 60_000
    assert len(unpacked(scene["intensity"], "u1")) == len(before)
    known = {tuple(np.round(place, 3)) for place in cloud.xyz}
    there = before[::50] + np.array(scene["origin"])
    nearest = [np.abs(cloud.xyz - place).max(axis=1).min() for place in there]
    assert max(nearest) < 1e-4 and len(known) > 1000
    np.testing.assert_allclose(after - before, np.tile(shift, (len(before), 1)), atol=1e-4)
    seen, unseen = scene["targets"]
    np.testing.assert_allclose(seen["scanned"][1], seen["surveyed"], atol=1e-4)
    assert "scanned" not in unseen and unseen["role"] == "unused"
    recorded, corrected = (unpacked(line).reshape(-1, 3) for line in scene["trajectory"])
    np.testing.assert_allclose(corrected - recorded, np.tile(shift, (len(recorded), 1)), atol=1e-4)


def test_of_many_targets_the_worst_and_evenly_spread_ones_are_drawn():
    "24 of 300: the 8 that were predicted worst, and others from the first to the last"
    rng = np.random.default_rng(5)
    rows = [target(f"T{k}", ORIGIN, left_out=[0.01, 0.0, 0.0]) for k in range(300)]
    worst = sorted(rng.choice(np.arange(1, 299), 8, replace=False))
    for k in worst:
        rows[k]["left_out"] = [0.0, 0.5, 0.0]
    names = close_ups(rows)
    assert len(names) == 24 and {f"T{k}" for k in worst} <= set(names)
    assert names[0] == "T0" and names[-1] == "T299"
    numbers = [int(name[1:]) for name in names if int(name[1:]) not in worst]
    assert max(np.diff(numbers)) < 30
    assert close_ups(rows[:24]) == [f"T{k}" for k in range(24)]


def test_24_targets_fit_in_15_megabytes_whatever_they_look_like(tmp_path):
    "Pictures of pure noise, which no format makes smaller; names that hold a script don't run"
    rng, evil = np.random.default_rng(6), "</script><script>alert(1)</script>"
    survey, correction, document = fabricate(drive(), 24)
    document["targets"][0]["name"] = evil

    def picture(name, size):
        camera = Camera.towards(ORIGIN, 0.0, 30.0, 100.0, size)
        sides = rng.integers(0, 256, (2, size[1], size[0], 3), dtype=np.uint8)
        return Picture(View(name, name, "", camera, "intensity"), *sides, (0.0, 1.0))

    names = [f"target-{row['name']}" for row in document["targets"][:3]]
    close = [picture(name, SMALL) for name in names]
    large = [picture(name, PANEL) for name in ("overview", "section")]
    cloud = street(100_000, rng)
    scene = turnable(correction, cloud, document["targets"], document["targets"])
    path = tmp_path / "report.html"
    seen = CloudViews((*large, *close), scene, 7)
    write_report(path, survey, correction, document, seen)
    html = path.read_text(encoding="utf-8")
    each = sum(len(png) for png in close[0].panels()) * 4 / 3  # in base64
    assert each > 200_000
    assert path.stat().st_size + 21 * each < 15e6
    assert "<script>alert" not in html
    assert html.count('<input type="range"') == 6
    text = words(html)
    assert "show one point of 7" in text and "3 of 24 targets" in text


# ---- the accuracy


def test_survey_error_counts_into_the_accuracy():
    "RMSE_H^2 = RMSE_E^2 + RMSE_N^2 + the survey's; the class is the next whole centimetre"
    residuals = np.tile([0.03, -0.04, 0.02], (40, 1))
    sigma = np.tile([0.012, 0.0, 0.015], (40, 1))
    found = positional_accuracy(residuals, sigma, 40)
    assert found["rmse_horizontal"] == pytest.approx(np.hypot(0.05, 0.012))
    assert found["rmse_vertical"] == pytest.approx(0.025)
    assert found["rmse_3d"] == pytest.approx(np.hypot(found["rmse_horizontal"], 0.025))
    assert (found["class_horizontal_cm"], found["class_vertical_cm"]) == (6, 3)
    assert found["conformant"]
    assert "meets the 6-cm horizontal" in found["statement"][1]
    assert "twice as accurate" in found["statement"][-1]  # 1.5 cm against 2 cm in height


def test_an_accuracy_of_exactly_a_class_belongs_to_it():
    "3 cm is the 3-cm class, not the next one for a rounding error"
    found = positional_accuracy(np.tile([0.0, 0.03, 0.01], (30, 1)), np.zeros((30, 3)), 30)
    assert (found["class_horizontal_cm"], found["class_vertical_cm"]) == (3, 1)


@pytest.mark.parametrize(("points", "conformant"), [(29, False), (30, True)])
def test_fewer_than_30_check_points_are_no_conformant_test(points, conformant):
    "It says so, however often each was seen"
    residuals = np.full((60, 3), 0.01)
    found = positional_accuracy(residuals, np.full((60, 3), 0.001), points)
    assert found["conformant"] == conformant
    statement = " ".join(found["statement"])
    assert ("fewer than 30 check points are not a conformant test" in statement) != conformant


def test_points_left_out_in_turn_are_an_estimate_and_no_test():
    "However many: they took part in the correction"
    found = positional_accuracy(np.full((50, 3), 0.01), np.zeros((50, 3)), 50, "leave_one_out")
    assert not found["conformant"]
    assert "There are no check points" in found["statement"][0]


def test_without_any_point_the_accuracy_is_not_determined():
    "No number is made up"
    found = positional_accuracy(np.empty((0, 3)), np.empty((0, 3)), 0)
    assert (
        found["rmse_horizontal"] is None
        and found["class_vertical_cm"] is None
        and found["based_on"] is None
    )
    assert "Not determined" in found["statement"][0]


# ---- what the files say


def test_report_json_tells_the_accuracy_and_the_files(commanded):
    "The accuracy by the check point, and the hash of every file that was read and written"
    folder, out = commanded[1].parents[1] / "Erste Fahrt", commanded[1]
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    check = report["check"]["after"]
    assert report["accuracy"]["points"] == 1 and not report["accuracy"]["conformant"]
    assert report["accuracy"]["fit"]["rmse_horizontal"] == pytest.approx(check["rmse_horizontal"])
    assert report["accuracy"]["rmse_horizontal"] > check["rmse_horizontal"]
    assert [row["what"] for row in report["inputs"]][:4] == [
        "survey", "cloud", "trajectory", "control"
    ]  # fmt: skip
    for rows, place in ((report["inputs"], folder), (report["outputs"] + report["files"], out)):
        for row in rows:
            content = (place / row["name"]).read_bytes()
            assert row["sha256"] == hashlib.sha256(content).hexdigest()
    control = [row for row in report["targets"] if row["role"] == "control" and row["used"]]
    left_out = np.array([row["left_out"] for row in control])
    assert np.sqrt((left_out**2).mean(axis=0)) == pytest.approx(
        report["control"]["leave_one_out"]["rmse"]
    )


def test_the_page_shows_the_pictures_of_its_survey(commanded):
    "Overview, each target that was seen, the 3D view, and the verdict on check points"
    html = (commanded[1] / "report.html").read_text(encoding="utf-8")
    text = words(html)
    assert "as independent check points tell" in text
    for name in ("T01", "T02", "T03", "T04", "T05"):
        assert f"{name}: how much of the picture" in html
    assert "not a conformant test" in text and 'id="scene"' in html
