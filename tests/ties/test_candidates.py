"""Candidates for pairs: what a grid of cells finds is what all pairs hold."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.survey import TIE_KINDS
from mlscorr.ties import SETTINGS
from mlscorr.ties.pairing import candidate_pairs, visit_number
from tests.ties.test_pairing import walls


def crowd(rng, number):
    "Features of all kinds and a few directions, of passes that return, in a street of 40 m"
    features = walls(rng.uniform([0, 0, 0], [40, 10, 4], (number, 3)), rng.integers(1, 5, number))
    kind = rng.choice(TIE_KINDS, number)
    direction = np.where(rng.uniform(size=number) < 0.5, 1.0, -1.0)[:, None] * [1.0, 0.0, 0.0]
    direction[kind == "pole"] = [0.0, 0.0, 1.0]
    direction[:, 1] += rng.normal(scale=0.05, size=number)
    return replace(
        features,
        kind=kind,
        direction=direction / np.linalg.norm(direction, axis=1, keepdims=True),
        gps_time=features.gps_time + rng.choice([0.0, 4.0, 30.0], number),
        scanner=rng.integers(0, 2, number),
        variance=rng.uniform(1e-4, 4e-2, number),
        extent=rng.uniform(0.3, 0.6, number),
    )


def all_pairs(features, place, sigma, radius, shift):
    "Pairs (k, 2) within the gates, of all that two visits make, by their definition"
    visit = visit_number(features)
    kind = features.kind
    first, second = np.nonzero(visit[:, None] < visit)
    before = features.direction[first]
    after = features.direction[second]
    cosine = np.einsum("ni,ni->n", before, after)
    sign = np.where((cosine < 0) & np.isin(kind[first], ("line", "dash")), -1.0, 1.0)
    axis = before + sign[:, None] * after
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    apart = place[second] + shift[second] - place[first]
    along = np.abs(np.einsum("ni,ni->n", apart, axis))
    across = np.linalg.norm(apart - np.einsum("ni,ni->n", apart, axis)[:, None] * axis, axis=1)
    misfit, beside = np.where(kind[first] == "pole", [across, along], [along, across])
    noise = features.variance[first] + features.variance[second]
    known = np.hypot(sigma[first], sigma[second])
    own = noise + 2 * SETTINGS.surface_sigma**2
    gate = np.minimum(radius, 3 * np.sqrt(known**2 + own))
    of_pole = np.hypot(np.minimum(radius, 3 * known), 3 * np.sqrt(own))
    gate = np.where(kind[first] == "pole", of_pole, gate)
    longer = np.abs(features.extent[first] - features.extent[second]) * np.sqrt(12)
    good = (kind[first] == kind[second]) & (cosine * sign >= np.cos(SETTINGS.parallel))
    good &= (misfit <= gate) & (beside <= SURFACES.cell)
    good &= (kind[first] != "dash") | (longer <= 6 * np.sqrt(noise))
    good &= (np.abs(features.gps_time[first] - features.gps_time[second]) > SETTINGS.pause) | (
        features.scanner[first] != features.scanner[second]
    )
    return np.column_stack([first, second])[good]


@pytest.mark.parametrize("way", [0.0, 3.0])
@pytest.mark.parametrize(("sigma", "radius"), [(0.05, 1.0), (0.5, 2.0)])
def test_all_pairs_within_the_gates_are_candidates(sigma, radius, way):
    "With few features nearby they are all pairs within the gates, displaced or not"
    rng = np.random.default_rng(1)
    features = crowd(rng, 600)
    sigmas = rng.uniform(0.5, 1, 600) * sigma
    correction = rng.normal(scale=0.2, size=(600, 3))
    shift = way * features.direction
    displaced = {"shift": shift} if way else {}
    pairs, distance = candidate_pairs(features, correction, sigmas, radius, **displaced)
    expected = all_pairs(features, features.centre + correction, sigmas, radius, shift)
    assert len(expected) > 40
    assert sorted(pairs.tolist()) == sorted(expected.tolist())
    assert (distance <= np.sqrt(2)).all()


def test_nothing_has_no_candidates():
    "Without features there is no pair, displaced or not"
    features = walls([[0.0, 0.0, 0.0]], [1])[[]]
    nothing = np.zeros((0, 3))
    for shift in (None, nothing):
        pairs, distance = candidate_pairs(features, nothing, np.zeros(0), 2.0, shift=shift)
        assert pairs.shape == (0, 2)
        assert distance.shape == (0,)
