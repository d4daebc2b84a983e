"""Effects of the vehicle: what the POS records, and the mounting of the scanner."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects.effect import Effect, quantity
from mlscorr.survey import Mounting

FIX_STEP = 1.0  # s between GNSS fixes, the paper's; the noise of each is its own
GNSS_LOST = "a GNSS that far off is known to be lost"
IN_TIME = "no survey is as long"


@dataclass(frozen=True)
class HeadingDrift(Effect):
    """Heading error grows in each pass from zero at its first epoch to magnitude at its last.

    A pass is a part of the trajectory without gaps. Recorded heading = true + error, clockwise.
    """

    name: ClassVar = "heading_drift"
    stage: ClassVar = "pos"
    magnitude: float = quantity(
        "deg",
        10.0,
        "any GNSS/INS knows the heading of a moving car better",
        typical=0.03,
        source="twice the paper's heading sigma of 0.014 deg (Mao et al. 2015, section 3)",
    )

    def _change(self, value, reference, rng):
        number = value.segment(value.gps_time)
        start = np.append(value.gps_time[0], value.gaps[:, 1])[number]
        end = np.append(value.gaps[:, 0], value.gps_time[-1])[number]
        share = (value.gps_time - start) / np.where(end > start, end - start, 1.0)
        turn = np.zeros((len(value), 3))
        turn[:, 2] = -np.radians(self.magnitude) * share  # heading is clockwise, Z is up
        return replace(value, attitude=Rotation.from_rotvec(turn) * value.attitude)


@dataclass(frozen=True)
class PositionStep(Effect):
    """GNSS jumps: recorded = true + magnitude from a time on to the end of that pass.

    The time counts from reference.start. Raises ValueError when it lies in no pass.
    """

    name: ClassVar = "position_step"
    stage: ClassVar = "pos"
    magnitude: tuple[float, float, float] = quantity(
        "m",
        20.0,
        GNSS_LOST,
        count=3,
        typical=0.19,
        source="one cycle of the GPS L1 carrier, 1575.42 MHz (IS-GPS-200), wrongly fixed",
    )
    time: float = quantity("s", 86_400.0, IN_TIME, least=0.0)

    def _change(self, value, reference, rng):
        start = reference.start + self.time
        number = int(value.segment(start))
        if number < 0:
            raise ValueError(_outside(self, value, reference))
        hit = (value.gps_time >= start) & (value.segment(value.gps_time) == number)
        return replace(value, position=value.position + hit[:, None] * np.array(self.magnitude))


@dataclass(frozen=True)
class PositionBump(Effect):
    """A bias comes and goes, as by multipath or a short outage, like a Gaussian in time.

    recorded = true + magnitude exp(-(t - time)^2 / (2 width^2)); the time counts from
    reference.start, the width is one sigma. Raises ValueError when the time is in no pass.
    """

    name: ClassVar = "position_bump"
    stage: ClassVar = "pos"
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
        "a bias of an hour is a datum",
        least=0.1,
        typical=10.0,
        source="estimate: a house front of 50-100 m passed at 8 m/s",
    )

    def _change(self, value, reference, rng):
        middle = reference.start + self.time
        if value.segment(middle) < 0:
            raise ValueError(_outside(self, value, reference))
        shape = np.exp(-0.5 * ((value.gps_time - middle) / self.width) ** 2)
        return replace(value, position=value.position + shape[:, None] * np.array(self.magnitude))


@dataclass(frozen=True)
class PositionNoise(Effect):
    """The position is noisier than its sigmas say: one more sigma, the same in E, N and H.

    The noise is that of GNSS fixes, one a second; between two of them the weight of the one
    falls as a cosine while the other's grows as a sine, so that the variance is the same at all
    times. Correlation falls to 1/pi after one second and to nothing after two.
    """

    name: ClassVar = "position_noise"
    stage: ClassVar = "pos"
    random: ClassVar = True
    magnitude: float = quantity(
        "m",
        10.0,
        GNSS_LOST,
        typical=0.02,
        source="nominal precision of the POS of Mao et al. 2015, section 3",
        least=0.0,
    )

    def _change(self, value, reference, rng):
        fixes = (value.gps_time - value.gps_time[0]) / FIX_STEP
        before = np.floor(fixes).astype(int)
        angle = 0.5 * np.pi * (fixes - before)[:, None]
        noise = self.magnitude * rng.standard_normal((before[-1] + 2, 3))
        mixed = np.cos(angle) * noise[before] + np.sin(angle) * noise[before + 1]
        return replace(value, position=value.position + mixed)


@dataclass(frozen=True)
class Boresight(Effect):
    """The recorded boresight lacks a small rotation: R_true = Exp(magnitude) R_recorded.

    About the body axes right, forward, up (Mao et al. 2015, Eq. 2).
    """

    name: ClassVar = "boresight"
    stage: ClassVar = "mounting"
    magnitude: tuple[float, float, float] = quantity(
        "deg",
        10.0,
        "a mounting is known from its drawing to a degree",
        count=3,
        typical=0.05,
        source="Mao et al. 2015, Table 6: 0.03, 0.06 and 0.21 deg",
    )

    def _change(self, value, reference, rng):
        turn = Rotation.from_rotvec(self.magnitude, degrees=True)
        return Mounting(value.lever_arm, turn.inv() * value.boresight)


@dataclass(frozen=True)
class LeverArm(Effect):
    """The recorded lever arm lacks magnitude: true = recorded + magnitude, in the body frame."""

    name: ClassVar = "lever_arm"
    stage: ClassVar = "mounting"
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


def _outside(effect, trajectory, reference):
    """The sentence for an event at a time at which nothing was recorded."""
    end = trajectory.gps_time[-1] - reference.start
    return (
        f"{effect.name} at {effect.time:g} s lies outside the trajectory, which ends after "
        f"{end:.1f} s, or in one of its {len(trajectory.gaps)} gaps between passes."
    )
