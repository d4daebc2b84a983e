"""Rates of correct, rejected and wrong matches of targets, over many random surveys.

    python benchmarks/matching_study.py [surveys]
    python benchmarks/matching_study.py canyons [surveys]
    python benchmarks/matching_study.py many [observations]

Each survey has 20 to 60 targets of two kinds and two sizes along one to three passes, 30 % of them
in look-alike pairs 1.5 m apart. The POS drifts by up to 3 m, from one of four causes in turn:
velocity errors that wander in outages, sums of sinusoids, an integrated MEMS, and the real error
series of a MEMS GNSS/INS where it is at hand (MLSCORR_SHARED). Its stated sigmas are 0.5 to 2 times
the drift's size. Of the control 10 % are mis-numbered (exchanged in pairs), 10 % moved by 0.3 to 3
m, and 10 % are hidden; of the observations 20 % are look-alikes without control, half of them near
a target. Nothing is drawn from the covariance functions of the estimate.

In canyons the POS has a bias and a trend of at most 1 to 3 m that its constant sigma of 0.5 m does
not state (also 10 times smaller and larger, and no sigma); look-alikes are 1.5 to 4 m from targets,
surveyed or not, and all control is correct. The last study concerns speed: as many surveyed points
as observations.
"""

import argparse
import os
import sys
import time
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from mlscorr.frames import attitude_from_angles
from mlscorr.io.trajectories import read_pos_error_series
from mlscorr.matching import match
from mlscorr.simulate.pos import given_error, pos_error
from mlscorr.simulate.scenario import PosScenario
from mlscorr.survey import ControlPoints, TargetObservations, Trajectory

ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM
START = 357_700.0  # s of the GPS week
SPEED = 8.0  # m/s
PAIR = 1.5, 1.5  # m between look-alikes, at least and at most
CANYON_PAIR = 1.5, 4.0
CANYON_SIGMAS = 0.5, 0.05, 5.0, None  # m; stated in canyons
WEAK = 3.0  # sigmas of the POS's relative motion below which a moved point can't be seen
SERIES = Path(os.environ.get("MLSCORR_SHARED", "../shared")) / "data/real_pos_error/OB_GINS_TXT.err"
CAUSES = ("outages", "sinusoids", "mems", "real")


@dataclass(frozen=True)
class Made:
    """A simulated survey: the input of match, and the truth of each observation and control point.

    truth (n,) is the row of the target seen, -1 for a look-alike; whole (k,) marks the control
    points whose position and appearance are those of their target, moved (k,) how far others were
    moved (m), 0 for mis-numbered ones.
    """

    observations: TargetObservations
    control: ControlPoints
    trajectory: Trajectory
    error: np.ndarray
    truth: np.ndarray
    whole: np.ndarray
    moved: np.ndarray
    cause: str


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("words", nargs="*", help="canyons or many, and the number of surveys")
    parser.add_argument("-v", action="store_true", help="print each survey")
    arguments = [int(word) for word in parser.parse_args().words if word.isdigit()]
    if "canyons" in sys.argv:
        print_canyons(*arguments)
    elif "many" in sys.argv:
        print("{:.1f} s for {} observations, {} right, {} wrong".format(*many(*arguments)))
    else:
        print_causes(*arguments)


def print_causes(surveys=100):
    """Counts of surveys with blunders by cause of the drift."""
    counts = {}
    started = time.perf_counter()
    for seed in range(surveys):
        made = make(seed, CAUSES[seed % len(CAUSES)])
        counts.setdefault(made.cause, []).append(score(made))
        if "-v" in sys.argv:
            print(seed, made.cause, counts[made.cause][-1])
    seconds = time.perf_counter() - started
    print(f"{'cause':10s}" + "".join(f"{title:>10s}" for title in TITLES) + f"{'share':>9s}")
    everything = [row for rows in counts.values() for row in rows]
    for cause, rows in (*counts.items(), ("all", everything)):
        total = np.sum(rows, axis=0)
        share = total[0] / max(total[:3].sum(), 1)
        print(f"{cause:10s}" + "".join(f"{n:10d}" for n in total) + f"{share:9.2%}")
    print(f"{seconds / surveys:.2f} s a survey")


