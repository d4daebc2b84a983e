"""Painted lines and dashes."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.surfaces import FeatureCollector
from mlscorr.surfaces._paint import Crossings, find_crossings, find_markings
from tests.beds import painted_roads as road
from tests.surfaces.test_collector import assert_same

AZIMUTHS = [0.0, 45.0, 70.0, 135.0]  # deg


def of_kind(features, kind):
    return features[features.kind == kind]


@pytest.mark.parametrize("azimuth", AZIMUTHS)
def test_lines_are_where_they_were_painted(azimuth):
    "Both lines are found all along, across within stated sigmas of 7 mm or less"
    lines = of_kind(road.features(azimuth), "line")
    x, y = road.along_and_left(lines.centre, azimuth).T
    error = y - np.where(y > road.EDGE / 2, road.EDGE, 0.0)
    assert np.sqrt(np.median(lines.variance)) < 0.007  # m
    assert np.mean(np.abs(error) < 2 * np.sqrt(lines.variance)) > 0.93
    for number in (1, 2):
        of_edge = x[(y > road.EDGE / 2) & (lines.pass_number == number)]
        assert np.diff(np.sort(of_edge)).max() < 3.0  # m
    left = np.array([-np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
    # 8 crossings of a centimetre over a metre
    assert np.mean(np.abs(lines.direction @ left) > np.cos(np.radians(3.0))) > 0.95
    assert (lines.direction[:, 2] == 0).all()


def test_dashes_are_known_along_the_way():
    "Of each pass all dashes but those at its ends, midway between their ends within stated sigmas"
    errors = []
    sigmas = []
    for seed in range(1, 5):
        dashes = of_kind(road.features(seed=seed), "dash")
        x, y = road.along_and_left(dashes.centre).T
        whole = (x > road.DASH) & (x < road.LENGTH - road.DASH)  # of others a pass may see a part
        dashes = dashes[whole]
        x = x[whole]
        y = y[whole]
        number = np.floor(x / (road.DASH + road.GAP))
        for one_pass in (1, 2):
            seen = number[dashes.pass_number == one_pass]
            assert len(seen) == len(set(seen)) >= road.LENGTH // (road.DASH + road.GAP) - 2
        assert np.abs(y).max() < 0.01  # m
        errors.append(x - number * (road.DASH + road.GAP) - road.DASH / 2)
        sigmas.append(np.sqrt(dashes.variance))
        assert np.allclose(np.sqrt(12) * dashes.extent, road.DASH, atol=0.15)  # m
    error = np.concatenate(errors)
    sigma = np.concatenate(sigmas)
    assert np.median(sigma) < 0.025  # m
    assert np.mean(np.abs(error) < 2 * sigma) > 0.9
    assert np.sqrt(np.mean(error**2)) < 0.025  # m


def test_a_vehicle_that_stands_sees_no_line():
    "Crossings of one place again and again are neither line nor dash"
    n = 200
    place = road.ORIGIN + np.random.default_rng(3).normal(0, 0.005, (n, 3))
    still = Crossings(road.START + np.arange(n) / 80, place, np.full(n, 1e-4), np.zeros(n, int))
    assert len(find_markings(still, road.START)) == 0
    assert len(find_markings(still[:0], road.START)) == 0


def test_chunks_and_their_order_do_not_matter():
    "Paint of chunks in any order is that of the whole, but for what borders of chunks cut"
    survey = road.survey()
    rng = np.random.default_rng(1)
    parts = [road.cloud(number, rng) for number in (0, 1)]
    pieces = [
        (file, part[first : first + 50_000])
        for file, part in zip(survey.clouds, parts, strict=True)
        for first in range(0, len(part), 50_000)
    ]
    whole, chunks, early = (FeatureCollector(survey, held) for held in (10**9, 10**9, 100))
    for file, part in zip(survey.clouds, parts, strict=True):
        whole.add(file, part)
    for row in rng.permutation(len(pieces)):
        chunks.add(*pieces[row])
    for piece in pieces:
        early.add(*piece)
    paint = [f[np.isin(f.kind, ("line", "dash"))] for f in (c.features() for c in (whole, chunks))]
    assert_same(paint[0], paint[1])
    counts = [len(of_kind(c.features(), kind)) for c in (whole, early) for kind in ("line", "dash")]
    assert counts[2] > 0.95 * counts[0]
    assert counts[3] >= counts[1] - 2


def test_paint_moves_with_the_origin():
    "A road 300 km east and 700 km north of another one has the same paint"
    shift = np.array([300_000.0, 700_000.0, 40.0])
    passes = road.survey().trajectory.passes
    cloud = road.cloud(0, np.random.default_rng(1))
    here, there = (
        find_markings(find_crossings(part, passes, 0), road.START)
        for part in (cloud, replace(cloud, xyz=cloud.xyz + shift))
    )
    assert np.array_equal(here.kind, there.kind)
    assert np.allclose(there.centre - shift, here.centre, atol=1e-6)
    assert np.allclose(there.variance, here.variance, rtol=1e-3)
