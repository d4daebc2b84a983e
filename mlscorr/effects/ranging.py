"""Effects of the scanner's beam and its ranges, and lost returns."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mlscorr.effects._quantity import quantity
from mlscorr.effects._settings import SETTINGS
from mlscorr.effects.effect import Effect


@dataclass(frozen=True)
class BeamDivergence(Effect):
    """The beam is wider than stated: full divergence (rad) = stated + magnitude.

    Parameters
    ----------
    magnitude : float
        Units: mrad.
    """

    stage: ClassVar = "beam"
    title: ClassVar = "Wide beam"
    meaning: ClassVar = "The laser footprint is wider than stated."
    sentence: ClassVar = "The laser beam is {size} wider than stated."
    remedy: ClassVar = "Ask the manufacturer for the beam width of the scanner."
    magnitude: float = quantity(
        "mrad",
        20.0,
        "no laser scanner has a footprint of 20 cm at 10 m",
        typical=0.35,
        source="RIEGL VQ-250 data sheet: 0.35 mrad",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        return value + 1e-3 * self.magnitude


@dataclass(frozen=True)
class RangeScale(Effect):
    """Ranges are too long in proportion: recorded = true (1 + magnitude).

    Parameters
    ----------
    magnitude : float
        Units: ratio.
    """

    stage: ClassVar = "range"
    title: ClassVar = "Range scale"
    meaning: ClassVar = "Range errors are proportional to the range."
    sentence: ClassVar = "The ranges of the scanner are too {side} by {size} of their length."
    remedy: ClassVar = "Check temperature and pressure in the scanner's range correction."
    sides: ClassVar = ("long", "short")
    magnitude: float = quantity(
        "ratio",
        0.01,
        "the time base or refractive index can't be wrong by a hundredth",
        typical=5e-5,
        source="estimate: quartz of the time base 20-50 ppm, air 1 ppm/K (Rueeger 1990)",
    )

    def _error(self, value, reference, rng):
        return self.magnitude * value.range


@dataclass(frozen=True)
class RangeBias(Effect):
    """Every range is too long: recorded = true + magnitude.

    Parameters
    ----------
    magnitude : float
        Units: m.
    """

    stage: ClassVar = "range"
    title: ClassVar = "Range bias"
    meaning: ClassVar = "All ranges have the same constant error."
    sentence: ClassVar = "All ranges of the scanner are {size} too {side}."
    remedy: ClassVar = "Have the zero offset of the scanner's ranges checked on a baseline."
    sides: ClassVar = ("long", "short")
    magnitude: float = quantity(
        "m",
        1.0,
        "the manufacturer's calibration can't be wrong by a meter",
        typical=0.010,
        source="RIEGL VQ-250 data sheet: accuracy 10 mm",
    )

    def _error(self, value, reference, rng):
        return self.magnitude


@dataclass(frozen=True)
class RangeWalk(Effect):
    """Range depends on the received intensity.

    recorded = true + magnitude log10(intensity / reference_intensity); an intensity below one count
    is set to one.

    Parameters
    ----------
    magnitude : float
        Units: m per decade.
    reference_intensity : float
        Intensity at which nothing is added. Units: counts of 16 bits.
    """

    stage: ClassVar = "range"
    title: ClassVar = "Range walk"
    meaning: ClassVar = "Ranges depend on the intensity of the return."
    sentence: ClassVar = (
        "Bright surfaces are measured {side} than dark ones: {size} for ten times the intensity."
    )
    remedy: ClassVar = "Ask the manufacturer for the intensity-dependent range correction."
    sides: ClassVar = ("farther", "nearer")
    worded_unit: ClassVar = "m"
    magnitude: float = quantity(
        "m per decade",
        0.2,
        "a pulse of 1 ns is 15 cm long, and its edge can't shift further",
        typical=0.005,
        source="estimate: a thirtieth of the 15 cm of a pulse of 1 ns, remaining after calibration",
    )
    reference_intensity: float = quantity(
        "counts of 16 bits",
        65535.0,
        "that is the full scale",
        default=6553.5,  # 1/10 of the full scale: asphalt and plaster in a street
        least=1.0,
    )

    def _error(self, value, reference, rng):
        decades = np.log10(np.maximum(value.intensity, 1.0) / self.reference_intensity)
        return self.magnitude * decades


@dataclass(frozen=True)
class IncidenceBias(Effect):
    """Range depends on the angle of incidence a: recorded = true + magnitude (1 / cos a - 1).

    A threshold on the linear edge of a pulse is reached with a delay proportional to the threshold
    over the amplitude, and by Lambert's law the amplitude is proportional to cos a. The magnitude
    is thus the bias at 60 deg; beyond 84 deg it is constant.

    Parameters
    ----------
    magnitude : float
        Units: m.
    """

    stage: ClassVar = "range"
    title: ClassVar = "Incidence bias"
    meaning: ClassVar = "Ranges depend on the incidence angle."
    sentence: ClassVar = "At oblique incidence, ranges are too {side}: by {size} at 60°."
    remedy: ClassVar = "Check ranges at grazing incidence against a known plane."
    sides: ClassVar = ("long", "short")
    magnitude: float = quantity(
        "m",
        0.1,
        "the error is nine times as large at grazing incidence and would be visible",
        typical=0.003,
        source="estimate: millimeters, as the noise that Soudarissanane et al. 2009 find at 60 deg",
    )

    def _error(self, value, reference, rng):
        return self.magnitude * (1.0 / np.maximum(value.incidence, SETTINGS.grazing_cosine) - 1.0)


@dataclass(frozen=True)
class RangeNoise(Effect):
    """Ranges are noisier than stated: additional white noise for each return, one sigma.

    Parameters
    ----------
    magnitude : float
        Units: m.
    """

    stage: ClassVar = "range"
    random: ClassVar = True
    title: ClassVar = "Noisy ranges"
    meaning: ClassVar = "Ranges are noisier than stated."
    sentence: ClassVar = (
        "The ranges of the scanner are noisier than stated: {size} of additional noise."
    )
    remedy: ClassVar = (
        "Set the scanner's range noise in survey.toml to the value found, or have the scanner "
        "checked."
    )
    magnitude: float = quantity(
        "m",
        1.0,
        "no surveying scanner is as noisy",
        typical=0.005,
        source="RIEGL VQ-250 data sheet: precision 5 mm",
        least=0.0,
    )

    def _error(self, value, reference, rng):
        return self.magnitude * rng.standard_normal(len(value))


@dataclass(frozen=True)
class Dropout(Effect):
    """A share of the returns is lost, each independently.

    Parameters
    ----------
    magnitude : float
        Units: ratio.
    """

    stage: ClassVar = "return"
    random: ClassVar = True
    title: ClassVar = "Lost returns"
    meaning: ClassVar = "Expected returns are missing."
    sentence: ClassVar = "{size} of the expected returns are missing."
    remedy: ClassVar = "Look for wet or dark surfaces, or a dirty scanner window."
    magnitude: float = quantity(
        "ratio",
        0.99,
        "too few returns would remain",
        typical=0.05,
        source="estimate: dark or wet surfaces return nothing for one pulse in twenty",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        return replace(value, kept=value.kept & (rng.random(len(value)) >= self.magnitude))
