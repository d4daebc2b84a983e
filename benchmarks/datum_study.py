"""How often is control in another scale, turn or tilt found, and how often where there is none?

python benchmarks/datum_study.py [FILE of real POS errors (.err)] [--seeds 20] [--points 8] [--good]

Of the drives of pos_study.py, each kind of POS with as many seeds: the share of good surveys that
are told that their control differs from the cloud by a linear term (false alarms), and the share of
the same surveys, with their control changed by one term, that are told this term. With --points,
of so many control points spread over the drive, as ``check`` looks at. With --good, of good
surveys alone.
"""

import argparse
import sys
import warnings
from collections import defaultdict
from dataclasses import replace

import numpy as np
from pos_study import surveys

from mlscorr.evaluate.datum import datum_differences
from mlscorr.survey import Pos

TURN = np.radians(0.03)
CHANGES = {  # of places about their middle
    "none": np.zeros((3, 3)),
    "scale": np.diag([4e-4, 4e-4, 0.0]),
    "turn": TURN * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
    "tilt": 4e-4 * np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.6, 0.8, 0.0]]),
}


def changed(matched, matrix):
    """The observed control points, surveyed with a linear change about their middle."""
    place = matched.surveyed.position
    moved = place + (place - place.mean(axis=0)) @ matrix.T
    return replace(matched, surveyed=replace(matched.surveyed, position=moved))


def spread(matched, number):
    """Observations of some control points along the drive."""
    rows = np.rint(np.linspace(0, len(matched) - 1, min(number, len(matched)))).astype(int)
    return matched[np.argsort(matched.gps_time)[rows]]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("series", nargs="?")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--points", type=int, default=None)
    parser.add_argument("--good", action="store_true")
    options = parser.parse_args()
    found = defaultdict(list)
    extents = defaultdict(list)
    for name, trajectory, matched, _, pos in surveys(options.series, options.seeds):
        kind = name.split(" window")[0]
        some = matched if options.points is None else spread(matched, options.points)
        for change in ["none"] if options.good else CHANGES:
            with warnings.catch_warnings(action="ignore"):
                moved = changed(some, CHANGES[change])
                differences = datum_differences(moved, trajectory, pos or Pos())
            terms = {difference.term for difference in differences}
            found[kind, change].append(terms)
            print(f"{name}, {change}: {', '.join(terms) or '-'}", file=sys.stderr, flush=True)
        local = some.surveyed.position[:, :2] - some.surveyed.position[:, :2].mean(axis=0)
        extents[kind].append(np.sqrt(np.mean(np.sum(local**2, axis=1))))
    print(f"| kind of POS | surveys | extent (m) | false alarms | {' | '.join([*CHANGES][1:])} |")
    print("|---|---|---|---|---|---|---|")
    print(*(row(kind, found, extents) for kind in extents), sep="\n")


def row(kind, found, extents):
    """A line of the table: surveys with a false alarm, and shares that are found."""
    good = found[kind, "none"]
    alarms = [sorted(terms) for terms in good if terms]
    shares = [
        f"{sum(change in terms for terms in found[kind, change])}/{len(found[kind, change])}"
        for change in list(CHANGES)[1:]
    ]
    said = f"{len(alarms)}/{len(good)}" + (f" {alarms}" if alarms else "")
    extent = f"{np.median(extents[kind]):.0f}"
    return f"| {' | '.join([kind, str(len(good)), extent, said, *shares])} |"


if __name__ == "__main__":
    main()
