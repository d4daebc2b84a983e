"""Probabilities learned from records are calibrated."""

import json
from importlib.resources import files

import numpy as np
import pytest
from gap_training.cases import known_mechanisms
from gap_training.fit import document, figures, fit, hash_of, out_of_fold
from gap_training.records import first_evidence

from mlscorr.gap.evidence import Costs, calibration_error
from mlscorr.gap.evidence.decision import LearnedDecision
from tests.beds.joint_scores import joint, records


@pytest.fixture(scope="module")
def known():
    "Two hundred and forty hand-made records of eight worlds"
    return records(240)


@pytest.mark.long
def test_evidence_that_shows_the_truth_is_learned(known):
    "Out of fold effects of 3 MDB and more are right in nine of ten, and stated as often"
    rates = figures(known, out_of_fold(known), Costs(1.0, 1.0, 1.0))
    assert rates["one effect right at 3 MDB and more"][0] > 0.9
    assert rates["clean, open sky: a cause claimed"][0] < 0.3
    assert rates["calibration error"][0] < 0.1


@pytest.mark.long
def test_a_dear_false_alarm_makes_alarms_rare(known):
    "With ten times the cost no more clean surveys alarm, and no more effects are found"
    probabilities = out_of_fold(known)
    cheap, dear = (figures(known, probabilities, Costs(c, 1.0, 1.0)) for c in (1.0, 10.0))
    for name in ("clean, bad sky: a cause claimed", "one effect right at 3 MDB and more"):
        assert dear[name][0] <= cheap[name][0]


@pytest.mark.long
def test_a_decision_comes_back_from_its_document(known):
    "Rounded coefficients give the same probabilities to 1e-3, and say what made them"
    decision = fit(known)
    content = document(decision, {"seeds": [0, 7]})
    again = LearnedDecision.of(content)
    one = joint(range_bias=3.0)
    before, after = (each.probabilities(one) for each in (decision, again))
    assert all(before[name] == pytest.approx(after[name], abs=1e-3) for name in before)
    assert content["made_of"] == {"seeds": [0, 7]}


@pytest.mark.long
def test_p_values_of_clean_surveys_are_remembered(known):
    "Of beta(1/2, 1) in 48 clean records the parameters are found within a third"
    a, b = fit(known).p_value
    assert np.allclose([a, b], [0.5, 1.0], rtol=0.35)


def test_hashes_tell_what_made_them():
    "Another order is another hash"
    assert hash_of(["a", "b"]) != hash_of(["b", "a"])


def test_the_shipped_decision_was_learned_on_the_evidence_of_today():
    "Evidence of the first case is that of decision.json to 1e-3: who changes it has to learn anew"
    shipped = json.loads(files("mlscorr.gap.evidence").joinpath("decision.json").read_text())[
        "made_of"
    ]
    evidence = first_evidence(shipped["seeds"][0], known_mechanisms(None))
    assert evidence == pytest.approx(shipped["evidence"], abs=1e-3)


def test_calibration_is_the_distance_of_stated_from_reached():
    "Stated 0.9: nine of ten right is 0, five of ten 0.4"
    stated = np.full(10, 0.9)
    number = np.arange(10)
    assert calibration_error(stated, number < 9) == pytest.approx(0.0, abs=1e-12)
    assert calibration_error(stated, number < 5) == pytest.approx(0.4)
