"""Effects of the scanner: beam, clock, range, angle, lost returns.

Where a source is called an estimate, the sentence is its derivation; nothing else backs it.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mlscorr.effects.effect import Effect, quantity

WALK_INTENSITY = 6553.5  # a tenth of the 16-bit full scale: asphalt and plaster of a street
GRAZING = 0.1  # cosine of incidence (84 deg) below which a bias by incidence grows no more


def pulse(returns):
    """Number (n,) of the pulse that each return came from, counted as they first appear.

    Returns of a pulse have one time and one angle; they need not stand side by side.
    """
    order = np.lexsort((returns.angle, returns.gps_time))
    time, angle = returns.gps_time[order], returns.angle[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(time) != 0) | (np.diff(angle) != 0)
    first = np.empty_like(order)
    first[order] = order[new][np.cumsum(new) - 1]  # the sort is stable: the first one's row
    appeared = np.cumsum(first == np.arange(len(first))) - 1
    return appeared[first]


def _noise_by_pulse(returns, rng):
    """Unit noise (n,), the same for all returns of a pulse, drawn in scan order."""
    if (returns.gps_time[1:] > returns.gps_time[:-1]).all():  # one return each: nothing to sort
        return rng.standard_normal(len(returns))
    number = pulse(returns)
    return rng.standard_normal(number.max(initial=-1) + 1)[number]


@dataclass(frozen=True)
class BeamDivergence(Effect):
    """The beam is wider than stated: full divergence (rad) = stated + magnitude."""

    name: ClassVar = "beam_divergence"
    stage: ClassVar = "beam"
    magnitude: float = quantity(
        "mrad",
        20.0,
        "a footprint of 20 cm at 10 m is no laser scanner's",
        typical=0.35,
        source="RIEGL VQ-250 data sheet: 0.35 mrad",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        return value + 1e-3 * self.magnitude


@dataclass(frozen=True)
class TimeOffset(Effect):
    """The scanner's clock is ahead of the POS's: recorded = true + magnitude."""

    name: ClassVar = "time_offset"
    stage: ClassVar = "clock"
    magnitude: float = quantity(
        "s",
        1.0,
        "more than the step of time messages is a wrong time system",
        typical=1e-3,
        source="estimate: time messages without the pulse per second hold to about 1 ms",
    )

    def _change(self, value, reference, rng):
        return replace(value, gps_time=value.gps_time + self.magnitude)


@dataclass(frozen=True)
class ClockDrift(Effect):
    """The scanner's clock runs fast: recorded = true + magnitude (true - reference.start)."""

    name: ClassVar = "clock_drift"
    stage: ClassVar = "clock"
    magnitude: float = quantity(
        "s per s",
        1e-3,
        "no quartz is off by more, and one that is would be replaced",
        typical=2e-5,
        source="usual data sheets of quartz oscillators: 20 ppm, running free of GNSS",
    )

    def _change(self, value, reference, rng):
        drift = self.magnitude * (value.gps_time - reference.start)
        return replace(value, gps_time=value.gps_time + drift)


