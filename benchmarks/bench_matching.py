"""Speed of matching many observations with as many surveyed points, compared with plain assignment.

    python benchmarks/bench_matching.py [observations]

The peers use neither drift nor time, and reject nothing: the nearest surveyed point, and the
assignment with the smallest sum of squared distances among all pairs within the radius
(scipy.sparse.csgraph). All run in turn; processor time counts, and each runs once on a small drive
before.
"""

import argparse
from time import thread_time

import numpy as np
from bench import peak_memory
from matching_study import long_drive
from rich.console import Console
from rich.table import Table
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import cKDTree

from mlscorr.matching import match
from mlscorr.survey import SEARCH_RADIUS

SMALL = 200  # observations


def by_evidence(observations, control, trajectory):
    """Names by mlscorr, None where refused."""
    matched = match(observations, control, trajectory).matched
    names = np.full(len(observations), None)
    names[np.searchsorted(observations.gps_time, matched.gps_time)] = matched.name
    return names


def by_distance(observations, control, trajectory):
    """Names of the nearest surveyed points."""
    return np.array(control.name)[cKDTree(control.position).query(observations.position)[1]]


def by_assignment(observations, control, trajectory):
    """Names by the smallest sum of squared distances within the search radius."""
    trees = cKDTree(observations.position), cKDTree(control.position)
    pairs = trees[0].sparse_distance_matrix(trees[1], SEARCH_RADIUS, output_type="coo_matrix")
    squares = csr_array((pairs.data**2 + 1e-12, (pairs.row, pairs.col)), shape=pairs.shape)
    rows, columns = min_weight_full_bipartite_matching(squares)
    names = np.full(len(observations), None)
    names[rows] = np.array(control.name)[columns]
    return names


METHODS = {
    "mlscorr": by_evidence,
    "nearest point (cKDTree)": by_distance,
    "smallest sum (min_weight_full_bipartite_matching)": by_assignment,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("observations", nargs="?", type=int, default=100_000)
    count = parser.parse_args().observations
    small = long_drive(SMALL)
    drive = long_drive(count)
    table = Table(f"{count} observations and points", "s", "observations/s", "right", "wrong", "MB")
    for title, name in METHODS.items():
        name(*small)
        before = peak_memory()
        begin = thread_time()
        names = name(*drive)
        seconds = thread_time() - begin
        right = np.sum(names == np.array(drive[1].name))
        wrong = np.sum(names != None) - right  # noqa: E711 - elementwise
        numbers = right, wrong, peak_memory() - before
        table.add_row(title, f"{seconds:.1f}", f"{count / seconds:.0f}", *map(str, numbers))
    Console().print(table)


if __name__ == "__main__":
    main()
