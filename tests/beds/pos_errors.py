"""Drives whose POS errs by known vectors, and targets beside them."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.estimate import estimate_correction, position_adjustment, position_prior
from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Matched, Pos, Trajectory
from tests.beds.discs import observed_discs, surveyed_discs

START = 357_900.0  # s of week
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m, UTM
LENGTH = 200.0  # s
NOISE = 0.005  # m, one sigma of extraction
SURVEYED = 0.003  # m, one sigma of the control points


class Case:
    """A drive with a known POS error, and targets on both sides of it.

    error (n, 3) is true - recorded position, turn (n, 3) the rotation vector that the recorded
    attitude lacks; both are given at ``epochs``, s from the start.
    """

    def __init__(self, epochs, error, times, rng, sigma=None, turn=None, attitude_sigma=None):
        heading = 0.3 + 0.5 * np.sin(epochs / 40.0)
        speed = 10.0 * np.column_stack([np.sin(heading), np.cos(heading), 0.0 * heading])
        position = CORNER + np.cumsum(speed, axis=0) * (epochs[1] - epochs[0])
        attitude = attitude_from_angles(
            0.01 * np.sin(epochs / 7), 0.02 * np.cos(epochs / 9), heading
        )
        rotation = Rotation.from_rotvec(np.zeros((len(epochs), 3)) if turn is None else turn)
        self.true = Trajectory(START + epochs, position, attitude)
        self.recorded = Trajectory(
            START + epochs, position - error, rotation.inv() * attitude, sigma, attitude_sigma
        )
        sides = np.resize([-6.0, 9.0, 14.0, -11.0], len(times))  # m to the right
        body = np.column_stack([sides, 0.0 * sides, 0.0 * sides - 1.0])
        self.look(START + np.asarray(times), body, rng)

    def look(self, gps_time, body, rng):
        n = len(gps_time)
        true = self.true.at(gps_time)
        recorded = self.recorded.at(gps_time)
        name = tuple(f"T{i:02d}" for i in range(1, n + 1))
        surveyed = true.position + true.attitude.apply(body) + SURVEYED * rng.normal(size=(n, 3))
        observed = (
            recorded.position + recorded.attitude.apply(body) + NOISE * rng.normal(size=(n, 3))
        )
        self.control = surveyed_discs(name, surveyed, SURVEYED)
        self.observations = observed_discs(name, gps_time, observed, NOISE)

    def estimate(self, **arguments):
        return estimate_correction(self.recorded, self.matched, **arguments)

    @property
    def matched(self):
        return Matched.by_name(self.observations, self.control)

    def adjustment(self, order=0):
        return position_adjustment(self.recorded, self.matched, Pos(), order, position_prior)

    def remaining(self, estimate):
        "True - corrected position (n, 3) at every epoch, m"
        return self.true.position - estimate.correction.corrected.position

    def spoil(self, number, vector):
        "Move one surveyed point"
        position = self.control.position.copy()
        position[number] += vector
        self.control = replace(self.control, position=position)


EPOCHS = np.arange(0.0, LENGTH + 0.05, 0.1)
CONSTANT = np.tile([0.4, -0.3, 0.2], (len(EPOCHS), 1))


def waves(rng, size=0.05):
    "Sums of sines of 40 to 190 s with random phases: no covariance function made them"
    periods = np.array([41.0, 61.0, 110.0, 190.0])
    phase = rng.uniform(0, 2 * np.pi, (3, 4))
    amplitude = size * rng.normal(size=(3, 4))
    return (amplitude * np.sin(2 * np.pi * EPOCHS[:, None, None] / periods + phase)).sum(axis=2)


def outage(rng, begin=60.0, length=60.0, size=0.7):
    "A drift that an outage lets grow and the smoother bridges, and the sigma(t) that tells of it"
    share = np.clip((EPOCHS - begin) / length, 0, 1)[:, None]
    bridge = np.sin(np.pi * share ** rng.uniform(0.7, 1.5, 3)) ** 2
    sigma = 0.015 + 4 * size * share * (1 - share) + np.zeros((1, 3))
    return size * rng.normal(size=3) * bridge + waves(rng, 0.005), sigma


def filtered_outage(rng, begin=60.0, end=110.0, size=0.5):
    "A drift that grows until GNSS returns, and the sigma(t) that tells of it; else millimetres"
    share = np.clip((EPOCHS - begin) / (end - begin), 0, 1)[:, None] ** 1.5
    share[end <= EPOCHS] = 0.0
    sigma = 0.015 + size * share + np.zeros((1, 3))
    return size * rng.normal(size=3) * share + waves(rng, 0.003), sigma


def even(n):
    return np.linspace(3.0, LENGTH - 3.0, n)


def smooth_case(seed, n=16, sigma=0.1):
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(2.0, LENGTH - 2.0, n))
    return Case(EPOCHS, waves(rng), times, rng, np.full((len(EPOCHS), 3), sigma))


def case_at_a_gap():
    "A drive with a constant error and a gap of 5 s, one target at each of its edges"
    case = Case(EPOCHS, CONSTANT, EPOCHS[[600, 650]], np.random.default_rng(1))
    kept = EPOCHS < 60.05
    kept[650:] = True
    case.recorded, case.true = case.recorded.select(kept), case.true.select(kept)
    return case


def outage_case(seed, n=20):
    rng = np.random.default_rng(seed)
    error, sigma = outage(rng)
    return Case(EPOCHS, error, even(n), rng, sigma)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))
