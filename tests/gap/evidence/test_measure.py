"""Size of a gap, in the unit of its kind of cause."""

import numpy as np
import pytest

from mlscorr.gap.evidence import (
    Explanations,
    Observations,
    Predicted,
    column_table,
    gap_kind,
    position_terms,
    scatter_terms,
    signed_root,
)
from mlscorr.gap.evidence.observations import STATED

NOISES = ("range_noise", "position_noise", "dropout")


def test_each_label_has_a_kind_of_gap(with_surface):
    "Effects shift, noise of pulses scatters, that of the POS wanders, dropout loses returns"
    rows = with_surface[0].rows
    kinds = [gap_kind(label, NOISES, rows) for label in ("range_bias", *NOISES)]
    assert kinds == ["systematic", "scatter", "position", "returns"]
    assert gap_kind("range_bias+range_noise", NOISES, rows) == "systematic"
    metric = rows.select(rows.metric)
    assert gap_kind("range_noise", NOISES, metric) == "position"


def test_a_root_keeps_its_sign():
    "4 mm^2 less than predicted are -2 mm; a share of 1 % squared is 1 %"
    assert signed_root(np.array([-4e-6, 9e-6])) == pytest.approx([-2.0, 3.0])
    assert signed_root(np.array([1e-4]), "%") == pytest.approx([1.0])


def test_positions_have_no_gap_where_the_belief_is_right(with_surface):
    "Of replicas the mean of sigma^2 (u^2 - 1) is zero within five standard errors"
    g, _ = with_surface
    observed = Observations.of(g.rows, g.background)
    drawn = observed.whitener().draw(np.random.default_rng(3), 300)
    mean = position_terms(observed, Predicted.nothing(g.rows), drawn).mean(axis=0)
    assert abs(mean.mean()) < 5 * mean.std() / np.sqrt(300)


def test_scatter_that_is_predicted_is_no_gap(with_surface):
    "Roughness of 1 + growth times the believed variance leaves nothing once it is predicted"
    rows = with_surface[0].rows
    growth = np.where(rows.channel == "roughness", 0.7, 0.0)
    residual = np.log1p(growth)[:, None]
    nothing = Predicted.nothing(rows)
    predicted = Predicted(nothing.shift, growth, nothing.extra)
    before, after = (scatter_terms(rows, each, residual) for each in (nothing, predicted))
    rough = growth > 0
    assert before[rough, 0] == pytest.approx(0.7 * rows.assumed[rough])
    assert np.abs(after).max() < 1e-12
    assert not before[~rough].any()


def test_an_effect_explains_its_own_squares(with_surface):
    "Twice an effect's shift has four times the square, by what chance leaves of it"
    g, signs = with_surface
    effect = next(s for s in signs if s.name == "range_bias")
    observed = Observations.of(g.rows, g.background)
    table = column_table(g.rows, (effect,), (), observed.sigma)
    shift = observed.columns(0.05 * effect.jacobian)
    whitener = observed.whitener(STATED)
    explained = Explanations.of(table, whitener.innovations(observed.columns(table.columns))[0])
    once, twice = (
        explained.largest(whitener.innovations(size * shift)[0])[0][0] for size in (1.0, 2.0)
    )
    assert once > 0
    assert twice + 1 == pytest.approx(4 * (once + 1))
