"""Roughness and returns are those of the scanner, not of what it looks at."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.residuals import build_rows, find_patches, limited_noise
from mlscorr.gap.residuals.channels import loss_variance, return_rate, roughness
from mlscorr.io.clouds import read_chunks


def test_roughness_is_what_the_scanner_is_believed_to_make(survey, targets, patches, pairing):
    "With the right belief the median ratio is 1 within 3 %; with half the noise it is near 4"
    rows = pairing.rows.select(pairing.rows.channel == "roughness")
    assert np.median(rows.residual) == pytest.approx(0.0, abs=0.03)
    scatter = 1.4826 * np.median(np.abs(rows.residual - np.median(rows.residual)))
    assert scatter == pytest.approx(np.sqrt(np.median(rows.noise)), rel=0.25)
    noise = survey.scanner.range_noise / 2
    quieter = replace(survey, scanner=replace(survey.scanner, range_noise=noise), reference=None)
    again = build_rows(quieter, *no_targets(targets), patches).rows
    again = again.residual[again.channel == "roughness"]
    assert np.median(again) == pytest.approx(np.log(4.0), abs=0.1)


def test_no_roughness_is_compared_with_a_default(survey, targets, patches):
    "With a default scanner noise no surface counts as rough"
    scanner = replace(survey.scanner, assumed=("range_noise",))
    bare = replace(survey, scanner=scanner, reference=None)
    assert "roughness" not in build_rows(bare, *no_targets(targets), patches).rows.channel


def test_what_is_curved_does_not_count_as_noisy(survey):
    "Waves of 1 cm height and 0.6 m length are not told as roughness, noise of 1 cm is"

    def waves(chunk, rng):
        return 0.01 * np.sin(chunk.xyz[:, :2].sum(axis=1) * 2 * np.pi / 0.8)

    def noise(chunk, rng):
        return rng.normal(0.0, 0.01, len(chunk))

    told = []
    for disturbance in (waves, noise):
        rng = np.random.default_rng(6)

        def chunks(file, disturbance=disturbance, rng=rng):
            for chunk in read_chunks(file):
                up = disturbance(chunk, rng)[:, None] * np.array([0.0, 0.0, 1.0])
                yield replace(chunk, xyz=chunk.xyz + up)

        found = find_patches(survey, chunks=chunks)
        road = found.normal[:, 2] > 0.9
        told.append(roughness(survey, found[road])[3].mean())
    assert told[0] < 0.2 and told[1] > 0.85


def no_targets(targets):
    "No matched target, and what find_targets read"
    return targets[0][np.zeros(len(targets[0]), dtype=bool)], targets[1]


def thinned(keep):
    "A reader of clouds that keeps some points: keep(n) gives (n,) bool"

    def chunks(file):
        for chunk in read_chunks(file):
            yield chunk[keep(len(chunk))]

    return chunks


def test_lost_returns_are_told_from_a_thinned_cloud(survey, pairing):
    "No loss is 0; a loss of 8 % is found to 1 %; every third point, or 1 of 4, is a delivery"
    rate = pairing.rows.channel == "return_rate"
    assert rate.sum() > 100
    assert np.abs(pairing.rows.residual[rate]).max() < 0.02
    rng = np.random.default_rng(2)
    lossy = find_patches(survey, chunks=thinned(lambda n: rng.random(n) >= 0.08))
    share, _, told = return_rate(lossy)
    assert share[told].mean() == pytest.approx(-0.08, abs=0.01)
    third = find_patches(survey, chunks=thinned(lambda n: np.arange(n) % 3 == 0))
    share, _, told = return_rate(third)
    assert np.median(share[told]) == 0.0
    quarter = find_patches(survey, chunks=thinned(lambda n: rng.random(n) < 0.25))
    assert not return_rate(quarter)[2].any()


def test_lost_returns_have_the_variance_of_what_all_patches_lose():
    "Patches of 80 pulses that lose 3 %, a twentieth of them half: binomial, within a tenth"
    rng = np.random.default_rng(7)
    fired = np.full(1000, 80)
    share = 1.0 - rng.binomial(fired, np.where(np.arange(1000) < 50, 0.5, 0.03)) / fired
    variance = loss_variance(share, fired, np.ones(1000, dtype=bool))
    assert variance == pytest.approx(0.03 * 0.97 / 80, rel=0.12)
    assert np.ptp(variance) == 0.0
    whole = loss_variance(np.ones(3), np.array([20, 40, 80]), np.zeros(3, dtype=bool))
    assert whole * [20, 40, 80] == pytest.approx(0.002 * 0.998)


def test_where_all_is_lost_the_variance_stays_positive():
    "Nothing returns from 3 patches of 80 pulses: that of a loss of 99.8 %"
    variance = loss_variance(np.zeros(3), np.full(3, 80), np.ones(3, dtype=bool))
    assert variance * 80 == pytest.approx(0.998 * 0.002)


def test_a_scanner_believed_too_noisy_is_told_and_noise_is_compared_with_the_cloud(pairing):
    "Planes that scatter a third of what is believed: so it is said, and nothing is left to explain"
    case_rows = pairing.rows
    rough = case_rows.channel == "roughness"
    quiet = replace(case_rows, residual=case_rows.residual - 2 * np.log(3.0) * rough)
    rows, (sentence,) = limited_noise(quiet)
    assert "scatter 3.0 times less" in sentence
    assert np.median(rows.residual[rough]) == pytest.approx(0.0, abs=1e-9)
    ratio = rows.assumed[rough] / quiet.assumed[rough]
    assert ratio == pytest.approx(np.full(rough.sum(), 1 / 9), rel=0.1)
    assert limited_noise(case_rows) == (case_rows, ())
