"""Planes that were seen twice are compared once, the earlier view with the later one."""

from dataclasses import replace

import numpy as np

from mlscorr.gap.residuals._surfaces import shared_rows
from tests.beds.displaced import correction_of, displaced


def test_a_raised_pass_stands_off_its_planes_along_their_normals(survey, patches):
    "2 cm more height in the first pass is 2 cm in the residuals of the road, to 3 mm"
    rng = np.random.default_rng(0)
    level = shared_rows(survey, patches, rng, limit=10_000)
    lift = np.array([0.0, 0.0, 0.02])
    first = (patches.pass_number == 1)[:, None]
    raised = replace(patches, centre=patches.centre + lift * first)
    rows = shared_rows(survey, raised, np.random.default_rng(0), limit=10_000)
    assert len(level) > 50 and len(rows) > 50
    assert (rows.gps_time < rows.gps_time_2).all()
    before, after = (np.median(part.residual[part.direction[:, 2] > 0.9]) for part in (level, rows))
    assert abs(after - before - lift[2]) < 0.003


def test_a_single_pass_shares_nothing(survey, patches):
    "Planes of eight seconds of one pass are seen once"
    alone = patches[patches.pass_number == 1]
    assert shared_rows(survey, alone, np.random.default_rng(0), limit=10) is None


def every_pair(survey, patches, correction=None):
    "The Rows of all planes that were seen twice"
    rng = np.random.default_rng(0)
    return shared_rows(survey, patches, rng, limit=10_000, correction=correction)


def test_a_pass_metres_off_finds_its_planes_by_a_correction(survey, patches):
    "2 m off, a pass shares the planes that it shared before, each off along its normal, to 1 mm"
    before = every_pair(survey, patches)
    shift = np.array([1.4, -1.4, 0.3])
    off, correction = displaced(survey, patches, shift)
    rows = every_pair(survey, off, correction)
    np.testing.assert_array_equal(rows.gps_time, before.gps_time)
    np.testing.assert_allclose(rows.residual, before.residual + rows.direction @ shift, atol=1e-3)
    alone = every_pair(survey, off)
    assert alone is None or len(alone) < len(before)


def test_a_correction_that_tears_passes_apart_is_not_followed(survey, patches):
    "If control of one pass is 2 m off, planes are shared as if there were none"
    before = every_pair(survey, patches)
    rows = every_pair(survey, patches, correction_of(survey, (0.0, 0.0, 2.0)))
    np.testing.assert_array_equal(rows.residual, before.residual)
