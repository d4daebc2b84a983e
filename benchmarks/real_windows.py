"""The collocation on real drift: ideal targets in windows of a real series of POS errors."""

import warnings
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from mlscorr.estimate import estimate_correction, position_adjustment, position_prior
from mlscorr.estimate._prediction import predict_under
from mlscorr.frames import attitude_from_angles
from mlscorr.io.trajectories import read_pos_error_series
from mlscorr.pos import SignalParameters
from mlscorr.survey import ControlPoints, Matched, Pos, TargetObservations, Trajectory

# s: length of the windows; start of that of a shared survey
WINDOW = 248.0
USED = 357_881.0
# s: GNSS was withheld 60 s in every 150 s
FROM = 357_900.0
EVERY = 150.0
LOST = 60.0


def interval(values, statistic=np.median):
    """Statistic of values (n,) over surveys with its 95 % bootstrap interval, as text."""
    values = np.asarray(values, dtype=float)
    drawn = np.random.default_rng(0).integers(len(values), size=(1000, len(values)))
    low, high = np.percentile([statistic(values[rows]) for rows in drawn], [2.5, 97.5])
    return f"{statistic(values):.3f} [{low:.3f}, {high:.3f}]"


def stated_sigma(gps_time):
    """Stated sigmas (n, 3; m) of such a POS: quadratic growth with the time without GNSS."""
    lost = (gps_time - FROM) % EVERY
    lost = np.where((gps_time >= FROM) & (lost < LOST), lost, 0.0)
    return np.outer(lost**2, [3.33e-4, 3.33e-4, 1.92e-4]) + np.array([0.015, 0.015, 0.03])


def cases(path):
    """Name, recorded trajectory, matched control and error (n, 3) of each window of a real series.

    Windows that overlap the shared survey's by more than half are skipped.
    """
    series = read_pos_error_series(path)
    sigma = stated_sigma(series.gps_time)
    starts = np.arange(series.gps_time[0], series.gps_time[-1] - WINDOW, WINDOW / 4)
    for seed, first in enumerate(starts):
        if abs(first - USED) >= WINDOW / 2:
            part = (series.gps_time >= first) & (series.gps_time <= first + WINDOW)
            made = window(series.gps_time[part], -series.position[part], sigma[part], seed)
            yield f"{first:.0f} s", *made


def windows(path):
    """Print residual errors on real drift, with its sigma(t) stated and without."""
    for title, hidden in (("sigma(t) stated", False), ("no sigma stated", True)):
        rows = []
        within = []
        for _, stated, matched, error in cases(path):
            if hidden:
                trajectory = replace(stated, position_sigma=None)
            else:
                trajectory = stated
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                pos = Pos(position_sigma=0.5) if hidden else None
                estimate = estimate_correction(trajectory, matched, pos)
            corrected = estimate.correction.corrected
            remaining = error - (corrected.position - trajectory.position)
            shares = np.abs(remaining / corrected.position_sigma)
            within.append([np.mean(shares < k) for k in (1, 1.96)])
            fits = [
                np.polynomial.Legendre.fit(matched.gps_time, m, 5) for m in matched.misclosure.T
            ]
            fitted = error - np.column_stack([fit(trajectory.gps_time) for fit in fits])
            stationary = error - _stationary(trajectory, matched)
            left = (error, fitted, stationary, remaining)
            rows.append([np.sqrt(np.mean(v**2, axis=0)) for v in left])
        _print_windows(title, np.array(rows), np.mean(within, axis=0))


def _print_windows(title, rows, shares):
    total = np.linalg.norm(rows, axis=2)
    print(
        f"{title}: {len(rows)} windows of {WINDOW:.0f} s. Medians   E      N      H      3-D  worst"
    )
    for i, name in enumerate(("raw", "LS, order 5", "stationary exponential", "mlscorr")):
        medians = [*np.median(rows[:, i], axis=0), np.median(total[:, i]), total[:, i].max()]
        print(f"{name:42s}", *(f"{value:6.3f}" for value in medians))
    for i, name in ((1, "LS, order 5"), (2, "stationary exponential")):
        medians = np.median(total[:, i]) / np.median(total[:, 3])
        print(
            f"{name}: {medians:.2f} times by medians, window by window "
            f"{interval(total[:, i] / total[:, 3])} times mlscorr's error"
        )
    mean = np.exp(np.log(total[:, 3]).mean())
    print(
        f"geometric mean {mean:.3f} m; truth within 1 sigma {shares[0]:.1%}, within 1.96 sigma "
        f"{shares[1]:.1%}"
    )


def window(gps_time, error, sigma, seed):
    """A drive of 10 m/s with a POS error (true - recorded) and 16 evenly spaced targets."""
    rng = np.random.default_rng(seed)
    n = 16
    zero = np.zeros(len(gps_time))
    way = np.array([532_000.0, 3_374_000.0, 40.0]) + np.outer(gps_time - gps_time[0], [6.0, 8.0, 0])
    attitude = attitude_from_angles(zero, zero, np.arctan2(0.6, 0.8))
    true = Trajectory(gps_time, way, attitude)
    recorded = Trajectory(gps_time, way - error, attitude, sigma)
    times = np.linspace(gps_time[0] + 2, gps_time[-1] - 2, n)
    arm = np.column_stack([np.resize([-6.0, 9.0, 14.0, -11.0], n), np.zeros(n), -np.ones(n)])
    name = tuple(f"T{i:02d}" for i in range(n))
    kind = ("circle",) * n
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    size = np.full(n, 0.6)
    centre, seen = (
        t.at(times).position + t.at(times).attitude.apply(arm) for t in (true, recorded)
    )
    surveyed = centre + 0.003 * rng.normal(size=(n, 3))
    control = ControlPoints(name, surveyed, np.full((n, 3), 0.003), kind, size, up)
    noise = np.tile(0.005**2 * np.eye(3), (n, 1, 1))
    seen = seen + 0.005 * rng.normal(size=(n, 3))
    passes = np.ones(n, int)
    points = np.full(n, 300)
    observations = TargetObservations(name, passes, times, seen, noise, up, kind, size, points)
    return recorded, Matched(observations, control), error


def _stationary(trajectory, matched):
    """Position error (n, 3) by one exponential covariance of constant sigma, as in the paper, with
    scale and correlation time by restricted likelihood."""
    constant = replace(trajectory, position_sigma=np.full((len(trajectory), 3), 0.3))
    adjustment = position_adjustment(constant, matched, Pos(), 1, position_prior)

    def parameters(x):
        scale, time = np.exp(x)
        return SignalParameters(
            family="exponential",
            drift_scale=scale,
            drift_time=time,
            walk_scale=1.0,
            jitter_scale=1.0,
            jitter_time=1.0,
            bias_scale=1.0,
            bias_time=1.0,
            level_scale=1.0,
            attitude_scale=1.0,
            attitude_time=time,
            trend_sigma=1e3,  # m: any size
        )

    def negative(x):
        return -adjustment.solve(parameters(x)).log_likelihood

    start = np.array([0.0, np.log(60.0)])
    bounds = np.column_stack([start - 7.0, start + 7.0])  # a factor of a thousand
    best = minimize(negative, start, method="Nelder-Mead", bounds=bounds).x
    return predict_under(adjustment, parameters(best))[0][:, :3]
