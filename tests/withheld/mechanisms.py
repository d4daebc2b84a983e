"""Mechanisms that exist here alone and in no library: how well does a diagnosis know that it
doesn't know?

Each is a function of RecordedPoints (mlscorr.simulate._mechanisms), a size in its unit and a
generator, and returns by how much the points are recorded elsewhere, (n, 3) in m on the map. It is
linear in the size. Where a source is called an estimate, the sentence is its derivation.
"""

import numpy as np
from scipy.spatial.transform import Slerp

MOMENT = 0.3  # s to each side, over which speed, turns and acceleration are taken
UP = np.array([0.0, 0.0, 1.0])
TOWN = 8.0  # m/s, a usual speed of mobile mapping in towns


def lift_with_speed(seen, size, rng):
    """A roof rack lifts with the wind: points too high by size (m) at 8 m/s, with speed squared.

    Source: estimate; 50 N of wind at 8 m/s on a rack that gives 1 cm per 50 N.
    """
    speed = _motion(seen)["speed"]
    return size * (speed / TOWN)[:, None] ** 2 * UP


def thermal_range_drift(seen, size, rng):
    """A scanner warms up: ranges grow by size (m) with a time constant of a minute.

    Source: estimate; millimetres in the first minutes, as manufacturers ask to wait for them.
    """
    elapsed = seen.gps_time - seen.trajectory.gps_time[0]
    return size * (1.0 - np.exp(-elapsed / 60.0))[:, None] * _beam(seen)


def roll_with_turn_rate(seen, size, rng):
    """A mount of rubber leans in bends: roll wrong by size (deg) at a turn rate of 10 deg/s.

    Source: estimate; 20 kg on 0.3 m height at 1 m/s^2 against a stiffness of 7000 N m/rad.
    """
    rate = _motion(seen)["turn"] @ UP / np.radians(10.0)
    return np.radians(size) * rate[:, None] * np.cross(_axis(seen, 1), _arm(seen))


def mirror_wobble(seen, size, rng):
    """Facets of a mirror are tilted: beams leave the scan plane by size (deg), 2 to 4 times a turn.

    Source: estimate; polygons of line scanners are ground to some seconds of arc to 0.01 deg.
    """
    often = rng.integers(2, 5)
    phase = rng.uniform(0.0, 2 * np.pi)
    wave = np.sin(often * _angle(seen) + phase) * np.linalg.norm(seen.scanner_xyz, axis=1)
    axis = seen.trajectory.at(seen.gps_time).attitude.apply(seen.mounting.boresight.apply(UP))
    return np.radians(size) * wave[:, None] * axis


def cyclic_range(seen, size, rng):
    """Crosstalk in a phase meter: ranges wrong by size (m), repeating each 3 to 12 m.

    Source: Rueeger 1990, Electronic Distance Measurement: some mm, by half the wavelength.
    """
    period = rng.uniform(3.0, 12.0)
    phase = rng.uniform(0.0, 2 * np.pi)
    away = np.linalg.norm(seen.scanner_xyz, axis=1)
    return size * np.sin(2 * np.pi * away / period + phase)[:, None] * _beam(seen)


def local_subsidence(seen, size, rng):
    """The ground has sunk since the survey of targets and surfaces, by size (m) about one place.

    Source: estimate; centimetres over tunnels, in a trough of 10 to 25 m to each side.
    """
    position = seen.trajectory.position
    middle = position[int(rng.uniform(0.25, 0.75) * (len(position) - 1))]
    width = rng.uniform(10.0, 25.0)
    away = np.linalg.norm((seen.xyz - middle)[:, :2], axis=1)
    return -size * np.exp(-0.5 * (away / width) ** 2)[:, None] * UP


def attitude_lag(seen, size, rng):
    """A filter in the inertial unit delays the attitude, and nothing else, by size (s).

    Source: estimate; a low pass of 10 Hz is late by 16 ms.
    """
    return -size * np.cross(_motion(seen)["turn"], _arm(seen))


def heading_dependent_bias(seen, size, rng):
    """Reflections on the roof turn with the car: off by size (m), east by cos, north by sin.

    Source: estimate; phase centres of antennas vary by millimetres to centimetres with azimuth.
    """
    forward = _axis(seen, 1)
    heading = np.arctan2(forward[:, 0], forward[:, 1])
    return size * np.column_stack([np.cos(heading), np.sin(heading), 0.0 * heading])


def brake_dive(seen, size, rng):
    """A long arm bends when the car brakes: pitch wrong by size (deg) at 1 m/s^2, nose down.

    Source: estimate; 20 kg on an arm of 0.5 m and 2000 N m/rad give 0.3 deg.
    """
    slower = -_motion(seen)["acceleration"]
    return -np.radians(size) * slower[:, None] * np.cross(_axis(seen, 0), _arm(seen))


