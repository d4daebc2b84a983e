"""From evidence to probabilities and one label."""

import numpy as np
import pytest

from mlscorr.gap.evidence import Costs
from mlscorr.gap.evidence.decision import cheapest, features, learned
from mlscorr.gap.evidence.labels import KINDS, JointScore, kind_of
from tests.beds.joint_scores import joint

NOISY = ("range_noise",)


@pytest.mark.parametrize(
    ("label", "kind"),
    [
        ("none", "none"),
        ("unknown", "unknown"),
        ("range_noise", "noise"),
        ("range_bias", "effect"),
        ("range_bias+range_noise", "effect"),
        ("range_bias+boresight", "pair"),
    ],
)
def test_labels_have_a_kind(label, kind):
    "By the number of effects, whatever noise is beside"
    assert kind_of(label, NOISY) == kind


def test_probabilities_are_shares_of_all_labels():
    "They sum to one, none is lost, and the most probable comes first"
    probability = learned().probabilities(joint(range_bias=8.0, range_bias_and_boresight=3.0))
    assert sum(probability.values()) == pytest.approx(1.0)
    assert set(probability) == set(joint(range_bias_and_boresight=3.0).score)
    assert list(probability.values()) == sorted(probability.values(), reverse=True)


def test_what_no_label_is_of_has_no_probability():
    "Without any pair the four other kinds share all"
    shares = dict(zip(KINDS, learned().by_kind(joint()), strict=True))
    assert shares["pair"] == 0.0
    assert sum(shares.values()) == pytest.approx(1.0)


def test_features_stay_finite_whatever_the_evidence():
    "Of a survey without noise classes and effects, and of evidence beyond all measure"
    for one in (joint(range_bias=1e6), joint(unknown=-1e6)):
        assert all(np.isfinite(list(features(one).values())))
    bare = joint()
    few = {"none": 0.0, "unknown": -3.0}
    values = features(JointScore(few, few, {}, bare.facts, ()))
    assert all(np.isfinite(list(values.values())))
    assert tuple(values) == tuple(features(bare)) == learned().names


def test_evidence_moves_the_verdict():
    "Nothing shows: none; odds of a million for one effect: that effect"
    assert next(iter(learned().probabilities(joint()))) == "none"
    assert next(iter(learned().probabilities(joint(range_bias=14.0)))) == "range_bias"


def test_the_label_is_the_one_that_costs_least():
    "A doubtful effect is named only if a false alarm costs no more than a miss"
    probability = {"range_bias": 0.55, "none": 0.45}
    assert cheapest(probability, NOISY, Costs(1.0, 1.0, 1.0)) == "range_bias"
    assert cheapest(probability, NOISY, Costs(5.0, 1.0, 1.0)) == "none"
    either = {"range_bias": 0.4, "time_offset": 0.35, "unknown": 0.2, "none": 0.05}
    assert cheapest(either, NOISY, Costs(1.0, 1.0, 1.0)) == "range_bias"
    assert cheapest(either, NOISY, Costs(1.0, 1.0, 0.1)) == "unknown"


def test_a_cause_is_no_false_alarm_where_noise_is_the_other_answer():
    "Something is wrong in any case: the more probable of noise and effect is named, as a name"
    probability = {"range_bias": 0.6, "range_noise": 0.38, "none": 0.02}
    assert cheapest(probability, NOISY, Costs()) == "range_bias"
    swapped = {"range_noise": 0.6, "range_bias": 0.38, "none": 0.02}
    assert cheapest(swapped, NOISY, Costs()) == "range_noise"
