"""The first pass over the cloud."""

import numpy as np
import pytest

from mlscorr.report.render._scout import scout
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


def test_chunks_of_any_size_turn_targets_the_same_way():
    "Discs along a street, on edges of chunks and beyond them all: the same normals to 1e-9"
    rng = np.random.default_rng(8)
    along = np.arange(12)[:, None] * [7.0, 0.0, 0.0]
    disc = rng.uniform(-0.15, 0.15, (12, 100, 3)) * [1.0, 0.02, 1.0] + along[:, None]
    cloud = PointCloud(
        ORIGIN + disc.reshape(-1, 3), START + np.arange(1200.0), np.full(1200, 900.0)
    )
    rows = [target(f"T{k}", ORIGIN + place) for k, place in enumerate(along)]
    rows.append(target("T12", np.add(ORIGIN, [-0.2, 0.0, 0.0])))  # half of it lies on the first
    normals = [
        scout(pieces(cloud, size), shifted(np.zeros(3)), rows, np.full(13, 0.8)).normals
        for size in (1200, 70)
    ]
    assert np.isfinite(normals[0]).all()
    assert np.abs(normals[0] - normals[1]).max() < 1e-9


def test_a_cloud_without_points_is_refused():
    "There is nothing to draw"
    with pytest.raises(ValueError, match="no points"):
        scout([], shifted(np.zeros(3)), [], np.empty(0))
