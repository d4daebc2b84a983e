"""A correction changes fast only where the recorded path jumps, and then by that."""

import numpy as np
import pytest

from mlscorr.estimate import estimate_correction, find_jumps
from mlscorr.frames import attitude_from_angles
from mlscorr.simulate import DEMO, simulate
from mlscorr.survey import ControlPoints, Matched, Pos, TargetObservations, Trajectory

# s, m
START = 345_600.0
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])
TIME = np.arange(0.0, 120.0, 0.02)  # s
LIMIT = 0.2  # m/s
SPREAD = 0.1  # s; resampling spreads a return of GNSS over some epochs


def slow(rng, size):
    "A slow error (n, 3) of about a size: two waves an axis"
    phase = rng.uniform(0.0, 2 * np.pi, (2, 3))
    waves = [
        np.sin(2 * np.pi * TIME[:, None] / p + q) for p, q in zip((37.0, 83.0), phase, strict=True)
    ]
    return size * (waves[0] + waves[1])


def outage(begin, end):
    "Share (n,) of a drift that grows as t^1.5 and is back at once"
    share = np.clip((TIME - begin) / (end - begin), 0.0, 1.0) ** 1.5
    return share * np.interp(TIME, [end, end + SPREAD], [1.0, 0.0])


def filtered(rng):
    "Two outages, the second too small for a step that shows by itself; sigma converges for 2 s"
    error = slow(rng, 0.005)
    sigma = np.full((len(TIME), 3), 0.012)
    for begin, end, size in ((20.0, 40.0, 0.5), (70.0, 80.0, 0.05)):
        error += outage(begin, end)[:, None] * size * rng.choice([-1.0, 1.0], 3)
        after = np.where(end + SPREAD < TIME, np.exp(-(TIME - end) / 0.7), 0.0)
        sigma += (outage(begin, end) * size + 0.02 * after)[:, None]
    teeth = 0.001 * (1.0 - TIME % 1.0)  # sigma falls a little by each GNSS epoch
    return error, sigma + teeth[:, None]


def smoothed(rng):
    "A drift of 0.2 m that is tied at both ends of 40 s, with a hump of sigma"
    share = np.clip((TIME - 40.0) / 40.0, 0.0, 1.0)
    hump = (4.0 * share * (1.0 - share)) ** 1.5
    error = slow(rng, 0.005) + 0.2 * hump[:, None] * rng.normal(size=3)
    return error, np.tile(0.012 + 0.2 * hump[:, None], 3)


def unfixed(rng):
    "GNSS that isn't fixed from 50 to 80 s, beside by 0.4 m"
    floated = np.interp(TIME, [50.0, 50.0 + SPREAD, 80.0, 80.0 + SPREAD], [0.0, 1.0, 1.0, 0.0])
    error = slow(rng, 0.005) + floated[:, None] * (slow(rng, 0.05) + 0.4)
    return error, np.where(floated > 0, 0.4, 0.015)[:, None] * [1.0, 1.0, 1.5]


def quiet(rng):
    "Sigma that falls at once from 0.3 m where the path doesn't step"
    sigma = np.where((TIME > 50.0) & (TIME < 70.0), 0.3, 0.015)
    return slow(rng, 0.01), np.repeat(sigma[:, None], 3, axis=1)


def corrected(error, sigma, rng, pos=None):
    "Correction of a drive of 8 m/s"
    way = CORNER + np.outer(TIME, [0.0, 8.0, 0.0])
    attitude = attitude_from_angles(np.zeros(len(TIME)), 0.0, 0.0)
    return controlled(Trajectory(START + TIME, way - error, attitude, sigma), error, rng, pos)


