"""Input that can't be is refused; what a POS doesn't state is filled in and told."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import checked_inputs, estimate_correction
from mlscorr.survey import Pos
from tests.beds.pos_errors import CONSTANT, EPOCHS, START, Case, even, rms, smooth_case


def test_sigma_columns_of_zero_are_no_statement():
    "No POS is perfect: the sigmas that are believed stand in for it, and a warning says so"
    rng = np.random.default_rng(4)
    zero = np.zeros((len(EPOCHS), 3))
    case = Case(EPOCHS, CONSTANT, even(12), rng, sigma=zero, attitude_sigma=zero)
    estimate = case.estimate()
    assert rms(case.remaining(estimate)) < 0.006  # m
    assert ("zero sigmas", "position_sigma") in [
        (warning.key, warning.values.get("column")) for warning in estimate.statements
    ]


def test_no_observation_is_refused():
    "Nothing can be estimated from no target"
    case = smooth_case(1)
    with pytest.raises(ValueError, match="No control point was observed"):
        estimate_correction(case.recorded, case.matched[[]])


@pytest.mark.parametrize("sigma", [-0.01, np.nan, 0.0])
def test_control_without_a_sigma_is_refused(sigma):
    "Negative, missing, or zero with a zero of its observation: one sentence with the name"
    case = smooth_case(1)
    stated = case.control.sigma.copy()
    stated[3] = sigma
    case.control = replace(case.control, sigma=stated)
    case.observations = replace(case.observations, covariance=np.zeros((16, 3, 3)))
    with pytest.raises(ValueError, match=r"1 of 16 observed control points .*first: T04"):
        case.estimate()


def test_negative_sigmas_of_the_pos_are_refused():
    "The number of epochs and the likely cause are told"
    case = smooth_case(1)
    sigma = case.recorded.position_sigma.copy()
    sigma[5:8] = -1.0
    case.recorded = replace(case.recorded, position_sigma=sigma)
    with pytest.raises(ValueError, match="3 of 2001 trajectory epochs have a negative"):
        case.estimate()


@pytest.mark.long
def test_sigmas_missing_in_part_are_filled_and_told():
    "Zeros over 10 s of a constant sigma: the same result as without them, and a sentence"
    case = smooth_case(1)
    expected = case.remaining(case.estimate())
    sigma = case.recorded.position_sigma.copy()
    sigma[500:600] = 0.0
    case.recorded = replace(case.recorded, position_sigma=sigma)
    estimate = case.estimate()
    assert case.remaining(estimate) == pytest.approx(expected, abs=1e-9)
    assert estimate.warnings[0].startswith("100 of 2001 trajectory epochs state a position_sigma")


CASE = smooth_case(1, n=4)


def checked(position=None, attitude=None, pos=None, order=1):
    "The filled trajectory of a drive with such sigmas, and the sentences about it"
    trajectory = replace(CASE.recorded, position_sigma=position, attitude_sigma=attitude)
    return checked_inputs(trajectory, CASE.matched, pos or Pos(), order)


def test_stated_sigmas_are_left_alone():
    "Smooth sigmas that grow to 20 times and fall back in one epoch are statements: no bit changes"
    sigma = np.full((len(EPOCHS), 3), 0.02)
    sigma[800:1200] = np.linspace(0.02, 0.4, 400)[:, None]
    filled, notes = checked(sigma, sigma / 100)
    assert notes == () and filled.position_sigma is sigma


def test_no_sigmas_are_no_fault():
    "A trajectory without columns is used as it is"
    filled, notes = checked()
    assert notes == () and filled.position_sigma is None and filled.attitude_sigma is None


@pytest.mark.parametrize("factor", [0.0, 0.01, 100.0])
@pytest.mark.parametrize("number", [1, 2])
def test_epochs_that_jump_alone_take_the_line_between_their_neighbours(number, factor):
    "Zero, a hundredth or a hundredfold at one or two epochs: the line beside it, to 1e-12 m"
    expected = np.tile(np.linspace(0.02, 0.05, len(EPOCHS))[:, None], (1, 3))
    sigma = expected.copy()
    sigma[700 : 700 + number] *= factor
    filled, (note,) = checked(sigma)
    np.testing.assert_allclose(filled.position_sigma, expected, atol=1e-12)
    assert note.key == "filled sigmas"
    assert (note.values["filled"], note.values["column"]) == (number, "position_sigma")
    assert note.values["first"] == pytest.approx(START + 70.0)


@pytest.mark.parametrize("column", ["position", "attitude"])
def test_zeros_everywhere_are_no_column(column):
    "The column goes, and a warning says so"
    filled, (note,) = checked(**{column: np.zeros((len(EPOCHS), 3))})
    assert getattr(filled, f"{column}_sigma") is None
    assert (note.key, note.values["column"]) == ("zero sigmas", f"{column}_sigma")


@pytest.mark.parametrize("axis", range(3))
def test_one_axis_of_zero_is_filled_with_the_others(axis):
    "If only the height sigma is zero, the whole epoch is filled from its neighbors"
    sigma = np.full((len(EPOCHS), 3), 0.03)
    sigma[100:105, axis] = 0.0
    filled, (note,) = checked(sigma)
    np.testing.assert_allclose(filled.position_sigma, 0.03)
    assert note.values["filled"] == 5


@pytest.mark.parametrize(
    "pos",
    [
        Pos(position_sigma=-0.01),
        Pos(attitude_sigma=np.array([1e-4, -1e-4, 1e-4])),
    ],
)
def test_negative_beliefs_are_refused(pos):
    "Both beliefs are named in m and deg"
    with pytest.raises(
        ValueError, match=r"under \[pos\] are .* m and .* deg; none may be negative"
    ):
        checked(pos=pos)


@pytest.mark.parametrize("order", [-1, 1.5, "1", None, True])
def test_an_order_is_a_whole_number_from_zero_on(order):
    "Order 0 is a shift; there is nothing below it, and nothing between two orders"
    with pytest.raises(ValueError, match=f"order of the trend is {order!r}; it must be"):
        checked(order=order)
    assert checked(order=0)[1] == checked(order=np.int64(1))[1] == ()


def test_a_sigma_of_zero_counts_with_that_of_the_observation():
    "A perfect survey point seen with 5 mm of noise is no fault"
    control = replace(CASE.control, sigma=np.zeros((4, 3)))
    matched = replace(CASE.matched, surveyed=control)
    assert checked_inputs(CASE.recorded, matched, Pos(), 1)[1] == ()
