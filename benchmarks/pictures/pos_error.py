"""Compare simulated with real POS error: drift without GNSS, and autocorrelation.

    python benchmarks/pictures/pos_error.py [SERIES.err] [--drives N] [--picture FILE.png]

SERIES.err is the error of a MEMS unit on a real drive, with GNSS withheld for 60 s in every 150 s
(OB_GINS_TXT.err of i2Nav-WHU/OB_GINS); without it only the simulation is drawn. That series is a
real-time one: errors grow until GNSS is back and, limited by a car's odometer, in proportion to
time. So it is compared with a simulated unit of the same kind, and with the same unit after
smoothing, as in the processing of surveys.
"""

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from mlscorr.frames import attitude_from_angles
from mlscorr.io.trajectories import read_pos_error_series
from mlscorr.simulate.pos import pos_error
from mlscorr.simulate.scenario import PosScenario
from mlscorr.survey import Trajectory

ROOT = Path(__file__).parents[2]
SERIES = Path("data", "real_pos_error", "OB_GINS_TXT.err")
# s: outages of the real series
FIRST = 357_900.0
PERIOD = 150.0
OUTAGE = 60.0
SETTLED = 65.0, 145.0  # s after an outage began: GNSS is back
STEP = 0.1  # s
LAGS = np.arange(0.0, 50.0, STEP)  # s
KINDS = {  # label of a simulated unit -> its scenario, color
    "simulated, real time with odometer": (
        {"processing": "filtered", "odometer": True},
        "#0072b2",
    ),
    "simulated, smoothed": ({}, "#009e73"),
}


def main():
    arguments = parse()
    drive = city_drive(1500.0)
    outages = tuple((t, OUTAGE) for t in np.arange(150.0, 1400.0, PERIOD))
    elapsed = drive.gps_time - drive.gps_time[0]
    runs = {}
    for label, (settings, color) in KINDS.items():
        scenario = PosScenario(grade="mems", outages=outages, **settings)
        errors = [
            pos_error(drive, scenario, np.random.default_rng(seed)).position
            for seed in range(arguments.drives)
        ]
        runs[label] = (elapsed, errors, color)
    if arguments.series:
        series = read_pos_error_series(arguments.series)
        elapsed = series.gps_time - FIRST + 150.0
        runs = {"real": (elapsed, [series.position], "black"), **runs}
    describe(runs)
    draw(runs, arguments.picture)
    print(f"Picture: {arguments.picture}")


def parse():
    shared = Path(os.environ.get("MLSCORR_SHARED") or ROOT.parent / "shared") / SERIES
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("series", nargs="?", type=Path, default=shared if shared.exists() else None)
    parser.add_argument("--drives", type=int, default=5, help="simulated drives of 1500 s")
    parser.add_argument(
        "--picture", type=Path, default=ROOT / "build" / "pictures" / "pos_error.png"
    )
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


def city_drive(duration):
    """A true trajectory at 10 Hz: round blocks, with speed between 3 and 13 m/s."""
    elapsed = np.arange(0.0, duration, STEP)
    speed = 8.0 + 5.0 * np.sin(2 * np.pi * elapsed / 37.0)
    corner = 0.5 * (1 + np.tanh((np.mod(elapsed, 45.0) - 22.5) / 2.0))  # 90 deg every 45 s
    heading = np.pi / 2 * (np.floor(elapsed / 45.0) + corner)
    course = np.column_stack([np.sin(heading), np.cos(heading), 0 * heading])
    position = [532_000.0, 3_374_000.0, 42.0] + STEP * np.cumsum(speed[:, None] * course, axis=0)
    return Trajectory(357_750.0 + elapsed, position, attitude_from_angles(0.0, 0.0, heading))


def pieces(elapsed, error, inside):
    """Errors (k, 3) of each outage, or of each interval with settled GNSS between outages."""
    first, last = (0.0, OUTAGE) if inside else SETTLED
    starts = np.arange(150.0, elapsed[-1] - PERIOD, PERIOD)
    return [error[(elapsed >= s + first) & (elapsed < s + last)] for s in starts]


def autocorrelation(segments):
    """Autocorrelation at LAGS of errors of zero mean, all segments and axes together."""
    values = []
    for lag in range(len(LAGS)):
        products = [(s[lag:] * s[: len(s) - lag]).mean(axis=0) for s in segments]
        values.append(np.mean(products))
    return np.array(values) / values[0]


def describe(runs):
    """Print growth, errors with GNSS, and the autocorrelation at some lags."""
    marks = (0, 5, 10, 20, 30, 40)
    print(f"{'':36} in outages of 60 s: largest error (median) / with GNSS: RMS E, N, H")
    for label, (elapsed, errors, _) in runs.items():
        lost = [p for e in errors for p in pieces(elapsed, e, True)]
        peak = np.median([np.linalg.norm(p, axis=1).max() for p in lost])
        held = np.vstack([p for e in errors for p in pieces(elapsed, e, False)])
        rms = np.sqrt((held**2).mean(axis=0)).round(3)
        print(f"{label:36} {peak:.2f} m / {rms} m")
    for inside in (True, False):
        print(f"Autocorrelation {'in outages' if inside else 'with GNSS'} at lags {marks} s")
        for label, (elapsed, errors, _) in runs.items():
            every = autocorrelation([p for e in errors for p in pieces(elapsed, e, inside)])
            print(f"{label:36}", *(f"{every[round(m / STEP)]:6.2f}" for m in marks))


def draw(runs, picture):
    """Draw the size of the error over time, above the autocorrelation in and outside outages."""
    figure = Figure(figsize=(10, 7.5), layout="constrained")
    panels = figure.subplot_mosaic([["over time", "over time"], ["lost", "held"]])
    over_time = panels["over time"]
    lost = panels["lost"]
    held = panels["held"]
    for label, (elapsed, errors, color) in runs.items():
        size = np.linalg.norm(errors[0], axis=1)
        over_time.semilogy(elapsed, size, color=color, lw=1, label=label)
        for axes, inside in ((lost, True), (held, False)):
            if len(errors) > 1:
                each = [autocorrelation(pieces(elapsed, e, inside)) for e in errors]
                axes.fill_between(
                    LAGS, *np.percentile(each, [5, 95], axis=0), color=color, alpha=0.2
                )
            every = autocorrelation([p for e in errors for p in pieces(elapsed, e, inside)])
            axes.plot(LAGS, every, color=color, label=label)
    for start in np.arange(150.0, 750.0, PERIOD):
        over_time.axvspan(start, start + OUTAGE, color="0.9", zorder=0)
    over_time.set(xlim=(0, 750), ylim=(3e-4, 10), xlabel="time (s); grey: no GNSS", ylabel="m")
    over_time.set_title("Position error of a MEMS GNSS/INS")
    over_time.legend(loc="lower right", ncols=3, fontsize="small")
    for axes, title in ((lost, "in outages"), (held, "with GNSS")):
        axes.set(xlim=(0, LAGS[-1]), ylim=(-0.6, 1.05), xlabel="lag (s)")
        axes.set_title(f"Autocorrelation {title}")
        axes.axhline(0.0, color="0.7", lw=0.8)
    lost.set_ylabel("1 at lag 0; bands: 90 % of the drives")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError) as error:  # of the input: a sentence says it
        sys.exit(f"Error: {error}")
