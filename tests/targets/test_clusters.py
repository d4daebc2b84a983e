import numpy as np
import pytest

from mlscorr.targets import SETTINGS
from mlscorr.targets._clusters import bright_components, components, connected

ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM


def test_bright_components_are_separate_patches():
    "Two bright patches 0.5 m apart are two components; their union comes at no level"
    rng = np.random.default_rng(0)
    xyz = np.column_stack([rng.uniform(-4, 4, (32_000, 2)), np.zeros(32_000)])
    first = np.abs(xyz[:, :2] - [-0.5, 0]).max(axis=1) < 0.25
    second = np.abs(xyz[:, :2] - [0.5, 0]).max(axis=1) < 0.25
    intensity = np.where(first | second, 900.0, 100.0)
    parts = [set(rows) for _, rows in bright_components(xyz + ORIGIN, intensity, 1.0)]
    assert parts == [set(np.flatnonzero(first)), set(np.flatnonzero(second))] or parts == [
        set(np.flatnonzero(second)),
        set(np.flatnonzero(first)),
    ]


def test_what_else_a_piece_holds_changes_no_component():
    "A patch has the same components alone and 2 m beside a brighter wall of ten times the points"
    rng = np.random.default_rng(2)
    patch = np.column_stack([rng.uniform(-0.3, 0.3, (2000, 2)), np.zeros(2000)])
    wall = np.column_stack([rng.uniform(-4.0, 4.0, (20_000, 2)), np.zeros(20_000)])
    wall[:, 0] += 6.3
    xyz = np.vstack([patch, wall])
    intensity = rng.uniform(800.0, 1000.0, 22_000)
    intensity[2000:] *= 1.5
    alone, both = (
        {tuple(rows) for _, rows in bright_components(xyz[:n] + ORIGIN, intensity[:n], 0.6)}
        for n in (2000, 22_000)
    )
    assert alone == {rows for rows in both if rows[0] < 2000}
    assert tuple(range(2000)) in alone


def test_a_wall_is_no_component():
    "A bright plane of 8 m reaches farther than a target and its post at any level"
    rng = np.random.default_rng(3)
    wall = np.column_stack([rng.uniform(-4.0, 4.0, (20_000, 2)), np.zeros(20_000)])
    assert list(bright_components(wall + ORIGIN, np.full(20_000, 900.0), 0.6)) == []


@pytest.mark.parametrize("dimensions", [2, 3])
def test_points_as_near_as_the_link_belong_together(dimensions):
    "A chain of points 8 cm apart is one component by 12 cm, and three where two links are broken"
    chain = np.zeros((30, dimensions))
    chain[:, 0] = 0.08 * np.arange(30)
    assert len(np.unique(connected(chain, 0.12))) == 1
    broken = np.delete(chain, [9, 10, 19, 20], axis=0)
    assert len(np.unique(connected(broken, 0.12))) == 3
    assert connected(chain[:0], 0.12).size == 0


def test_components_of_too_few_points_are_left_out():
    "Two patches, one with a point less than a target needs: the other comes alone, in order"
    n = SETTINGS.smallest_count
    rng = np.random.default_rng(1)
    points = rng.uniform(0, 0.1, (2 * n - 1, 2))
    points[n:] += 5.0
    (part,) = components(points, 0.2)
    assert part.tolist() == list(range(n))