def print_canyons(surveys=100):
    """Counts of canyons by stated sigma."""
    print(f"{'sigma':10s}" + "".join(f"{title:>10s}" for title in TITLES) + f"{'share':>9s}")
    for sigma in CANYON_SIGMAS:
        rows = [score(make_canyon(seed, sigma)) for seed in range(surveys)]
        if "-v" in sys.argv:
            for seed, row in enumerate(rows):
                print(seed, row) if row[1] + row[2] + row[5] else None
        total = np.sum(rows, axis=0)
        share = total[0] / total[:3].sum()
        print(f"{sigma!s:10s}" + "".join(f"{n:10d}" for n in total) + f"{share:9.2%}", flush=True)


def many(count=100_000):
    """Seconds, observations, and right and wrong matches of a drive past this number of points."""
    observations, control, drive = long_drive(count)
    started = time.perf_counter()
    found = match(observations, control, drive).matched
    seconds = time.perf_counter() - started
    rows = np.searchsorted(observations.gps_time, found.gps_time)
    right = sum(control.name[row] == name for row, name in zip(rows, found.name, strict=True))
    return seconds, count, right, len(found) - right


def long_drive(count):
    """TargetObservations, ControlPoints and Trajectory of a drive past this number of points.

    The i-th observation is the i-th point, 4 m on from the one before.
    """
    rng = np.random.default_rng(0)
    gps_time = START + 0.5 * np.arange(count + 40)
    path = ORIGIN + np.outer(gps_time - START, [0.0, 8.0, 0.0])
    level = attitude_from_angles(0.0, 0.0, np.zeros(len(path)))
    drift = 0.5 * np.sin((gps_time[:count, None] - START) / [40.0, 60.0, 90.0])
    drive = Trajectory(gps_time, path, level, np.full(path.shape, 0.3), np.full(path.shape, 2e-4))
    across = np.column_stack([rng.choice([-6.0, 6.0], count), np.zeros(count), np.ones(count)])
    place = path[:count] + across
    nowhere = np.full((count, 3), np.nan)
    names = tuple(f"T{i}" for i in range(count))
    kinds = ("circle",) * count
    sizes = np.full(count, 0.6)
    control = ControlPoints(names, place, np.full((count, 3), 0.003), kinds, sizes, nowhere)
    noise = rng.normal(0, 0.005, (count, 3))
    variance = np.tile(np.eye(3) * 0.005**2, (count, 1, 1))
    observations = TargetObservations(
        (None,) * count,
        np.ones(count, int),
        gps_time[:count],
        place + drift + noise,
        variance,
        nowhere,
        kinds,
        sizes,
        np.full(count, 100),
    )
    return observations, control, drive


TITLES = ("right", "refused", "wrong", "moved used", "moved", "else used", "else", "no reason")


@cache
def small_set(seeds):
    """Simulated surveys of each cause, for each seed."""
    causes = [cause for cause in CAUSES if cause != "real"]
    return [make(len(causes) * seed + i, cause) for seed in seeds for i, cause in enumerate(causes)]


def figures(seeds=(0, 1, 2, 3)):
    """Counts as in TITLES over a small set of surveys."""
    counts = np.sum([score(made) for made in small_set(seeds)], axis=0)
    return dict(zip(TITLES, counts, strict=True))


def score(made):
    """Counts (8,) as in TITLES: matchable observations right, refused and matched wrong; those of
    moved or mis-numbered points used and all; look-alikes used and all; without a reason."""
    result = match(made.observations, made.control, made.trajectory)
    rows = {t: i for i, t in enumerate(made.observations.gps_time)}
    column = np.full(len(made.truth), -1)
    matched = [rows[t] for t in result.matched.gps_time]
    column[matched] = made.control.rows(result.matched.name)
    on_target = made.truth >= 0
    good = on_target & made.whole[made.truth]
    bad = on_target & ~good
    used = column >= 0
    named = {refusal.name for refusal in result.refusals} | set(result.matched.name)
    silent = sum(name not in named for name in made.control.name)
    silent += sum(not reason for reason in result.reasons)
    return np.array(
        [
            np.sum(good & (column == made.truth)),
            np.sum(good & ~used),
            np.sum(good & used & (column != made.truth)),
            np.sum(bad & used),
            np.sum(bad),
            np.sum(~on_target & used),
            np.sum(~on_target),
            silent,
        ]
    )


