"""Surveyed and observed targets, and both matched."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.survey import ControlPoints, Matched, TargetObservations

CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m, UTM


def surveyed(*names):
    "Points 10 m apart to the east, with sigmas of 1, 2 and 3 mm"
    n = len(names)
    places = CORNER + np.outer(np.arange(n), [10.0, 0.0, 0.0])
    sigma = np.tile([0.001, 0.002, 0.003], (n, 1))
    return ControlPoints(names, places, sigma, ("circle",) * n, np.full(n, 0.4), sigma * np.nan)


def observed(*names):
    "Observations of points, 5 cm too far north and 2 mm uncertain, a second apart"
    points = surveyed("T1", "T2", "T3")
    places = points[points.rows(names)].position + np.array([0.0, 0.05, 0.0])
    n = len(names)
    return TargetObservations(
        name=names,
        pass_number=np.ones(n, int),
        gps_time=413_200.0 + np.arange(n),
        position=places,
        covariance=np.tile(4e-6 * np.eye(3), (n, 1, 1)),
        normal=np.zeros((n, 3)),
        kind=("circle",) * n,
        size=np.full(n, 0.4),
        points=np.full(n, 100),
    )


def test_rows_are_found_by_name():
    "Names in any order, and twice, give the rows of their points"
    assert surveyed("T1", "T2", "T3").rows(["T3", "T1", "T3"]).tolist() == [2, 0, 2]


def test_a_name_that_nobody_surveyed_is_refused():
    "A name without a point is an error and no guess"
    with pytest.raises(KeyError, match="T9"):
        surveyed("T1").rows(["T9"])


@pytest.mark.parametrize("rows", [[True, False, True], [0, 2], np.array([0, 2])])
def test_a_mask_selects_what_its_numbers_do(rows):
    "Names, kinds and arrays of the same points are taken"
    part = surveyed("T1", "T2", "T3")[rows]
    assert part.name == ("T1", "T3") and part.kind == ("circle", "circle")
    assert part.position[:, 0] - CORNER[0] == pytest.approx([0.0, 20.0])  # m


def test_nothing_selected_is_an_empty_table():
    "No row at all keeps the shapes of the arrays"
    empty = observed("T1", "T2")[[]]
    assert len(empty) == 0 and empty.name == () and empty.covariance.shape == (0, 3, 3)


def test_points_of_two_tables_follow_each_other():
    "Control and check points together keep their order"
    both = surveyed("T1", "T2") + surveyed("C1")
    assert both.name == ("T1", "T2", "C1") and both.position.shape == (3, 3)


def test_the_misclosure_is_what_must_be_added_to_the_cloud():
    "An observation 5 cm too far north has a misclosure of -5 cm, its point's and its own sigma"
    matched = Matched.by_name(observed("T2", "T1", "T2"), surveyed("T1", "T2", "T3"))
    assert matched.misclosure == pytest.approx(np.tile([0.0, -0.05, 0.0], (3, 1)), abs=1e-9)
    assert matched.variance[0] == pytest.approx([5e-6, 8e-6, 13e-6])  # m^2


def test_passes_over_one_point_share_its_number():
    "Points are numbered as they appear, each once"
    matched = Matched.by_name(observed("T2", "T1", "T2", "T3"), surveyed("T1", "T2", "T3"))
    assert matched.point_number.tolist() == [0, 1, 0, 2]
    assert matched[[1, 3]].name == ("T1", "T3") and len(matched[[1, 3]].gps_time) == 2


def test_frozen_nouns_are_not_changed():
    "A table with other places is another one"
    points = surveyed("T1")
    moved = replace(points, position=points.position + 1.0)
    assert np.array_equal(points.position[0], CORNER) and moved.position[0, 2] == 41.0  # m


def test_observations_are_of_the_first_scanner_unless_another_is_named():
    "The number of the scanner follows its row"
    matched = Matched.by_name(observed("T2", "T1"), surveyed("T1", "T2"))
    assert matched.scanner.tolist() == [0, 0]
    named = replace(matched, scanner=np.array([1, 2]))
    assert named[[1, 0]].scanner.tolist() == [2, 1]
