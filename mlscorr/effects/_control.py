"""Effects of the control survey: frames that differ from the cloud's, and a wrong point."""

from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects._quantity import quantity
from mlscorr.effects.effect import Effect
from mlscorr.effects.stages import EAST_NORTH_UP, MAP


@dataclass(frozen=True)
class MapRotation(Effect):
    """Control is rotated about reference.place, counter-clockwise from above, including normals.

    Parameters
    ----------
    magnitude : float
        Units: rad.
    """

    stage: ClassVar = "control"
    title: ClassVar = "Rotated frame"
    meaning: ClassVar = (
        "The frame of the surveyed targets is rotated relative to that of the cloud."
    )
    sentence: ClassVar = (
        "The frame of the surveyed targets is rotated {side} by {size} relative to that of the "
        "cloud."
    )
    remedy: ClassVar = (
        "Check CRS and datum of control and trajectory. If the control is right, mlscorr apply "
        "survey.toml gap.json -o applied moves the cloud into its frame."
    )
    sides: ClassVar = ("counter-clockwise", "clockwise")
    magnitude: float = quantity(
        "rad",
        0.1,
        "the meridian convergence of a UTM zone stays below 0.06 rad (is it in degrees?)",
        typical=1e-4,
        source="estimate: a total station oriented over 100 m to 1 cm",
    )

    def _change(self, value, reference, rng):
        turn = Rotation.from_rotvec([0.0, 0.0, self.magnitude])
        return replace(
            value,
            position=reference.place + turn.apply(value.position - reference.place),
            normal=turn.apply(value.normal),
        )


@dataclass(frozen=True)
class MapScale(Effect):
    """Control is scaled in the plane about reference.place, by 1 + magnitude, without heights.

    Parameters
    ----------
    magnitude : float
        Units: ratio.
    """

    stage: ClassVar = "control"
    title: ClassVar = "Map scale"
    meaning: ClassVar = "The scale of the surveyed coordinates differs from that of the cloud."
    sentence: ClassVar = (
        "The scale of the surveyed coordinates is too {side} by {size}, compared with the cloud."
    )
    remedy: ClassVar = "Check CRS and projection scale of control and trajectory."
    sides: ClassVar = ("large", "small")
    magnitude: float = quantity(
        "ratio",
        0.01,
        "map projections for surveying stay within a thousandth (is it in ppm?)",
        typical=4e-4,
        source="UTM's scale at the central meridian, 0.9996, not applied",
    )

    def _error(self, value, reference, rng):
        return self.magnitude * ((value.position - reference.place) * [1.0, 1.0, 0.0])


@dataclass(frozen=True)
class HorizontalDatum(Effect):
    """Control is in another frame, moved in the plane: recorded = true + magnitude (E, N).

    Parameters
    ----------
    magnitude : 2 floats
        Easting and northing. Units: m.
    """

    stage: ClassVar = "control"
    title: ClassVar = "Horizontal datum"
    meaning: ClassVar = "Surveyed targets and cloud are in different frames, shifted horizontally."
    sentence: ClassVar = (
        "Surveyed targets and cloud are in different frames: the targets are shifted by {size}."
    )
    remedy: ClassVar = "Check CRS and datum of control and trajectory."
    sides: ClassVar = EAST_NORTH_UP[:2]
    parts: ClassVar = MAP[:2]
    magnitude: tuple[float, float] = quantity(
        "m",
        1000.0,
        "classical datums differ from WGS 84 by a few hundred meters at most",
        count=2,
        typical=0.05,
        source="plates move 2-7 cm a year (ITRF2014, Altamimi et al. 2016): an epoch not reduced",
    )

    def _error(self, value, reference, rng):
        return np.array([*self.magnitude, 0.0])


@dataclass(frozen=True)
class VerticalDatum(Effect):
    """Control heights are in another datum: recorded = true + magnitude.

    Parameters
    ----------
    magnitude : float
        Units: m.
    """

    stage: ClassVar = "control"
    title: ClassVar = "Vertical datum"
    meaning: ClassVar = "The surveyed targets and the cloud have different height systems."
    sentence: ClassVar = (
        "The surveyed heights of the targets are {size} {side} those of the cloud: two height "
        "systems."
    )
    remedy: ClassVar = (
        "Check the vertical datum and geoid of control and trajectory. If the control is right, "
        "mlscorr apply survey.toml gap.json -o applied moves the cloud into its system."
    )
    sides: ClassVar = ("above", "below")
    magnitude: float = quantity(
        "m",
        120.0,
        "that is more than the geoid's largest height above the ellipsoid",
        typical=0.03,
        source="estimate: geoid models are accurate to a few centimeters",
    )

    def _error(self, value, reference, rng):
        return np.array([0.0, 0.0, self.magnitude])


@dataclass(frozen=True)
class TargetOutlier(Effect):
    """One surveyed target, given by name, is wrong: recorded = true + magnitude.

    Parameters
    ----------
    magnitude : 3 floats
        Easting, northing and height. Units: m.
    target : str
        Its name.

    Raises
    ------
    ValueError
        If no target has that name.
    """

    stage: ClassVar = "control"
    title: ClassVar = "Wrong target"
    meaning: ClassVar = "The surveyed coordinates of one target are wrong."
    sentence: ClassVar = "The surveyed coordinates of {where} are wrong by {size}."
    remedy: ClassVar = "Survey that target again, or remove it from the control."
    sides: ClassVar = EAST_NORTH_UP
    parts: ClassVar = MAP
    magnitude: tuple[float, float, float] = quantity(
        "m",
        100.0,
        "at that distance it is another point",
        count=3,
        typical=0.05,
        source="estimate: a prism constant of 3-5 cm omitted",
    )
    target: str = field()

    def __post_init__(self):
        super().__post_init__()
        if not isinstance(self.target, str):
            raise ValueError(
                f"target = {self.target!r} of {self.name} is not the name of a target."
            )

    def _error(self, value, reference, rng):
        if self.target not in value.name:
            near = get_close_matches(self.target, value.name, n=1, cutoff=0.0)[0]
            raise ValueError(
                f"{self.name} names {self.target!r}, which is not among the {len(value)} "
                f"targets; the nearest name is {near!r}."
            )
        hit = np.array([name == self.target for name in value.name])
        return hit[:, None] * np.array(self.magnitude)
