"""Distances of observations from their surveyed positions, relative to the stated sigma."""

from dataclasses import replace

import numpy as np
import pytest
from gap_training import features

from mlscorr.gap.advice import agreements


@pytest.mark.long
def test_errors_of_the_stated_size_agree_with_it():
    "Residuals drawn row by row with the stated variances have their RMS, to 10 %, in each channel"
    g = features.geometry(3, targets=30, patches=300, rough=False)
    variance = g.rows.noise + g.rows.survey
    legs = g.background.position**2 + g.background.attitude**2
    np.add.at(variance, g.background.row, legs.sum(axis=1))
    noise = np.random.default_rng(4).standard_normal(len(variance))
    drawn = replace(g.rows, residual=np.sqrt(variance) * noise)
    parts = agreements(drawn, g.background)
    assert {part.channel for part in parts} == set(g.rows.channel[g.rows.metric])
    for part in parts:
        assert part.rms_mm == pytest.approx(part.stated_mm, rel=0.1)
        assert part.things == len(np.unique(g.rows.item[g.rows.channel == part.channel]))
    thrice = agreements(replace(drawn, residual=3 * drawn.residual), g.background)
    assert [part.rms_mm for part in thrice] == pytest.approx([3 * part.rms_mm for part in parts])
