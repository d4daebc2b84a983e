"""Clustering and plane fits of the target search compared with scikit-learn, SciPy and Open3D.

    python benchmarks/bench_libraries.py [--points MILLIONS] [--repeat N]

An extraction from a simulated street is run once, and the points of every call that grows clusters
or fits a plane are recorded. Each tool then answers the same calls; the fastest of several rounds
counts. Clusters are compared with exact single linkage (points nearer than a link belong together)
by the adjusted Rand index, planes by their inliers, relative to those of the best of 5 000 samples.
The accuracy of planes is measured on boards of known normal.
"""

import argparse
import tempfile
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from bench_targets import make_street
from rich.console import Console
from rich.table import Table
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from sklearn.cluster import DBSCAN
from sklearn.metrics import adjusted_rand_score

import mlscorr
from mlscorr.io.tables.control import NO_POINTS
from mlscorr.targets import _seeds
from mlscorr.targets._clusters import bright_components, connected
from mlscorr.targets._plane import fit_plane
from mlscorr.targets.settings import SETTINGS

CALLS = 400  # of each kind, spread evenly over all that an extraction makes
REFERENCE = 5000  # samples of the plane that serves as the reference


@contextmanager
def listened(names):
    """Record the arguments of the functions that find target seeds, by function name."""
    calls = {name: [] for name in names}
    plain = {name: getattr(_seeds, name) for name in names}

    def listening(name):
        def call(*given):
            calls[name].append(given)
            return plain[name](*given)

        return call

    try:
        for name in names:
            setattr(_seeds, name, listening(name))
        yield calls
    finally:
        for name in names:
            setattr(_seeds, name, plain[name])


def real_calls(points):
    """Arguments of clusters, of component trees and of planes in a real extraction."""
    with tempfile.TemporaryDirectory() as folder:
        make_street(Path(folder), points)
        survey = mlscorr.read_survey(folder)
        surveyed = survey.surveyed
        # free-standing plates are found by their edges: with them, every kind of seed is sought
        kinds = tuple("plate" if k % 2 else kind for k, kind in enumerate(surveyed.kind))
        control = replace(surveyed, kind=kinds)
        survey = replace(survey, control=control, check=NO_POINTS)
        with listened(("components", "fit_plane", "bright_components")) as calls:
            mlscorr.find_targets(survey)
    return tuple(_spread(calls[name]) for name in ("components", "bright_components", "fit_plane"))


def _spread(calls):
    """Up to CALLS evenly chosen calls, without those that have too few points to be meaningful."""
    enough = [call for call in calls if len(call[0]) >= SETTINGS.smallest_count]
    chosen = np.unique(np.linspace(0, len(enough) - 1, min(CALLS, len(enough))).round().astype(int))
    return [enough[k] for k in chosen]


def by_dbscan(points, link):
    """Labels by scikit-learn: with core size one this is exact single linkage."""
    return DBSCAN(eps=link, min_samples=1).fit_predict(points)


def by_tree(points, link):
    """Labels by SciPy: pairs of a k-d tree, and components of their graph."""
    matrix = cKDTree(points).sparse_distance_matrix(cKDTree(points), link, output_type="coo_matrix")
    return connected_components(matrix, directed=False)[1]


def by_open3d(points, link):
    """Labels by Open3D, which supports only three dimensions."""
    import open3d

    space = np.zeros((len(points), 3))
    space[:, : points.shape[1]] = points
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(space))
    return np.asarray(cloud.cluster_dbscan(link, 1))


def open3d_plane(samples):
    """Function that fits a plane by Open3D's segment_plane with this number of samples."""
    import open3d

    def fit(xyz, tolerance):
        middle = xyz.mean(axis=0)
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(xyz - middle))
        open3d.utility.random.seed(1)
        *normal, offset = cloud.segment_plane(tolerance, 3, samples)[0]
        return np.array(normal), offset - np.dot(normal, middle)

    return fit


def own_plane(xyz, tolerance):
    """Fit by mlscorr: normal and offset."""
    plane = fit_plane(xyz, tolerance)
    normal = plane.axes[2]
    return normal, -normal @ plane.origin


def timed(run, calls, repeat):
    """Answers to all calls, and the milliseconds of the fastest of several rounds."""
    run(*calls[0])  # compiled, loaded
    fastest = np.inf
    for _ in range(repeat):
        start = perf_counter()
        answers = [run(*call) for call in calls]
        fastest = min(fastest, perf_counter() - start)
    return answers, 1e3 * fastest


CLUSTERS = {
    "mlscorr (voxels)": connected,
    "Open3D cluster_dbscan": by_open3d,
    "SciPy k-d tree": by_tree,
    "scikit-learn DBSCAN": by_dbscan,
}


