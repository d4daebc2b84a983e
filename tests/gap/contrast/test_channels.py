"""Channels of a real cloud beside those of a simulated one."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.contrast import contrast_clouds, contrast_returns
from tests.beds.twin_clouds import range_of, sampled, twins


def contrasted(survey, real, simulated):
    "The Contrast of each channel of two clouds"
    contrasts = contrast_clouds(survey, real, simulated, np.random.default_rng(0))
    return {contrast.channel: contrast for contrast in contrasts}


def against_belief(survey, patches, loss):
    "The same of a cloud and of what is believed"
    contrasts = contrast_returns(survey, patches, loss, np.random.default_rng(0))
    return {contrast.channel: contrast for contrast in contrasts}


def sentences(contrasts):
    return [text for contrast in contrasts for text in contrast.sentences]


def beyond(table, start):
    "Values of the bins that begin at a range or behind it, where they are known"
    values = table.value[np.array(table.edges[:-1]) >= start]
    return values[np.isfinite(values)]


@pytest.mark.long
def test_a_falloff_that_the_simulator_lacks_is_measured_and_named(pair):
    "Returns 1.4 times weaker beyond 8 m: to 2 %, by range and by nothing else, in a sentence"
    survey, _, simulated = pair

    def fade(survey, cloud):
        factor = np.where(range_of(survey, cloud) > 8.0, 1 / 1.4, 1.0)
        return replace(cloud, intensity=(cloud.intensity * factor).astype(np.uint16))

    faded = contrasted(survey, sampled(survey, fade), simulated)
    table = faded["intensity"].tables[0]
    assert np.exp(-beyond(table, 8)) == pytest.approx(1.4, rel=0.03)
    assert np.abs(table.value[np.array(table.edges[1:]) <= 8]).max() < 0.01
    (said,) = faded["intensity"].sentences
    assert "times weaker than simulated ones beyond 8 m" in said
    assert "lacks falloff with range" in said
    assert not sentences([faded["density"], faded["dropout"], faded["edge_width"]])


@pytest.mark.long
def test_returns_that_are_lost_far_away_are_measured_and_named(pair):
    "A fifth of the points lost beyond 10 m: density and beams without return say so, to 3 %"
    survey, _, simulated = pair
    rng = np.random.default_rng(1)

    def lose(survey, cloud):
        far = range_of(survey, cloud) > 10.0
        return cloud[~(far & (rng.random(len(cloud)) < 0.2))]

    lossy = contrasted(survey, sampled(survey, lose), simulated)
    assert np.exp(beyond(lossy["density"].tables[0], 10)) == pytest.approx(0.8, abs=0.03)
    assert beyond(lossy["dropout"].tables[0], 10) == pytest.approx(0.2, abs=0.03)
    assert "fewer points" in lossy["density"].sentences[0]
    assert "beyond 10 m" in lossy["density"].sentences[0]
    assert not lossy["intensity"].sentences


def test_a_simulation_of_half_of_the_drive_says_nothing_of_the_rest(pair):
    "A simulated cloud that ends after half of the time shows no missing density in the other half"
    survey, real, simulated = pair
    half = np.median(simulated.cells.begin)
    cells = simulated.cells[simulated.cells.begin < half]
    density = contrasted(survey, real, replace(simulated, cells=cells))["density"]
    assert abs(density.whole.value[0]) < 0.01
    assert not density.sentences


@pytest.mark.long
@pytest.mark.parametrize("seed", [11, 12])
def test_twins_differ_in_nothing(tmp_path, seed):
    "Another POS error and other noise: no channel says anything, with beams wide and thin"
    # simulates two surveys, a second or two
    divergence = 3.0 * (seed % 2)
    survey, simulated = twins(tmp_path, seed, beam_divergence=divergence, loss=0.02)
    contrasts = contrasted(survey, sampled(survey), sampled(simulated)).values()
    assert not sentences(contrasts)
    assert not any(contrast.silent for contrast in contrasts)


@pytest.mark.long
def test_a_wide_beam_smears_edges(pair, tmp_path):
    "A beam of 12 mrad against a thin one: edges are wider by several mrad, beyond 3 sigma"
    survey, _, simulated = pair
    wide, _ = twins(tmp_path, 3, beam_divergence=12.0)
    edges = contrasted(survey, sampled(wide), simulated)["edge_width"]
    assert edges.whole.value[0] > max(5.0, 3 * edges.whole.sigma[0])


def test_a_channel_of_which_nothing_is_known_is_silent(pair):
    "Without intensities, and without clouds, a sentence stands where a number would"
    survey, real, simulated = pair
    level = replace(simulated.points, intensity=np.full(len(simulated.points), 7.0))
    contrasts = contrasted(survey, real, replace(simulated, points=level))
    assert "simulated cloud has no intensity" in contrasts["intensity"].silent
    assert not contrasts["intensity"].tables and not contrasts["density"].silent
    assumed = against_belief(survey, real.patches, None)
    assert all(contrast.silent for contrast in assumed.values())
    assert "no effect dropout" in assumed["dropout"].silent


def test_lost_returns_are_compared_with_a_simulator_that_has_them(pair):
    "A simulator that loses a tenth of the returns, where none is lost: 10 % too many"
    survey, real, _ = pair
    dropout = against_belief(survey, real.patches, 0.1)["dropout"]
    assert dropout.whole.value[0] == pytest.approx(-0.1, abs=1e-3)
    assert dropout.document()["whole"]["simulated"] == pytest.approx([0.1])
    assert "loses too many returns" in dropout.sentences[0]
