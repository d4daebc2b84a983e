"""The model section says what was estimated, in numbers that JSON can hold."""

import json

import numpy as np
import pytest

from mlscorr.estimate import COMPONENTS
from mlscorr.evaluate import model_section
from tests.beds.pos_errors import CONSTANT, EPOCHS, Case, even, smooth_case


@pytest.fixture(scope="module")
def estimate():
    "Of nine targets, one of which is 0.5 m wrong under a POS of 2 cm"
    rng = np.random.default_rng(2)
    case = Case(EPOCHS, CONSTANT, even(9), rng, np.full((len(EPOCHS), 3), 0.02))
    case.spoil(4, [0.4, -0.3, 0.0])
    return case.estimate()


@pytest.fixture(scope="module")
def section(estimate):
    return model_section(estimate)


def test_json_holds_it_without_nan(section):
    "Written and read it is the same"
    assert json.loads(json.dumps(section, allow_nan=False)) == section


def test_the_wrong_point_is_listed_with_its_test(estimate, section):
    "Name, statistic and critical value; it has no test among the used ones"
    (outlier,) = section["outliers"]
    assert outlier["name"] == "T05" and outlier["statistic"] > outlier["critical"] > 10.0
    assert outlier["statistic"] == estimate.outliers[0].statistic
    used = [f"T{i:02d}" for i in range(1, 10) if i != 5]
    assert [test["name"] for test in section["tests"]] == used


def test_tests_have_three_numbers_for_each_pass(estimate, section):
    "w, redundancy and detectable error of each axis, as the estimate has them"
    for row, test in zip(section["tests"], estimate.tests, strict=True):
        np.testing.assert_allclose(row["w"], test.w)
        np.testing.assert_allclose(row["detectable"], test.detectable)
        assert np.shape(row["redundancy"]) == (1, 3)


def test_families_and_orders_are_shares(section):
    "Probabilities of the families sum to one, so do those of orders and families together"
    for name in ("alternatives", "orders"):
        assert sum(row["probability"] for row in section[name]) == pytest.approx(1.0)
    assert len({row["family"] for row in section["alternatives"]}) == 4
    best = max(section["alternatives"], key=lambda row: row["probability"])
    assert section["covariance"]["family"] == best["family"]


def test_components_are_named(section):
    "Six ratios between 0 and 1; those below a half are determined"
    assert list(section["variance_ratio"]) == list(COMPONENTS) == list(section["determined"])
    for name, ratio in section["variance_ratio"].items():
        assert 0.0 <= ratio <= 1.0
        assert section["determined"][name] == (ratio < 0.5)
    assert section["determined"]["easting"]


def test_one_target_left_out_is_not_corrected():
    "The prior of the POS alone tests it: its whole misclosure of 0.4, 0.3 and 0.2 m remains"
    section = model_section(Case(EPOCHS, CONSTANT, [100.0], np.random.default_rng(1)).estimate())
    (test,) = section["tests"]
    assert test["statistic"] > 0.0 and np.isfinite(test["w"]).all()
    for row in section["orders"]:
        assert row["leave_one_out_rmse"] == pytest.approx([0.4, 0.3, 0.2], abs=0.03)  # m


@pytest.mark.long
def test_the_global_test_and_gap_are_those_of_the_guards():
    "Statistic within limits, start and end of the longest stretch without control"
    estimate = smooth_case(12, n=6).estimate()
    section = model_section(estimate)
    guards = estimate.guards
    assert section["longest_gap"] == list(guards.longest_gap)
    low, high = section["global_test"]["limits"]
    assert section["global_test"]["passed"] == (low <= section["global_test"]["statistic"] <= high)
    assert section["passes_without_control"] == []
