"""The extraction finds simulated targets where they are, or says nothing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.closure.rerun import _boards, _drawn, _fitted, _meet, _views_of, refit_targets
from mlscorr.survey import PointCloud, Trajectory

pytestmark = pytest.mark.long

CENTRE = np.array([532_006.0, 3_374_010.0, 42.0])  # m, UTM; on a wall that faces the drive
START = 413_200.0  # s
SIZE = 0.6  # m


@pytest.fixture(scope="module")
def drive(case):
    "A survey of a drive north at 5 m/s, 6 m beside the wall"
    time = START + np.arange(0.0, 4.0, 0.01)
    path = CENTRE + np.outer(time - START - 2.0, [0.0, 5.0, 0.0]) - [6.0, 0.0, 0.0]
    trajectory = Trajectory(time, path, Rotation.identity(len(time)))
    return replace(case[0], trajectory=trajectory, mounting=None)


def wall(rng, kind="circle", centre=CENTRE, noise=0.003):
    "Points every 1.5 cm on the wall about a white target, with noise across it"
    axis = np.arange(-1.0, 1.0, 0.015)
    along, up = (grid.ravel() for grid in np.meshgrid(axis, axis, indexing="ij"))
    xyz = CENTRE + np.column_stack([rng.normal(0.0, noise, len(along)), along, up])
    apart = xyz[:, 1:] - centre[1:]
    if kind == "circle":
        inside = np.hypot(*apart.T) <= SIZE / 2
    else:
        inside = np.abs(apart).max(axis=1) <= SIZE / 2
    intensity = np.where(inside, 20_000.0, 3_000.0) * rng.normal(1.0, 0.05, len(along))
    return PointCloud(xyz, START + 2.0 + along / 5.0, intensity)


def fit(cloud, survey, expected=CENTRE, kind="circle", bright=20_000.0):
    rng = np.random.default_rng(3)
    return _fitted(cloud, (kind, SIZE), survey, expected, bright, rng)


@pytest.mark.parametrize("kind, limit", [("circle", 0.003), ("square", 0.005)])
@pytest.mark.parametrize("moved", [(0.0, 0.0, 0.0), (0.0, 0.12, -0.05)])
def test_a_target_is_found_where_it_is(drive, kind, limit, moved):
    "To 3 mm, and where edges lie between lines 15 mm apart to 5 mm, also 13 cm away"
    centre = CENTRE + np.array(moved)
    target = fit(wall(np.random.default_rng(1), kind, centre), drive, kind=kind)
    assert np.linalg.norm(target.position - centre) < limit  # m
    assert target.kind == kind and target.size == SIZE


def test_a_target_elsewhere_is_another(drive):
    "One that stands more than half its size away is not the one that was expected"
    centre = CENTRE + np.array([0.0, 0.5, 0.2])
    cloud = wall(np.random.default_rng(1), centre=centre)
    assert np.linalg.norm(centre - CENTRE) > SETTINGS.largest_offset * SIZE
    assert fit(cloud, drive) is None


def test_a_few_points_are_no_target(drive):
    "Ten points about the expected place tell nothing, however bright"
    cloud = wall(np.random.default_rng(1))
    near = np.argsort(np.linalg.norm(cloud.xyz - CENTRE, axis=1))[:10]
    assert fit(cloud[near], drive) is None
    assert fit(cloud[:0], drive) is None


def test_a_wall_without_paint_is_no_target(drive):
    "The same wall of one intensity has no disc"
    cloud = wall(np.random.default_rng(1))
    plain = replace(cloud, intensity=np.full(len(cloud), 3_000.0))
    assert fit(plain, drive) is None


def simulated_points(case):
    "Points that refit_targets takes from a run without effects"
    survey, _, rows, beams = case
    run, dither, speckle, _ = _drawn(rows, survey, beams, (), np.random.default_rng(9))
    boards = _boards(rows, beams, ())
    met = _meet(rows, beams, _views_of(rows, beams), run.beams, boards, speckle)
    xyz, kept = run.measure(met)
    return xyz + dither, kept, met, run.beams, boards


def refitted(case, simulated):
    "Residuals (m,), NaN where nothing was filled in"
    survey, _, rows, beams = case
    residual = np.full(len(rows), np.nan)
    views = _views_of(rows, beams)
    refit_targets(residual, rows, survey, beams, views, simulated, np.random.default_rng(1))
    return residual


@pytest.fixture(scope="module")
def simulated(case):
    return simulated_points(case)


def test_residuals_are_found_less_surveyed(case, simulated):
    "All points 3 cm to the east raise the residuals by 3 cm along the east, to 1 mm"
    rows, (xyz, *others) = case[2], simulated
    shift = np.array([0.03, 0.0, 0.0])
    before = refitted(case, simulated)
    after = refitted(case, (xyz + shift, *others))
    on = rows.channel == "target"
    known = np.isfinite(before) & np.isfinite(after)
    assert known[on].mean() > 0.9 and not known[~on].any()
    expected = rows.direction[known] @ shift
    np.testing.assert_allclose((after - before)[known], expected, atol=1e-3)
    assert np.sqrt(np.mean(before[known] ** 2)) < 2e-3  # m


def test_targets_without_points_are_left_open(case, simulated):
    "Rows of a view without returns do not change, the others are filled"
    _, _, rows, beams = case
    xyz, kept, *others = simulated
    view = np.flatnonzero(beams.target == 0)[0]
    lost = refitted(case, (xyz, kept & (beams.view != view), *others))
    whole = refitted(case, simulated)
    own = (rows.item == beams.item[view]) & (rows.channel == "target")
    assert np.isnan(lost[own]).all()
    np.testing.assert_array_equal(lost[~own], whole[~own])


def test_what_is_known_much_worse_than_observed_is_not_compared(case, simulated):
    "Of a twelfth of the points: beside rows of 0.1 mm some are left open, beside rows of 1 m not"
    survey, read, rows, beams = case
    rng = np.random.default_rng(4)
    xyz, kept, *others = simulated
    thin = kept & (rng.random(len(kept)) < 0.08)
    sure = replace(rows, noise=np.full(len(rows), 1e-8))
    strict = refitted((survey, read, sure, beams), (xyz, thin, *others))
    vague = refitted(
        (survey, read, replace(rows, noise=np.ones(len(rows))), beams), (xyz, thin, *others)
    )
    assert np.isfinite(strict).sum() < np.isfinite(vague).sum()
    both = np.isfinite(strict)
    np.testing.assert_array_equal(strict[both], vague[both])