def cluster_table(title, calls, tools, repeat):
    """Print a comparison of clusterings by several of the tools."""
    points = sum(len(call[0]) for call in calls)
    table = Table(
        *("tool", "ms", "times ours", "clusters", "Rand index: mean", "least", "calls alike"),
        title=f"{title}: {len(calls)} calls, {points:,} points",
    )
    exact = [by_open3d(*call) for call in calls]  # all three libraries agree
    ours = None
    for name in tools:
        answers, taken = timed(CLUSTERS[name], calls, repeat)
        ours = ours or taken
        pairs = zip(exact, answers, strict=True)
        rand = np.array([adjusted_rand_score(*pair) for pair in pairs])
        clusters = sum(len(np.unique(labels)) for labels in answers)
        alike = f"{np.mean(rand > 1 - 1e-9):.3f}"
        numbers = f"{clusters}", f"{rand.mean():.4f}", f"{rand.min():.3f}", alike
        table.add_row(name, f"{taken:.0f}", f"{taken / ours:.1f}", *numbers)
    return table


def plane_tools():
    """Functions that fit a plane, by tool."""
    trials = SETTINGS.plane_trials
    return {
        f"mlscorr ({trials} samples)": own_plane,
        f"Open3D segment_plane ({trials})": open3d_plane(trials),
        "Open3D segment_plane (1000)": open3d_plane(1000),
    }


def plane_table(calls, repeat):
    """Print a comparison of planes through the points of real calls."""
    points = sum(len(call[0]) for call in calls)
    table = Table(
        *("tool", "ms", "times ours", "points held: mean", "5 %"),
        title=f"Planes: {len(calls)} calls, {points:,} points",
    )
    most = [_held(call, open3d_plane(REFERENCE)(*call)) for call in calls]
    ours = None
    for name, run in plane_tools().items():
        answers, taken = timed(run, calls, repeat)
        ours = ours or taken
        held = [_held(call, plane) for call, plane in zip(calls, answers, strict=True)]
        share = np.array(held) / np.maximum(most, 1)
        numbers = f"{share.mean():.3f}", f"{np.percentile(share, 5):.3f}"
        table.add_row(name, f"{taken:.0f}", f"{taken / ours:.1f}", *numbers)
    return table


def board_table(boards=300):
    """Print errors on boards of 0.6 m with 5 mm of noise and a third of the points behind."""
    rng = np.random.default_rng(1)
    calls = []
    for _ in range(boards):
        board = np.column_stack([rng.uniform(-0.3, 0.3, (80, 2)), rng.normal(0.0, 0.005, 80)])
        post = rng.uniform([-0.05, -0.6, 0.04], [0.05, 0.3, 0.12], (40, 3))
        calls.append((np.vstack([board, post]), SETTINGS.thickness))
    table = Table(
        *("tool", "angle: RMS (deg)", "largest", "offset: RMS (mm)", "largest"),
        title=f"{boards} boards of known normal",
    )
    for name, run in plane_tools().items():
        planes = [run(*call) for call in calls]
        angle = np.degrees([np.arccos(min(1.0, abs(normal[2]))) for normal, _ in planes])
        offset = 1e3 * np.array([offset for _, offset in planes])  # of the middle of a board
        rms = np.sqrt(np.mean(angle**2)), np.sqrt(np.mean(offset**2))
        numbers = rms[0], angle.max(), rms[1], np.abs(offset).max()
        table.add_row(name, *(f"{number:.2f}" for number in numbers))
    return table


def _held(call, plane):
    """Number of points within the tolerance of a call from a plane."""
    xyz, tolerance = call
    normal, offset = plane
    return np.count_nonzero(np.abs(xyz @ normal + offset) <= tolerance)


def main(points, repeat):
    console = Console(width=120)
    clusters, bright, planes = real_calls(points)
    console.print(plane_table(planes, repeat))
    console.print(board_table())
    console.print(cluster_table("Parts of flat patches", clusters, CLUSTERS, repeat))
    linked = [(xyz, SETTINGS.link_shares[0] * size) for xyz, _, size in bright]
    fast = list(CLUSTERS)[:2]  # the others take minutes of so many points
    console.print(cluster_table("Points near control", linked, fast, 1))
    _, taken = timed(lambda *call: list(bright_components(*call)), bright, 1)
    console.print(f"Their component tree at all levels of intensity, two links: {taken:.0f} ms")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--points", type=float, default=1.0, help="millions, of the street")
    parser.add_argument("--repeat", type=int, default=3, help="rounds, of which the fastest counts")
    given = parser.parse_args()
    main(given.points * 1e6, given.repeat)
