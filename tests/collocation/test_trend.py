"""The polynomial trend: any polynomial on the control span, its end value outside."""

import numpy as np
import pytest

from mlscorr.collocation import polynomial_design

START = 413_200.0  # s of week
SPAN = START + 3.0, START + 103.0


@pytest.mark.parametrize("order", range(6))
def test_every_polynomial_of_the_order_is_in_the_basis(order):
    "A polynomial per axis is fitted to 1e-9 m, on the span and, where it may run on, beyond it"
    time = np.linspace(START, START + 120.0, 200)
    coefficients = np.random.default_rng(order).normal(size=(order + 1, 3))
    error = np.polynomial.polynomial.polyval((time - START) / 100.0, coefficients).T
    design = polynomial_design(time, SPAN, order, extrapolate=True).reshape(600, -1)
    parameters = np.linalg.lstsq(design, error.ravel(), rcond=None)[0]
    assert np.abs(design @ parameters - error.ravel()).max() < 1e-9  # m


def test_the_trend_keeps_its_end_value_outside_the_control_span():
    "Before the first and after the last control epoch nothing changes any more"
    design = polynomial_design(np.array([START, *SPAN, START + 1e4]), SPAN, 5)
    assert np.array_equal(design[0], design[1]) and np.array_equal(design[2], design[3])


def test_the_design_of_high_orders_is_well_conditioned():
    "Order 5 at GPS times loses less than two digits"
    design = polynomial_design(np.linspace(*SPAN, 100), SPAN, 5).reshape(300, -1)
    assert np.linalg.cond(design) < 100