def make_canyon(seed, sigma):
    """Simulate a survey in a canyon with this stated sigma (m), or None."""
    return make(seed, "canyon", sigma)


def make(seed, cause, stated=None):
    """Simulate a survey."""
    rng = np.random.default_rng(seed)
    is_canyon = cause == "canyon"
    if cause == "real" and not SERIES.exists():
        cause = "outages"
    local = _places(rng, CANYON_PAIR if is_canyon else PAIR)
    n = len(local)
    kinds, sizes = _appearances(rng, local)
    length = local[:, 0].max() + 40.0
    drives = [_drive(length, number, rng) for number in range(rng.integers(1, 4))]
    recorded, errors = zip(*(_record(drive, cause, rng, stated) for drive in drives), strict=True)
    seen = [_see(local, drive, rng) for drive in drives]
    hidden = rng.random(n) < 0.1
    control, whole, moved = _survey(local, kinds, sizes, rng, 0.0 if is_canyon else 1.0)
    parts = [
        _observe(number, local, kinds, sizes, hidden, drive, one, error, rng)
        for number, (drive, one, error) in enumerate(zip(drives, seen, errors, strict=True), 1)
    ]
    truth = np.concatenate([part[1] for part in parts])
    order = rng.permutation(len(truth))
    return Made(
        _stack([part[0] for part in parts])[order],
        control,
        _join(recorded),
        np.vstack([part[2] for part in parts])[order],
        truth[order],
        whole,
        moved,
        cause,
    )


def _places(rng, pair):
    """Targets (n, 3) along the street: meters ahead, to the right, up; 30 % of them in pairs."""
    n = int(rng.integers(20, 61))
    ahead = 40.0 + np.cumsum(rng.uniform(5.0, 60.0, n))
    places = np.column_stack([ahead, rng.choice([-1, 1], n) * rng.uniform(4, 15, n)])
    places = np.column_stack([places, rng.uniform(0.0, 4.0, n)])
    for i in range(0, n - 1, 7):
        along = rng.normal(size=3) * [1, 1, 0.3]
        places[i + 1] = places[i] + _between(*pair, rng) * along / np.linalg.norm(along)
    return places


def _between(least, most, rng):
    if least == most:
        return least
    return rng.uniform(least, most)


def _appearances(rng, local):
    n = len(local)
    kinds = rng.choice(["circle", "square"], n)
    sizes = rng.choice([0.3, 0.6], n)
    for i in range(0, n - 1, 7):
        kinds[i + 1] = kinds[i]
        sizes[i + 1] = sizes[i]
    return kinds, sizes


def _way(ahead):
    """The winding street: position (n, 3) in the map and heading (n,) at a length in meters."""
    heading = 0.8 * np.sin(ahead / 150.0)
    steps = np.linspace(0.0, max(float(np.max(ahead)), 1.0) + 1.0, 20_000)
    turn = 0.8 * np.sin(steps / 150.0)
    d = steps[1] - steps[0]
    east = np.cumsum(np.sin(turn)) * d
    north = np.cumsum(np.cos(turn)) * d
    place = [np.interp(ahead, steps, east), np.interp(ahead, steps, north), 0.01 * ahead]
    return ORIGIN + np.column_stack(place), heading


def _to_map(local):
    place, heading = _way(local[:, 0])
    right = np.column_stack([np.cos(heading), -np.sin(heading), np.zeros(len(heading))])
    return place + local[:, 1:2] * right + local[:, 2:] * [0, 0, 1]


def _drive(length, number, rng):
    """The true trajectory of a pass; odd ones go back. It stops once for a while."""
    pause = number * (length / SPEED + 120.0)
    elapsed = np.arange(0.0, length / SPEED + 30.0, 0.1)
    stop = rng.uniform(0, length / SPEED)
    slow = rng.uniform(5, 25)
    driven = SPEED * np.where(elapsed < stop, elapsed, np.maximum(elapsed - slow, stop))
    driven = np.clip(driven, 0.0, length)
    ahead = length - driven if number % 2 else driven
    place, heading = _way(ahead)
    attitude = attitude_from_angles(0.0, 0.0, heading + np.pi * (number % 2))
    return Trajectory(START + pause + elapsed, place, attitude)


