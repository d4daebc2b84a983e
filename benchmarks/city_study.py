"""Cost of planning, joining and solving many drives of a city, at feature level.

    python benchmarks/city_study.py [DRIVES ...] [--tiles TILES] [--places PLACES] [--limit LIMIT]
                                    [--seed SEED] [--workers WORKERS]

Vehicles wander a grid of streets, 200 s each, at 10 Hz. Their observations of walls, road and
poles, and the control points of one drive in ten, are generated without a point cloud. Each size
runs in a separate process, which reports its memory; seconds are processor time except for wall
times.
"""

import argparse
import itertools
import resource
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from mlscorr.frames import attitude_from_angles
from mlscorr.io.store import TaskStore
from mlscorr.io.tables.control import NO_POINTS
from mlscorr.matching import Matches
from mlscorr.pipeline.finding import MatchedTargets
from mlscorr.pipeline.project.city import in_turn, project_drives
from mlscorr.pipeline.project.corrected import motion_of
from mlscorr.pipeline.project.engine import engine
from mlscorr.pipeline.project.joint import FoundDrive
from mlscorr.pipeline.project.running import Run
from mlscorr.pipeline.project.settings import SETTINGS
from mlscorr.pipeline.project.stages import area_tasks
from mlscorr.survey import (
    ControlPoints,
    Matched,
    Mounting,
    Pos,
    Scanner,
    Survey,
    TargetObservations,
    TieFeatures,
    Trajectory,
)
from mlscorr.targets import NO_POINTS as NO_CLOUD
from mlscorr.targets import Candidates

BLOCK = 100.0  # m between crossings
SPEED = 10.0  # m/s
DURATION = 200.0  # s of a drive
RATE = 10.0  # epochs a second
TURN = 1.5  # s, one sigma of how a turn is smoothed: a jerk of 1.5 m/s^3, no step of the POS
ORIGIN = np.array([532_000.0, 3_374_000.0, 40.0])
START = 1_357_700_000.0  # s, GPS
SIGMA = 0.5  # m, that the POS states
NOISE = 0.005  # m, of a plane's place
CONTROL_SHARE = 0.1  # of the drives


