"""The reference surface of a scene: its fixed surroundings as a static scan gives them."""

import numpy as np

from mlscorr.simulate.shapes import Mesh

REACH = 50.0  # m from the drive's line: what a scanner on a tripod beside it sees well
SIGMA = 0.001  # m of each corner: a static scan's noise averages out, its stations fit to 1 mm
ALIKE = 6  # decimals of m to which corners are one


def static_scan(scene, rng):
    """Mesh of a Scene's ground and walls; cars, trees, posts and targets are not in it.

    Corners are off by a millimetre, those at one place alike.
    """
    triangles = scene.mesh.triangles[: scene.fixed]
    near = scene.centre_line.distance(triangles.mean(axis=1)) <= REACH
    corners = triangles[near].reshape(-1, 3)
    _, first, number = np.unique(
        corners.round(ALIKE), axis=0, return_index=True, return_inverse=True
    )
    moved = corners[first] + SIGMA * rng.standard_normal((len(first), 3))
    reflectance = scene.mesh.reflectance[: scene.fixed][near]
    return Mesh(moved[number.ravel()].reshape(-1, 3, 3), reflectance)
