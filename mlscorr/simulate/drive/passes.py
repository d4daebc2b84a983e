"""True trajectories of a vehicle along a way, one for each pass, in order of time."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.random import Generator
from scipy.optimize import brentq

from mlscorr.frames import attitude_from_angles
from mlscorr.simulate.drive._pace import Pace
from mlscorr.simulate.drive._path import course, draw, read_path
from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.scene import CentreLine, line_along, line_on_mesh, section, winding_line
from mlscorr.simulate.settings import SETTINGS
from mlscorr.simulate.vehicle import VEHICLES
from mlscorr.survey import GAP_FACTOR, Trajectory


def drive(scenario: Scenario, rng: Generator) -> tuple[CentreLine, float, tuple[Trajectory, ...]]:
    """Make center line, its length (m) along the drive, and the true trajectory of each pass.

    Trajectories are in map coordinates, in the order of time, with epochs at the pose rate.

    Parameters
    ----------
    scenario : Scenario
    rng : Generator

    Raises
    ------
    ValueError
        If the drive is inconsistent, or leaves its mesh.
    """
    line_rng, pace_rng, motion_rng = rng.spawn(3)
    if scenario.drive.file is not None:
        return _follow(scenario, motion_rng)
    _check(scenario.drive)
    paces, phases = _paces(scenario.drive, pace_rng)
    longest = 1.15 * paces[0].distance(_epochs(scenario.drive))[-1] + 100.0
    fastest = max(leg.speed or scenario.drive.speed for leg in scenario.drive.passes)
    line = winding_line(longest, scenario.drive.turns, line_rng, scenario.scene.kind, fastest)
    length = _length(scenario, line, paces[0], phases[0])
    if scenario.scene.kind == "mesh":
        line = line_on_mesh(scenario, line, length)
    trajectories: list[Trajectory] = []
    start = scenario.start_time
    rngs = motion_rng.spawn(len(paces))
    for i, leg in enumerate(scenario.drive.passes):
        path = _path(scenario, line, length, leg, phases[i])
        elapsed, distance = _timing(scenario, paces[i], path, is_first=i == 0)
        if i:
            start = trajectories[-1].gps_time[-1] + leg.pause
        trajectories.append(_trajectory(scenario, path, start + elapsed, distance, rngs[i]))
    return line, length, tuple(trajectories)


def _epochs(drive):
    """Times (n,) of the first pass from its start. Units: s."""
    return np.arange(round(drive.duration * drive.pose_rate) + 1) / drive.pose_rate


def _check(drive):
    """Refuse inconsistent settings."""
    if len(_epochs(drive)) < 3:
        raise ValueError(
            f"A drive of {drive.duration} s has fewer than 3 epochs at {drive.pose_rate} Hz."
        )
    for start, duration in drive.stops:
        if start + duration > drive.duration:
            raise ValueError(
                f"A stop of {duration} s from {start} s is outside the first pass of "
                f"{drive.duration} s."
            )
    for leg in drive.passes:
        if abs(leg.lateral) > SETTINGS.lateral_limit:
            raise ValueError(
                f"A pass {leg.lateral} m from the center line is outside the scene. Give a "
                f"lateral of up to {SETTINGS.lateral_limit:.0f} m."
            )
    for leg in drive.passes[1:]:
        if leg.pause <= GAP_FACTOR / drive.pose_rate:
            raise ValueError(
                f"A pause of {leg.pause} s between passes is not a gap of a trajectory at "
                f"{drive.pose_rate} Hz. Give more than {GAP_FACTOR / drive.pose_rate} s."
            )


def _paces(drive, rng):
    """Pace of every pass, and the phase (rad) of its weaving."""
    paces = []
    phases = []
    for i, (leg, own) in enumerate(zip(drive.passes, rng.spawn(len(drive.passes)), strict=True)):
        cruise = leg.speed or drive.speed
        duration = drive.duration * drive.speed / cruise
        phase = own.uniform(0.0, 2 * np.pi)
        slow_at = own.uniform(0.3, 0.7) * duration
        stops = ()
        if i == 0:
            stops = drive.stops
        paces.append(Pace(cruise, phase, slow_at, stops))
        phases.append(own.uniform(0.0, 2 * np.pi))
    return paces, phases


def _ground(scenario, length, s, lateral):
    """Height of the POS above the center line (m) and cross fall (rad), each (n,)."""
    pos_height = VEHICLES[scenario.scene.kind].pos_height
    if scenario.scene.kind != "street":
        return np.full(len(s), pos_height), np.zeros(len(s))
    height, fall = section(scenario.drive, length).under_wheels(s, lateral)
    return height + pos_height, fall


def _path(scenario, line, length, leg, phase):
    """Path of a pass."""
    ground = partial(_ground, scenario, length)
    speed = leg.speed or scenario.drive.speed
    vehicle = VEHICLES[scenario.scene.kind]
    return draw(line, ground, length, leg, speed, vehicle, phase, scenario.drive.u_turn)


def _length(scenario, line, pace, phase):
    """Length of the way (m) for the first pass to have its intended duration."""
    drive = scenario.drive
    first = drive.passes[0]
    shortest = 10.0
    least = _path(scenario, line, shortest, first, phase)
    distance = _with_turn(scenario, pace, _epochs(drive)).distance(_epochs(drive))[-1]
    if distance <= least.length:
        purpose = ""
        if drive.u_turn:
            purpose = " for a U-turn"
        raise ValueError(
            f"A drive of {distance:.1f} m in {drive.duration} s is too short: {least.length:.0f} "
            f"m are needed{purpose}. Drive longer or faster, or stop less."
        )
    longest = line.curve.x[-1] - 2 * SETTINGS.margin
    return brentq(
        lambda length: _path(scenario, line, length, first, phase).length - distance,
        shortest,
        longest,
        xtol=1e-6,
    )


def _with_turn(scenario, pace, elapsed, half=None):
    """Pace that slows down in the U-turn, half way (m) or where the pace itself is half way."""
    if not scenario.drive.u_turn:
        return pace
    vehicle = VEHICLES[scenario.scene.kind]
    speed = np.sqrt(SETTINGS.cornering * vehicle.turning_radius)
    duration = 8.0 * vehicle.turning_radius / speed

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
    longest = 4.0 * path.length / pace.cruise + 120.0
    elapsed = np.arange(round(longest * drive.pose_rate)) / drive.pose_rate
    distance = _with_turn(scenario, pace, elapsed, path.length / 2).distance(elapsed)
    driven = distance <= path.length
    return elapsed[driven], distance[driven]


def _trajectory(scenario, path, gps_time, distance, rng):
    """Trajectory along a path, with heading along it, roll from the road, and small vibrations."""
    vehicle = VEHICLES[scenario.scene.kind]
    place = path.curve(distance)
    east, north, up, _ = path.curve(distance, 1).T
    shaking = 1.0
    if vehicle.calm_speed > 0:
        speed = np.gradient(distance, 1.0 / scenario.drive.pose_rate)
        shaking = speed / (speed + vehicle.calm_speed)
    position = place[:, :3] + np.array(scenario.origin)
    position[:, 2] += vehicle.heave * shaking * _vibration(gps_time, vehicle, rng)
    roll, pitch, heading = (
        np.radians(sigma) * shaking * _vibration(gps_time, vehicle, rng)
        for sigma in vehicle.vibration
    )
    attitude = attitude_from_angles(
        roll + place[:, 3],
        pitch + np.arctan2(up, np.hypot(east, north)),
        heading + np.arctan2(east, north),
    )
    return Trajectory(gps_time, position, attitude)


def _follow(scenario, rng):
    """Drive from a file: its path, its timing, and its attitude if available."""
    kind = scenario.scene.kind
    origin = np.array(scenario.origin)
    vehicle = VEHICLES[kind]
    pieces = read_path(scenario)
    offset = pieces[0][1][0]
    whole = np.vstack([position for _, position, _ in pieces]) - offset
    if kind == "river":
        whole[:, 2] *= 0.0  # the water is level
    line, length = line_along(whole)
    if kind == "mesh":
        line = line_on_mesh(scenario, line, length)
    height = _ground(scenario, length, np.zeros(1), np.zeros(1))[0][0]
    trajectories = []
    for elapsed, position, attitude in pieces:
        place = position - offset + [0.0, 0.0, height]
        if kind == "mesh":
            place[:, 2] = height + line.height(place)
        elif kind == "river":
            place[:, 2] = height
        rotation = attitude
        if attitude is None:
            heading, pitch = course(elapsed, place)
            roll = np.radians(vehicle.vibration[0]) * _vibration(elapsed, vehicle, rng)
            rotation = attitude_from_angles(roll, pitch, heading)
        trajectories.append(Trajectory(scenario.start_time + elapsed, origin + place, rotation))
    return line, length, tuple(trajectories)


def _vibration(gps_time, vehicle, rng):
    """Smooth vibration (n,) of unit RMS, weaker at higher frequencies."""
    frequencies = np.array(vehicle.frequencies)
    phase = rng.uniform(0, 2 * np.pi, len(frequencies))
    amplitude = frequencies**-0.5
    waves = amplitude * np.sin(2 * np.pi * gps_time[:, None] * frequencies + phase)
    return waves.sum(axis=1) / np.sqrt((amplitude**2).sum() / 2)
