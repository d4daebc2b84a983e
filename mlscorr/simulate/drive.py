"""The true trajectories of a vehicle along a way: one for each pass, in the order of time."""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import brentq

from mlscorr.simulate.given import course, read_given
from mlscorr.simulate.line import MARGIN, centre_line, line_along
from mlscorr.simulate.mesh_scene import line_on_mesh
from mlscorr.simulate.pace import CORNERING, Pace
from mlscorr.simulate.street import CROWN, ROAD, TURN_RADIUS, section
from mlscorr.simulate.turning import LATERAL_LIMIT, draw
from mlscorr.survey import GAP_FACTOR, Trajectory, attitude_from_angles

POS_HEIGHT = {"street": 1.8, "mesh": 1.8, "river": 2.5}  # m above road or water: on the roof
RADIUS = {"street": TURN_RADIUS, "mesh": TURN_RADIUS, "river": 8.0}  # m, of a U-turn
VIBRATION = {  # deg of roll, pitch, heading: a car on its springs, a boat in small waves
    "street": (0.25, 0.15, 0.05),
    "mesh": (0.25, 0.15, 0.05),
    "river": (1.0, 0.5, 0.2),
}
HEAVE = {"street": 0.012, "mesh": 0.012, "river": 0.04}  # m, the same in height
FREQUENCIES = {  # Hz: road to body resonance; waves of a few metres
    "street": np.array([0.13, 0.37, 0.9, 1.6]),
    "mesh": np.array([0.13, 0.37, 0.9, 1.6]),
    "river": np.array([0.11, 0.23, 0.38, 0.55]),
}
CALM = 1.5  # m/s at which a car's vibration is half of its full size: it rests when it stands


def drive(scenario, rng):
    """Centre line, its length (m) along the drive, and the true trajectories, one for each pass.

    Trajectories are in map coordinates, in the order of time, with epochs at the pose rate.
    Raises ValueError for a drive that contradicts itself, or that leaves its mesh.
    """
    line_rng, pace_rng, motion_rng = rng.spawn(3)
    if scenario.drive.file is not None:
        return _follow(scenario, motion_rng)
    _check(scenario.drive)
    paces, phases = _paces(scenario.drive, pace_rng)
    longest = 1.15 * paces[0].distance(_epochs(scenario.drive))[-1] + 100.0
    line = centre_line(
        longest, scenario.drive.turns, line_rng, scenario.scene.kind, _fastest(scenario.drive)
    )
    length = _length(scenario, line, paces[0], phases[0])
    if scenario.scene.kind == "mesh":
        line = line_on_mesh(scenario, line, length)
    trajectories, start = [], scenario.start_time
    rngs = motion_rng.spawn(len(paces))
    for i, one in enumerate(scenario.drive.passes):
        path = _path(scenario, line, length, one, phases[i])
        elapsed, distance = _timing(scenario, paces[i], path, is_first=i == 0)
        if i:
            start = trajectories[-1].gps_time[-1] + one.pause
        trajectories.append(_trajectory(scenario, path, start + elapsed, distance, rngs[i]))
    return line, length, tuple(trajectories)


def _epochs(drive):
    """Times (n,) of the first pass from its start. Units: s."""
    return np.arange(round(drive.duration * drive.pose_rate) + 1) / drive.pose_rate


def _fastest(drive):
    return max(one.speed or drive.speed for one in drive.passes)


def _check(drive):
    """Refuse what contradicts itself."""
    if len(_epochs(drive)) < 3:
        raise ValueError(
            f"A drive of {drive.duration} s has less than 3 epochs at {drive.pose_rate} Hz."
        )
    for start, duration in drive.stops:
        if start + duration > drive.duration:
            raise ValueError(
                f"A stop of {duration} s from {start} s lies outside the first pass of "
                f"{drive.duration} s."
            )
    for one in drive.passes:
        if abs(one.lateral) > LATERAL_LIMIT:
            raise ValueError(
                f"A pass {one.lateral} m beside the centre line leaves the scene: give a lateral "
                f"of up to {LATERAL_LIMIT:.0f} m."
            )
    for one in drive.passes[1:]:
        if one.pause <= GAP_FACTOR / drive.pose_rate:
            raise ValueError(
                f"A pause of {one.pause} s between passes is no gap of a trajectory at "
                f"{drive.pose_rate} Hz: give more than {GAP_FACTOR / drive.pose_rate} s."
            )


def _paces(drive, rng):
    """Pace of every pass, and the phase (rad) of its weaving."""
    paces, phases = [], []
    for i, (one, own) in enumerate(zip(drive.passes, rng.spawn(len(drive.passes)), strict=True)):
        cruise = one.speed or drive.speed
        duration = drive.duration * drive.speed / cruise
        phase, slow_at = own.uniform(0.0, 2 * np.pi), own.uniform(0.3, 0.7) * duration
        paces.append(Pace(cruise, phase, slow_at, drive.stops if i == 0 else ()))
        phases.append(own.uniform(0.0, 2 * np.pi))
    return paces, phases


def _ground(scenario, length, s, lateral):
    """Height of the POS above the centre line (m) and cross fall (rad), each (n,)."""
    kind = scenario.scene.kind
    if kind != "street":
        return np.full(len(s), POS_HEIGHT[kind]), np.zeros(len(s))
    height, fall = section(scenario.drive, length).under_wheels(s, lateral)
    return height + POS_HEIGHT[kind], fall