def _see(local, drive, rng):
    """Sighting time gps_time (n,) of each target: that of the nearest epoch, slightly shifted."""
    place, _ = _way(local[:, 0])
    distance = np.linalg.norm(drive.position[None, ::5] - place[:, None], axis=2)
    time = drive.gps_time[::5][np.argmin(distance, axis=1)]
    time = time + rng.uniform(-0.2, 0.2, len(time))
    return np.clip(time, drive.gps_time[0], drive.gps_time[-1])


def _record(drive, cause, rng, stated=None):
    """Recording of the POS: the trajectory with sigmas, and its position error (n, 3)."""
    n = len(drive)
    if cause == "canyon":
        error = _canyon(drive.gps_time, rng)
        sigma = None if stated is None else np.full((n, 3), stated)
        position = drive.position + error
        return Trajectory(drive.gps_time, position, drive.attitude, sigma), error
    if cause in ("mems", "real"):
        if cause == "real":
            made = given_error(drive, read_pos_error_series(SERIES), rng)
        else:
            span = drive.gps_time[-1] - drive.gps_time[0]
            outages = [(t, 60.0) for t in np.arange(20.0, span - 70.0, 130.0)]
            scenario = PosScenario(grade="mems", processing="filtered", outages=tuple(outages))
            made = pos_error(drive, scenario, rng)
        smaller = min(1.0, 3.0 / np.linalg.norm(made.position, axis=1).max())
        error = smaller * made.position
        sigma = smaller * made.position_sigma * 2.0 ** rng.uniform(-1, 1)
        angles = made.attitude_sigma
    else:
        make_error = _outages if cause == "outages" else _sinusoids
        error, size = make_error(drive.gps_time, rng)
        sigma = np.hypot(0.02, size * 2.0 ** rng.uniform(-1, 1))
        angles = np.full((n, 3), 2e-4)
    error = error + rng.normal(0.0, 0.1, 3)
    recorded = Trajectory(drive.gps_time, drive.position + error, drive.attitude, sigma, angles)
    return recorded, error


def _canyon(gps_time, rng):
    """A bias and a trend, at most 1 to 3 m, in a canyon that begins and ends within 10 s."""
    first, last = np.quantile(gps_time, [rng.uniform(0.0, 0.3), rng.uniform(0.7, 1.0)])
    inside = np.clip((gps_time - first) / 10.0, 0, 1) * np.clip((last - gps_time) / 10.0, 0, 1)
    direction = rng.normal(size=(2, 3)) * [1.0, 1.0, 0.5]
    share = np.clip((gps_time - first) / (last - first), 0.0, 1.0)
    error = inside[:, None] * (direction[0] + np.outer(share, direction[1]))
    error *= rng.uniform(1.0, 3.0) / np.linalg.norm(error, axis=1).max()
    return error + 0.02 * np.sin(gps_time / 7)[:, None]


def _outages(gps_time, rng):
    """Wandering velocity errors in outages of 20 to 60 s, bridged back; up to 3 m."""
    error = np.zeros((len(gps_time), 3))
    size = np.zeros((len(gps_time), 3))
    start = gps_time[0] + rng.uniform(0, 40)
    while start < gps_time[-1]:
        rows = np.flatnonzero((gps_time >= start) & (gps_time < start + rng.uniform(20, 60)))
        if len(rows) > 2:
            share = np.linspace(0, 1, len(rows))
            walk = np.cumsum(np.cumsum(rng.standard_normal((len(rows), 3)), axis=0), axis=0)
            walk -= share[:, None] * walk[-1]
            largest = rng.uniform(0.3, 3.0)
            error[rows] = walk * largest / np.linalg.norm(walk, axis=1).max()
            size[rows] = largest / 2 * np.sin(np.pi * share)[:, None]
        start += rng.uniform(60, 150)
    return error + 0.02 * np.sin(gps_time / 7)[:, None], size


