"""Effects of a scanner mounting that differs from the recorded one."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects._quantity import quantity
from mlscorr.effects.effect import Effect
from mlscorr.effects.stages import BODY
from mlscorr.survey import Mounting


@dataclass(frozen=True)
class Boresight(Effect):
    """The recorded boresight needs a small rotation: R_true = Exp(magnitude) R_recorded.

    About the body axes right, forward, up (Mao et al. 2015, Eq. 2).

    Parameters
    ----------
    magnitude : 3 floats
        Right, forward and up. Units: deg.
    """

    stage: ClassVar = "mounting"
    title: ClassVar = "Boresight"
    meaning: ClassVar = "The scanner's orientation differs from the recorded mounting."
    sentence: ClassVar = "The recorded boresight is wrong: the scanner is actually rotated {size}."
    remedy: ClassVar = "Run mlscorr calibrate, which estimates the mounting from the targets."
    sides: ClassVar = (
        ("nose up", "nose down"),
        ("right side down", "left side down"),
        ("to the left", "to the right"),
    )
    parts: ClassVar = BODY
    magnitude: tuple[float, float, float] = quantity(
        "deg",
        10.0,
        "drawings give a mounting to a degree",
        count=3,
        typical=0.05,
        source="Mao et al. 2015, Table 6: 0.03, 0.06 and 0.21 deg",
    )

    def _change(self, value, reference, rng):
        turn = Rotation.from_rotvec(self.magnitude, degrees=True)
        return Mounting(value.lever_arm, turn.inv() * value.boresight)


@dataclass(frozen=True)
class LeverArm(Effect):
    """The recorded lever arm needs magnitude: true = recorded + magnitude, in the body frame.

    Parameters
    ----------
    magnitude : 3 floats
        Right, forward and up. Units: m.
    """

    stage: ClassVar = "mounting"
    title: ClassVar = "Lever arm"
    meaning: ClassVar = "The scanner's position on the vehicle differs from the recorded mounting."
    sentence: ClassVar = "The recorded lever arm is wrong: the scanner is actually {size}."
    remedy: ClassVar = "Run mlscorr calibrate, which estimates the mounting from the targets."
    sides: ClassVar = (
        ("farther right", "farther left"),
        ("farther forward", "farther back"),
        ("higher", "lower"),
    )
    parts: ClassVar = BODY
    magnitude: tuple[float, float, float] = quantity(
        "m",
        5.0,
        "no car is larger",
        count=3,
        typical=0.02,
        source="Mao et al. 2015, Table 6: 0.0005, 0.015 and 0.065 m",
    )

    def _change(self, value, reference, rng):
        return Mounting(value.lever_arm - np.array(self.magnitude), value.boresight)
