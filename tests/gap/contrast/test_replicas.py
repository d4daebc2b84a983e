"""Innovations of replicas of a survey."""

from dataclasses import replace

import numpy as np
import pytest
from feature_errors import errors
from gap_training.features import geometry

from mlscorr.gap.contrast import replica_innovations
from mlscorr.gap.evidence import infer_causes
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import signatures


@pytest.mark.long
def test_replicas_are_as_many_and_as_wide_as_the_model_says():
    "A clean survey of features: an innovation each, about as wide as its own, each time the same"
    g = geometry(5, targets=16, patches=40)
    rows = replace(g.rows, residual=errors(g, np.random.default_rng(1)))
    signs, _ = signatures(rows, g.survey)
    few = [sign for sign in signs if sign.name in ("time_offset", "range_bias")]
    model = background(rows, g.survey)
    inference = infer_causes(rows, model, g.survey, few, np.random.default_rng(0))
    replicas, again = (
        replica_innovations(rows, model, inference, np.random.default_rng(0)) for _ in range(2)
    )
    assert len(replicas) == len(inference.where.innovation)
    assert replicas.std() == pytest.approx(inference.where.innovation[:, 1].std(), rel=0.5)
    assert np.array_equal(replicas, again)