def _sinusoids(gps_time, rng):
    """Sums of sinusoids of 30 to 300 s in each axis; up to 3 m."""
    periods = rng.uniform(30, 300, (5, 3))
    phases = rng.uniform(0, 2 * np.pi, (5, 3))
    argument = 2 * np.pi * gps_time[:, None, None] / periods + phases
    error = (rng.uniform(0.2, 1, (5, 3)) * np.sin(argument)).sum(axis=1)
    error *= rng.uniform(0.5, 3.0) / np.linalg.norm(error, axis=1).max()
    return error, np.full(error.shape, np.sqrt(np.mean(error**2)))


def _survey(local, kinds, sizes, rng, blunders=1.0):
    """ControlPoints, a mask of the correct ones, and the displacements of the others."""
    n = len(local)
    position = _to_map(local)
    order = rng.permutation(n)
    pairs = order[: 2 * round(blunders * 0.05 * n)].reshape(-1, 2)
    moved_rows = order[2 * len(pairs) :][: round(blunders * 0.1 * n)]
    whole = np.ones(n, bool)
    moved = np.zeros(n)
    surveyed = position + rng.normal(0, 0.003, (n, 3))
    # The names of the two points are exchanged, with the appearance that belongs to the name: if
    # both look the same, the exchange is neither visible nor relevant.
    kinds = kinds.copy()
    sizes = sizes.copy()
    for a, b in pairs:
        whole[[a, b]] = kinds[a] == kinds[b] and sizes[a] == sizes[b]
        kinds[[a, b]] = kinds[[b, a]]
        sizes[[a, b]] = sizes[[b, a]]
    away = rng.standard_normal((len(moved_rows), 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    moved[moved_rows] = rng.uniform(0.3, 3.0, len(moved_rows))
    surveyed[moved_rows] += away * moved[moved_rows, None]
    whole[moved_rows] = False
    names = tuple(f"T{i + 1:02d}" for i in range(n))
    nowhere = np.full((n, 3), np.nan)
    control = ControlPoints(names, surveyed, np.full((n, 3), 0.003), tuple(kinds), sizes, nowhere)
    return control, whole, moved


def _observe(number, local, kinds, sizes, hidden, drive, seen, error, rng):
    """TargetObservations of a pass, look-alikes included, their truth and POS errors."""
    rows = np.flatnonzero(~hidden & (rng.random(len(local)) > 0.03))
    extra = round(0.2 * len(rows))
    near = rng.random(extra) < 0.5
    beside = local[rng.choice(len(local), extra)] + rng.normal(0, 1.5, (extra, 3)) * [1, 1, 0.5]
    anywhere = np.column_stack(
        [
            rng.uniform(0, local[:, 0].max(), extra),
            rng.choice([-1, 1], extra) * rng.uniform(4, 15, extra),
            rng.uniform(0, 4, extra),
        ]
    )
    other = np.where(near[:, None], beside, anywhere)
    like = rng.integers(0, len(local), extra)
    times = np.concatenate([seen[rows], _see(other, drive, rng)])
    at = np.column_stack([np.interp(times, drive.gps_time, e) for e in error.T])
    n = len(times)
    sigma = rng.uniform(0.002, 0.01, n)
    place = _to_map(np.vstack([local[rows], other])) + at + rng.normal(size=(n, 3)) * sigma[:, None]
    return (
        TargetObservations(
            (None,) * n,
            np.full(n, number),
            times,
            place,
            np.eye(3) * (sigma**2)[:, None, None],
            np.tile([1.0, 0.0, 0.0], (n, 1)),
            tuple(kinds[np.append(rows, like)]),
            sizes[np.append(rows, like)],
            np.full(n, 100),
        ),
        np.append(rows, np.full(extra, -1)),
        at,
    )


def _stack(parts):
    first = parts[0]
    values = {}
    for name in first.__dataclass_fields__:
        several = [getattr(part, name) for part in parts]
        tuples = isinstance(several[0], tuple)
        values[name] = sum(several, ()) if tuples else np.concatenate(several)
    return replace(first, **values)


def _join(drives):
    rotation = drives[0].attitude.concatenate([drive.attitude for drive in drives])
    columns = ("gps_time", "position", "position_sigma", "attitude_sigma")
    columns = [name for name in columns if getattr(drives[0], name) is not None]
    joined = {name: np.concatenate([getattr(drive, name) for drive in drives]) for name in columns}
    return Trajectory(attitude=rotation, **joined)


if __name__ == "__main__":
    main()
