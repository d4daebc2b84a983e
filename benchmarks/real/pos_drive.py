"""The real drive with its real error, targets along it, and simulators' models of its POS."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from page import SHARED

from mlscorr.frames import georeference
from mlscorr.gap.residuals.pairing import target_rows
from mlscorr.io.trajectories import read_pos_error_series, read_poses
from mlscorr.simulate import Scenario
from mlscorr.simulate.drive import drive
from mlscorr.simulate.pos import PosError, pos_error, record
from mlscorr.simulate.recording import true_mounting
from mlscorr.simulate.scenario import PosScenario, ScannerScenario
from mlscorr.survey import (
    ControlPoints,
    PointCloud,
    Pos,
    Survey,
    TargetObservations,
    Trajectory,
)
from mlscorr.targets import Candidates

DATA = SHARED / "real_pos_error"
FILES = ("GNSS_RTK.pos", "OB_GINS_TXT.err")
# s: GNSS was withheld, according to the notes of the data
FIRST = 357_900.0
PERIOD = 150.0
OUTAGE = 60.0
LEAD = 45.0  # s with GNSS before each outage; as much follows it
# s and m: smallest distances between targets
EVERY = 5.0
MOVED = 3.0
# m, one sigma: total station; centers as found by extraction
SURVEY = 0.003
EXTRACTION = 0.004
BELIEF = {"grade": "mems", "odometer": True, "processing": "filtered"}  # a car, in real time
CHOICE = [
    {"grade": grade, "odometer": odometer, "processing": processing}
    for grade in ("mems", "tactical")
    for odometer in (True, False)
    for processing in ("filtered", "smoothed")
]
DRAWS = 3  # simulated drives of one setting, whose stated sigmas are averaged
MOUNTING = true_mounting(ScannerScenario())


@dataclass(frozen=True)
class Drive:
    """The real drive with its real error, and targets along it.

    true, recorded: Trajectory over the series; error: PosError; lost (n,) bool: withheld GNSS; time
    (k,), beam (k, 3), centre (k, 3): time of each sighting, position in the scanner's frame, and
    position on the map.
    """

    true: Trajectory
    error: PosError
    recorded: Trajectory
    outages: tuple
    time: np.ndarray
    beam: np.ndarray
    centre: np.ndarray

    def lost(self, gps_time):
        """Mask (n,) of the times at which GNSS was withheld."""
        return np.any([(gps_time >= s) & (gps_time < s + d) for s, d in self.outages], axis=0)


def real_drive(rng):
    """The real drive at 10 Hz with its real error, and simulated targets along it."""
    path = DATA / FILES[0]
    scenario = Scenario(
        start_time=float(read_poses(path).gps_time[0]), drive={"file": path, "pose_rate": 10.0}
    )
    true = drive(scenario, rng)[2][0]
    series = read_pos_error_series(DATA / FILES[1])
    inside = (true.gps_time >= series.gps_time[0]) & (true.gps_time <= series.gps_time[-1])
    true = Trajectory(true.gps_time[inside], true.position[inside], true.attitude[inside])

    def at(values):
        return np.column_stack([np.interp(true.gps_time, series.gps_time, v) for v in values.T])

    error = PosError(at(series.position), at(series.attitude), None, None)
    starts = np.arange(FIRST, true.gps_time[-1] - OUTAGE, PERIOD)
    time = _times(true)
    side = rng.choice([-1.0, 1.0], len(time))
    away = rng.uniform(4.0, 12.0, len(time))
    body = np.column_stack([side * away, 0 * away, rng.uniform(-1.8, 3.0, len(time))])
    beam = MOUNTING.boresight.inv().apply(body) * [1.0, 1.0, 0.0]  # in the plane of scan
    return Drive(
        true,
        error,
        record(true, error),
        tuple((float(s), OUTAGE) for s in starts),
        time,
        beam,
        georeference(true, MOUNTING, beam, time),
    )


def _times(true):
    """Times of targets: every 5 s, provided that the vehicle has moved on."""
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(true.position, axis=0), axis=1)))
    times = []
    last = -np.inf
    for t in np.arange(true.gps_time[0] + 1.0, true.gps_time[-1] - 1.0, EVERY):
        here = np.interp(t, true.gps_time, way)
        if here - last >= MOVED:
            times.append(t)
            last = here
    return np.array(times)


def simulate_pos(one, settings, seed, outages=()):
    """PosError of the simulator on the real drive."""
    spans = tuple((start - one.true.gps_time[0], length) for start, length in outages)
    return pos_error(one.true, PosScenario(**settings, outages=spans), np.random.default_rng(seed))


def belief(one, seed, draws=DRAWS):
    """Pos as stated by survey.toml: the sigmas of the simulated POS while it has GNSS."""
    errors = [simulate_pos(one, BELIEF, [seed, k]) for k in range(draws)]
    position = np.sqrt(np.mean([e.position_sigma**2 for e in errors]))
    attitude = np.sqrt(np.mean([e.attitude_sigma**2 for e in errors], axis=(0, 1)))
    return Pos(round(float(position), 4), attitude)


def outage_models(one, seed, choice=CHOICE, draws=DRAWS):
    """Stated sigmas (n, 3), (n, 3) of the simulated POS with the outages, for each choice."""
    found = []
    for settings in choice:
        errors = [simulate_pos(one, settings, [seed, k], one.outages) for k in range(draws)]
        sigmas = [[e.position_sigma, e.attitude_sigma] for e in errors]
        found.append(np.sqrt(np.mean(np.square(sigmas), axis=0)))
    return found


def spans(one, windows):
    """Windows of one period: around each outage, and before the first one."""
    cycles = [(start - LEAD, start - LEAD + PERIOD) for start, _ in one.outages]
    cycles = [span for span in cycles if span[1] <= one.true.gps_time[-1]][:windows]
    begins = np.arange(one.true.gps_time[0], one.outages[0][0] - PERIOD, PERIOD - 20.0)
    return cycles, [(float(b), float(b + PERIOD)) for b in begins]


def window_rows(one, span, recorded, believed, rng):
    """Rows of the targets that are observed in a window, and the Survey that recorded them."""
    inside = (one.true.gps_time >= span[0]) & (one.true.gps_time <= span[1])
    seen = (one.time >= span[0] + 0.5) & (one.time <= span[1] - 0.5)
    n = int(seen.sum())
    names = tuple(f"T{i + 1:02d}" for i in range(n))
    surveyed = one.centre[seen] + SURVEY * rng.standard_normal((n, 3))
    observed = georeference(recorded, MOUNTING, one.beam[seen], one.time[seen])
    observed = observed + EXTRACTION * rng.standard_normal((n, 3))
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    size = np.full(n, 0.6)
    kind = ("circle",) * n
    control = ControlPoints(names, surveyed, np.full((n, 3), SURVEY), kind, size, up)
    none = ControlPoints((), np.zeros((0, 3)), np.zeros((0, 3)), (), np.zeros(0), np.zeros((0, 3)))
    part = Trajectory(
        *(v[inside] for v in (recorded.gps_time, recorded.position, recorded.attitude))
    )
    survey = Survey(
        "real drive", Path("real"), None, (), part, MOUNTING, control, none, pos=believed
    )
    matched = TargetObservations(
        names,
        np.ones(n, int),
        one.time[seen],
        observed,
        np.tile(EXTRACTION**2 * np.eye(3), (n, 1, 1)),
        up,
        kind,
        size,
        np.full(n, 300),
    )
    empty = PointCloud(np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return target_rows(survey, matched, Candidates(empty, np.zeros(0, int), empty, {})), survey


def with_sigmas(one, survey, sigmas):
    """The survey with sigmas of a POS that may lose GNSS."""
    rows = np.searchsorted(one.true.gps_time, survey.trajectory.gps_time)
    position, attitude = (sigma[rows] for sigma in sigmas)
    changed = replace(survey.trajectory, position_sigma=position, attitude_sigma=attitude)
    return replace(survey, trajectory=changed)
