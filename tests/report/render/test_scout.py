"""The first pass over the cloud."""

import numpy as np
import pytest

from mlscorr.report.render.scout import scout
from mlscorr.survey import PointCloud
from tests.beds.street_of_points import ORIGIN, START, pieces, shifted, target


def test_a_target_tells_how_it_is_turned():
    "The normal of a bright disc among what stands behind it, to 2 deg; NaN where nothing lies"
    rng = np.random.default_rng(7)
    disc = rng.uniform(-0.15, 0.15, (400, 3)) * [1.0, 0.0, 1.0] + rng.normal(0, 0.003, (400, 3))
    behind = np.add(rng.uniform(-0.15, 0.15, (80, 3)), [0.0, 0.15, 0.0])
    xyz = ORIGIN + np.vstack([disc, behind])
    cloud = PointCloud(xyz, np.full(480, START + 1.0), np.repeat([900.0, 100.0], [400, 80]))
    rows = [target("T1", ORIGIN), target("T2", ORIGIN + 50.0)]
    scouted = scout(pieces(cloud, 100), shifted(np.zeros(3)), rows, np.array([0.4, 0.4]))
    assert abs(scouted.normals[0, 1]) > np.cos(np.radians(2.0))
    assert np.isnan(scouted.normals[1]).all() and len(scouted.before) == 480


def test_a_cloud_without_points_is_refused():
    "There is nothing to draw"
    with pytest.raises(ValueError, match="no points"):
        scout([], shifted(np.zeros(3)), [], np.empty(0))
