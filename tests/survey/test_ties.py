"""Features that passes saw, and the ties between them."""

import numpy as np
import pytest

from mlscorr.survey import TieFeatures, Ties

EAST = np.array([1.0, 0.0, 0.0])


@pytest.fixture
def wall():
    "A wall that the second pass, 900 s later, puts 0.3 m farther east than the first"
    centre = np.array([[447_000.3, 5_410_000.0, 120.0], [447_000.0, 5_410_000.4, 120.2]])
    return TieFeatures(
        pass_number=np.array([2, 1]),
        scanner=np.array([0, 0]),
        kind=np.array(["plane", "plane"]),
        gps_time=np.array([414_100.0, 413_200.0]),
        centre=centre,
        direction=np.tile(-EAST, (2, 1)),
        variance=np.full(2, 1e-6),
        tilt=np.full(2, 1e-4),
        extent=np.full(2, 0.3),
        points=np.array([200, 300]),
        sweep=np.zeros((2, 3)),
    )


@pytest.mark.parametrize("pair", [(0, 1), (1, 0)])
def test_the_misclosure_is_later_less_earlier(wall, pair):
    "Shift that place 1 needs relative to place 2, whatever the order in the pair"
    ties = Ties.between(wall, np.array([pair]), EAST[None], np.array([4e-6]))
    assert np.isclose(ties.misclosure[0], 0.3, atol=1e-9)
    assert np.array_equal(ties.pass_number, [[1, 2]])
    assert np.array_equal(ties.gps_time, [[413_200.0, 414_100.0]])
    assert np.array_equal(ties.feature, [[1, 0]])
    assert np.isclose(ties.sigma[0], 0.002)


def test_a_correction_of_either_view_closes_the_tie(wall):
    "n . (c1 - c2) = misclosure: moved by such corrections, both places agree along n"
    ties = Ties.between(wall, np.array([[0, 1]]), EAST[None], np.array([4e-6]))
    for share in (0.0, 0.4, 1.0):
        first = share * 0.3 * EAST
        second = (share - 1) * 0.3 * EAST
        corrected = ties.place[0] + [first, second]
        assert abs((corrected[1] - corrected[0]) @ ties.direction[0]) < 1e-9
