"""The simulator run again on the pulses that a survey recorded.

Effects turn truth into record, so here they are taken off what was recorded: the true time, angle,
pose and mounting. From there each pulse is cast into a world (see worlds.py); what it meets goes
through the effects on range and return, and lies on the map by what was recorded.

Random effects on the pose are not realised: what the POS errs by is in the record already, and
its variance is for who compares to know. The beam is thin, whatever its divergence.
"""

from copy import deepcopy
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects import Reference, Returns, apply_effects, effect_streams
from mlscorr.simulate.rays import Platform
from mlscorr.survey import Mounting, Survey, Trajectory

ROUNDS = 2  # of true = recorded - effect(true): an effect of 1e-2 leaves 1e-6 of itself
NO_MOUNTING = Mounting(np.zeros(3), Rotation.identity())  # beams from the navigation centre


@dataclass(frozen=True)
class RecordedPulses:
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

    def __len__(self):
        return len(self.gps_time)

    def __getitem__(self, selection):
        return RecordedPulses(*(getattr(self, field.name)[selection] for field in fields(self)))

    @classmethod
    def concatenate(cls, several):
        """All pulses of some, in their order."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(one, name) for one in several]) for name in names))


@dataclass(frozen=True)
class Met:
    """What each pulse meets: range (n,) in m, NaN for nothing; cosine of incidence (n,); intensity
    (n,) in counts of 16 bits."""

    range: np.ndarray
    incidence: np.ndarray
    intensity: np.ndarray


@dataclass(frozen=True)
class Draws:
    """Random numbers of one run, drawn before anything depends on the effects: unit noise (n,) of
    range and angle, and the streams of random effects by their names."""

    range: np.ndarray
    angle: np.ndarray
    streams: dict

    @classmethod
    def of(cls, n, rng):
        """Draws for n pulses; the same seed gives the same, whatever the effects are."""
        one, two, streams = rng.spawn(3)
        return cls(one.standard_normal(n), two.standard_normal(n), effect_streams(streams))


@dataclass(frozen=True)
class Replay:
    """Recorded pulses that a simulator with some effects fires again.

    Parameters
    ----------
    survey : Survey
        As recorded; its Scanner says what noise the simulator makes.
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
    def beams(self):
        """Where each pulse truly starts (n, 3), about the origin, and its unit direction (n, 3)."""
        platform = Platform.of(self._trajectory, self._mounting, self.origin)
        noise = self.survey.scanner.angle_noise * self.draws.angle
        return aim(platform, self._time, self._angle - noise, self.pulses.elevation)

    def measure(self, met):
        """Points (n, 3) on the map where the recorded ones would lie, NaN where nothing is met,
        and whether they are kept (n,)."""
        noise = self.survey.scanner.range_noise * self.draws.range
        returns = Returns(
            gps_time=self._time,
            angle=self._angle,
            range=met.range + noise,
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
        """The value after the effects of a stage, with the same random numbers each time."""
        streams = self.draws.streams
        used = {effect.name for effect in self.effects if effect.stage == stage}
        streams = {name: deepcopy(streams[name]) for name in used}
        return apply_effects(self.effects, stage, value, self.reference, streams)

    def _has(self, stage):
        return any(effect.stage == stage for effect in self.effects)

    @cached_property
    def _time(self):
        """True times (n,), held within the pass."""
        if not self._has("clock"):
            return self.pulses.gps_time
        trajectory, recorded = self.survey.trajectory, self.pulses.gps_time
        starts = np.append(trajectory.gps_time[0], trajectory.gaps[:, 1])
        ends = np.append(trajectory.gaps[:, 0], trajectory.gps_time[-1])
        number = trajectory.segment(recorded)
        return np.clip(self._undone("clock", "gps_time"), starts[number], ends[number])

    @cached_property
    def _angle(self):
        """Angles (n,) as measured, with noise. Units: rad."""
        return self._undone("angle", "angle") if self._has("angle") else self.pulses.angle

    def _undone(self, stage, name):
        """A field of the pulses without the effects of a stage."""
        recorded = getattr(self.pulses, name)
        values = {field.name: getattr(self.pulses, field.name) for field in fields(RecordedPulses)}
        del values["elevation"]
        true = Returns(**values, kept=np.ones(len(self.pulses), dtype=bool))
        for _ in range(ROUNDS):
            error = getattr(self._changed(stage, true), name) - getattr(true, name)
            true = replace(true, **{name: recorded - error})
        return getattr(true, name)

    @cached_property
    def _trajectory(self):
        """The true trajectory, as far as systematic effects tell."""
        effects = [e for e in self.effects if e.stage == "pos" and not e.random]
        return without(self.survey.trajectory, effects, "pos", self.reference, _without_pose)

    @cached_property
    def _mounting(self):
        recorded = recorded_mounting(self.survey)
        return without(recorded, self.effects, "mounting", self.reference, _without_mount)


def replay(survey, pulses, world, effects, reference, rng, origin):
    """Fire a survey's recorded pulses again into a world: points (n, 3), kept (n,), Met.

    Parameters
    ----------
    survey : Survey
    pulses : RecordedPulses
    world : object
        Its ``meet(start, direction)`` gives Met.
    effects : iterable of Effect
    reference : Reference
    rng : numpy.random.Generator
    origin : (3,) array
        About which the world is given. Units: m.
    """
    draws = Draws.of(len(pulses), rng)
    run = Replay(survey, pulses, tuple(effects), reference, draws, np.asarray(origin, dtype=float))
    met = world.meet(*run.beams)
    return *run.measure(met), met


def without(recorded, effects, stage, reference, take_off):
    """What is true, of a value (Trajectory, Mounting, ControlPoints) as it was recorded.

    ``take_off(recorded, true, changed)`` is what `recorded` is without the way from `true` to
    `changed`; random effects must not be among these.
    """
    effects, true = [effect for effect in effects if effect.stage == stage], recorded
    nothing = {effect.name: None for effect in effects}
    for _ in range(ROUNDS if effects else 0):
        changed = apply_effects(effects, stage, true, reference, nothing)
        true = take_off(recorded, true, changed)
    return true


def _without_pose(recorded, true, changed):
    attitude = recorded.attitude
    if changed.attitude is not true.attitude:
        attitude = true.attitude * changed.attitude.inv() * attitude
    position = recorded.position - (changed.position - true.position)
    return Trajectory(recorded.gps_time, position, attitude)


def _without_mount(recorded, true, changed):
    lever_arm = recorded.lever_arm - (changed.lever_arm - true.lever_arm)
    boresight = true.boresight * changed.boresight.inv() * recorded.boresight
    return Mounting(lever_arm, boresight)


def recorded_mounting(survey):
    """The survey's mounting; where it is not known, beams are from the navigation centre, in the
    body frame."""
    return NO_MOUNTING if survey.mounting is None else survey.mounting


def aim(platform, gps_time, angle, elevation):
    """Start (n, 3) about the platform's origin, in m, and unit direction (n, 3) of pulses."""
    nothing, zero = np.zeros(len(gps_time)), np.zeros(3)
    start = platform.place(gps_time, angle, elevation, nothing, zero)
    return start, platform.place(gps_time, angle, elevation, nothing + 1.0, zero) - start


def recorded_platform(survey, origin):
    """Platform of the trajectory and mounting as they were recorded, about an origin (3,) in m."""
    return Platform.of(survey.trajectory, recorded_mounting(survey), np.asarray(origin, float))


def recorded_pulses(platform, cloud, origin, normal):
    """RecordedPulses of points within the trajectory.

    Parameters
    ----------
    platform : Platform
        As recorded_platform gives it, about the origin.
    cloud : PointCloud
    origin : (3,) array
        Units: m.
    normal : (n, 3) array, or (3,) of all
        Unit normals of the surfaces they lie on.
    """
    time, level, quarter = cloud.gps_time, np.zeros(len(cloud)), np.full(len(cloud), np.pi / 2)
    start, x = aim(platform, time, level, level)
    axes = x, aim(platform, time, quarter, level)[1], aim(platform, time, level, quarter)[1]
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


def true_targets(targets, effects, reference):
    """ControlPoints where they truly are, of those that were surveyed."""
    return without(targets, effects, "control", reference, _without_control)


def _without_control(recorded, true, changed):
    return replace(recorded, position=recorded.position - (changed.position - true.position))
