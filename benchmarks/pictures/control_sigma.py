"""Draw the sigma of a correction along a drive with an outage, by where control is.

    python benchmarks/pictures/control_sigma.py [--picture FILE.png]

Drift along one axis has a Matern 3/2 covariance, scaled by the sigma that the POS states: 2 cm
under open sky, up to 40 cm in an outage. The sigma with control points, or with ties to a second
pass whose POS is good to 2 cm, follows from least squares collocation.
"""

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

PICTURES = Path(__file__).parents[2] / "build" / "pictures"
TIME = np.arange(0.0, 140.0, 0.5)  # s
OUTAGE = (45.0, 95.0)  # s
CORRELATION_TIME = 30.0  # s
CONTROL = np.array([15.0, 40.0, 105.0, 125.0])  # s
ADDED = 72.0  # s: one more control point, in the outage
SURVEY = 0.004  # m, one sigma of a target
SECOND_PASS = 0.02  # m, one sigma of the POS where it has GNSS
BLUE = "#0072b2"
ORANGE = "#d55e00"
GREEN = "#009e73"


def stated(time):
    """Sigma stated by the POS in m, for an outage bridged by a smoother."""
    start, end = OUTAGE
    inside = np.clip((time - start) / (end - start), 0.0, 1.0)
    return 0.02 + 0.38 * np.sin(np.pi * inside) ** 2


def covariance(first, second):
    """Of the drift (m^2) at times of both."""
    lag = np.sqrt(3) * np.abs(first[:, None] - second) / CORRELATION_TIME
    return stated(first)[:, None] * stated(second) * (1 + lag) * np.exp(-lag)


def remaining(times, sigmas):
    """Sigma (m) at TIME once the drift was observed at times with sigmas."""
    observed = covariance(times, times) + np.diag(sigmas**2)
    across = covariance(TIME, times)
    gain = np.linalg.solve(observed, across.T)
    return np.sqrt(np.diag(covariance(TIME, TIME)) - np.einsum("ij,ji->i", across, gain))


def draw(path):
    """Write the picture."""
    figure, axes = plt.subplots(figsize=(10, 4.2), layout="constrained")
    axes.axvspan(*OUTAGE, color="#f1f3f5", label="GNSS outage")
    axes.plot(TIME, 100 * stated(TIME), color="0.55", linestyle="--", label="stated by the POS")
    few = np.full(len(CONTROL), SURVEY)
    added = np.append(CONTROL, ADDED)
    ties = np.arange(*OUTAGE, 2.0)
    cases = (
        (CONTROL, few, ORANGE, "control outside the outage"),
        (added, np.append(few, SURVEY), BLUE, "one more point in the outage"),
        (
            np.append(CONTROL, ties),
            np.append(few, np.full(len(ties), SECOND_PASS)),
            GREEN,
            "ties to a second pass with GNSS",
        ),
    )
    for times, sigmas, color, words in cases:
        axes.plot(TIME, 100 * remaining(times, sigmas), color=color, linewidth=2, label=words)
    axes.plot(CONTROL, np.zeros(len(CONTROL)), "o", color="#1b2733", clip_on=False)
    axes.plot(ADDED, 0.0, "o", color=BLUE, clip_on=False)
    axes.set(xlabel="time (s)", ylabel="one sigma (cm)", xlim=(0, TIME[-1]), ylim=(0, 42))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9, loc="upper left")
    figure.savefig(path, dpi=110)


def main():
    picture = parse().picture
    draw(picture)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "control_sigma.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()
