"""Results as lines of Open3D: where they run, and what their colors say."""

import numpy as np
import pytest

from mlscorr.correction import Correction
from mlscorr.report import correction_lines, search_figure, tie_lines
from mlscorr.report._show import Layer, viewer_geometry
from mlscorr.survey import Ties, map_places
from tests.beds.drives import CORNER, drive, with_errors


def ties_of(apart):
    "Ties along the height, whose views lie so far apart (n,), in m"
    n = len(apart)
    place = np.repeat(CORNER + np.arange(3.0 * n).reshape(n, 1, 3), 2, axis=1)
    place[:, 1, 2] += apart
    return Ties(
        gps_time=np.tile([413_201.0, 413_215.0], (n, 1)),
        place=place,
        direction=np.tile([0.0, 0.0, 1.0], (n, 1)),
        misclosure=np.asarray(apart),
        variance=np.full(n, 1e-6),
        kind=np.array(["plane"] * n),
        pass_number=np.tile([1, 2], (n, 1)),
        scanner=np.zeros((n, 2), int),
        feature=np.arange(2 * n).reshape(n, 2),
    )


@pytest.mark.parametrize("enlarged", [1.0, 20.0])
def test_ties_run_between_both_views(enlarged):
    "Each line is as long as both lie apart, or 20 times that, about its middle to 1e-9 m"
    apart = np.array([0.02, -0.05, 0.3])
    ties = ties_of(apart)
    lines = tie_lines(ties, None, enlarged)
    ends = map_places(lines)[lines.line.indices.numpy()]
    np.testing.assert_allclose(ends[:, 1, 2] - ends[:, 0, 2], enlarged * apart, atol=2e-9)
    np.testing.assert_allclose(ends.mean(axis=1), ties.place.mean(axis=1), rtol=0, atol=2e-9)
    assert np.array_equal(lines.line["misclosure"].numpy()[:, 0], apart)
    assert len(np.unique(lines.line.colors.numpy(), axis=0)) == 3


def test_no_ties_are_no_lines():
    "A search that found nothing is shown as nothing"
    assert len(tie_lines(ties_of(np.empty(0)), None, 1.0).line.indices) == 0


def test_a_plan_of_a_search_tells_how_many_it_refused():
    "3 ties and 2 pairs refused; a search without ties has a plan, too"
    trajectory = drive()
    for found, refused in ((3, 2), (0, 0)):
        figure = search_figure(trajectory, ties_of(np.full(found, 0.1)), ties_of(np.ones(refused)))
        assert figure.axes[0].get_title(loc="left") == f"{found} ties, {refused} pairs rejected"


def test_the_correction_colors_the_trajectory_by_its_size():
    "Lines that were moved farther are brighter on the scale, and carry the 3D length in m"
    recorded = drive()
    correction = Correction(recorded, with_errors(recorded))
    lines = correction_lines(correction, CORNER, "correction")
    moved = correction.corrected.position - recorded.position
    length = np.linalg.norm(moved, axis=1)[recorded.line_pairs].mean(axis=1)
    np.testing.assert_allclose(lines.line["correction"].numpy()[:, 0], length, atol=1e-9)
    red = lines.line.colors.numpy()[:, 0]
    assert (np.diff(red[np.argsort(length)]) > -0.01).all() and np.ptp(red) > 0.5


def test_a_viewer_gets_float32_about_an_origin_near_it():
    "Places within 0.01 mm, and colors from 0 to 1, of clouds and of lines"
    recorded = drive()
    colors = np.tile(np.array([255, 0, 51], np.uint8), (len(recorded) - 1, 1))
    lines = Layer("path", recorded.position, recorded.line_pairs, colors)
    cloud = Layer("points", recorded.position)
    for layer, kind in ((lines, "line"), (cloud, "point")):
        geometry = viewer_geometry(layer, CORNER, "#ff0033")
        places = geometry.point.positions.numpy()
        assert places.dtype == np.float32
        assert np.abs(places + CORNER - recorded.position).max() < 1e-5
        shade = getattr(geometry, kind)["colors"].numpy()
        np.testing.assert_allclose(shade, np.tile([1.0, 0.0, 0.2], (len(shade), 1)), atol=1e-6)
