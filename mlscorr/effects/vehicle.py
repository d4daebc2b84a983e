"""Effects on the data recorded by the POS."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects._quantity import SizeEstimate, quantity
from mlscorr.effects.effect import Effect
from mlscorr.effects.stages import EAST_NORTH_UP, MAP
from mlscorr.wording import DASH, joined, known, size

GNSS_LOST = "a GNSS solution that far off is recognized as lost"
IN_TIME = "no survey is as long"


@dataclass(frozen=True)
class HeadingDrift(Effect):
    """Heading error grows in each pass from zero at its first epoch to magnitude at its last.

    A pass is a gap-free part of the trajectory. Recorded heading = true + error, clockwise.

    Parameters
    ----------
    magnitude : float
        Units: deg.
    """

    stage: ClassVar = "pos"
    title: ClassVar = "Heading drift"
    meaning: ClassVar = "The heading of the POS drifts during each pass."
    sentence: ClassVar = (
        "The heading of the POS drifts {side} by {size} from start to end of each pass."
    )
    remedy: ClassVar = (
        "Reprocess the trajectory: heading drift indicates GNSS with too few turns, or a gyro bias."
    )
    sides: ClassVar = ("to the right", "to the left")
    magnitude: float = quantity(
        "deg",
        10.0,
        "any GNSS/INS has a more accurate heading in a moving car",
        typical=0.03,
        source="twice the paper's heading sigma of 0.014 deg (Mao et al. 2015, section 3)",
    )

    def _change(self, value, reference, rng):
        start, end = value.passes[value.segment(value.gps_time)].T
        share = (value.gps_time - start) / np.where(end > start, end - start, 1.0)
        turn = np.zeros((len(value), 3))
        turn[:, 2] = -np.radians(self.magnitude) * share  # heading is clockwise, Z points up
        return replace(value, attitude=Rotation.from_rotvec(turn) * value.attitude)


@dataclass(frozen=True)
class PositionStep(Effect):
    """GNSS jumps: recorded = true + magnitude from a time to the end of that pass.

    The time counts from reference.start.

    Parameters
    ----------
    magnitude : 3 floats
        Easting, northing and height. Units: m.
    time : float
        Of the event, from reference.start. Units: s.

    Raises
    ------
    ValueError
        If it is not in any pass.
    """

    stage: ClassVar = "pos"
    title: ClassVar = "GNSS jump"
    meaning: ClassVar = "The recorded position jumps and stays offset until the end of the pass."
    sentence: ClassVar = (
        "The recorded position jumps {size}{where} and stays offset until the end of the pass."
    )
    remedy: ClassVar = "Reprocess the trajectory; mlscorr correct removes such a drift."
    sides: ClassVar = EAST_NORTH_UP
    parts: ClassVar = MAP
    magnitude: tuple[float, float, float] = quantity(
        "m",
        20.0,
        GNSS_LOST,
        count=3,
        typical=0.19,
        source="one cycle of the GPS L1 carrier, 1575.42 MHz (IS-GPS-200), wrongly fixed",
    )
    time: float = quantity("s", 86_400.0, IN_TIME, least=0.0)

    def _error(self, value, reference, rng):
        start = _moment(self, value, reference)
        hit = (value.gps_time >= start) & (value.segment(value.gps_time) == value.segment(start))
        return hit[:, None] * np.array(self.magnitude)


@dataclass(frozen=True)
class PositionBump(Effect):
    """A bias comes and goes like a Gaussian in time, as from multipath or a short outage.

    recorded = true + magnitude exp(-(t - time)^2 / (2 width^2)); the time counts from
    reference.start, the width is one sigma.

    Parameters
    ----------
    magnitude : 3 floats
        Easting, northing and height. Units: m.
    time : float
        Of the event, from reference.start. Units: s.
    width : float
        One sigma of the Gaussian. Units: s.

    Raises
    ------
    ValueError
        If the time is not in any pass.
    """

    stage: ClassVar = "pos"
    title: ClassVar = "Temporary GNSS error"
    meaning: ClassVar = "The recorded position is temporarily wrong: multipath, or a short outage."
    sentence: ClassVar = "The recorded position is temporarily wrong{where}, by up to {size}."
    remedy: ClassVar = "Check GNSS at that time; mlscorr correct removes such a drift."
    sides: ClassVar = EAST_NORTH_UP
    parts: ClassVar = MAP
    magnitude: tuple[float, float, float] = quantity(
        "m",
        20.0,
        GNSS_LOST,
        count=3,
        typical=0.1,
        source="raw east RMS under multipath, 0.107 m (Mao et al. 2015, Table 5)",
    )
    time: float = quantity("s", 86_400.0, IN_TIME, least=0.0)
    width: float = quantity(
        "s",
        3600.0,
        "a bias of an hour is a datum error",
        least=0.1,
        typical=10.0,
        source="estimate: a house front of 50-100 m passed at 8 m/s",
    )

    def _error(self, value, reference, rng):
        middle = _moment(self, value, reference)
        shape = np.exp(-0.5 * ((value.gps_time - middle) / self.width) ** 2)
        return shape[:, None] * np.array(self.magnitude)


@dataclass(frozen=True)
class PositionNoise(Effect):
    """Position is noisier than stated: additional noise of one sigma, equal in E, N and H.

    The noise is that of GNSS fixes, one per second as in the paper. Between two fixes, the weight
    of the first decreases as a cosine and that of the second increases as a sine, so that the
    variance is constant. The correlation is 1/pi after one second and zero after two.

    Parameters
    ----------
    magnitude : float
        Units: m.
    """

    stage: ClassVar = "pos"
    random: ClassVar = True
    title: ClassVar = "Noisy positions"
    meaning: ClassVar = "The recorded position is noisier or drifts more than its sigmas state."
    sentence: ClassVar = (
        "The positions of the POS are less accurate than the simulator assumes: {size}."
    )
    remedy: ClassVar = (
        "Run mlscorr correct, which removes the drift from the cloud; give it the sigmas found "
        "here."
    )
    magnitude: float = quantity(
        "m",
        10.0,
        GNSS_LOST,
        typical=0.02,
        source="nominal precision of the POS of Mao et al. 2015, section 3",
        least=0.0,
    )

    # further parameters of a diagnosis: for all sigmas, or for intervals with larger ones
    FACTOR: ClassVar = "factor on sigma"
    WINDOW: ClassVar = ("start", "length", "largest sigma over the stated")

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Return the parameter names; see Effect. Those of intervals may be numbered."""
        return (*cls.parts, cls.FACTOR, *cls.WINDOW)

    @classmethod
    def size_in_words(cls, parameters: dict[str, SizeEstimate]) -> dict[str, str]:
        """Excess of a POS's errors over its sigmas: at all times, or in intervals.

        >>> window = {"start": 413205.0, "length": 20.0, "largest sigma over the stated": 12.0}
        >>> window = {name: SizeEstimate(value, None, "") for name, value in window.items()}
        >>> PositionNoise.size_in_words(window)
        {'size': 'errors up to 12 times as large between gps_time 413205 s and 413225 s'}
        """
        if cls.FACTOR in parameters:
            estimate, sigma, _ = parameters[cls.FACTOR]
            return {"size": f"errors {size(estimate, sigma, '')} times as large"}
        if "magnitude" in parameters:
            estimate, sigma, unit = parameters["magnitude"]
            value = None
            if known(estimate):
                value = abs(estimate)
            return {"size": f"{size(value, sigma, unit)} of additional noise"}
        return {"size": cls._windows_in_words(parameters)}

    @classmethod
    def _windows_in_words(cls, parameters):
        """Describe two intervals with their times, and the number of others."""
        starts, lengths, factors = (
            [number.estimate for name, number in parameters.items() if name.startswith(key)]
            for key in cls.WINDOW
        )
        if not starts or not all(map(known, [*starts, *lengths, *factors])):
            return DASH
        spans = [
            f"between gps_time {start:.0f} s and {start + length:.0f} s"
            for start, length in zip(starts, lengths, strict=True)
        ]
        words = spans[:2]
        left = len(spans) - 2
        if left == 1:
            words.append("once more")
        elif left > 1:
            words.append(f"{left} more times")
        return f"errors up to {max(factors):.0f} times as large {joined(words)}"

    def _error(self, value, reference, rng):
        fixes = value.gps_time - value.gps_time[0]  # one per second
        before = np.floor(fixes).astype(int)
        angle = 0.5 * np.pi * (fixes - before)[:, None]
        noise = self.magnitude * rng.standard_normal((before[-1] + 2, 3))
        return np.cos(angle) * noise[before] + np.sin(angle) * noise[before + 1]


def _moment(effect, trajectory, reference):
    """The gps_time (s) of an event; refused if nothing was recorded then."""
    moment = reference.start + effect.time
    if trajectory.segment(moment) < 0:
        end = trajectory.gps_time[-1] - reference.start
        raise ValueError(
            f"{effect.name} at {effect.time:g} s is outside the trajectory, which ends after "
            f"{end:.1f} s, or in one of its {len(trajectory.gaps)} gaps between passes."
        )
    return moment
