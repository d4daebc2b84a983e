"""Quality gates: what they ask of a report, and how they are refused."""

import numpy as np
import pytest

from mlscorr.evaluate import Statistics, failures, read_gate
from mlscorr.evaluate.quality import failed, quantities

RESIDUALS = np.array([[0.03, 0.00, -0.05], [-0.03, 0.04, 0.05]])
COUNTS = {"n_surveyed": 9, "n_seen": 7, "n_scored": 6, "n_unseen": 1}
REPORT = {
    "control": {
        "n": 4,
        **COUNTS,
        "after": Statistics.of(RESIDUALS[:0]).document(),
        "leave_one_out": {"rmse": [0.1, 0.2, 0.3]},
    },
    "check": {"n": 2, **COUNTS, "after": Statistics.of(RESIDUALS).document()},
    "model": {"sigma0": 1.5, "outliers": [{"name": "T01"}]},
    "coverage": {
        "longest_gap_s": 61.0,
        "points_outside_trajectory": 0,
        "points_outside_control": 12,
        "points_corrected": 1000,
        "points_untouched": 0,
        "points_extrapolated": 250,
        "points_noise": 30,
        "share_extrapolated": 0.25,
        "seconds_extrapolated": 31.0,
        "metres_extrapolated": 190.0,
    },
    "weak": [{"length_m": 150.0, "sigma": 0.3}, {"length_m": 40.0, "sigma": 0.8}],
}


@pytest.mark.parametrize(
    ("quantity", "value"),
    [
        ("check.rmse_e", 0.03),
        ("check.max_n", 0.04),
        ("check.rmse_h", 0.05),
        ("check.std_h", 0.05 * np.sqrt(2)),
        ("check.rmse_horizontal", np.sqrt((0.03**2 + 0.05**2) / 2)),
        ("check.max_3d", np.sqrt(0.03**2 + 0.04**2 + 0.05**2)),
        ("check.n", 2),
        ("leave_one_out.rmse_n", 0.2),
        ("model.sigma0", 1.5),
        ("model.outliers", 1),
        ("coverage.longest_gap_s", 61.0),
        ("check.n_seen", 7),
        ("check.n_unseen", 1),
        ("control.n_scored", 6),
        ("coverage.points_extrapolated", 250),
        ("coverage.share_extrapolated", 0.25),
        ("weak.n", 2),
        ("weak.sigma", 0.8),
        ("weak.length_m", 150.0),
    ],
)
def test_a_gate_compares_the_quantity_that_it_names(quantity, value):
    "A limit just below the value is exceeded, one just above is not"
    assert len(failures([read_gate(f"{quantity} > {value - 1e-6}")], REPORT)) == 1
    assert failures([read_gate(f"{quantity}>={value + 1e-6}")], REPORT) == []
    assert len(failures([read_gate(f"{quantity} < {value + 1e-6}")], REPORT)) == 1


def test_a_failure_names_the_axis_in_full_with_its_value():
    "A gate on h reports that it is the height, not the horizontal error"
    (failure,) = failed([read_gate("check.rmse_h > 0.03")], REPORT)
    assert failure.key == "exceeded"
    assert failure.values["what"] == "rmse of check points in height (m)"
    assert failure.values["value"] == pytest.approx(0.05)


def test_what_was_not_determined_is_not_good_enough():
    "Without any value neither > nor < lets a survey pass"
    for text in ("control.rmse_e > 1", "control.rmse_e < 0", "leave_one_out.max_3d > 1"):
        assert [failure.key for failure in failed([read_gate(text)], REPORT)] == ["not determined"]


def test_without_a_weak_stretch_no_limit_on_it_is_exceeded():
    "Nothing extrapolated has a sigma of zero"
    report = REPORT | {"weak": []}
    assert failures([read_gate("weak.sigma > 0"), read_gate("weak.n > 0")], report) == []


def test_every_quantity_can_be_asked():
    "No name that is offered fails on a report"
    for quantity in quantities():
        failures([read_gate(f"{quantity} > 0")], REPORT)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("check.rmse_x > 0.03", "'check.rmse_"),
        ("checks.rmse_e > 0.03", "'check.rmse_e'"),
        ("check.rmse_e", "QUANTITY > NUMBER"),
        ("check.rmse_e > 3 cm", "QUANTITY > NUMBER"),
        ("check.rmse_e == 0.03", "QUANTITY > NUMBER"),
        ("check.rmse_e > nan", "QUANTITY > NUMBER"),  # which no value ever is
        ("check.rmse_e > inf", "QUANTITY > NUMBER"),
        ("", "QUANTITY > NUMBER"),
    ],
)
def test_other_sentences_are_refused_with_the_way_out(text, words):
    "A gate that can't be read says how to write one, or the nearest name"
    with pytest.raises(ValueError) as error:
        read_gate(text)
    assert words in str(error.value)
