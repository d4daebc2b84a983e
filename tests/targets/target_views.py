"""Echoes of one target, seen by the small scanner of the benchmarks or made by hand."""

from functools import cache

import numpy as np
from target_rays import ORIGIN, TARGETS, view

from mlscorr.targets import ScannerPath
from mlscorr.targets._echoes import Echoes

SIZE = 0.6  # m
TOLERANCE = 0.03  # m
STEP = 1.5e-3  # rad between pulses: sparse, which is quick
KINDS = {look: kind for look, (kind, _) in TARGETS.items()}


@cache
def views(look, count=3):
    "Whole views of a target, up to 50 deg oblique and without clutter, of 80 points at least"
    seen = (
        view(look, SIZE, np.random.default_rng([11, i]), 50.0, 0.0, clutter=False, step=STEP)
        for i in range(4 * count)
    )
    return tuple([each for each in seen if each.on_target >= 80][:count])


def echoes_of(seen):
    "A view as Echoes about ORIGIN"
    cloud = seen.cloud
    path = seen.path.seen_from(ORIGIN)
    return Echoes(cloud.xyz - ORIGIN, cloud.gps_time, cloud.intensity, path, TOLERANCE)


def centre_of(seen):
    "The true centre about ORIGIN. Units: m."
    return seen.centre - ORIGIN


def wall(white, rng, half=0.9, spacing=0.02, distance=6.0, noise=0.002):
    "Echoes of a wall across the x axis; white(u, v) tells where it is bright, NaN where a gap is"
    axis = np.arange(-half, half, spacing)
    u, v = (grid.ravel() for grid in np.meshgrid(axis, axis, indexing="ij"))
    paint = np.asarray(white(u, v), dtype=float)
    there = np.isfinite(paint)
    u = u[there]
    v = v[there]
    paint = paint[there]
    xyz = np.column_stack([distance + rng.normal(0.0, noise, len(u)), u, v])
    intensity = np.where(paint > 0.5, 12_000.0, 2_000.0) * rng.normal(1.0, 0.03, len(u))
    time = 413_200.0 + 1e-4 * np.arange(len(u))
    return Echoes(xyz, time, intensity, ScannerPath(time[[0, -1]], np.zeros((2, 3))), TOLERANCE)
