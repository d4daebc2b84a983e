"""Areas: they cover a city once, their weights fade, and pieces hold what lies in them."""

import numpy as np
import pytest

from mlscorr.pipeline.project.areas import Area, areas_of

PLACE = np.array([532_000.0, 3_374_000.0, 40.0])  # m
MARGIN = 50.0  # m


def city(rng, n=20_000):
    "Places (n, 3) in a city of 2 by 1 km, denser in its middle"
    spread = np.array([1000.0, 500.0, 5.0])
    return PLACE + spread * rng.beta(2.0, 2.0, size=(n, 3)) * 2


@pytest.mark.parametrize("seed", range(3))
def test_areas_cover_a_city_once(seed):
    "Each place, and any far away, lies in one area; with its margin none holds more than 3 000"
    rng = np.random.default_rng(seed)
    places = city(rng)
    areas = areas_of(places, 3_000, MARGIN)
    far = PLACE + rng.normal(scale=1e5, size=(200, 3))
    everywhere = np.vstack([places, far])
    assert (sum(area.contains(everywhere).astype(int) for area in areas) == 1).all()
    near = [np.count_nonzero(area.weight(places)) for area in areas]
    assert max(near) <= 3_000
    assert min(area.contains(places).sum() for area in areas) >= 500


def test_areas_are_wider_than_their_margins():
    "With 20 000 places within 150 m no area is cut that would consist of its margin"
    places = PLACE + np.random.default_rng(0).uniform(0, 150.0, size=(20_000, 3))
    assert len(areas_of(places, 3_000, MARGIN)) == 1
    assert len(areas_of(places, 20_000, 1.0)) == 1
    assert len(areas_of(places[:0], 1, MARGIN)) == 1


def test_weights_fade_across_an_edge():
    "Of two areas both weights are a half at the edge, sum up to one, and end at the margin"
    west, east = Area(np.full(2, -np.inf), np.full(2, np.inf), MARGIN).parted(0, PLACE[0])
    away = np.array([-60.0, -50.0, -25.0, 0.0, 25.0, 50.0, 60.0])  # m
    position = PLACE + np.outer(away, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(west.weight(position), [1, 1, 0.75, 0.5, 0.25, 0, 0], atol=1e-9)
    np.testing.assert_allclose(west.weight(position) + east.weight(position), 1.0, atol=1e-9)
    assert west.contains(position).tolist() == [True] * 3 + [False] * 4


def test_weights_are_smooth_at_a_corner():
    "A metre changes no area's share by more than a tenth where four of them meet"
    whole = Area(np.full(2, -np.inf), np.full(2, np.inf), MARGIN)
    areas = [part for half in whole.parted(0, PLACE[0]) for part in half.parted(1, PLACE[1])]
    way = np.linspace(-80.0, 80.0, 161)
    for direction in ([1.0, 0.0, 0.0], [0.7, 0.7, 0.0], [0.6, -0.8, 0.0]):
        weight = np.array([area.weight(PLACE + np.outer(way, direction)) for area in areas])
        share = weight / weight.sum(axis=0)
        assert np.abs(np.diff(share, axis=1)).max() < 0.1
