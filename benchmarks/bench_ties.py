"""Speed and memory of the tie search, compared with bare decoding and Open3D's ICP of two passes.

    python benchmarks/bench_ties.py [millions of points ...]

By default 2, 10 and 20 million points on two passes of a simulated street, repeated file after file
for more than 2. Absolute times mean nothing on a busy machine, so processor time is measured, and
each search runs between two decodings of the same files by laspy in separate processes. ICP starts
from the two passes as recorded, on points of voxels of 0.2 m.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

import laspy
import numpy as np
from rich.console import Console
from rich.table import Table

import mlscorr
from mlscorr.io.clouds import read_chunks
from mlscorr.simulate import Scenario, simulate
from mlscorr.surfaces import FeatureCollector
from mlscorr.ties import search_ties

CHUNK = 1_000_000  # points
# m, of the ICP
VOXEL = 0.2
RADIUS = 1.0
RUNS = "decode", "ties", "decode", "icp"
RATE = 333_000  # points a second


def make_street(folder, points):
    """Write two passes there and back, with half of the points on each."""
    seconds = points / RATE / 2
    scenario = Scenario(
        drive={"duration": seconds, "passes": [{}, {"direction": "back", "pause": 20.0}]},
        targets={"control": 4, "check": 2},
        scanner=[{"lines_per_second": 200, "points_per_line": 1667}],
    )
    simulate(scenario, np.random.default_rng(1)).write(folder)


def decode(folder):
    """Decode the clouds by laspy alone, and return the processor seconds."""
    start = process_time()
    for path in sorted(Path(folder).glob("*.laz")):
        with laspy.open(path) as reader:
            for chunk in reader.chunk_iterator(CHUNK):
                len(chunk)
    return process_time() - start, 0, 0


def ties(folder):
    """Processor seconds of features and pairs, without decoding; number of both."""
    survey = mlscorr.read_survey(folder)
    for _ in range(2):  # compiled kernels are loaded by the first
        collector = FeatureCollector(survey)
        used = 0.0
        for file in survey.clouds:
            for chunk in read_chunks(file, CHUNK):
                start = process_time()
                collector.add(file, chunk)
                used += process_time() - start
        start = process_time()
        features = collector.features()
        used += process_time() - start
        start = process_time()
        pairs = search_ties(survey, features).ties
        paired = process_time() - start
    print(f"{len(features)} features, {len(pairs)} ties, pairing {paired:.2f} s", file=sys.stderr)
    return used, len(features), len(pairs)


def icp(folder):
    """Processor seconds of Open3D's point-to-plane ICP of the second pass onto the first."""
    import open3d

    passes = []
    for file in mlscorr.read_survey(folder).clouds:
        xyz = np.concatenate([chunk.xyz for chunk in read_chunks(file, CHUNK)])
        passes.append(xyz)
    start = process_time()
    origin = passes[0][0]
    clouds = []
    for xyz in passes:
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(xyz - origin))
        cloud = cloud.voxel_down_sample(VOXEL)
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(4 * VOXEL, 30))
        clouds.append(cloud)
    registration = open3d.pipelines.registration
    result = registration.registration_icp(
        clouds[1],
        clouds[0],
        RADIUS,
        np.eye(4),
        registration.TransformationEstimationPointToPlane(),
    )
    return process_time() - start, len(clouds[0].points), len(result.correspondence_set)


def measure(task, folder):
    """Run one task in a separate process: processor seconds, two counts, peak memory in MB."""
    command = [sys.executable, __file__, "--task", task, str(folder)]
    out = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    return [float(word) for word in out[-4:]]


def main():
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    usual = [2.0, 10.0, 20.0]
    parser.add_argument("millions", nargs="*", type=float, default=usual, help="of points")
    sizes = parser.parse_args().millions
    table = Table("points", "task", "CPU s", "of decoding", "counts", "MB")
    for size in sizes:
        with tempfile.TemporaryDirectory() as folder:
            make_street(folder, size * 1e6)
            points = mlscorr.read_survey(folder).points
            rows = {}
            for task in RUNS:
                rows.setdefault(task, []).append(measure(task, folder))
            decoding = np.mean([row[0] for row in rows["decode"]])
            for task, runs in rows.items():
                used, *counts, memory = np.mean(runs, axis=0)
                text = " ".join(f"{count:.0f}" for count in counts)
                share = f"{used / decoding:.2f}"
                table.add_row(f"{points}", task, f"{used:.2f}", share, text, f"{memory:.0f}")
    Console().print(table)


if __name__ == "__main__":
    if "--task" in sys.argv:
        task, folder = sys.argv[-2:]
        values = {"decode": decode, "ties": ties, "icp": icp}[task](folder)
        lines = Path("/proc/self/status").read_text().splitlines()
        print(*values, next(int(line.split()[1]) / 1024 for line in lines if "VmHWM" in line))
    else:
        main()
