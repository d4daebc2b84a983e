"""One view while the cloud goes by."""

import numpy as np

from mlscorr.report.render._sheet import Sheet
from mlscorr.report.render._views import View
from mlscorr.report.render.quantities import CloudPair
from mlscorr.report.render.view import Camera
from mlscorr.survey import PointCloud
from tests.beds.street_of_points import ORIGIN, SIZE, START


def sheet(is_cut, moved):
    "A sheet with one point that the correction moves by so much to the north, a slab of 1 m"
    camera = Camera.towards(ORIGIN, 0.0, 0.0, 10.0, SIZE)
    view = View("a", "", "", camera, "state", half_depth=0.5, is_cut=is_cut)
    before = PointCloud(ORIGIN[None] + [0.0, -moved, 0.0], np.array([START]), np.ones(1))
    after = PointCloud(ORIGIN[None], np.array([START]), np.ones(1))
    blank = Sheet.blank(view)
    pair = CloudPair(before, after, (None, None))
    blank.add(pair, pair.values("state"))
    return blank


def test_both_sides_of_a_cut_show_the_same_points():
    "A point that lies in the slab only after the correction is shown on both sides of a cut"
    for is_cut, count in ((True, 1), (False, 0)):
        before, after = sheet(is_cut, 2.0).canvases
        assert (before.drawn.sum(), after.drawn.sum()) == (count, 1)


def test_a_finished_sheet_is_white_where_nothing_lies():
    "A point of a cut is a disc in its colour; the other state stands grey behind it"
    picture = sheet(True, 0.0).finished()
    assert picture.before.shape == (180, 240, 3)
    assert (picture.before == 255).all(axis=2).mean() > 0.99
    assert tuple(picture.after[90, 120]) == (0x00, 0x72, 0xB2)
