"""Undetermined methods are refused with numbers, and passes count as no further targets."""

import numpy as np
import pytest

from mlscorr.baselines import (
    Undetermined,
    fit_affine,
    fit_horizontal_and_height,
    fit_rigid,
    fit_shift,
)
from mlscorr.baselines.pairs import CentredPairs
from mlscorr.survey import Matched
from tests.beds.streets import SHIFT, observed, on_a_line, on_a_plane, targets


def random_targets(n):
    def place(_, rng):
        return targets(rng, n)

    place.__name__ = f"{n}_targets"
    return place


@pytest.mark.parametrize(
    ("fit", "layout", "words"),
    [
        (fit_horizontal_and_height, random_targets(1), "at least 2 control points"),
        (fit_rigid, random_targets(1), "at least 3 control points"),
        (fit_rigid, random_targets(2), "at least 3 control points"),
        (fit_rigid, on_a_line, "from one line by only 0.0000 m"),
        (fit_affine, random_targets(3), "at least 4 control points"),
        (fit_affine, on_a_line, "from one plane by only 0.0000 m"),
        (fit_affine, on_a_plane, "from one plane by only 0.0000 m"),
    ],
)
def test_a_degenerate_geometry_is_refused_with_numbers(fit, layout, words):
    "Too few targets, or targets on a line or plane, are told from those that determine a method"
    place, time = layout(9, np.random.default_rng(3))
    with pytest.raises(Undetermined, match=words):
        fit(observed(place, time, place + SHIFT))


@pytest.mark.parametrize("fit", [fit_shift, fit_horizontal_and_height, fit_rigid, fit_affine])
def test_nothing_is_fitted_to_nothing(fit):
    """Without a control point in the cloud no transformation is determined."""
    with pytest.raises(Undetermined, match="No control point was found"):
        fit(Matched.none())


def test_targets_nearly_on_a_plane_are_refused():
    "Targets 5 mm off a plane, with a sigma of 3 mm, don't determine an affine transformation"
    rng = np.random.default_rng(4)
    place, time = on_a_plane(12, rng)
    place += rng.normal(0.0, 0.005, place.shape)
    with pytest.raises(Undetermined, match="one plane"):
        fit_affine(observed(place, time, place + SHIFT))


def test_passes_over_one_target_are_one_target():
    "Four observations of two targets don't determine a rigid motion"
    place, time = targets(np.random.default_rng(5), 2)
    twice = np.vstack([place, place + 0.3])
    times = np.append(time, time + 0.2)
    matched = observed(twice, times, twice, ("T1", "T2", "T3", "T4"))[[0, 1, 0, 1]]
    with pytest.raises(Undetermined, match="there are 2"):
        fit_rigid(matched)


def test_pairs_stand_about_their_weighted_mean():
    "Places about the origin have no mean, and the mean misclosure is the shift, to a nanometre"
    place, time = targets(np.random.default_rng(12))
    pairs = CentredPairs.of(observed(place, time, place + SHIFT))
    assert np.abs(np.sum(pairs.weight * pairs.observed, axis=0)).max() < 1e-9  # m
    assert pairs.mean == pytest.approx(SHIFT, abs=1e-9)
    assert pairs.spread()[0] == pytest.approx(np.sort(pairs.spread())[-1]) and pairs.targets == 16
