"""Effects of the scanner's encoder, which measures the angle of each beam."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mlscorr.effects._quantity import quantity
from mlscorr.effects.effect import Effect
from mlscorr.effects.stages import noise_by_pulse


@dataclass(frozen=True)
class AngleScale(Effect):
    """The encoder's scale is wrong about the zero beam: recorded = true + magnitude angle.

    The angle is reduced to -180 to 180 deg.

    Parameters
    ----------
    magnitude : float
        Units: ratio.
    """

    stage: ClassVar = "angle"
    title: ClassVar = "Encoder scale"
    meaning: ClassVar = "Scan angle errors are proportional to the angle from the zero beam."
    sentence: ClassVar = "The scan angles of the encoder are too {side} by {size}."
    remedy: ClassVar = "Have the scanner's encoder checked."
    sides: ClassVar = ("large", "small")
    magnitude: float = quantity(
        "ratio",
        0.05,
        "one turn of the mirror would be wrong by 18 deg",
        typical=1e-4,
        source="estimate: 0.3 mm at 3 m and 60 deg; such a term is in Lichti and Licht 2006",
    )

    def _error(self, value, reference, rng):
        return self.magnitude * (np.mod(value.angle + np.pi, 2 * np.pi) - np.pi)


@dataclass(frozen=True)
class AngleEccentricity(Effect):
    """The encoder's disc is off its axis: recorded = true + magnitude sin(angle - phase).

    Parameters
    ----------
    magnitude : float
        Units: rad.
    phase : float
        Angle from the zero beam at which the error rises through zero. Units: rad.
    """

    stage: ClassVar = "angle"
    title: ClassVar = "Encoder eccentricity"
    meaning: ClassVar = "Scan angle errors repeat once per turn."
    sentence: ClassVar = (
        "The scanner's encoder is eccentric: scan angles are wrong by up to {size}, once per turn."
    )
    remedy: ClassVar = "Have the scanner's encoder checked."
    parts: ClassVar = ("magnitude cos(phase)", "magnitude sin(phase)")
    magnitude: float = quantity(
        "rad",
        0.05,
        "a disc of 25 mm radius can't be eccentric by more than 1 mm",
        typical=1e-4,
        source="derived: 2.5 um of eccentricity on a disc of 25 mm radius",
    )
    phase: float = quantity("rad", 7.0, "a turn has 6.28 rad (is it in degrees?)", default=0.0)

    def _error(self, value, reference, rng):
        return self.magnitude * np.sin(value.angle - self.phase)


@dataclass(frozen=True)
class AngleNoise(Effect):
    """Angles are noisier than stated: additional white noise for each pulse, one sigma.

    Parameters
    ----------
    magnitude : float
        Units: deg.
    """

    stage: ClassVar = "angle"
    random: ClassVar = True
    title: ClassVar = "Noisy scan angles"
    meaning: ClassVar = "Scan angles are noisier than stated."
    sentence: ClassVar = "The scan angles are noisier than stated: {size} of additional noise."
    remedy: ClassVar = (
        "Set the scanner's angle noise in survey.toml to the value found, or have its encoder "
        "checked."
    )
    magnitude: float = quantity(
        "deg",
        1.0,
        "encoders of surveying scanners resolve thousandths of a degree",
        typical=0.002,
        source="twice the resolution of the RIEGL VQ-250's data sheet, 0.001 deg",
        least=0.0,
    )

    def _error(self, value, reference, rng):
        return np.radians(self.magnitude) * noise_by_pulse(value, rng)
