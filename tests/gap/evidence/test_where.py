"""The gap and its splits."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.evidence import Observations, infer_causes
from mlscorr.gap.signatures import displacements
from tests.gap.inference import surveyed


@pytest.mark.long
def test_the_gap_adds_up_over_every_split_and_may_be_negative(with_surface):
    "Shares sum to one; a survey quieter than believed has a negative gap, inside the band or below"
    g, signs = with_surface
    quiet = replace(g.rows, residual=_quiet(g))
    where = infer_causes(quiet, g.background, g.survey, signs, np.random.default_rng(1), 20).where
    assert where.before < 0
    assert where.before <= where.null_band[1]
    for split in where.splits:
        assert split.share.sum() == pytest.approx(1.0)
        total = np.sum(split.count * np.sign(split.before) * split.before**2) / split.count.sum()
        assert total == pytest.approx(-(where.before**2))


@pytest.mark.long
@pytest.mark.parametrize("middle", [30.0, 160.0])
def test_a_bump_is_shown_when_it_is_not_when_it_surprises(with_surface, middle):
    "30 cm for 8 s (sigma): the stretch in time is where it is half as large, to 3 s at each end"
    g, signs = with_surface
    bump = make_effect("position_bump", magnitude=[0.02, 0.02, 0.3], time=middle, width=8.0)
    rows = surveyed(g, 5, bump)
    where = infer_causes(rows, g.background, g.survey, signs, np.random.default_rng(1), 20).where
    extent = next(split.extent for split in where.splits if split.by == "time")
    assert extent.low == pytest.approx(middle - 9.4, abs=3.0)
    assert extent.high == pytest.approx(middle + 9.4, abs=3.0)
    assert extent.share > 0.8
    assert extent.rows < 0.3


@pytest.mark.long
def test_an_error_in_a_band_of_ranges_is_shown_there(with_surface):
    "3 cm of range between 10 and 13 m, which no effect is: the stretch of ranges to 0.7 m"
    g, signs = with_surface
    rows = g.rows
    away = g.rows.covariates["range"]
    views = displacements(rows, g.survey)
    beam = {item: views.directions["beam"][k] for k, item in enumerate(views.item)}
    inside = np.flatnonzero(rows.metric & (away >= 10.0) & (away <= 13.0))
    shift = np.zeros(len(rows))
    shift[inside] = [0.03 * rows.direction[i] @ beam[rows.item[i]] for i in inside]
    rows = surveyed(g, 6, outside=shift)
    where = infer_causes(rows, g.background, g.survey, signs, np.random.default_rng(1), 20).where
    extent = next(split.extent for split in where.splits if split.by == "range")
    assert extent.low == pytest.approx(10.0, abs=0.7)
    assert extent.high == pytest.approx(13.0, abs=0.7)


def _quiet(g):
    "Half of what the believed covariance draws, in the order of the rows"
    observed = Observations.of(g.rows, g.background)
    residual = np.zeros(len(g.rows))
    drawn = observed.whitener().draw(np.random.default_rng(5), 1)[:, 0]
    residual[observed.row] = 0.5 * drawn
    return residual
