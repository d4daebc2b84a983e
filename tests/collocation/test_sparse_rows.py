"""What rows see of the states at knots."""

import numpy as np
import pytest

from mlscorr.collocation._knots import Knots, knot_step
from mlscorr.collocation._states import Layout
from mlscorr.collocation.sparse_rows import Sides
from tests.collocation.joint_states import ALL_FAMILIES
from tests.collocation.linked_rows import Street


def sides_of(street, nodes=1000):
    "Layout, knots, and Sides of control and ties"
    rows = street.rows
    times, clocks = (np.concatenate(part) for part in zip(*(r.epochs for r in rows), strict=True))
    layout = Layout.of(rows[0].signals)
    knots = Knots.of(times, clocks, [knot_step(signal.covariance) for signal in rows[0].signals])
    return layout, knots, [Sides.of(part, layout, knots, nodes) for part in rows]


@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_gains_and_remainder_make_up_the_variance_of_each_side(family):
    "At a knot a gain of one and nothing left; between them never more than one is left"
    street = Street(family, 60.0)
    _, knots, (_, ties) = sides_of(street)
    at_knot = np.isin(street.tie_time, knots.times)
    jitter = ties.gains[:, :, 1]  # exponential, with knots at all epochs
    assert at_knot.all()
    assert jitter[:, :, 0] == pytest.approx(1.0)
    assert (jitter[:, :, 1] == 0.0).all()
    assert (ties.remaining[:, :, 1] == 0.0).all()
    assert ((ties.remaining >= 0.0) & (ties.remaining < 1e-8)).all()


def test_whiteners_are_those_of_noise_and_what_the_knots_leave():
    "W R W^T = 1, with R the noise that an observation has alone"
    layout, _, sides = sides_of(Street("exponential", 60.0))
    for part, rows in zip(sides, Street("exponential", 60.0).rows, strict=True):
        white = part.white @ rows.noise.separate @ part.white.swapaxes(1, 2)
        assert np.abs(white - np.eye(white.shape[1])).max() < 1e-9
        halved = part.whitened(layout, rows.noise.separate / 0.25)
        assert np.abs(halved.white - 0.5 * part.white).max() < 1e-9 * np.abs(part.white).max()


def test_shared_errors_have_nodes_of_their_own():
    "Both passes of a target see the same one, ties none, and elimination gives it a place"
    street = Street("matern32", 60.0)
    _, _, (control, ties) = sides_of(street, nodes=40)
    assert control.unknown.tolist() == [*range(40, 46), *range(40, 46)]
    assert (control.sigma == street.noise.shared[street.noise.group]).all()
    assert (ties.unknown == -1).all()
    place = np.arange(46)[::-1]
    assert control.placed(place).unknown[:6].tolist() == [5, 4, 3, 2, 1, 0]
    assert (ties.placed(place).unknown == -1).all()
