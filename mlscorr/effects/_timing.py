"""Effects of the scanner's clock.

If a source is called an estimate, here and in the other modules of this package, the sentence is
its only derivation.
"""

from dataclasses import dataclass
from typing import ClassVar

from mlscorr.effects._quantity import quantity
from mlscorr.effects.effect import Effect
from mlscorr.effects.stages import noise_by_pulse


@dataclass(frozen=True)
class TimeOffset(Effect):
    """The scanner's clock is ahead of the POS's: recorded = true + magnitude.

    Parameters
    ----------
    magnitude : float
        Units: s.
    """

    stage: ClassVar = "clock"
    title: ClassVar = "Scanner clock offset"
    meaning: ClassVar = "The clocks of scanner and POS differ by a constant."
    sentence: ClassVar = "The clock of the scanner is {size} {side} the clock of the POS."
    remedy: ClassVar = (
        "Have the time synchronization of the scanner checked. Until then, mlscorr apply "
        "survey.toml gap.json -o applied removes the offset found from the cloud."
    )
    sides: ClassVar = ("ahead of", "behind")
    magnitude: float = quantity(
        "s",
        1.0,
        "a difference of more than 1 s means a wrong time system",
        typical=1e-3,
        source="estimate: time messages without the pulse per second are accurate to about 1 ms",
    )

    def _error(self, value, reference, rng):
        return self.magnitude


@dataclass(frozen=True)
class ClockDrift(Effect):
    """The scanner's clock runs fast: recorded = true + magnitude (true - reference.start).

    Parameters
    ----------
    magnitude : float
        Units: s per s.
    """

    stage: ClassVar = "clock"
    title: ClassVar = "Scanner clock drift"
    meaning: ClassVar = "The clock of the scanner runs faster or slower than the clock of the POS."
    sentence: ClassVar = "The clock of the scanner runs {side} by {size}."
    remedy: ClassVar = (
        "Have the scanner's clock disciplined by the POS; a remaining drift is a fault of the "
        "device."
    )
    sides: ClassVar = ("fast", "slow")
    magnitude: float = quantity(
        "s per s",
        1e-3,
        "no quartz oscillator in use is off by more",
        typical=2e-5,
        source="usual data sheets of quartz oscillators: 20 ppm, free-running without GNSS",
    )

    def _error(self, value, reference, rng):
        return self.magnitude * (value.gps_time - reference.start)


@dataclass(frozen=True)
class TimeJitter(Effect):
    """Each pulse's time stamp has independent noise, shared by the pulse's returns.

    Parameters
    ----------
    magnitude : float
        Units: s.
    """

    stage: ClassVar = "clock"
    random: ClassVar = True
    title: ClassVar = "Noisy time stamps"
    meaning: ClassVar = "The time stamp of each laser pulse has its own random error."
    sentence: ClassVar = (
        "The time stamps of the scanner have noise of {size} that the simulator does not include."
    )
    remedy: ClassVar = (
        "Check how the scanner's pulses are time-stamped: by the pulse per second of the POS, "
        "or by the computer that stores them."
    )
    magnitude: float = quantity(
        "s",
        0.01,
        "an error longer than the time of a scan line mixes up the lines",
        typical=1e-4,
        source="estimate: interrupts of an operating system that is not real-time take 0.1 ms",
        least=0.0,
    )

    def _error(self, value, reference, rng):
        return self.magnitude * noise_by_pulse(value, rng)