def tilted_window(seen, size, rng):
    """Beams take a longer way through a tilted window: size (m) more range to one side.

    The glass is flat, so the way in it goes with 1 / cos of the angle to its normal.
    Source: estimate; 5 mm of glass are 2.5 mm of optical path, 1 mm more at 45 deg.
    """
    from_normal = _angle(seen) - rng.uniform(0.0, 2 * np.pi)
    away = np.abs(np.mod(from_normal + np.pi, 2 * np.pi) - np.pi)
    longer = 1.0 / np.cos(np.clip(away, 0.0, np.radians(60.0))) - 1.0
    return size * np.where(away < np.radians(90.0), longer, 0.0)[:, None] * _beam(seen)


MECHANISMS = {
    "lift with speed": lift_with_speed,
    "thermal range drift": thermal_range_drift,
    "roll with turn rate": roll_with_turn_rate,
    "mirror wobble": mirror_wobble,
    "cyclic range": cyclic_range,
    "local subsidence": local_subsidence,
    "attitude lag": attitude_lag,
    "heading-dependent bias": heading_dependent_bias,
    "brake dive": brake_dive,
    "tilted window": tilted_window,
}

UNITS = {  # unit of the size, and the largest one that a user would not see at once
    "lift with speed": ("m", 0.5),
    "thermal range drift": ("m", 0.1),
    "roll with turn rate": ("deg", 5.0),
    "mirror wobble": ("deg", 1.0),
    "cyclic range": ("m", 0.1),
    "local subsidence": ("m", 0.5),
    "attitude lag": ("s", 0.2),
    "heading-dependent bias": ("m", 0.5),
    "brake dive": ("deg", 5.0),
    "tilted window": ("m", 0.1),
}

LEADS = {  # a right lead has one of the words of each entry, which are parted by |
    "lift with speed": ("height error", "speed"),
    "thermal range drift": ("range error", "time"),
    "roll with turn rate": ("roll error|right", "turn"),
    "mirror wobble": ("across|pitch|heading|along the drive", "turn of the scanner|scan angle"),
    "cyclic range": ("range error", "range"),
    "local subsidence": ("height error", "place|time"),
    "attitude lag": ("roll error|pitch error|heading error|right|along", "rate|acceleration"),
    "heading-dependent bias": ("easting|northing|right|along", "heading|pass|place|time"),
    "brake dive": ("pitch error|height error|along", "acceleration|speed"),
    "tilted window": ("range error", "turn of the scanner|scan angle"),
}


def _beam(seen):
    """Unit vectors (n, 3) on the map from the scanner to the points."""
    pose = seen.trajectory.at(seen.gps_time)
    beam = pose.attitude.apply(seen.mounting.boresight.apply(seen.scanner_xyz))
    return beam / np.linalg.norm(beam, axis=1, keepdims=True)


def _arm(seen):
    """Points (n, 3) on the map from the POS. Units: m."""
    return seen.xyz - seen.trajectory.at(seen.gps_time).position


def _axis(seen, number):
    """Unit vectors (n, 3) on the map of a body axis: right, forward, up."""
    return seen.trajectory.at(seen.gps_time).attitude.apply(np.eye(3)[number])


def _angle(seen):
    """Scan angles (n,) in rad."""
    return np.arctan2(seen.scanner_xyz[:, 1], seen.scanner_xyz[:, 0])


def _motion(seen):
    """Speed (n,) in m/s, turn (n, 3) about map axes in rad/s, acceleration (n,) in m/s^2."""
    trajectory = seen.trajectory
    parts = []
    starts = np.append(trajectory.gps_time[0], trajectory.gaps[:, 1])
    ends = np.append(trajectory.gaps[:, 0], trajectory.gps_time[-1])
    for start, end in zip(starts, ends, strict=True):
        time = np.linspace(start, end, max(4, int((end - start) / 0.1)))
        inside = (trajectory.gps_time >= start) & (trajectory.gps_time <= end)
        known = trajectory.gps_time[inside]
        position = trajectory.position[inside]
        early, late = (np.clip(time + step, start, end) for step in (-MOMENT, MOMENT))
        place = [_at(known, position, t) for t in (early, late)]
        turned = Slerp(known, trajectory.attitude[inside])
        span = (late - early)[:, None]
        velocity = (place[1] - place[0]) / span
        turn = (turned(late) * turned(early).inv()).as_rotvec() / span
        speed = np.linalg.norm(velocity, axis=1)
        parts.append(np.column_stack([time, speed, turn, np.gradient(speed, time)]))
    table = np.vstack(parts)
    told = _at(table[:, 0], table[:, 1:], seen.gps_time)
    return {"speed": told[:, 0], "turn": told[:, 1:4], "acceleration": told[:, 4]}


def _at(time, values, wanted):
    """Columns (n, k) of values at wanted times (n,)."""
    return np.column_stack([np.interp(wanted, time, column) for column in values.T])
