"""The wall that is cut."""

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.estimate import TieResiduals
from mlscorr.report.render import worst_facades
from mlscorr.report.render._scout import Scouted
from mlscorr.report.render._views import PictureOptions, section
from mlscorr.report.render.section import find_place
from mlscorr.survey import PointCloud, Ties
from tests.beds.street_of_points import ORIGIN, START


def wall(split, apart):
    "A wall of 3 m height over ground, scanned once or twice, the second time apart by so much"
    rng = np.random.default_rng(5)
    n = 4000
    late = np.arange(n) >= n // 2 if split else np.zeros(n, bool)
    xyz = np.column_stack([rng.uniform(0, 8, n), np.zeros(n), rng.uniform(0, 3, n)])
    xyz[:, 1] += 0.003 * rng.standard_normal(n)
    floor = rng.random(n) < 0.3
    xyz[floor] *= [1, 0, 0]
    xyz[floor, 1] = rng.uniform(-1, 0, floor.sum())
    true = Rotation.from_euler("z", 30, degrees=True).apply(xyz)
    normal = Rotation.from_euler("z", 30, degrees=True).apply([0.0, 1.0, 0.0])
    gone = np.where(late, 1.0, 0.0 if split else 1.0)[:, None] * apart * normal
    time = START + np.where(late, 100.0, 0.0)
    before, after = (PointCloud(ORIGIN + v, time, np.ones(n)) for v in (true + gone, true))
    return Scouted(before, after, np.empty((0, 3))), normal


def test_the_section_cuts_a_wall_seen_twice_across():
    "Two visits 0.12 m apart are found, with the wall's normal to 1 deg and the gap to 5 mm"
    scouted, normal = wall(True, 0.12)
    place = find_place(scouted)
    assert abs(place.normal @ normal) > np.cos(np.radians(1.0))
    assert place.splits == (START + 50.0,)
    np.testing.assert_allclose([place.before, place.after], [0.12, 0.0], atol=0.005)


def tie_at(scouted, normal, passes=(3, 5), used=True):
    "TieResiduals of one tie in the middle of the wall"
    time = np.array([[START, START + 100.0]])
    before = scouted.before
    high = before.xyz[:, 2] > ORIGIN[2] + 1.0
    place = [before.xyz[high & (before.gps_time == t)].mean(axis=0) for t in time[0]]
    tie = Ties(
        gps_time=time,
        place=np.array([place]),
        direction=normal[None],
        misclosure=np.array([normal @ (place[1] - place[0])]),
        variance=np.array([1e-5]),
        kind=np.array(["plane"]),
        pass_number=np.array([passes]),
        scanner=np.zeros((1, 2), int),
        feature=np.array([[0, 1]]),
    )
    return TieResiduals(tie, np.array([used]), np.zeros(1))


def test_a_tie_chooses_the_wall_and_names_the_passes():
    "The section of a tied wall has the passes' numbers, 0.12 m apart before and 0 after, to 5 mm"
    scouted, normal = wall(True, 0.12)
    place = find_place(scouted, tie_at(scouted, normal))
    assert place.passes == (3, 5)
    np.testing.assert_allclose([place.before, place.after], [0.12, 0.0], atol=0.005)
    view = section(scouted, PictureOptions((640, 480)), tie_at(scouted, normal))
    assert view.visits == ("scanned in pass 3", "scanned in pass 5")
    assert "scanned twice: 12.0 cm apart before" in view.title


def test_ties_that_are_not_used_choose_no_wall():
    "A refused tie, one of the road, and two visits of one pass: no passes to name"
    scouted, normal = wall(True, 0.12)
    assert find_place(scouted, tie_at(scouted, normal, used=False)).passes == ()
    assert find_place(scouted, tie_at(scouted, normal, (2, 2))).passes == ()
    up = np.array([0.0, 0.0, 1.0])
    assert len(worst_facades(tie_at(scouted, up))) == 0


def test_three_visits_have_three_colours():
    "Each visit has a number of its own, and their faces' largest distance is told"
    parts = [wall(True, apart)[0] for apart in (0.1, 0.3)]
    late = parts[1].before.gps_time > START + 50.0
    time = np.where(late, START + 200.0, parts[1].before.gps_time)
    before, after = (
        PointCloud(
            np.concatenate([getattr(parts[0], side).xyz, getattr(parts[1], side).xyz[late]]),
            np.concatenate([parts[0].before.gps_time, time[late]]),
            np.ones(len(late) + late.sum()),
        )
        for side in ("before", "after")
    )
    view = section(Scouted(before, after, np.empty((0, 3))), PictureOptions((640, 480)))
    assert view.splits == (START + 50.0, START + 150.0)
    assert len(view.visits) == 3
    assert "scanned 3 times: 30.0 cm apart before" in view.title


def test_the_section_of_a_wall_seen_once_tells_how_far_it_moves():
    "Seen once, the wall's movement is that of the correction to 1 mm; without a wall no place"
    scouted, _ = wall(False, 0.3)
    place = find_place(scouted)
    assert place.splits == ()
    np.testing.assert_allclose(place.moved, 0.3, atol=1e-3)
    flat = PointCloud(scouted.before.xyz * [1, 1, 0], scouted.before.gps_time, np.ones(4000))
    assert find_place(Scouted(flat, flat, scouted.normals)) is None
