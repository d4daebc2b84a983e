import numpy as np
import pytest

from mlscorr.targets.regions import bright_regions

ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM


def wall(rng, bright, points=20_000):
    "A wall of 4 x 4 m at UTM coordinates; bright tells where it is three times as bright"
    uv = rng.uniform(-2, 2, (points, 2))
    xyz = ORIGIN + np.column_stack([uv[:, 0], 0.003 * rng.standard_normal(points), uv[:, 1]])
    return xyz, np.where(bright(uv), 9000, 3000) * rng.normal(1.0, 0.03, points)


@pytest.mark.parametrize("size", [0.3, 0.6])
def test_a_disc_on_a_wall_is_the_only_region(size):
    "Its centre to 2 cm, its half extent to 3 cm, and very like a disc"
    rng = np.random.default_rng(1)
    xyz, intensity = wall(rng, lambda uv: np.hypot(*(uv - 0.4).T) < size / 2, 60_000)
    (region,) = bright_regions(xyz, intensity)
    assert np.linalg.norm(region.centre - ORIGIN - [0.4, 0.0, 0.4]) < 0.02  # m
    assert region.radius == pytest.approx(size / np.sqrt(2), abs=0.03)  # m
    assert region.likeness > 0.9


def test_a_long_stripe_is_no_region():
    "A road marking of 0.15 m by 4 m is bright, and like no target"
    xyz, intensity = wall(np.random.default_rng(2), lambda uv: np.abs(uv[:, 0]) < 0.075)
    assert bright_regions(xyz, intensity) == []


@pytest.mark.parametrize("seed", range(6))
def test_a_checkerboard_on_a_wall_is_a_region(seed):
    "Its white quadrants, however it is turned and the points lie: the centre to 3 cm, alone"
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0.0, np.pi / 2)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])

    def white(uv):
        x, y = axes @ (uv - 0.4).T
        return (np.maximum(np.abs(x), np.abs(y)) < 0.3) & (x * y > 0)

    (region,) = bright_regions(*wall(rng, white, 40_000))
    assert np.linalg.norm(region.centre - ORIGIN - [0.4, 0.0, 0.4]) < 0.03  # m
    assert region.likeness > 0.8
