"""The data of the 3D view."""

import json

import numpy as np

from mlscorr.evaluate import TargetRow
from mlscorr.report.cloud import thin_evenly, viewer_data
from tests.beds.reports import because
from tests.beds.street_of_points import ORIGIN, shifted, street, target, unpacked


def test_the_scene_is_thinned_evenly_in_space():
    "9 of 10 points in one corner don't crowd out the rest: each place is as dense as any other"
    rng = np.random.default_rng(3)
    corner = ORIGIN + rng.uniform(0, 1, (90_000, 3)) * [20.0, 20.0, 0.1]
    ground = ORIGIN + rng.uniform(0, 1, (10_000, 3)) * [200.0, 20.0, 0.1]
    rows, edge = thin_evenly(np.vstack([corner, ground]), limit=1000)
    assert 400 < len(rows) <= 1000 and 1.0 < edge < 4.0
    in_corner = (np.vstack([corner, ground])[rows, 0] < ORIGIN[0] + 20.0).mean()
    assert 0.05 < in_corner < 0.25  # its share of the area is a tenth


def test_the_scene_holds_the_cloud_before_and_after():
    "At UTM size each point is where it was recorded and where it was moved to, within 0.1 mm"
    cloud = street(20_000, np.random.default_rng(4))
    shift = np.array([0.31, -0.12, 0.07])
    row = target("T1", np.add(ORIGIN, [100.0, 0.0, 2.0]), shift)
    lost = TargetRow.unobserved("T2", None, "control", ORIGIN, because("not seen"))
    scene = viewer_data(shifted(shift), cloud, [row, lost], [row])
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
