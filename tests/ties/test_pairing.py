"""Pairing of features that are the same object."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.survey import TieFeatures
from mlscorr.ties import pair_features, residuals
from tests.beds import painted_roads as road
from tests.beds import tie_streets as street

NOTHING = np.zeros(3)


def walls(place, number, normal=(1.0, 0.0, 0.0), time=None):
    "A plane at each place (n, 3), of the passes (n,)"
    place = street.ORIGIN + np.array(place, float)
    number = np.array(number)
    n = len(place)
    return TieFeatures(
        pass_number=number,
        scanner=np.zeros(n, int),
        kind=np.full(n, "plane"),
        gps_time=street.START + 100.0 * number if time is None else np.array(time),
        centre=place,
        direction=np.broadcast_to(np.array(normal), (n, 3)),
        variance=np.full(n, 1e-6),
        tilt=np.full(n, 1e-4),
        extent=np.full(n, 0.3),
        points=np.full(n, 100),
        sweep=np.zeros((n, 3)),
    )


def pair(features, sigma, radius=2.0, correction=NOTHING, **options):
    "Ties of features with the same correction and sigma everywhere"
    n = len(features)
    correction = np.broadcast_to(correction, (n, 3))
    return pair_features(features, correction, np.full(n, sigma), radius, **options)


def test_undisturbed_passes_agree_within_their_sigma():
    "Ties of two passes without any error are zero within stated sigmas, at 3 mm and less"
    ties = pair(street.features(), 0.02)
    assert len(ties) > 300
    ratio = ties.misclosure / ties.sigma
    planes = ties.kind == "plane"
    assert np.mean(np.abs(ratio) < 3) > 0.97
    assert np.median(ties.sigma[planes]) < 0.0035
    assert set(map(tuple, ties.pass_number)) == {(1, 2)}


def test_metres_and_degrees_apart_true_pairs_prevail():
    "Passes 1.5 m apart with a boresight off by 2 deg: with the true correction all are paired"
    wrong, truth = street.misplaced(street.features(), (0.8, -1.0, 0.8), (1.0, 1.5, -1.0))
    known = pair_features(wrong, truth, np.full(len(wrong), 0.05), 2.0)
    assert len(known) > 300
    assert np.mean(np.abs(residuals(known, truth)) < 0.02) > 0.98
    blind = pair(wrong, 0.7)
    assert len(blind) > 150
    assert np.mean(np.abs(residuals(blind, truth)) < 0.05) > 0.5


def test_a_correction_closes_what_it_should():
    "The misclosure of a wall 0.4 m off is that, whatever was believed when it was paired"
    features = walls([[0, 0, 0], [0.4, 0.2, 0.1]], [1, 2])
    for believed in (0.0, 0.3):
        correction = np.array([[believed, 0, 0], [0.0, 0, 0]])
        ties = pair_features(features, correction, np.full(2, 0.3), 1.0)
        assert np.isclose(ties.misclosure, 0.4, atol=1e-9).all()
        assert np.isclose(residuals(ties, correction), 0.4 - believed, atol=1e-9).all()


def test_two_scanners_see_a_wall_on_the_same_pass():
    "One that was seen again after a second is a tie if another scanner did, none if the same did"
    features = walls([[0, 0, 0], [0.1, 0.2, 0.1]], [1, 2], time=street.START + np.array([0.0, 1.0]))
    assert len(pair(features, 0.1)) == 0
    ties = pair(replace(features, scanner=np.array([1, 0])), 0.1)
    assert ties.scanner.tolist() == [[1, 0]]  # the earlier view first
    assert np.isclose(ties.misclosure, 0.1, atol=1e-9).all()


def test_a_scanner_that_spins_sees_a_wall_again_at_a_visit():
    "Seen after 1.5 s and a minute later: a tie to each, one of them only where visits are enough"
    times = street.START + np.array([0.0, 1.5, 60.0])
    features = walls([[0, 0, 0], [0.1, 0.2, 0.1], [0.4, 0.1, 0.0]], [1, 1, 1], time=times)
    for pause, pairs in ((1.0, [[0, 1], [1, 2]]), (10.0, [[1, 2]])):
        ties = pair(features, 0.1, pause=pause)
        assert ties.feature.tolist() == pairs
    assert len(pair(features[[0, 1]], 0.1, pause=2.0)) == 0


def test_a_repeated_facade_is_not_paired_with_the_next_window():
    """Reveals 1.2 m apart, of which each pass sees every other: none is near enough where sigma is
    0.2 m, and where it is 0.6 m those beyond the next pair too
    """
    places = [[1.2 * i, 8.0, 3.0] for i in range(20)]
    features = walls(places, [1 + i % 2 for i in range(20)])
    assert len(pair(features, 0.2)) == 0
    assert len(pair(features, 0.6)) == 0


def test_a_street_that_changed_at_random_has_no_ties():
    "Features of the second pass at random places: those that pair do so elsewhere too"
    features = street.features()
    rng = np.random.default_rng(1)
    late = features.pass_number == 2
    low, high = (edge(features.centre, axis=0) for edge in (np.min, np.max))
    centre = np.where(late[:, None], rng.uniform(low, high, features.centre.shape), features.centre)
    assert len(pair(features, 0.4)) > 300
    assert len(pair(replace(features, centre=centre), 0.4)) == 0


def test_chance_in_one_direction_takes_nothing_from_another():
    "Houses rebuilt beside the same road: its ties stay, in full, and hardly another one"
    features = street.features()
    rng = np.random.default_rng(1)
    is_road = features.direction[:, 2] > 0.9
    gone = (features.pass_number == 2) & ~is_road
    low, high = (edge(features.centre, axis=0) for edge in (np.min, np.max))
    centre = np.where(gone[:, None], rng.uniform(low, high, features.centre.shape), features.centre)
    is_road = [
        pair(replace(features, centre=place), 0.4).direction[:, 2] > 0.9
        for place in (features.centre, centre)
    ]
    assert is_road[1].sum() == is_road[0].sum()
    assert (~is_road[1]).sum() < (~is_road[0]).sum() / 10


@pytest.mark.parametrize("uncertain", [1, 2])
def test_a_pass_whose_place_is_hardly_known_pairs_with_one_that_is(uncertain):
    "Metres of sigma in either pass, centimetres in the other: gates are wide, yet no chance"
    features = street.features()
    sigma = np.where(features.pass_number == uncertain, 1.0, 0.02)
    ties = pair_features(features, np.zeros((len(features), 3)), sigma, 4.0)
    assert len(ties) > 300


def test_a_rough_surface_is_no_chance():
    "Ground that varies by 3 cm from metre to metre pairs with itself, within a gate of 2 cm too"
    rng = np.random.default_rng(1)
    east, north = np.mgrid[:20, :20].reshape(2, -1) / 2
    places = np.column_stack([east, north, 0.03 * rng.standard_normal(400)])
    again = places + 0.005 * rng.standard_normal((400, 3))
    features = walls([*places, *again], [1] * 400 + [2] * 400, (0.0, 0.0, 1.0))
    assert len(pair(features, 0.005, radius=0.02)) > 300


def test_a_parallel_street_is_another():
    "Facades of the next street, 40 m aside and beyond any radius, are no partners"
    features = walls([[0, 0, 2], [40.0, 0, 2]], [1, 2])
    assert len(pair(features, 20.0, radius=10.0)) == 0
    assert len(pair(features, 20.0, radius=50.0)) == 1


def test_the_nearest_of_both_is_a_pair():
    "Of two walls 0.3 m behind each other each finds itself in the other pass, not its neighbour"
    features = walls([[0, 0, 0], [0.3, 0, 0], [0.08, 0, 0], [0.38, 0, 0]], [1, 1, 2, 2])
    ties = pair(features, 0.2)
    assert np.array_equal(ties.feature, [[0, 2], [1, 3]])


def test_walls_seen_from_both_sides_are_two():
    "A thin wall's other side faces away: no pair"
    features = walls([[0, 0, 0], [0.1, 0, 0]], [1, 2])
    turned = replace(features, direction=features.direction * np.array([[1], [-1]]))
    assert len(pair(features, 0.2)) == 1
    assert len(pair(turned, 0.2)) == 0


@pytest.mark.parametrize(("degrees", "count"), [(5.0, 1), (12.0, 0)])
def test_directions_are_parallel_within_the_angle(degrees, count):
    "Up to 8 degrees apart, two walls may be the same"
    features = walls([[0, 0, 0], [0.1, 0, 0]], [1, 2])
    turn = np.radians(degrees)
    direction = np.array([[1.0, 0, 0], [np.cos(turn), np.sin(turn), 0]])
    features = replace(features, direction=direction)
    assert len(pair(features, 0.2)) == count


def test_one_pass_has_no_ties():
    "Features measured once in a single pass have no ties"
    assert len(pair(street.features(1, 1), 1.0)) == 0


def test_nothing_has_no_ties():
    "A street without a plane or pole is no error"
    assert len(pair_features(street.features()[[]], np.zeros((0, 3)), np.zeros(0), 2.0)) == 0


def test_a_loop_is_tied_to_itself():
    "The same pass 45 s later sees the wall again; 5 s later it still sees it for the first time"
    places = [[0, 0, 0], [0.05, 0, 0], [0.02, 0, 0]]
    time = street.START + np.array([0.0, 5.0, 45.0])
    ties = pair(walls(places, [1, 1, 1], time=time), 0.2)
    assert len(ties) == 1
    assert ties.gps_time[0, 1] == time[2]


def test_each_pass_gives_a_partner():
    "Seen by four passes, a wall has six ties"
    places = [[0.01 * i, 0, 0] for i in range(4)]
    assert len(pair(walls(places, [1, 2, 3, 4]), 0.2)) == 6


def test_a_pole_ties_both_directions_across_it():
    "Two rows across the axis, none along it, and never with a plane"
    features = walls([[0, 0, 0], [0.1, 0.05, 0.4], [0.1, 0.0, 0.0]], [1, 2, 2], (0.0, 0.0, 1.0))
    features = replace(features, kind=np.array(["pole", "pole", "plane"]))
    ties = pair(features, 0.2)
    assert np.array_equal(ties.kind, ["pole", "pole"])
    assert np.abs(ties.direction[:, 2]).max() < 1e-12
    shift = np.linalg.solve(ties.direction[:, :2], ties.misclosure)
    assert np.allclose(shift, [0.1, 0.05], atol=1e-9)


@pytest.mark.parametrize(("kind", "count"), [("pole", 2), ("plane", 0)])
def test_a_gate_is_no_narrower_than_the_noise(kind, count):
    "At a sigma of 3 mm, poles of 2 cm pair up at 5 cm, walls of 1 mm do not"
    features = walls([[10, 5, 1], [10.05, 5, 1]], [1, 2], [0.0, 0.0, 1.0])
    features = replace(features, kind=np.full(2, kind))
    if kind == "pole":
        features = replace(features, variance=np.full(2, 0.02**2))
    else:
        features = replace(features, direction=np.tile([1.0, 0.0, 0.0], (2, 1)))
    assert len(pair(features, 0.003, radius=0.015)) == count


@pytest.mark.parametrize("azimuth", [0.0, 20.0, 45.0])  # deg
def test_poles_hold_along_walls_and_across_them(azimuth):
    "In a street turned by an azimuth, a pole's rows are across the walls and along them alone"
    across = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
    place = [[10, 5, 1], [10, 5, 1], [14, 5, 1], [14, 5, 1]]
    features = walls(place, [1, 2, 1, 2], across)
    direction = np.where(np.arange(4)[:, None] < 2, [0.0, 0.0, 1.0], across)
    kind = np.repeat(["pole", "plane"], 2)
    ties = pair(replace(features, kind=kind, direction=direction), 0.02)
    held = np.abs(ties.direction[ties.kind == "pole"] @ across)
    assert np.sort(held) == pytest.approx([0.0, 1.0], abs=1e-9)


@pytest.mark.parametrize("azimuth", [0.0, 45.0, 70.0, 135.0])
def test_paint_is_paired_whichever_way_it_was_crossed(azimuth):
    "Passes 15 cm apart across, 20 along: lines tell the one, dashes the other, to their sigmas"
    # m
    along = 0.20
    left = 0.15
    shift = road.turned(np.array([[along, left, 0.0]]), azimuth)[0] - road.ORIGIN
    ties = pair(road.features(azimuth, shift=shift), 0.08)
    for kind, least in (("line", 40), ("dash", 4)):
        part = ties[ties.kind == kind]
        assert len(part) >= least
        error = part.misclosure - part.direction @ shift
        assert np.mean(np.abs(error) < 3 * part.sigma) > 0.95
        size = np.median(np.abs(part.direction @ shift))
        assert np.isclose(size, left if kind == "line" else along, atol=0.01)  # m


def painted(place, number, kind="line", extent=0.3, direction=(0.6, -0.8, 0.0)):
    "Paint at each place (n, 3), of the passes (n,)"
    features = walls(place, number, direction)
    n = len(features)
    return replace(features, kind=np.full(n, kind), extent=np.broadcast_to(extent, n).copy())


def test_paint_has_no_front():
    "Lines whose directions are opposite are a pair, walls that face away from each other are none"
    opposite = np.array([[0.6, -0.8, 0.0], [-0.6, 0.8, 0.0]])
    lines = replace(painted([[0, 0, 0], [0.1, 0, 0]], [1, 2]), direction=opposite)
    ties = pair(lines, 0.1)
    assert np.allclose(np.abs(ties.misclosure), 0.06, atol=1e-9)  # m
    assert np.allclose(np.sign(ties.misclosure), ties.direction[:, 0] / 0.6, atol=1e-9)
    assert len(pair(replace(lines, kind=np.full(2, "plane")), 0.1)) == 0


@pytest.mark.parametrize(("sigma", "number"), [(0.2, 2), (0.4, 0), (0.6, 0)])
def test_lanes_that_drift_could_exchange_are_not_paired(sigma, number):
    "Lines 3.2 m apart are pairs while two gates of three sigmas of a difference reach less far"
    across = 3.2 * np.array([0.6, -0.8, 0.0])
    place = np.array([[0.0, 0.0, 0.0], across])
    ties = pair(painted(np.concatenate([place, place + 0.1]), [1, 1, 2, 2]), sigma)
    assert len(ties) == number


def test_dashes_of_other_lengths_are_not_paired():
    "A dash of which a parked car hid a metre is no pair of the whole; one as long is"
    place = [[0, 0, 0], [0.1, 0.0, 0.0]]
    # m
    whole = 3.0 / np.sqrt(12)
    part = 2.0 / np.sqrt(12)
    assert len(pair(painted(place, [1, 2], "dash", np.array([whole, part])), 0.1)) == 0
    assert len(pair(painted(place, [1, 2], "dash", whole), 0.1)) == 1
