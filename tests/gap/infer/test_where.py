"""The gap and its splits."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.infer.causes import infer_causes
from mlscorr.gap.infer.observations import Observations


def test_the_gap_adds_up_over_every_split_and_may_be_negative(with_surface):
    "Shares sum to one; a survey quieter than believed has a negative gap, inside the band or below"
    g, signs = with_surface
    quiet = replace(g.rows, residual=_quiet(g))
    where = infer_causes(quiet, g.background, g.survey, signs, np.random.default_rng(1), 20).where
    assert where.before < 0
    assert "mm less than predicted, no more than by chance" in where.headline
    for split in where.splits:
        assert split.share.sum() == pytest.approx(1.0)
        total = np.sum(split.count * np.sign(split.before) * split.before**2) / split.count.sum()
        assert total == pytest.approx(-(where.before**2))


def _quiet(g):
    "Half of what the believed covariance draws, in the order of the rows"
    observed = Observations.of(g.rows, g.background)
    residual = np.zeros(len(g.rows))
    drawn = observed.whitener().draw(np.random.default_rng(5), 1)[:, 0]
    residual[observed.row] = 0.5 * drawn
    return residual