class City:
    "Streets, drives along random routes through them, and the observations of these"

    def __init__(self, drives, tiles, places, seed):
        self.rng = np.random.default_rng(seed)
        self.edge = max(int(np.sqrt(drives * DURATION * SPEED / BLOCK / 6)), 3)  # seen 3 times
        self.tiles = tiles
        self.places = places
        self.blocks = {}
        self.errors = {}
        self.drives = [self.drive(number) for number in range(drives)]

    def crossings(self):
        "Random route (k, 2) over the grid that never turns round at once"
        place = self.rng.integers(0, self.edge, 2)
        ahead = None
        way = [place]
        while len(way) <= DURATION * SPEED / BLOCK:
            steps = [np.array(step) for step in ((1, 0), (-1, 0), (0, 1), (0, -1))]
            steps = [s for s in steps if ahead is None or not np.array_equal(s, -ahead)]
            steps = [s for s in steps if ((place + s >= 0) & (place + s < self.edge)).all()]
            ahead = steps[self.rng.integers(len(steps))]
            place = place + ahead
            way.append(place)
        return np.array(way)

    def block(self, first, second):
        "Places, directions and kinds along the block between two crossings, always the same"
        key = tuple(map(tuple, sorted((first.tolist(), second.tolist()))))
        if key not in self.blocks:
            low, high = np.array(key, float) * BLOCK
            along = (high - low) / BLOCK
            across = np.array([-along[1], along[0]])
            rng = np.random.default_rng([*key[0], *key[1]])
            n = self.places
            at = rng.uniform(0, BLOCK, n)
            part = rng.choice(4, n, p=[0.35, 0.3, 0.3, 0.05])
            side = np.select([part == 1, part == 2], [10.0, -10.0], rng.uniform(-6, 6, n))
            plan = low + at[:, None] * along + side[:, None] * across
            height = np.where(part == 0, 0.0, rng.uniform(1, 8, n))
            lean = rng.normal(scale=0.03, size=(n, 3))
            lean[:, :2] += np.where(rng.uniform(size=n) < 0.2, 0.5, 0.0)[:, None] * along
            facing = np.column_stack([*np.outer(across, -np.sign(side)), np.zeros(n)])
            upright = (part == 0) | (part == 3)
            direction = np.where(upright[:, None], [0.0, 0.0, 1.0], facing) + lean
            direction[part == 3] = [0.0, 0.0, 1.0]
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
            kind = np.where(part == 3, "pole", "plane")
            self.blocks[key] = ORIGIN + np.column_stack([plan, height]), direction, kind
        return self.blocks[key]

    def drive(self, number):
        "FoundDrive along a route"
        rng = self.rng
        way = self.crossings()
        start = START + 86_400.0 * (number // 50) + 400.0 * (number % 50)
        times = start + np.arange(0.0, DURATION + 1e-9, 1 / RATE)
        passed = start + np.arange(len(way)) * BLOCK / SPEED
        plan = np.column_stack([np.interp(times, passed, BLOCK * xy) for xy in way.T])
        plan = gaussian_filter1d(plan, TURN * RATE, axis=0, mode="nearest")
        knots = np.arange(start - 30.0, start + DURATION + 60.0, 30.0)
        error = CubicSpline(knots, rng.normal(scale=SIGMA, size=(len(knots), 3)))
        recorded = ORIGIN + np.column_stack([plan, np.full(len(plan), 2.5)]) + error(times)
        level = attitude_from_angles(
            np.zeros(len(times)), np.zeros(len(times)), np.zeros(len(times))
        )
        sigmas = np.full((len(times), 3), SIGMA), np.full((len(times), 3), 1e-4)
        trajectory = Trajectory(times, recorded, level, *sigmas)
        survey = Survey(
            name=f"drive-{number}",
            path=Path("project.toml"),
            crs=None,
            clouds=(),
            trajectory=trajectory,
            mounting=Mounting(np.zeros(3), Rotation.identity()),
            control=NO_POINTS,
            check=NO_POINTS,
            scanner=Scanner(),
            pos=Pos(),
        )
        self.errors[survey.name] = error
        features = self.seen(way, passed, error)
        passes = {(tile, 0): tile + 1 for tile in range(self.tiles)}
        candidates = Candidates(NO_CLOUD, np.empty(0, int), NO_CLOUD, passes, {})
        control = self.control(way, passed, error, number)
        nothing = TargetObservations.concatenate([control.observations])[[]]
        matches = Matches(nothing, nothing, (), np.empty(0), ())
        finding = MatchedTargets(survey, matches, candidates, {})
        return FoundDrive(survey, finding, features, control, control[[]])

    def left(self, name, correction):
        "Residual error (n, 3) of a drive after a correction. Units: m"
        recorded = correction.recorded
        corrected = correction.corrected
        added = corrected.position - recorded.position
        return added + self.errors[name](recorded.gps_time)

    def seen(self, way, passed, error):
        "TieFeatures of a drive"
        parts = [self.block(*ends) for ends in itertools.pairwise(way)]
        place, direction, kind = (np.concatenate(each) for each in zip(*parts, strict=True))
        number = np.repeat(np.arange(len(parts)), self.places)
        along = (way[1:] - way[:-1])[number]
        ahead = np.einsum("ni,ni->n", place[:, :2] - ORIGIN[:2] - BLOCK * way[number], along)
        times = passed[number] + ahead / SPEED
        n = len(place)
        centre = place + error(times) + self.rng.normal(scale=NOISE, size=(n, 3))
        tile = np.minimum((times - passed[0]) / DURATION * self.tiles, self.tiles - 1).astype(int)
        features = TieFeatures(
            tile + 1,
            np.zeros(n, int),
            kind,
            times,
            centre,
            direction,
            np.full(n, NOISE**2),
            np.full(n, 1e-5),
            np.full(n, 0.3),
            np.full(n, 100),
            np.zeros((n, 3)),
        )
        return features[np.argsort(times)]

    def control(self, way, passed, error, number):
        "Matched control of every tenth drive: a point each 20 s"
        count = 10 if number % round(1 / CONTROL_SHARE) == 0 else 0
        at = np.linspace(passed[0] + 5.0, passed[-1] - 5.0, count)
        plan = np.column_stack([np.interp(at, passed, BLOCK * xy) for xy in way.T])
        true = ORIGIN + np.column_stack([plan, np.full(count, 2.0)]) + [0.0, 5.0, 0.0]
        name = tuple(f"{number}-{k}" for k in range(count))
        kind = ("circle",) * count
        size = 0.2
        normal = np.tile([0.0, -1.0, 0.0], (count, 1))
        seen = true + error(at) + self.rng.normal(scale=NOISE, size=(count, 3))
        covariance = np.tile(NOISE**2 * np.eye(3), (count, 1, 1))
        observed = TargetObservations(
            name,
            np.full(count, self.tiles),
            at,
            seen,
            covariance,
            normal,
            kind,
            np.full(count, size),
            np.full(count, 200),
        )
        sigma = np.full((count, 3), NOISE)
        points = ControlPoints(name, true, sigma, kind, np.full(count, size), normal)
        return Matched(observed, points)


def run(given):
    "Print the cost of a city with this number of drives"
    number = given.drives[0]
    begin = processor_time()
    city = City(number, given.tiles, given.places, given.seed)
    made = processor_time() - begin
    clock = perf_counter()
    positions = []
    left = []
    within = []
    states = []
    with threadpool_limits(1), areas_at_work(given.workers) as work:
        drives = project_drives(city.drives, 1, ORIGIN, True, work, given.limit)
        for corrected, state in drives:
            motion_of(corrected, False)
            states.append(state.state)
            correction = corrected.estimate.correction
            remains = city.left(state.name, correction)
            within.append(np.abs(remains) < 2 * correction.corrected.position_sigma)
            rows = slice(None, None, round(RATE))
            positions.append(correction.recorded.position[rows])
            left.append(remains[rows])
    clock = perf_counter() - clock
    joined = processor_time() - begin - made
    features = sum(len(drive.features) for drive in city.drives)
    held = sum(state in ("controlled", "tied") for state in states)
    size = [np.sqrt((part**2).sum(axis=1).mean()) for part in left]
    print(
        number,
        features,
        made,
        joined,
        clock,
        memory(),
        held,
        *np.percentile(size, [50, 95]),
        100 * np.mean(within),
        _apart(positions, left),
    )


@contextmanager
def areas_at_work(workers):
    "Estimators of areas: this process, or the given number of worker processes, as in a project"
    if workers == 1:
        yield in_turn
        return
    with TemporaryDirectory() as folder, engine(workers, None) as processes:
        store = TaskStore(Path(folder))
        run = Run(store, processes, lambda outcome: None)
        yield lambda areas: list(run.results(area_tasks(store, "city", areas)).values())
        if run.faults:
            raise SystemExit(str(run.faults[0].fault))


def _apart(places, left):
    "RMS of the difference of the residual errors of two drives at one place. Units: m"
    drive = np.repeat(np.arange(len(places)), list(map(len, places)))
    place = np.concatenate(places)[:, :2]
    left = np.concatenate(left)
    first, second = cKDTree(place).query_pairs(SPEED / 2, output_type="ndarray").T
    other = drive[first] != drive[second]
    return np.sqrt(((left[first[other]] - left[second[other]]) ** 2).sum(axis=1).mean())


def used():
    "Resources used by this process and its workers that have ended"
    return [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]


def processor_time():
    "Processor time of all processes in s"
    return sum(part.ru_utime + part.ru_stime for part in used())


def memory():
    "Peak memory of the largest process so far in MB"
    return max(part.ru_maxrss for part in used()) * 1024 / 1e6


def main():
    """Run each size in a separate process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", type=int, nargs="*", default=[1, 2])
    parser.add_argument("--tiles", type=int, default=4, help="Of each drive.")
    parser.add_argument("--places", type=int, default=300, help="Planes and poles of a block.")
    parser.add_argument("--limit", type=int, default=SETTINGS.area_seconds, help="Of an area, s.")
    parser.add_argument("--seed", type=int, default=0, help="Of the city and its drives.")
    parser.add_argument("--workers", type=int, default=1, help="Processes that estimate areas.")
    parser.add_argument("--run", action="store_true")
    given = parser.parse_args()
    if given.run:
        run(given)
        return
    heads = (
        "drives",
        "planes, poles",
        "making, s",
        "joining, s",
        "by clock, s",
        "MB",
        "held",
        "left of 0.87 m",
        "95 %",
        "within 2 sigma, %",
        "apart, m",
    )
    title = f"{given.tiles} tiles a drive, {given.places} planes and poles a block of {BLOCK:.0f} m"
    table = Table(*heads, title=f"{title}; what is left: 3D RMS of a drive")
    for number in given.drives:
        command = [sys.executable, __file__, str(number), "--tiles", str(given.tiles)]
        command += ["--places", str(given.places), "--limit", str(given.limit)]
        command += ["--seed", str(given.seed), "--workers", str(given.workers), "--run"]
        words = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
        table.add_row(*(f"{float(word):.4g}" for word in words))
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
