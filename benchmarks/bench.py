"""Speed and memory relative to the plain tools, all measured in this run.

    python benchmarks/bench.py

Absolute times mean nothing on a busy machine, so competitors run in turn and medians are compared.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

import laspy
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation, Slerp

from mlscorr.correction import Correction
from mlscorr.frames import attitude_from_angles
from mlscorr.io.clouds import CorrectedPart, sample_gps_times, write_parts
from mlscorr.survey import CloudFile, Trajectory

START = 357_900.0  # s of week
PULSES = 400_000  # a second
RATE = 200.0  # Hz, of the POS
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # UTM
SCALE = np.full(3, 0.001)  # m
CHUNK = 1_000_000  # points


def drift(seconds):
    """A drive at 10 m/s whose recorded poses have slowly varying errors of decimeters and
    millirads.
    """
    time = START - 1.0 + np.arange(0.0, seconds + 2.0, 1.0 / RATE)
    wave = np.sin(time[:, None] / [7.0, 11.0, 13.0])
    position = CORNER + np.outer(time - START, [0.0, 10.0, 0.0]) + 0.1 * wave
    attitude = attitude_from_angles(*(0.02 * wave).T)
    moved = Rotation.from_rotvec(1e-3 * wave) * attitude
    return Correction(
        Trajectory(time, position, attitude), Trajectory(time, position + 0.3 * wave, moved)
    )


def street_chunks(points, rng):
    """X, Y, Z (integers), gps_time and intensity of a line scanner in a street, in time order."""
    for first in range(0, points, CHUNK):
        time = START + np.arange(first, min(first + CHUNK, points)) / PULSES
        angle = 2 * np.pi * 150.0 * time
        across = np.sin(angle)
        up = np.cos(angle)
        ground = 2.0 / np.maximum(-up, 0.03)
        distance = np.minimum(ground, 12.0 / np.maximum(np.abs(across), 0.2))
        intensity = 20_000 * np.exp(-distance / 30) + 500 * rng.standard_normal(len(time))
        distance += 0.004 * rng.standard_normal(len(time))  # m, range noise
        xyz = np.stack([distance * across, 10.0 * (time - START), distance * up])
        yield np.rint(xyz / SCALE[:, None]).astype(np.int32), time, intensity


def write_street(path, points):
    """Write a LAZ file in format 6 of some 3 bytes per point."""
    header = laspy.LasHeader(point_format=6)
    header.scales = SCALE
    header.offsets = CORNER
    with laspy.open(path, "w", header=header) as writer:
        for xyz, time, intensity in street_chunks(points, np.random.default_rng(1)):
            chunk = laspy.ScaleAwarePointRecord.zeros(len(time), header=header)
            chunk["X"], chunk["Y"], chunk["Z"] = xyz
            chunk["gps_time"] = time
            chunk["intensity"] = intensity
            writer.write_points(chunk)
    return path


def bare_copy(path, target):
    """Time that laspy and lazrs take for the copy alone."""
    with laspy.open(path) as reader, laspy.open(target, "w", header=reader.header) as writer:
        for points in reader.chunk_iterator(CHUNK):
            writer.write_points(points)


def corrected_copy(path, points, target, correction):
    file = CloudFile(path, points, 0.0, "week")
    write_parts([CorrectedPart(file, correction)], target)


def slerp_increments(correction, xyz, time):
    """Correct in plain float64: both poses by Slerp, Eq. 1 backward and forward."""
    old, new = (
        (
            np.stack([np.interp(time, t.gps_time, p) for p in t.position.T], axis=1),
            Slerp(t.gps_time, t.attitude)(time).as_matrix(),
        )
        for t in (correction.recorded, correction.corrected)
    )
    body = np.einsum("nji,nj->ni", old[1], xyz - old[0])
    return new[0] + np.einsum("nij,nj->ni", new[1], body) - xyz


def seconds(repeats, *functions):
    """Median time of each function, called in turn. Units: s."""
    times = [[] for _ in functions]
    for _ in range(repeats + 1):
        for function, taken in zip(functions, times, strict=True):
            start = perf_counter()
            function()
            taken.append(perf_counter() - start)
    return [median(taken[1:]) for taken in times]  # the first call warms up


def kernel_rows():
    correction = drift(240.0)
    rng = np.random.default_rng(2)
    xyz, time, _ = next(street_chunks(CHUNK, rng))
    time = START + (time - START) * 240.0 / (time[-1] - START)  # over the whole drive
    order = rng.permutation(CHUNK)
    points = xyz.T * SCALE + CORNER
    few = slice(None, None, 10)

    def shift(xyz, time):
        return lambda: correction.shift_integers(list(xyz), SCALE, CORNER, time)

    sorted_time, unsorted_time, slerp_time = seconds(
        9,
        shift(xyz.copy(), time),
        shift(xyz[:, order].copy(), time[order]),
        lambda: slerp_increments(correction, points[few], time[few]),
    )
    plain = slerp_increments(correction, points[few], time[few])
    difference = np.abs(correction.increments(points, time)[0][few] - plain).max() * 1e3
    speed = CHUNK / sorted_time / 1e6
    yield "kernel, sorted by time", f"{speed:.0f} M points/s/core", ">= 20"
    yield "scipy Slerp + einsum", f"{CHUNK / 10 / slerp_time / 1e6:.2f} M points/s/core", ""
    yield "kernel, unsorted / sorted", f"{sorted_time / unsorted_time:.2f}", ">= 0.25"
    yield "kernel - float64 slerp, largest", f"{difference:.1e} mm", "<= 1e-4"


def copy_rows(folder):
    path = write_street(folder / "street.laz", 4 * CHUNK)
    target = folder / "copy.laz"
    correction = drift(4 * CHUNK / PULSES)
    bare, corrected = seconds(
        7,
        lambda: bare_copy(path, target),
        lambda: corrected_copy(path, 4 * CHUNK, target, correction),
    )
    yield "bare LAZ copy", f"{4 * CHUNK / bare / 1e6:.1f} M points/s", ""
    yield "corrected / bare copy, wall time", f"{corrected / bare:.2f}", "<= 1.25"


def memory_rows(folder):
    peaks = []
    for millions in (2, 20):
        path = write_street(folder / f"{millions}.laz", millions * CHUNK)
        command = [sys.executable, __file__, str(path), str(folder / "out.laz")]
        peaks.append(int(subprocess.run(command, check=True, capture_output=True).stdout))
        yield f"peak memory over imports, {millions} M points", f"{peaks[-1]} MB", "<= 300"
    yield "peak memory, 20 M / 2 M points", f"{peaks[1] / peaks[0]:.2f}", "about 1"


def peak_memory():
    """Peak memory of this process alone (ru_maxrss starts at the parent's value). Units: MB."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) // 1024


def main():
    table = Table("measured in this run", "", "goal")
    with tempfile.TemporaryDirectory() as name:
        for rows in (kernel_rows(), copy_rows(Path(name)), memory_rows(Path(name))):
            for row in rows:
                table.add_row(*row)
    Console().print(table)


if __name__ == "__main__":
    if len(sys.argv) == 3:  # the child whose memory is measured
        before = peak_memory()
        count = sample_gps_times(sys.argv[1])[0]
        corrected_copy(Path(sys.argv[1]), count, sys.argv[2], drift(count / PULSES))
        print(peak_memory() - before)
    else:
        argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
        main()
