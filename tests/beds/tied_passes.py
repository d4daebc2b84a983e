"""A street driven there and back whose recorded path drifts, control points, and ties."""

from dataclasses import dataclass

import numpy as np

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Matched, Ties, Trajectory
from tests.beds.discs import observed_discs, surveyed_discs

ORIGIN = np.array([523_000.0, 3_378_000.0, 40.0])  # m, UTM
# s
START = 413_200.0
LENGTH = 60.0
PAUSE = 100.0
SPEED = 6.0  # m/s
NOISE = 0.004  # m, of targets and of ties


@dataclass(frozen=True)
class TiedPasses:
    "Recorded Trajectory, true - recorded position (n, 3), Matched control, and Ties"

    trajectory: Trajectory
    error: np.ndarray
    matched: Matched
    ties: Ties

    def left(self, correction):
        "True - corrected position (n, 3). Units: m"
        return self.error - (correction.corrected.position - self.trajectory.position)


def drift(time, seed):
    "True - recorded position (n, 3) of half a metre, by sines that no covariance family knows. m"
    rng = np.random.default_rng([seed, 7])
    period = rng.uniform(80.0, 200.0, (3, 3))
    phase = rng.uniform(0, 2 * np.pi, (3, 3))
    size = 0.3 * np.array([1.0, 1.0, 0.5])
    turns = 2 * np.pi * time[:, None, None] / period + phase
    return size * np.sin(turns).sum(axis=2)


def tied_passes(
    seed, control=(3.0, 16.0, 30.0, 44.0, 57.0), number=300, wrong=0.0, apart=0.5, shared=0.0
):
    """TiedPasses: control points at times of both passes, ties of facades, road and cross
    walls, a share of which is wrong by up to a distance apart; those of a second share an error.
    """
    rng = np.random.default_rng(seed)
    elapsed = np.arange(0.0, LENGTH, 0.1)
    time = np.concatenate([elapsed, elapsed + LENGTH + PAUSE])
    along = SPEED * np.concatenate([elapsed, LENGTH - elapsed])
    heading = np.repeat([np.pi / 2, -np.pi / 2], len(elapsed))
    across = np.repeat([-1.0, 1.0], len(elapsed))
    true = np.column_stack([along, across, np.full(len(along), 2.0)])
    error = drift(time, seed)
    sigma = np.full((len(time), 3), 0.5)
    trajectory = Trajectory(
        START + time, ORIGIN + true - error, attitude_from_angles(0.0, 0.0, heading), sigma
    )
    times = np.array(control)
    matched = _matched(times, trajectory, seed, rng)
    return TiedPasses(trajectory, error, matched, _ties(number, wrong, apart, shared, rng, seed))


def _matched(times, trajectory, seed, rng):
    n = len(times)
    along = SPEED * np.minimum(times, 2 * LENGTH + PAUSE - times)  # there, or back
    place = ORIGIN + np.column_stack([along, np.full(n, 8.0), np.full(n, 3.0)])
    seen = place - drift(times, seed) + NOISE * rng.standard_normal((n, 3))
    names = tuple(f"T{i}" for i in range(n))
    normal = [0.0, -1.0, 0.0]
    observed = observed_discs(names, START + times, seen, NOISE, normal)
    return Matched(observed, surveyed_discs(names, place, 0.003, normal))


def _ties(number, wrong, apart, shared, rng, seed):
    first = rng.uniform(1.0, LENGTH - 1.0, number)
    second = 2 * LENGTH + PAUSE - first  # when the same place is passed on the way back
    normal = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])[
        rng.integers(3, size=number)
    ]
    place = np.column_stack([SPEED * first, rng.uniform(-9, 9, number), rng.uniform(0, 5, number)])
    views = np.stack([place - drift(t, seed) for t in (first, second)], axis=1)
    noise = NOISE * rng.standard_normal(number)
    is_wrong = rng.random(number) < wrong
    noise[is_wrong] += rng.choice([-1.0, 1.0], is_wrong.sum()) * rng.uniform(
        apart / 5, apart, is_wrong.sum()
    )
    of_second = shared * rng.standard_normal((int(LENGTH), 3))[first.astype(int)]
    noise += np.einsum("ni,ni->n", normal, of_second)
    views[:, 1] += noise[:, None] * normal
    times = START + np.column_stack([first, second])
    return ties_of_planes(times, views, normal, NOISE, ORIGIN)


def ties_of_planes(gps_time, place, normal, sigma, origin=0.0):
    "Ties of planes that two passes saw: times (n, 2), places (n, 2, 3) from an origin, one sigma"
    number = len(normal)
    return Ties(
        gps_time=gps_time,
        place=origin + place,
        direction=normal,
        misclosure=np.einsum("ni,ni->n", normal, place[:, 1] - place[:, 0]),
        variance=np.full(number, sigma**2),
        kind=np.full(number, "plane"),
        pass_number=np.tile([1, 2], (number, 1)),
        scanner=np.zeros((number, 2), int),
        feature=np.arange(2 * number).reshape(number, 2),
    )