def _path(scenario, line, length, one_pass, phase):
    """Path of a pass."""
    ground = partial(_ground, scenario, length)
    radius = RADIUS[scenario.scene.kind] if scenario.drive.u_turn else None
    speed = one_pass.speed or scenario.drive.speed
    return draw(line, ground, length, one_pass, speed, radius, phase)


def _length(scenario, line, pace, phase):
    """Length of the way (m) that the first pass needs to drive as long as it should."""
    drive = scenario.drive
    first = drive.passes[0]
    shortest = 10.0
    least = _path(scenario, line, shortest, first, phase)
    distance = _with_turn(scenario, pace, _epochs(drive)).distance(_epochs(drive))[-1]
    if distance <= least.length:
        raise ValueError(
            f"A drive of {distance:.1f} m in {drive.duration} s is too short: {least.length:.0f} m "
            f"are needed{' for a U-turn' if drive.u_turn else ''}. Drive longer or faster, or stop "
            "less."
        )
    longest = line.curve.x[-1] - 2 * MARGIN
    return brentq(
        lambda length: _path(scenario, line, length, first, phase).length - distance,
        shortest,
        longest,
        xtol=1e-6,
    )


def _with_turn(scenario, pace, elapsed, half=None):
    """The pace that is slow in the U-turn, half way (m) or where the pace itself is half way."""
    if not scenario.drive.u_turn:
        return pace
    speed = np.sqrt(CORNERING * RADIUS[scenario.scene.kind])
    duration = 8.0 * RADIUS[scenario.scene.kind] / speed

    def slowed(middle):
        return replace(pace, turn=(middle, duration, speed))

    def ahead(middle):
        distance = slowed(middle).distance(elapsed)
        return np.interp(middle, elapsed, distance) - (half or distance[-1] / 2)

    return slowed(brentq(ahead, 0.0, elapsed[-1], xtol=1e-3))


def _timing(scenario, pace, path, is_first):
    """Times (n,) from the start of a pass in s, and the distance (n,) along its path in m."""
    drive = scenario.drive
    if is_first:
        elapsed = _epochs(drive)
        distance = _with_turn(scenario, pace, elapsed).distance(elapsed)
        return elapsed, np.minimum(distance, path.length)
    most = 4.0 * path.length / pace.cruise + 120.0
    elapsed = np.arange(round(most * drive.pose_rate)) / drive.pose_rate
    distance = _with_turn(scenario, pace, elapsed, path.length / 2).distance(elapsed)
    driven = distance <= path.length
    return elapsed[driven], distance[driven]


def _trajectory(scenario, path, gps_time, distance, rng):
    """Trajectory along a path, looking where it goes, leaning with the road, shaken a little."""
    kind = scenario.scene.kind
    place = path.curve(distance)
    east, north, up, _ = path.curve(distance, 1).T
    shaking = 1.0
    if kind != "river":
        speed = np.gradient(distance, 1.0 / scenario.drive.pose_rate)
        shaking = speed / (speed + CALM)
    position = place[:, :3] + np.array(scenario.origin)
    position[:, 2] += HEAVE[kind] * shaking * _vibration(gps_time, kind, rng)
    roll, pitch, heading = (
        np.radians(v) * shaking * _vibration(gps_time, kind, rng) for v in VIBRATION[kind]
    )
    attitude = attitude_from_angles(
        roll + place[:, 3],
        pitch + np.arctan2(up, np.hypot(east, north)),
        heading + np.arctan2(east, north),
    )
    return Trajectory(gps_time, position, attitude)


def _follow(scenario, rng):
    """The drive of a given file: its path, its timing, its attitude where it has one."""
    kind, origin = scenario.scene.kind, np.array(scenario.origin)
    height = POS_HEIGHT[kind] + (CROWN * ROAD if kind == "street" else 0.0)
    pieces = read_given(scenario)
    offset = pieces[0][1][0]
    whole = np.vstack([position for _, position, _ in pieces]) - offset
    line, length = line_along(whole * [1.0, 1.0, 0.0 if kind == "river" else 1.0])
    if kind == "mesh":
        line = line_on_mesh(scenario, line, length)
    trajectories = []
    for elapsed, position, attitude in pieces:
        place = position - offset + [0.0, 0.0, height]
        if kind == "mesh":
            place[:, 2] = height + line.height(place)
        elif kind == "river":
            place[:, 2] = height
        if attitude is None:
            heading, pitch = course(elapsed, place)
            roll = np.radians(VIBRATION[kind][0]) * _vibration(elapsed, kind, rng)
            attitude = attitude_from_angles(roll, pitch, heading)
        trajectories.append(Trajectory(scenario.start_time + elapsed, origin + place, attitude))
    return line, length, tuple(trajectories)


def _vibration(gps_time, kind, rng):
    """Smooth vibration (n,) of unit RMS, weaker at higher frequencies."""
    frequencies = FREQUENCIES[kind]
    phase = rng.uniform(0, 2 * np.pi, len(frequencies))
    amplitude = frequencies**-0.5
    waves = amplitude * np.sin(2 * np.pi * gps_time[:, None] * frequencies + phase)
    return waves.sum(axis=1) / np.sqrt((amplitude**2).sum() / 2)


__all__ = ["centre_line", "drive"]