def controlled(recorded, error, rng, pos=None):
    "Correction by 13 targets along a drive, to 3 mm"
    n = 13
    ends = recorded.gps_time[[0, -1]]
    times = np.linspace(ends[0] + 1.0, ends[1] - 1.0, n)
    name = tuple(f"T{i:02d}" for i in range(n))
    kind = ("circle",) * n
    size = np.full(n, 0.6)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    centre = recorded.at(times).position + np.array([8.0, 0.0, -1.0])
    true = np.column_stack([np.interp(times, recorded.gps_time, e) for e in error.T])
    control = ControlPoints(
        name,
        centre + true + 0.003 * rng.normal(size=(n, 3)),
        np.full((n, 3), 0.003),
        kind,
        size,
        up,
    )
    noise = np.tile(0.003**2 * np.eye(3), (n, 1, 1))
    seen = TargetObservations(
        name, np.ones(n, int), times, centre, noise, up, kind, size, np.full(n, 300)
    )
    return estimate_correction(recorded, Matched(seen, control), pos).correction


def rate_and_jumps(correction):
    "Largest rate (m/s) of corrected - recorded outside jumps, and the jumps"
    time = correction.recorded.gps_time
    moved = correction.corrected.position - correction.recorded.position
    rate = np.linalg.norm(np.diff(moved, axis=0), axis=1) / np.diff(time)
    jumps = find_jumps(correction)
    for jump in jumps:
        rate[(time[:-1] >= jump.start - 1e-6) & (time[1:] <= jump.end + 1e-6)] = 0.0
    return rate.max(), jumps


@pytest.mark.parametrize(
    ("made", "times"),
    [(filtered, (40.05, 80.05)), (smoothed, ()), (unfixed, (50.05, 80.05)), (quiet, ())],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_correction_changes_at_once_at_steps_of_the_path_alone(made, times, seed):
    "Elsewhere by less than 0.2 m/s; at steps by the step of the path, to 2 cm"
    rng = np.random.default_rng(seed)
    rate, jumps = rate_and_jumps(corrected(*made(rng), rng))
    assert rate < LIMIT
    assert [jump.time - START for jump in jumps] == pytest.approx(times, abs=0.15)
    for jump in jumps:
        assert np.add(jump.size, jump.step) == pytest.approx(0.0, abs=0.02)  # m


@pytest.mark.parametrize("seed", [0, 1])
def test_the_demo_is_torn_nowhere(seed):
    "Its two returns of GNSS are two jumps, of which one is below 10 cm; elsewhere below 0.2 m/s"
    simulated = simulate(DEMO, np.random.default_rng(seed))
    (true,), (recorded,) = simulated.true_passes, simulated.passes
    error = true.position - recorded.position
    rate, jumps = rate_and_jumps(controlled(recorded, error, np.random.default_rng(seed)))
    assert rate < LIMIT
    assert len(jumps) == 2
    for jump in jumps:
        moved = error[np.searchsorted(true.gps_time, [jump.start - 1e-6, jump.end - 1e-6])]
        assert jump.size == pytest.approx(moved[1] - moved[0], abs=0.025)  # m


def test_jumps_of_a_report_have_time_and_size():
    "Of a return of GNSS at 40 s: from, to, and how far corrected - recorded moves, E, N, H"
    rng = np.random.default_rng(2)
    error, sigma = filtered(rng)
    (row, *_) = [jump.document() for jump in find_jumps(corrected(error, sigma, rng))]
    assert set(row) == {"time", "from", "to", "size", "step"}
    assert row["from"] < START + 40.1 and row["to"] > START + 40.0
    rows = np.searchsorted(START + TIME, [row["from"], row["to"]])
    assert row["size"] == pytest.approx(np.diff(error[rows], axis=0)[0], abs=0.03)  # m


def test_a_path_without_sigma_jumps_where_it_steps():
    "No sigma(t): one jump, and slow changes elsewhere"
    rng = np.random.default_rng(3)
    error, _ = filtered(rng)
    rate, jumps = rate_and_jumps(corrected(error, None, rng, Pos(position_sigma=0.5)))
    assert rate < LIMIT and len(jumps) == 1
