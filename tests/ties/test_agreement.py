"""Ties that agree, how much a second of them is believed, and what they hold."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.ties import (
    SETTINGS,
    consistent_ties,
    group_by_time,
    information,
    pair_features,
    unconstrained_directions,
    unconstrained_sentence,
    weigh_by_time,
)
from tests.beds import tie_streets as street

UP = np.array([0.0, 0.0, 1.0])


def ties_of(features, sigma=0.05):
    "Ties of features that nothing is known of, and that correction of nothing"
    zero = np.zeros((len(features), 3))
    return pair_features(features, zero, np.full(len(features), sigma), 1.0), zero


def test_a_car_that_left_is_refused():
    "Its flat bonnet 0.5 m above the road of the second pass disagrees with the road beside it"
    rng = np.random.default_rng(5)
    n = 3_000
    hood = np.column_stack([rng.uniform(3, 13, n), rng.uniform(4.2, 6.4, n), np.full(n, 0.5)])
    survey = street.survey()
    features = street.collect(survey, street.clouds(1, car=hood))
    ties, zero = ties_of(features, 0.4)
    is_car = np.abs(ties.misclosure) > 0.3
    agree = consistent_ties(ties, zero)
    assert is_car.sum() > 3
    assert not agree[is_car].any()
    assert agree[~is_car].mean() > 0.95


def test_what_drifts_together_agrees():
    "A second pass that is 0.4 m off as a whole loses no tie by it"
    wrong, _ = street.misplaced(street.features(), (0.3, -0.2, 0.2))
    ties, zero = ties_of(wrong, 0.3)
    assert consistent_ties(ties, zero).mean() > 0.95


def test_ties_without_neighbours_are_kept():
    "With fewer than five others near it, a tie can't be refused"
    ties, zero = ties_of(street.features())
    lone = ties[:4]
    far = replace(lone, misclosure=lone.misclosure + np.array([0.0, 0.0, 0.0, 1.0]))
    assert consistent_ties(far, zero).all()
    assert len(consistent_ties(ties[:0], zero)) == 0


def test_noise_of_normals_holds_no_tunnel():
    "Without walls across the way its direction is unheld, however many noisy normals there are"
    ties, _ = ties_of(street.features())
    assert list(unconstrained_directions(ties)) == []
    tunnel = ties[(np.abs(ties.direction[:, 0]) < 0.1) & (ties.kind == "plane")]
    ((part, axis),) = unconstrained_directions(tunnel)
    assert len(part) == len(tunnel)
    assert abs(axis[0]) > np.cos(np.radians(3.0))
    assert "passes 1 and 2" in unconstrained_sentence(part, axis)


def later(ties, stretches, azimuth=0.0):
    "The same ties some stretches of time later, on a way turned by an azimuth (deg)"
    turned = Rotation.from_euler("z", -azimuth, degrees=True).apply(ties.direction)
    time = ties.gps_time + stretches * SETTINGS.pause
    return replace(ties, gps_time=time, direction=turned)


def test_a_wall_in_one_place_holds_no_tunnel():
    "Walls across the way in one stretch of five hold the one where they stand"
    ties, _ = ties_of(street.features())
    tunnel = ties[(np.abs(ties.direction[:, 0]) < 0.1) & (ties.kind == "plane")]
    parts = [later(tunnel, number) for number in range(1, 5)]
    ((part, axis),) = unconstrained_directions(type(ties).concatenate([ties, *parts]))
    assert len(part) == 4 * len(tunnel)
    assert abs(axis[0]) > np.cos(np.radians(3.0))
    parts = [later(ties, number) for number in range(1, 3)]
    assert (
        list(unconstrained_directions(type(ties).concatenate([ties, *parts, later(tunnel, 3)])))
        == []
    )


def test_a_bend_holds_no_tunnel():
    "Walls that turn with the way, by 15 deg from stretch to stretch, stand across it nowhere"
    ties, _ = ties_of(street.features())
    tunnel = ties[(np.abs(ties.direction[:, 0]) < 0.1) & (ties.kind == "plane")]
    bent = type(ties).concatenate([later(tunnel, n, 15.0 * (n - 2)) for n in range(5)])
    ((part, axis),) = unconstrained_directions(bent)
    assert len(part) == len(bent)
    assert abs(axis[0]) > np.cos(np.radians(3.0))


def test_a_tunnel_leaves_its_length_unheld():
    "Walls, road and no cross wall: the weakest direction is along the way, by a factor of 100"
    ties, _ = ties_of(street.features())
    tunnel = ties[np.abs(ties.direction[:, 0]) < 0.1]
    held = information(tunnel, np.zeros(len(tunnel), int))
    values, axes = np.linalg.eigh(held)
    assert np.abs(axes[0, 0, 0]) > 0.999
    assert values[0, 0] < values[0, 1] / 100
    whole = np.linalg.eigvalsh(information(ties, np.zeros(len(ties), int)))
    assert whole[0, 0] > 1 / 0.005**2


def test_no_second_is_better_than_its_bound():
    "Whatever their number, the ties of a second know a shift to 5 mm per axis at best"
    ties, _ = ties_of(street.features())
    for side in (0, 1):
        group = group_by_time(ties, side, SURFACES.moment)
        sigma = np.linalg.eigvalsh(information(weigh_by_time(ties), group))[:, -1] ** -0.5
        assert sigma.min() > 0.0049
        assert np.linalg.eigvalsh(information(ties, group))[:, -1].max() ** -0.5 < 0.0008


def test_many_ties_take_no_weight_from_few():
    "Ten times as many ties of the road leave those of walls as they are"
    ties, _ = ties_of(street.features())
    road = ties[np.abs(ties.direction @ UP) > 0.99]
    wall = ties[np.abs(ties.direction @ UP) < 0.1]
    crowd = type(ties).concatenate([wall, *[road] * 10])
    alone = weigh_by_time(wall).variance
    ratio = weigh_by_time(crowd).variance[: len(wall)] / alone
    assert np.percentile(ratio, 95) < 1.05
