"""Patches are flat, small in space and time, and say of themselves what is true."""

import numpy as np
import pytest

from mlscorr.gap.residuals import SETTINGS, Patches
from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.surfaces import cell_corner


def test_patches_are_small_and_short(patches):
    "A cell of 1 m and a second: centres and sample points of a patch lie that close together"
    span = np.ptp(patches.time, axis=1)
    away = np.linalg.norm(patches.xyz - patches.centre[:, None], axis=2).max(axis=1)
    assert span.max() <= SETTINGS.moment and away.max() < np.sqrt(3.0) * SETTINGS.cell
    assert patches.points.min() >= SETTINGS.plane_points
    assert (np.abs(patches.gps_time - patches.time.mean(axis=1)) < SETTINGS.moment).all()


def test_the_variance_is_that_about_the_plane(patches):
    "Of all patches whose points are kept the scatter about centre and normal is theirs, to 5 %"
    whole = np.flatnonzero(patches.points <= SETTINGS.patch_pulses)[:100]
    ratio = []
    counts = []
    for i in whole:
        away = (patches.cloud[i].xyz - patches.centre[i]) @ patches.normal[i]
        counts.append(len(away) / patches.points[i])
        ratio.append((away @ away) / (len(away) - 3) / patches.variance[i])
    assert len(ratio) == 100
    assert np.mean(np.abs(np.array(counts) - 1.0) <= 0.03) > 0.95
    assert np.median(ratio) == pytest.approx(1.0, abs=0.05)


def test_normals_point_to_the_scanner(survey, patches):
    "Of unit length, and less than a right angle from the sight of the vehicle"
    np.testing.assert_allclose(np.linalg.norm(patches.normal, axis=1), 1.0, atol=1e-12)
    sight = survey.trajectory.at(patches.gps_time).position - patches.centre
    assert (np.einsum("pi,pi->p", sight, patches.normal) > 0).mean() > 0.99


def test_flat_things_have_the_ripple_of_noise(patches):
    "Variance about the plane over that between neighbours is about one, in the median to 10 %"
    assert np.median(patches.ripple) == pytest.approx(1.0, abs=0.1)
    assert (patches.spread > 0.1).all()


def test_no_more_returned_than_was_fired(patches):
    "Shares of returns lie between 0 and 1, and all of a simulator without loss is there"
    told = patches.fired > 0
    assert told.mean() > 0.3
    assert (patches.returned <= patches.fired)[told].all()
    assert (patches.returned / np.maximum(patches.fired, 1))[told].mean() > 0.98


def test_neighbours_are_kept_or_left_together(patches):
    "Patches of one square of 4 cells have one number, and these spread evenly from 0 to 1"
    assert patches.block.min() >= 0.0 and patches.block.max() < 1.0
    side = SURFACES.block_cells * SETTINGS.cell
    square = np.floor(cell_corner(patches.xyz[:, 0])[:, :2] / side + 0.5 / side).astype(int)
    numbers = {}
    for key, block in zip(map(tuple, square), patches.block, strict=True):
        numbers.setdefault(key, set()).add(block)
    assert np.mean([len(blocks) <= 2 for blocks in numbers.values()]) > 0.9
    assert 0.3 < np.mean(np.unique(patches.block)) < 0.7


def test_a_choice_of_patches_is_one_of_all_columns(patches):
    "Chosen by number, joined again: the same clouds, points and normals"
    odd = patches[1::2]
    even = patches[::2]
    again = Patches.concatenate([even, odd])
    order = np.argsort(
        np.concatenate([np.arange(0, len(patches), 2), np.arange(1, len(patches), 2)])
    )
    for name in ("centre", "normal", "xyz", "points", "block"):
        np.testing.assert_array_equal(getattr(again[order], name), getattr(patches, name))
    assert all(a is b for a, b in zip(again[order].cloud, patches.cloud, strict=True))
