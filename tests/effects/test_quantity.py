"""Quantities that no survey can have are refused."""

import numpy as np
import pytest

from mlscorr.effects import (
    make_effect,
)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("boresite", {}, r"'boresite' is an unknown effect; the nearest known one is boresight\."),
        (
            "boresight",
            {"magnitude": [200, 0, 0]},
            r"^boresight of 200 deg exceeds 10 deg; drawings .* to a degree\.$",
        ),
        ("boresight", {"magnitude": 1.0}, "of 1.0 is invalid: it must be 3 numbers in deg"),
        ("range_bias", {"magnitude": [1.0]}, "must be one number in m"),
        ("range_bias", {"magnitude": True}, "must be one number in m"),
        ("range_bias", {"magnitude": "0.1"}, "must be one number in m"),
        ("range_bias", {"magnitude": np.nan}, "of nan is not finite"),
        ("range_noise", {"magnitude": -0.1}, "range_noise of -0.1 m is less than 0 m"),
        ("range_bias", {"size": 0.1}, r"no parameter 'size'; its parameters are magnitude \(m\)"),
        ("position_step", {"magnitude": [0, 0, 1]}, r"needs time; .*magnitude \(3 numbers in m\)"),
        ("angle_eccentricity", {"magnitude": 1e-3, "phase": 90}, "phase of angle.* 90 rad exceeds"),
        (
            "target_outlier",
            {"magnitude": [1, 0, 0], "target": 3},
            "3 of target_outlier is not the name of a target",
        ),
        ("dropout", {"magnitude": 1.0}, "dropout of 1 ratio exceeds 0.99"),
        ("map_rotation", {"magnitude": 2.0}, r"2 rad exceeds 0.1 rad; .*degrees\?"),
    ],
)
def test_what_no_survey_can_have_is_refused_in_a_sentence(name, parameters, message):
    "Name, value, unit, limit, and why"
    with pytest.raises(ValueError, match=message) as error:
        make_effect(name, **parameters)
    assert "\n" not in str(error.value)
