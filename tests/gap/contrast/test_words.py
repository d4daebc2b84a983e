"""Sentences on where channels differ."""

import re

import numpy as np
import pytest

from mlscorr.gap.contrast._words import sentence
from mlscorr.gap.contrast.tables import Binning, Measure, weights_of

EDGES = (0, 10, 20, 40, 80)


def said(channel, factors):
    "Statement on a channel whose four bins of range differ by factors, in 30 blocks"
    rng = np.random.default_rng(0)
    n = 120
    away = np.repeat([5.0, 15.0, 30.0, 60.0], 30)
    block = np.tile(np.arange(30), 4)
    real = np.repeat(factors, 30) * (1 + 0.01 * rng.standard_normal(n))
    split = Binning("range", away, EDGES)
    if channel == "intensity":
        columns = [np.log(real), np.ones(n)]
    else:
        columns = [real, np.ones(n)]

    def figure(sums):
        ratio = sums[..., 0] / sums[..., 1]
        if channel == "intensity":
            return ratio
        if channel == "density":
            return np.log(ratio)
        return ratio - 1.0

    measure = Measure(
        channel,
        block,
        columns,
        figure,
        lambda s: (s[:, 0] / s[:, 1], np.ones(s.shape[0])),
        weights_of(30, rng),
        None,
        (split,),
    )
    table, sums = measure.table(split)
    return sentence(measure, table.judged(4), sums)


@pytest.mark.parametrize(
    ("channel", "factors", "words"),
    [
        (
            "intensity",
            [1, 1, 0.5, 0.5],
            r"1\.99\d+ ± 0.00\d+ times weaker than simulated ones beyond 20 m",
        ),
        (
            "intensity",
            [1, 1, 1, 2],
            "beyond 40 m, relative to their usual ratio: the simulator's",
        ),
        (
            "density",
            [1, 0.5, 1, 1],
            r"49\.\d+ ± 0\.\d+ % fewer points than the simulated one between 10 and 20 m",
        ),
        ("density", [1.5, 1, 1, 1], "more points than the simulated one within 10 m"),
        ("dropout", [1.1, 1.1, 1.1, 1.1], "give no return everywhere"),
        ("edge_width", [1, 1, 1, 3], r"[12]\.\d+ ± 0\.\d+ mrad more than simulated beyond 40 m"),
        ("edge_width", [1, 1, 1, 0.5], "beam is too wide"),
    ],
)
def test_a_sentence_says_what_where_and_why(channel, factors, words):
    "Figure with its sigma, the stretch of range, and what the simulator lacks"
    text = said(channel, factors)
    assert re.search(words, text)


def test_what_differs_everywhere_alike_is_a_matter_of_units():
    "An intensity three times as strong at all ranges, and one that is the same: nothing is said"
    assert said("intensity", [3, 3, 3, 3]) == ""
    assert said("intensity", [1, 1, 1, 1]) == ""
