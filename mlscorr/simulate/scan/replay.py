"""Replay of the recorded pulses of a survey in the simulator.

Effects turn the truth into the record, so here they are removed from the recorded time, angle, pose
and mounting. Each pulse is then cast into a world (see worlds.py), the effects on range and return
are applied to the result, and it is georeferenced with the recorded data.

Random effects on the pose are not simulated, because the record already contains the POS error,
whose variance the comparison must include. The beam is thin, regardless of its divergence.
"""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.random import Generator

from mlscorr.effects import Reference, Returns, apply_effects, effect_streams
from mlscorr.simulate.scan.rays import Platform
from mlscorr.survey import Columns, ControlPoints, Mounting, PointCloud, Survey, Trajectory


@dataclass(frozen=True, repr=False)
class RecordedPulses(Columns):
    """Pulses of a survey as they were recorded.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    angle, elevation, range : (n,) array
        From the zero beam, out of the scan plane, along the beam, by the recorded mounting.
        Units: rad, m.
    intensity : (n,) array
        Counts of 16 bits.
    incidence : (n,) array
        Cosine of the angle between beam and surface normal.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    elevation: np.ndarray
    range: np.ndarray
    intensity: np.ndarray
    incidence: np.ndarray


def aim(
    platform: Platform, gps_time: np.ndarray, angle: np.ndarray, elevation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Start (n, 3) relative to the platform's origin, in m, and unit direction (n, 3) of pulses.

    Parameters
    ----------
    platform : Platform
    gps_time : (n,) array
        Units: s.
    angle : (n,) array
        From the zero beam. Units: rad.
    elevation : (n,) array
        Out of the scan plane. Units: rad.
    """
    start = platform.scanner(gps_time)
    return start, _towards(platform, gps_time, angle, elevation) - start


def _towards(platform, gps_time, angle, elevation):
    """Positions (n, 3) of pulses one meter after their start, relative to the platform's origin."""
    return platform.place(gps_time, angle, elevation, np.ones(len(gps_time)), np.zeros(3))


def recorded_platform(survey: Survey, origin: np.ndarray) -> Platform:
    """Make the Platform of the recorded trajectory and mounting, relative to an origin (3,) in m.

    Parameters
    ----------
    survey : Survey
    origin : (3,) array
        Map coordinates of the local origin. Units: m.
    """
    return Platform.of(survey.trajectory, survey.assumed_mounting, np.asarray(origin, float))


def recorded_pulses(
    platform: Platform, cloud: PointCloud, origin: np.ndarray, normal: np.ndarray
) -> RecordedPulses:
    """Reconstruct the RecordedPulses of points within the trajectory.

    Parameters
    ----------
    platform : Platform
        From recorded_platform, relative to the origin.
    cloud : PointCloud
    origin : (3,) array
        Units: m.
    normal : (n, 3) array, or (3,) of all
        Unit normals of the surfaces of the points.
    """
    time = cloud.gps_time
    zeros = np.zeros(len(cloud))
    quarter = np.full(len(cloud), np.pi / 2)
    start, x = aim(platform, time, zeros, zeros)
    ends = _towards(platform, time, quarter, zeros), _towards(platform, time, zeros, quarter)
    axes = x, *(end - start for end in ends)
    sight = cloud.xyz - origin - start
    x, y, z = (np.einsum("ni,ni->n", sight, axis) for axis in axes)
    away = np.sqrt(x**2 + y**2 + z**2)
    slant = np.einsum("ni,ni->n", sight, np.broadcast_to(normal, sight.shape)) / away
    return RecordedPulses(
        gps_time=time,
        angle=np.arctan2(y, x),
        elevation=np.arcsin(np.clip(z / away, -1.0, 1.0)),
        range=away,
        intensity=cloud.intensity.astype(float),
        incidence=np.abs(slant),
    )


@dataclass(frozen=True, repr=False)
class Met(Columns):
    """Result of each pulse: range (n,) in m, NaN for none; cosine of incidence (n,); intensity
    (n,) in counts of 16 bits.
    """

    range: np.ndarray
    incidence: np.ndarray
    intensity: np.ndarray


@dataclass(frozen=True)
class Draws:
    """Random numbers of one run, drawn before anything depends on the effects: unit noise (n,)
    of range and angle, and the streams of random effects by name.
    """

    range: np.ndarray
    angle: np.ndarray
    streams: dict

    @classmethod
    def of(cls, n: int, rng: Generator) -> "Draws":
        """Draw the numbers for n pulses; the same seed gives the same ones for any effects.

        Parameters
        ----------
        n : int
            Pulses.
        rng : Generator
        """
        ranges, angles, streams = rng.spawn(3)
        return cls(ranges.standard_normal(n), angles.standard_normal(n), effect_streams(streams))


