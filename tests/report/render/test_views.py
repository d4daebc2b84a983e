"""Contents and viewpoint of each picture."""

from dataclasses import replace

import numpy as np

from mlscorr.report.render import PictureOptions
from mlscorr.report.render._scout import Scouted
from mlscorr.report.render._views import overview
from tests.beds.street_of_points import SIZE, START, street, target


def test_the_bright_disc_lies_where_the_arrow_starts(drawn):
    "On both sides the bright points' centre is the scanned one, to 8 cm for thinly hit targets"
    targets = [picture for picture in drawn if picture.name.startswith("target")]
    assert len(targets) == 5
    for picture in targets:
        camera = picture.view.camera
        for side, pixels in enumerate((picture.before, picture.after)):
            _, arrow = picture.view.marks[side]
            scanned = camera.project(arrow.points)[0][0]
            aside = centre_of_the_bright(pixels) - scanned
            assert np.hypot(*aside) / camera.scale < 0.08, picture.name


def centre_of_the_bright(pixels):
    "Centre of the yellow pixels, column and row"
    red, _, blue = pixels.astype(int).transpose(2, 0, 1)
    row, column = np.nonzero(red - blue > 60)
    return np.array([column.mean(), row.mean()])


def scouted(shape):
    "A street of 200 m, stretched by factors about its middle"
    cloud = street(4000, np.random.default_rng(1))
    middle = cloud.xyz.mean(axis=0)
    cloud = replace(cloud, xyz=middle + (cloud.xyz - middle) * shape)
    return Scouted(cloud, cloud, np.empty((0, 3)))


def test_a_street_lies_across_its_picture_and_an_area_is_seen_from_above():
    "A street to the east is seen from the south at 45 deg; 400 m x 400 m from straight above"
    options = PictureOptions(SIZE, (480, 180))
    along, area = (overview(scouted(shape), [], options) for shape in ([1, 1, 1], [2, 20, 1]))
    np.testing.assert_allclose(along.camera.axes[0], [1.0, 0.0, 0.0], atol=0.02)
    assert along.camera.size == (480, 180) and area.camera.size == SIZE
    np.testing.assert_allclose(area.camera.axes[2], [0.0, 0.0, -1.0], atol=1e-9)
    assert "no target was found" in along.title


def test_the_title_counts_check_points_alone_where_there_are_some():
    "RMSE of 0.30 m before and 0.10 m after, of one check point seen twice"
    check = replace(target("T2", (0, 0, 0)), role="check", after=np.array([0.1, 0.0, 0.0]))
    rows = [target("T1", (0, 0, 0), (5.0, 0.0, 0.0)), check, replace(check, gps_time=START)]
    title = overview(scouted([1, 1, 1]), rows, PictureOptions(SIZE)).title
    assert title.startswith(
        "3D RMSE at 1 check point, 2 observations: 30.0 cm before, 10.0 cm after"
    )


def test_the_title_does_not_boast_of_the_fit_of_control_points():
    "Leave-one-out residuals of control, 0.05 m; for a single point only its misclosure"
    rows = [replace(target(name, (0, 0, 0)), after=np.full(3, 1e-4)) for name in ("T1", "T2")]
    left_out = [replace(row, left_out=np.array([0.0, 0.03, 0.04])) for row in rows]
    titles = [
        overview(scouted([1, 1, 1]), some, PictureOptions(SIZE)).title
        for some in (left_out, rows[:1])
    ]
    assert titles == [
        "3D RMSE at 2 control points: 30.0 cm before, 5.0 cm leave-one-out",
        "3D RMSE at 1 control point: 30.0 cm before; it was used for the correction",
    ]
