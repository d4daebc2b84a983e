"""Effects of the control survey: frames that differ from the cloud's, and a wrong point."""

from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects.effect import Effect, quantity


@dataclass(frozen=True)
class VerticalDatum(Effect):
    """Control heights are in another datum: recorded = true + magnitude."""

    name: ClassVar = "vertical_datum"
    stage: ClassVar = "control"
    magnitude: float = quantity(
        "m",
        120.0,
        "that is more than the geoid's largest height above the ellipsoid",
        typical=0.03,
        source="estimate: geoid models hold to a few centimetres",
    )

    def _change(self, value, reference, rng):
        return replace(value, position=value.position + np.array([0.0, 0.0, self.magnitude]))


@dataclass(frozen=True)
class HorizontalDatum(Effect):
    """Control is in another frame, moved in the plane: recorded = true + magnitude (E, N)."""

    name: ClassVar = "horizontal_datum"
    stage: ClassVar = "control"
    magnitude: tuple[float, float] = quantity(
        "m",
        1000.0,
        "classical datums lie some hundred metres from WGS 84, not more",
        count=2,
        typical=0.05,
        source="plates move 2-7 cm a year (ITRF2014, Altamimi et al. 2016): an epoch not reduced",
    )

    def _change(self, value, reference, rng):
        return replace(value, position=value.position + np.array([*self.magnitude, 0.0]))


@dataclass(frozen=True)
class MapRotation(Effect):
    """Control is turned about reference.place, counter-clockwise from above; normals too."""

    name: ClassVar = "map_rotation"
    stage: ClassVar = "control"
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
    """Control is scaled in the plane about reference.place, by 1 + magnitude; heights are not."""

    name: ClassVar = "map_scale"
    stage: ClassVar = "control"
    magnitude: float = quantity(
        "ratio",
        0.01,
        "map projections for surveying stay within a thousandth (is it in ppm?)",
        typical=4e-4,
        source="UTM's scale at the central meridian, 0.9996, not applied",
    )

    def _change(self, value, reference, rng):
        arm = (value.position - reference.place) * [1.0, 1.0, 0.0]
        return replace(value, position=value.position + self.magnitude * arm)


@dataclass(frozen=True)
class TargetOutlier(Effect):
    """One surveyed target, by its name, is wrong: recorded = true + magnitude.

    Raises ValueError when no target has that name.
    """

    name: ClassVar = "target_outlier"
    stage: ClassVar = "control"
    magnitude: tuple[float, float, float] = quantity(
        "m",
        100.0,
        "a point that far off is another point",
        count=3,
        typical=0.05,
        source="estimate: a prism constant of 3-5 cm forgotten",
    )
    target: str = field()

    def __post_init__(self):
        super().__post_init__()
        if not isinstance(self.target, str):
            raise ValueError(f"target of {self.name} of {self.target!r} is not a target's name.")

    def _change(self, value, reference, rng):
        if self.target not in value.name:
            near = get_close_matches(self.target, value.name, n=1, cutoff=0.0)[0]
            raise ValueError(
                f"{self.name} names {self.target!r}, which is none of the {len(value)} targets; "
                f"the nearest name is {near!r}."
            )
        hit = np.array([name == self.target for name in value.name])
        return replace(value, position=value.position + hit[:, None] * np.array(self.magnitude))
