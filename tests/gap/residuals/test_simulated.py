"""A survey against the clouds that a simulator made of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mlscorr.gap.residuals import SimulatedBeams
from mlscorr.survey import PointCloud
from tests.beds.displaced import correction_of
from tests.beds.drives import START as DRIVE_START
from tests.beds.drives import drive

START = 413_200.0  # s


def cloud(xyz, time):
    return PointCloud(np.asarray(xyz, dtype=float), np.asarray(time), np.ones(len(xyz)))


@pytest.fixture
def patches():
    "Two patches of 30 points each, at UTM size, 10 us apart"
    rng = np.random.default_rng(2)
    place = np.array([350_000.0, 4_300_000.0, 20.0])
    time = START + 1e-5 * np.arange(60)
    xyz = place + rng.uniform(0, 1, (60, 3))
    return SimpleNamespace(cloud=[cloud(xyz[::2], time[::2]), cloud(xyz[1::2], time[1::2])])


def test_pulses_of_the_same_times_are_paired_in_any_order(patches):
    "Simulated points 2 cm higher, shuffled and in chunks: each is 2 cm from its own, to 1 nm"
    beams = SimulatedBeams(patches)
    rng = np.random.default_rng(3)
    every = PointCloud.concatenate(patches.cloud)
    every = every[rng.permutation(60)]
    higher = cloud(every.xyz + np.array([0.0, 0.0, 0.02]), every.gps_time + 1e-9)
    for part in (slice(0, 25), slice(25, 60)):
        beams.add(higher[part])
    np.testing.assert_allclose(beams.offset, np.tile([0.0, 0.0, -0.02], (60, 1)), atol=1e-9)
    assert beams.patch.tolist() == [0] * 30 + [1] * 30


def test_of_several_echoes_the_nearest_counts(patches):
    "A second echo at 0.5 m, before or after in the file, doesn't take the place of the first"
    every = PointCloud.concatenate(patches.cloud)
    far = cloud(every.xyz + np.array([0.5, 0.0, 0.0]), every.gps_time)
    near = cloud(every.xyz + np.array([0.01, 0.0, 0.0]), every.gps_time)
    for order in ((far, near), (near, far)):
        beams = SimulatedBeams(patches)
        for part in order:
            beams.add(part)
        assert np.abs(beams.offset[:, 0] + 0.01).max() < 1e-9


def test_other_times_and_places_are_no_pair(patches):
    "Half of the step later, or more than a metre away, nothing is paired"
    every = PointCloud.concatenate(patches.cloud)
    beams = SimulatedBeams(patches)
    beams.add(cloud(every.xyz, every.gps_time + 5e-6))
    beams.add(cloud(every.xyz + np.array([0.0, 1.5, 0.0]), every.gps_time))
    assert np.isnan(beams.offset).all()


@pytest.mark.parametrize("has_error", [False, True])
def test_beams_metres_off_are_paired_with_a_simulator_that_has_the_error_or_not(patches, has_error):
    "2 m off by a correction, simulated points are 2 m, or nothing, from the recorded ones, to 1 nm"
    every = PointCloud.concatenate(patches.cloud)
    shift = np.array([2.0, 0.0, 0.0])
    trajectory = drive()
    trajectory = replace(trajectory, gps_time=trajectory.gps_time + START - 5.0 - DRIVE_START)
    survey = SimpleNamespace(trajectory=trajectory)
    beams = SimulatedBeams(patches, correction_of(survey, shift))
    beams.add(cloud(every.xyz - (not has_error) * shift, every.gps_time))
    expected = np.tile((not has_error) * shift, (60, 1))
    np.testing.assert_allclose(beams.offset, expected, atol=1e-9)
