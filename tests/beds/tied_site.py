"""A calibration site driven there and back with a wrong mounting: targets, and planes as ties."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles, georeference, to_scanner
from mlscorr.survey import Matched, Mounting, Ties, Trajectory
from tests.beds.discs import observed_discs, surveyed_discs
from tests.beds.tied_passes import ties_of_planes

START = 413_200.0  # s of week
ORIGIN = np.array([523_000.0, 3_378_000.0, 40.0])  # m, UTM
# s of a pass, and when the way back begins
LENGTH = 40.0
BACK = 100.0
SPEED = 5.0  # m/s
# m, one sigma
NOISE = 0.003
SURVEYED = 0.003
TIE_NOISE = 0.002  # m; a hundred such planes stand for the six hundred of 5 mm that a site gives
# what the POS states
POSITION = 0.005
ATTITUDE = np.radians([0.001, 0.001, 0.002])
LACKS = np.append([0.03, -0.02, 0.0], np.radians([0.3, -0.3, 0.4]))  # m, rad: half a degree
RECORDED = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90, 0, 35], degrees=True)
)


@dataclass(frozen=True)
class TiedSite:
    "Recorded Trajectory, Matched control, Ties, what the mounting lacks (6,), wrong ties (n,)"

    trajectory: Trajectory
    matched: Matched
    ties: Ties
    lacks: np.ndarray
    wrong: np.ndarray


def tied_site(seed, targets=6, number=100, wrong=0.0):
    """TiedSite: control points passed twice, planes at all azimuths and slopes seen from
    both directions, a share of which is wrong by decimetres. The position drifts by millimetres.
    """
    rng = np.random.default_rng(seed)
    true = drive()
    phase = rng.uniform(0, 2 * np.pi, 3)
    turns = 2 * np.pi * (true.gps_time - START)[:, None] / [60.0, 85.0, 110.0] + phase
    recorded = Trajectory(
        true.gps_time,
        true.position + POSITION * np.sin(turns),
        true.attitude,
        np.full((len(true), 3), POSITION),
        np.tile(ATTITUDE, (len(true), 1)),
    )
    turn = Rotation.from_rotvec(LACKS[3:])
    mounting = Mounting(RECORDED.lever_arm + LACKS[:3], turn * RECORDED.boresight)

    def look(when, place, noise):
        seen = to_scanner(true, mounting, place, when) + noise
        return georeference(recorded, RECORDED, seen, when)

    matched = _matched(true, targets, look, rng)
    is_wrong = rng.random(number) < wrong
    ties = _ties(true, is_wrong, look, rng)
    return TiedSite(recorded, matched, ties, LACKS, is_wrong)


def drive():
    "Along a gentle bend, and after a pause the same way back"
    time = np.arange(0.0, LENGTH + 0.05, 0.1)
    heading = 0.7 + 0.1 * np.sin(time / 9.0)
    way = np.cumsum(
        0.1 * SPEED * np.column_stack([np.sin(heading), np.cos(heading), 0 * time]), axis=0
    )
    return Trajectory(
        START + np.append(time, time + BACK),
        ORIGIN + np.vstack([way, way[::-1]]),
        attitude_from_angles(0.0, 0.0, np.append(heading, heading[::-1] + np.pi)),
    )


def places(true, first, rng):
    "Places (n, 3) to both sides of the way, ahead or behind at times (n,), and when seen again"
    n = len(first)
    side = rng.choice([-1.0, 1.0], n) * rng.uniform(4.0, 25.0, n)
    body = np.column_stack([side, rng.uniform(-10, 10, n), rng.uniform(-2, 8, n)])
    pose = true.at(START + first)
    return pose.position + pose.attitude.apply(body), BACK + LENGTH - first + rng.uniform(
        -4.0, 4.0, n
    )


def _matched(true, targets, look, rng):
    first = np.linspace(4.0, LENGTH - 4.0, targets)
    place, second = places(true, first, rng)
    n = 2 * targets
    times = START + np.append(first, second)
    seen = look(times, np.vstack([place, place]), NOISE * rng.standard_normal((n, 3)))
    names = tuple(f"T{i}" for i in range(targets))
    control = surveyed_discs(names, place + SURVEYED * rng.standard_normal(place.shape), SURVEYED)
    passes = np.repeat([1, 2], targets)
    observed = observed_discs(names * 2, times, seen, NOISE, pass_number=passes)
    return Matched.by_name(observed, control)


def _ties(true, is_wrong, look, rng):
    number = len(is_wrong)
    first = rng.uniform(4.0, LENGTH - 4.0, number)
    place, second = places(true, first, rng)
    azimuth = rng.uniform(0, 2 * np.pi, number)
    normal = np.column_stack([np.sin(azimuth), np.cos(azimuth), 0 * azimuth])
    normal[::4] = [0.0, 0.0, 1.0]  # road and pavement
    noise = TIE_NOISE / np.sqrt(2) * rng.standard_normal((2, number, 1)) * normal
    place_then = place + (is_wrong * rng.uniform(0.1, 0.5, number))[:, None] * normal
    none = np.zeros((number, 3))
    views = look(START + first, place, none), look(START + second, place_then, none)
    place = np.stack(views + noise, axis=1)
    return ties_of_planes(START + np.column_stack([first, second]), place, normal, TIE_NOISE)
