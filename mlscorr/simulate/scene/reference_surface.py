"""The reference surface of a scene: its fixed surroundings as a static scan gives them."""

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scene.build import Scene
from mlscorr.simulate.scene.shapes import Mesh
from mlscorr.simulate.settings import SETTINGS


def static_scan(scene: Scene, rng: Generator) -> Mesh:
    """Mesh of a Scene's ground and walls; cars, trees, posts and targets are not in it.

    Corners are off by a millimetre, those at one place alike.

    Parameters
    ----------
    scene : Scene
    rng : Generator
    """
    triangles = scene.mesh.triangles[: scene.fixed]
    near = scene.centre_line.distance(triangles.mean(axis=1)) <= SETTINGS.static_range
    corners = triangles[near].reshape(-1, 3)
    _, first, number = np.unique(corners.round(6), axis=0, return_index=True, return_inverse=True)
    moved = corners[first] + SETTINGS.static_sigma * rng.standard_normal((len(first), 3))
    reflectance = scene.mesh.reflectance[: scene.fixed][near]
    return Mesh(moved[number.ravel()].reshape(-1, 3, 3), reflectance)
