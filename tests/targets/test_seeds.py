"""Seeds stand where targets are, and say how large what they saw is."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.targets import SETTINGS, BrightRegion
from mlscorr.targets._seeds import (
    _circumcircles,
    _extent,
    _surrounded,
    _thinned,
    bright_seeds,
    flat_patches,
    hole_seeds,
    plate_seeds,
    region_seeds,
)
from tests.targets.target_views import KINDS, SIZE, TOLERANCE, centre_of, echoes_of, views, wall

RNG = np.random.default_rng


def disc(u, v):
    return np.hypot(u, v) < SIZE / 2


def places(seeds):
    "Middles of seeds in space (n, 3)"
    return np.array([seed.plane.origin + seed.middle @ seed.plane.axes[:2] for seed in seeds])


def nearest(seeds, place):
    return np.linalg.norm(places(seeds) - place, axis=1).min()


@pytest.mark.parametrize("look", ["disc", "plate", "checkerboard", "retro disc"])
def test_bright_targets_have_a_seed(look):
    "Within a tenth of the size of the true centre, among seeds that all are as large as it may be"
    for seen in views(look):
        seeds = list(bright_seeds(echoes_of(seen), KINDS[look], SIZE))
        assert nearest(seeds, centre_of(seen)) < SIZE / 10
        for seed in seeds:
            assert not seed.by_edges and len(seed.rows) >= SETTINGS.smallest_count
            assert SETTINGS.smallest_length * SIZE <= seed.extent < 2.5 * SIZE


def test_a_seed_of_a_disc_knows_its_extent_and_threshold():
    "0.6 m to a point spacing; all its points are brighter than the level, on the wall's plane"
    echoes = wall(disc, RNG(1))
    seeds = list(bright_seeds(echoes, "circle", SIZE))
    best = min(seeds, key=lambda seed: np.linalg.norm(seed.middle))
    assert best.extent == pytest.approx(SIZE, abs=0.04)
    assert (echoes.intensity[best.rows] >= best.threshold).all()
    assert abs(best.plane.axes[2, 0]) > 0.9999
    assert not best.bloomed


def test_a_saturated_disc_may_be_larger():
    "A disc with more than half of its points at the largest count is saturated"
    echoes = wall(disc, RNG(1))
    clipped = type(echoes)(
        echoes.xyz, echoes.gps_time, np.minimum(echoes.intensity, 10_000.0), echoes.path, TOLERANCE
    )
    assert all(seed.bloomed for seed in bright_seeds(clipped, "circle", SIZE))
    wide = wall(lambda u, v: np.hypot(u, v) < 0.45, RNG(1))
    assert not list(bright_seeds(wide, "circle", 0.5))  # 0.9 m is no disc of 0.5 m


def test_sizes_need_not_be_known():
    "Without a size discs of 0.3 to 1 m have a seed of their extent"
    for size in (0.3, 0.6, 1.0):
        echoes = wall(lambda u, v, size=size: np.hypot(u, v) < size / 2, RNG(2))
        extents = [seed.extent for seed in bright_seeds(echoes, "circle", None)]
        assert min(abs(extent - size) for extent in extents) < 0.05


@pytest.mark.parametrize("look", ["plate", "board"])
def test_plates_have_a_seed_whatever_their_intensity(look):
    "A square that stands free is found by its edges, within a tenth of its size"
    for seen in views(look):
        seeds = list(plate_seeds(echoes_of(seen), KINDS[look], SIZE, RNG(1)))
        assert nearest(seeds, centre_of(seen)) < SIZE / 10
        assert all(seed.by_edges and seed.threshold == 0.0 for seed in seeds)


@pytest.mark.parametrize("size", [SIZE, None])
def test_holes_have_a_seed_in_their_middle(size):
    "Of known size or not: to 3 cm, twice the radius is its extent, points are about it"
    for seen in views("hole"):
        seeds = list(hole_seeds(echoes_of(seen), size, RNG(1)))
        assert nearest(seeds, centre_of(seen)) < 0.03  # m
        best = seeds[int(np.argmin(np.linalg.norm(places(seeds) - centre_of(seen), axis=1)))]
        assert best.extent == pytest.approx(SIZE, abs=0.12)
        assert best.mesh > 0.0


def test_a_wall_without_a_gap_has_no_hole():
    "Nor one with a notch at its border, which is not surrounded"
    whole = wall(disc, RNG(3))
    notch = wall(lambda u, v: np.where(np.hypot(u - 0.9, v) < 0.3, np.nan, 0.0), RNG(3))
    for echoes in (whole, notch):
        middles = [seed.middle for seed in hole_seeds(echoes, SIZE, RNG(1))]
        assert not any(np.abs(middle).max() < 0.5 for middle in middles)


def test_a_region_is_looked_at_alone():
    "Seeds come from bright points within its radius only, in the region's own coordinates"
    two = wall(lambda u, v: (np.hypot(u - 0.5, v) < 0.2) | (np.hypot(u + 0.5, v) < 0.2), RNG(4))
    origin = np.array([532_000.0, 3_374_000.0, 42.0])
    region = BrightRegion(origin + np.array([6.0, 0.5, 0.0]), 0.3, 6_000.0)
    seeds = list(region_seeds(two, region, origin, "circle", None))
    assert len(seeds) >= 1
    for seed in seeds:
        assert np.abs(two.xyz[seed.rows][:, 1] - 0.5).max() < 0.25
        assert (two.intensity[seed.rows] >= 6_000.0).all()


def test_flat_patches_are_the_planes_of_a_piece():
    "Two walls at right angles, the larger first, all points of each and no others, each once"
    rng = RNG(5)
    first = np.column_stack([rng.normal(6.0, 0.002, 3000), rng.uniform(-1, 1, (3000, 2))])
    second = np.column_stack(
        [rng.uniform(4.0, 5.5, 1500), rng.normal(1.0, 0.002, 1500), rng.uniform(-1, 1, 1500)]
    )
    xyz = np.vstack([first, second])
    one = np.ones(len(xyz))
    seen = wall(disc, rng)
    echoes = replace(seen, xyz=xyz, gps_time=one.cumsum(), intensity=one)
    patches = list(flat_patches(echoes, SIZE, RNG(1)))
    assert len(patches) == 2
    (plane, rows), (other, others) = patches
    assert abs(plane.axes[2, 0]) > 0.999 and abs(other.axes[2, 1]) > 0.999
    assert (rows < 3000).mean() > 0.97 and len(rows) > 2900
    assert (others >= 3000).mean() > 0.97


@pytest.mark.parametrize(
    "extent, fits",
    [
        ((0.6, 0.6), True),
        ((0.6, 0.25), True),
        ((0.6, 0.15), False),
        ((0.38, 0.38), False),
        ((0.75, 0.6), True),
        ((0.85, 0.85), False),
    ],
)
def test_extents_tell_what_a_disc_may_be(extent, fits):
    "Half hidden, or seen a little too large; not a stripe, and not half its size"
    points = RNG(6).uniform(0, 1, (4000, 2)) * extent
    found = _extent(points, "circle", SIZE, SIZE)
    assert (found is not None) == fits
    if fits:
        assert found[0] == pytest.approx(max(extent), abs=0.01)
        np.testing.assert_allclose(found[1], np.array(extent) / 2, atol=0.01)


def test_circumcircles_pass_through_their_three_points():
    "Centre as far from each as the radius; of three on a line it is infinite"
    a, b, c = RNG(7).normal(size=(3, 50, 2))
    centre, radius = _circumcircles(a, b, c)
    for corner in (a, b, c):
        np.testing.assert_allclose(np.linalg.norm(corner - centre, axis=1), radius, rtol=1e-6)
    line = np.array([[0.0, 0.0]]), np.array([[1.0, 1.0]]), np.array([[2.0, 2.0]])
    assert np.isinf(_circumcircles(*line)[1]).all()


@pytest.mark.parametrize("share, expected", [(1.0, True), (0.8, True), (0.6, False)])
def test_a_gap_is_surrounded_in_three_quarters_of_the_directions(share, expected):
    "Points on a full circle and on most of it are, on a half-open one not"
    angle = np.linspace(0.0, 2 * np.pi * share, 200, endpoint=False)
    points = np.column_stack([np.cos(angle), np.sin(angle)]) + 5.0
    assert _surrounded(points, np.array([5.0, 5.0])) == expected


def test_thinned_points_are_one_in_each_cube():
    "The same in any order of random numbers while they are few; at most so many of a dense piece"
    xyz = RNG(8).uniform(0, 1, (5000, 3))
    rows = _thinned(xyz, 0.1, RNG(1))
    cubes = np.floor(xyz[rows] / 0.1).astype(int)
    assert len(np.unique(cubes, axis=0)) == len(rows) == len(np.unique(np.floor(xyz / 0.1), axis=0))
    dense = RNG(9).uniform(0, 3, (60_000, 3))
    assert len(_thinned(dense, 0.02, RNG(1))) == SETTINGS.piece_points