@dataclass(frozen=True)
class Replay:
    """Recorded pulses, fired again by a simulator with some effects.

    Parameters
    ----------
    survey : Survey
        Recorded survey; its Scanner gives the noise of the simulator.
    pulses : RecordedPulses
    effects : iterable of Effect
    reference : Reference
        Of the effects.
    draws : Draws
    origin : (3,) array
        Map coordinates of the local origin. Units: m.
    """

    survey: Survey
    pulses: RecordedPulses
    effects: tuple
    reference: Reference
    draws: Draws
    origin: np.ndarray

    @cached_property
    def beams(self) -> tuple[np.ndarray, np.ndarray]:
        """True start (n, 3) of each pulse, relative to the origin, and its unit direction (n,
        3).
        """
        platform = Platform.of(self._trajectory, self._mounting, self.origin)
        noise = self.survey.scanner.angle_noise * self.draws.angle
        return aim(platform, self._time, self._angle - noise, self.pulses.elevation)

    def measure(self, met: Met) -> tuple[np.ndarray, np.ndarray]:
        """Simulate map positions (n, 3), NaN without a return, and flags (n,) of kept points.

        Parameters
        ----------
        met : Met
        """
        returns = Returns(
            gps_time=self._time,
            angle=self._angle,
            range=met.range + self.survey.scanner.range_noise * self.draws.range,
            intensity=met.intensity,
            incidence=met.incidence,
            kept=np.isfinite(met.range),
        )
        measured = self._changed("range", returns).range
        kept = self._changed("return", returns).kept
        pulses = self.pulses
        place = pulses.gps_time, pulses.angle, pulses.elevation, measured, self.origin
        return self._recorded.place(*place), kept

    @cached_property
    def _recorded(self):
        return recorded_platform(self.survey, self.origin)

    def _changed(self, stage, value):
        """Value after the effects of a stage, with the same random numbers each time."""
        streams = self.draws.streams
        used = {effect.name for effect in self.effects if effect.stage == stage}
        streams = {name: deepcopy(streams[name]) for name in used}
        return apply_effects(self.effects, stage, value, self.reference, streams)

    @cached_property
    def _time(self):
        """True times (n,), limited to the pass."""
        trajectory = self.survey.trajectory
        recorded = self.pulses.gps_time
        starts, ends = trajectory.passes.T
        number = trajectory.segment(recorded)
        return np.clip(self._undone("clock", "gps_time"), starts[number], ends[number])

    @cached_property
    def _angle(self):
        """Angles (n,) as measured, with noise. Units: rad."""
        return self._undone("angle", "angle")

    def _undone(self, stage, name):
        """Field of the pulses without the effects of a stage."""
        recorded = getattr(self.pulses, name)
        values = {field.name: getattr(self.pulses, field.name) for field in fields(RecordedPulses)}
        del values["elevation"]
        true = Returns(**values, kept=np.ones(len(self.pulses), dtype=bool))
        for _ in range(2):  # true = recorded - effect(true): two iterations leave 1e-6 of 1e-2
            error = getattr(self._changed(stage, true), name) - getattr(true, name)
            true = replace(true, **{name: recorded - error})
        return getattr(true, name)

    @cached_property
    def _trajectory(self):
        """True trajectory, except for random effects."""
        effects = [e for e in self.effects if e.stage == "pos" and not e.random]
        return without(self.survey.trajectory, effects, "pos", self.reference, _without_pose)

    @cached_property
    def _mounting(self):
        recorded = self.survey.assumed_mounting
        return without(recorded, self.effects, "mounting", self.reference, _without_mount)


def without(
    recorded: Any, effects: tuple, stage: str, reference: Reference, take_off: Callable
) -> Any:
    """Remove effects from a recorded value (Trajectory, Mounting, ControlPoints).

    ``take_off(recorded, true, changed)`` removes the difference between `true` and `changed` from
    `recorded`; random effects are not allowed.

    Parameters
    ----------
    recorded : Trajectory, Mounting or ControlPoints
    effects : tuple of Effect
    stage : str
        Stage of the effects.
    reference : Reference
        Of the effects.
    take_off : function
        Function of recorded, true, changed that removes the difference between true and changed
        from recorded.
    """
    effects = [effect for effect in effects if effect.stage == stage]
    true = recorded
    nothing: Any = {effect.name: None for effect in effects}
    if not effects:
        return recorded
    for _ in range(2):
        true = take_off(recorded, true, apply_effects(effects, stage, true, reference, nothing))
    return true


def _without_pose(recorded, true, changed):
    attitude = recorded.attitude
    if changed.attitude is not true.attitude:
        attitude = true.attitude * changed.attitude.inv() * attitude
    position = recorded.position - (changed.position - true.position)
    return Trajectory(recorded.gps_time, position, attitude, session=recorded.session)


def _without_mount(recorded, true, changed):
    lever_arm = recorded.lever_arm - (changed.lever_arm - true.lever_arm)
    return Mounting(lever_arm, true.boresight * changed.boresight.inv() * recorded.boresight)


def true_targets(targets: ControlPoints, effects: tuple, reference: Reference) -> ControlPoints:
    """True positions of surveyed targets, as ControlPoints.

    Parameters
    ----------
    targets : ControlPoints
        As surveyed.
    effects : tuple of Effect
    reference : Reference
        Of the effects.
    """
    return without(targets, effects, "control", reference, _without_control)


def _without_control(recorded, true, changed):
    return replace(recorded, position=recorded.position - (changed.position - true.position))