@dataclass(frozen=True)
class TimeJitter(Effect):
    """Each pulse's time stamp has noise of its own, shared by the pulse's returns."""

    name: ClassVar = "time_jitter"
    stage: ClassVar = "clock"
    random: ClassVar = True
    magnitude: float = quantity(
        "s",
        0.01,
        "more than the time of a scan line mixes up the lines",
        typical=1e-4,
        source="estimate: interrupts of an operating system without real time take 0.1 ms",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        jitter = self.magnitude * _noise_by_pulse(value, rng)
        return replace(value, gps_time=value.gps_time + jitter)


@dataclass(frozen=True)
class RangeBias(Effect):
    """Every range is too long: recorded = true + magnitude."""

    name: ClassVar = "range_bias"
    stage: ClassVar = "range"
    magnitude: float = quantity(
        "m",
        1.0,
        "the manufacturer's calibration can't miss a metre",
        typical=0.010,
        source="RIEGL VQ-250 data sheet: accuracy 10 mm",
    )

    def _change(self, value, reference, rng):
        return replace(value, range=value.range + self.magnitude)


@dataclass(frozen=True)
class RangeScale(Effect):
    """Ranges are too long in proportion: recorded = true (1 + magnitude)."""

    name: ClassVar = "range_scale"
    stage: ClassVar = "range"
    magnitude: float = quantity(
        "ratio",
        0.01,
        "a counter or a refractive index can't be wrong by a hundredth",
        typical=5e-5,
        source="estimate: quartz of the counter 20-50 ppm, air 1 ppm/K (Rueeger 1990)",
    )

    def _change(self, value, reference, rng):
        return replace(value, range=value.range + self.magnitude * value.range)


@dataclass(frozen=True)
class RangeWalk(Effect):
    """Range depends on the received intensity.

    recorded = true + magnitude log10(intensity / reference_intensity); an intensity below one
    count is taken as one.
    """

    name: ClassVar = "range_walk"
    stage: ClassVar = "range"
    magnitude: float = quantity(
        "m per decade",
        0.2,
        "a pulse of 1 ns is 15 cm long, and its edge can't walk further",
        typical=0.005,
        source="estimate: a thirtieth of the 15 cm of a pulse of 1 ns, left by calibration",
    )
    reference_intensity: float = quantity(
        "counts of 16 bits",
        65535.0,
        "that is the full scale",
        default=WALK_INTENSITY,
        least=1.0,
    )

    def _change(self, value, reference, rng):
        decades = np.log10(np.maximum(value.intensity, 1.0) / self.reference_intensity)
        return replace(value, range=value.range + self.magnitude * decades)


@dataclass(frozen=True)
class IncidenceBias(Effect):
    """Range depends on the angle of incidence a: recorded = true + magnitude (1 / cos a - 1).

    A threshold on the straight edge of a pulse is reached later by a time in proportion to the
    threshold over the amplitude, and by Lambert's law the amplitude goes with cos a. So the
    magnitude is the bias at 60 deg; beyond 84 deg it stays as it is.
    """

    name: ClassVar = "incidence_bias"
    stage: ClassVar = "range"
    magnitude: float = quantity(
        "m",
        0.1,
        "it acts ninefold at grazing incidence, and would show to the eye",
        typical=0.003,
        source="estimate: millimetres, as the noise that Soudarissanane et al. 2009 find at 60 deg",
    )

    def _change(self, value, reference, rng):
        lateness = 1.0 / np.maximum(value.incidence, GRAZING) - 1.0
        return replace(value, range=value.range + self.magnitude * lateness)


@dataclass(frozen=True)
class RangeNoise(Effect):
    """Ranges are noisier than stated: white noise of one more sigma, for each return."""

    name: ClassVar = "range_noise"
    stage: ClassVar = "range"
    random: ClassVar = True
    magnitude: float = quantity(
        "m",
        1.0,
        "no surveying scanner is as noisy",
        typical=0.005,
        source="RIEGL VQ-250 data sheet: precision 5 mm",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        noise = self.magnitude * rng.standard_normal(len(value))
        return replace(value, range=value.range + noise)


@dataclass(frozen=True)
class AngleScale(Effect):
    """The encoder's scale is wrong about the zero beam: recorded = true + magnitude angle.

    The angle counts from -180 to 180 deg, whichever turn it is given in.
    """

    name: ClassVar = "angle_scale"
    stage: ClassVar = "angle"
    magnitude: float = quantity(
        "ratio",
        0.05,
        "a turn of the mirror would miss 18 deg",
        typical=1e-4,
        source="estimate: 0.3 mm at 3 m and 60 deg; such a term is in Lichti and Licht 2006",
    )

    def _change(self, value, reference, rng):
        from_zero = np.mod(value.angle + np.pi, 2 * np.pi) - np.pi
        return replace(value, angle=value.angle + self.magnitude * from_zero)


@dataclass(frozen=True)
class AngleEccentricity(Effect):
    """The encoder's disc is off its axis: recorded = true + magnitude sin(angle - phase)."""

    name: ClassVar = "angle_eccentricity"
    stage: ClassVar = "angle"
    magnitude: float = quantity(
        "rad",
        0.05,
        "a disc of 25 mm radius can't be off its axis by more than 1 mm",
        typical=1e-4,
        source="derived: 2.5 um off the axis on a disc of 25 mm radius",
    )
    phase: float = quantity("rad", 7.0, "a turn has 6.28 rad (is it in degrees?)", default=0.0)

    def _change(self, value, reference, rng):
        return replace(value, angle=value.angle + self.magnitude * np.sin(value.angle - self.phase))


@dataclass(frozen=True)
class AngleNoise(Effect):
    """Angles are noisier than stated: white noise of one more sigma, for each pulse."""

    name: ClassVar = "angle_noise"
    stage: ClassVar = "angle"
    random: ClassVar = True
    magnitude: float = quantity(
        "deg",
        1.0,
        "encoders of surveying scanners resolve thousandths",
        typical=0.002,
        source="twice the resolution of the RIEGL VQ-250's data sheet, 0.001 deg",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        noise = np.radians(self.magnitude) * _noise_by_pulse(value, rng)
        return replace(value, angle=value.angle + noise)


@dataclass(frozen=True)
class Dropout(Effect):
    """A share of the returns is lost, each by its own chance."""

    name: ClassVar = "dropout"
    stage: ClassVar = "return"
    random: ClassVar = True
    magnitude: float = quantity(
        "ratio",
        0.99,
        "nothing to work with would be left",
        typical=0.05,
        source="estimate: dark or wet surfaces return nothing for one pulse in twenty",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        return replace(value, kept=value.kept & (rng.random(len(value)) >= self.magnitude))
