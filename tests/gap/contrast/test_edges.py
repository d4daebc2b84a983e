"""Depth edges along scan lines."""

import numpy as np
import pytest

from mlscorr.gap.contrast._edges import EdgeCollector, edges_of
from mlscorr.io.clouds import read_chunks
from mlscorr.survey import PointCloud

ORIGIN = np.array([532000.0, 3374000.0, 0.0])
STEP = 1e-3  # rad between pulses
ROUGH = 0.05  # m


def line(ranges, numbers=None):
    "Points and sights of one scan line of ranges, at pulses of some numbers"
    numbers = np.arange(len(ranges)) if numbers is None else numbers
    beam = np.column_stack([np.cos(STEP * numbers), np.sin(STEP * numbers), np.zeros(len(numbers))])
    sight = beam * np.asarray(ranges, float)[:, None]
    time = 413200.0 + 1e-5 * numbers
    return PointCloud(sight + ORIGIN, time, np.ones(len(time))), sight


def test_a_thin_beam_steps():
    "From 10 m to 14 m between two pulses: an edge of no width, on the near surface"
    edges = edges_of(*line([10.0] * 10 + [14.0] * 10), ROUGH)
    assert edges.range == pytest.approx([10.0], abs=0.01)
    assert edges.width == pytest.approx([0.0])


@pytest.mark.parametrize("between", [[11.0], [10.8, 12.5], [10.5, 11.2, 13.0]])
def test_pulses_between_are_its_width(between):
    "One to three pulses between the surfaces, whichever way the line runs: as many steps"
    for ranges in ([10.0] * 10 + between + [14.0] * 10, [14.0] * 10 + between[::-1] + [10.0] * 10):
        edges = edges_of(*line(ranges), ROUGH)
        assert edges.width == pytest.approx([STEP * len(between)], rel=0.01)


def test_pulses_that_measure_both_surfaces_are_its_width():
    "Three pulses with a second return behind the near surface: three steps"
    ranges = [10.0] * 7 + [10.0, 14.0] * 3 + [14.0] * 10
    numbers = np.array([*range(7), 7, 7, 8, 8, 9, 9, *range(10, 20)])
    edges = edges_of(*line(ranges, numbers), ROUGH)
    assert edges.width == pytest.approx([3 * STEP], rel=0.01)


@pytest.mark.parametrize(
    "ranges",
    [
        [10.0] * 10 + [10.1] * 10,  # a curb
        [10.0] * 10 + [8.0, 8.0] + [14.0] * 10,  # a post before both
        list(10.0 + np.arange(20) % 2),  # a hedge
    ],
)
def test_what_is_no_edge_between_two_surfaces_is_none(ranges):
    "A small step, a third thing in the way, leaves without a plateau"
    assert len(edges_of(*line(ranges), ROUGH)) == 0


def test_a_missing_pulse_is_no_edge():
    "A missing pulse has no known range, so it is no edge"
    numbers = np.delete(np.arange(21), 10)
    assert len(edges_of(*line([10.0] * 10 + [14.0] * 10, numbers), ROUGH)) == 0


def test_edges_do_not_depend_on_where_chunks_end(pair):
    "A cloud in pieces of 499 points has the edges of the whole one, those at their ends among them"
    survey = pair[0]
    edges = []
    cloud = next(read_chunks(survey.clouds[0], 200_000))
    for size in (len(cloud), 499):
        collector = EdgeCollector(survey)
        for first in range(0, len(cloud), size):
            collector.add(cloud[first : first + size])
        edges.append(collector.edges())
    assert len(edges[0]) > 100
    np.testing.assert_array_equal(edges[1].gps_time, edges[0].gps_time)
    np.testing.assert_array_equal(edges[1].width, edges[0].width)


def test_memory_is_bounded_by_whole_moments(pair):
    "Half of the edges: those of a share of the moments, all of them"
    survey, real, _ = pair
    small = EdgeCollector(survey, limit=len(real.edges) // 2)
    for chunk in read_chunks(survey.clouds[0]):
        small.add(chunk)
    kept = small.edges()
    assert 0 < len(kept) <= len(real.edges) // 2
    assert len(kept) == (real.edges.chance < small.share).sum()
