"""Effects of the control survey move it as its frame does."""

import numpy as np
import pytest

from tests.effects.bed import (
    AGREEMENT,
    CONTROL,
    REFERENCE,
    applied,
)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("vertical_datum", lambda arm: np.tile([0, 0, 0.03], (len(arm), 1))),
        ("horizontal_datum", lambda arm: np.tile([0.05, -0.02, 0], (len(arm), 1))),
        ("map_rotation", lambda arm: 1e-5 * np.cross([0, 0, 1.0], arm)),
        ("map_scale", lambda arm: 1e-4 * arm * [1, 1, 0]),
        ("target_outlier", lambda arm: np.eye(6)[:, [2]] * [0.05, 0, -0.1]),
    ],
)
def test_the_control_moves_as_its_frame_does(name, expected):
    "Control at UTM size moves by the derivative of its own transformation, to 0.1 %"
    shift = applied(name).position - CONTROL.position
    wanted = expected(CONTROL.position - REFERENCE.place)
    assert np.abs(shift - wanted).max() < AGREEMENT * np.abs(wanted).max() + 1e-9  # m
