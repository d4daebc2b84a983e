"""Everything that a scanner can hit: street, river bank or user's mesh, and surveyed targets."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from mlscorr.frames import angles_from_attitude, from_polar
from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.scene._river import River
from mlscorr.simulate.scene._street import Street
from mlscorr.simulate.scene.centre_line import CentreLine
from mlscorr.simulate.scene.mesh import MeshSite
from mlscorr.simulate.scene.placing import Targets, place_targets
from mlscorr.simulate.scene.shapes import UP, Mesh
from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import Trajectory

SITES: dict[str, Any] = {"street": Street, "river": River, "mesh": MeshSite}


@dataclass(frozen=True)
class Scene:
    """Everything that a scanner can hit.

    Parameters
    ----------
    mesh : Mesh
    target : (n,) int array
        Target of each triangle, -1 for none.
    targets : Targets
    centre_line : CentreLine
    fixed : int
        Number of leading triangles that are ground and walls.
    """

    mesh: Mesh
    target: np.ndarray
    targets: Targets
    centre_line: CentreLine
    fixed: int


def build_scene(scenario: Scenario, line: CentreLine, length: float, rng: Generator) -> Scene:
    """Build the Scene of a Scenario along a center line, on which the drive is `length` (m) long.

    Parameters
    ----------
    scenario : Scenario
    line : CentreLine
    length : float
        Of the drive along the line. Units: m.
    rng : Generator

    Raises
    ------
    ValueError
        If targets cannot be placed, or a mesh is unusable.
    """
    site_rng, target_rng = rng.spawn(2)
    site = SITES[scenario.scene.kind](scenario, line, length, site_rng)
    placed = place_targets(scenario.targets, length, site, _yaw(scenario.scanner), target_rng)
    surroundings = Mesh.concatenate([site.mesh, site.furniture(placed)])
    number = np.repeat(np.arange(len(placed.targets)), [len(mesh) for mesh in placed.meshes])
    return Scene(
        Mesh.concatenate([surroundings, *placed.meshes]),
        np.concatenate([np.full(len(surroundings), -1), number]),
        placed.targets,
        line,
        len(site.mesh),
    )


def _yaw(scanners):
    """Mean yaw of the scan planes against the vehicle's cross-section, 0 for level ones. rad."""
    turns = []
    for scanner in scanners:
        across = Rotation.from_euler("xyz", scanner.boresight, degrees=True).apply(UP)
        turn = 0.0
        if np.hypot(across[0], across[1]) >= 0.5 and across[1]:
            turn = np.arctan(-across[0] / across[1])
        turns.append(turn)
    return float(np.mean(turns))


def sky_elevation(scene: Scene, trajectory: Trajectory, origin: np.ndarray) -> np.ndarray:
    """Elevation (n, 2) below which the sky is hidden on the left and right. Units: rad.

    Parameters
    ----------
    scene : Scene
    trajectory : Trajectory
        True trajectory, in map coordinates.
    origin : (3,) array
        Map coordinates of the scene's local origin. Units: m.
    """
    rate = 2.0  # Hz, sampling rate before interpolation
    fan = np.radians([-40.0, -20.0, 0.0, 20.0, 40.0])  # about right and left; the median counts
    elevation = np.radians(np.arange(0.5, 90.0))
    start, end = trajectory.gps_time[[0, -1]]
    times = np.linspace(start, end, max(2, round((end - start) * rate)))
    pose = trajectory.at(times)
    heading = angles_from_attitude(pose.attitude)[2]
    azimuth = heading[:, None, None] + np.array([-np.pi / 2, np.pi / 2])[:, None] + fan
    grid = np.broadcast_arrays(1.0, np.pi / 2 - azimuth[..., None], elevation)
    direction = from_polar(*map(np.ravel, grid)).reshape(*grid[0].shape, 3)
    eye = np.broadcast_to((pose.position - origin)[:, None, None, None], direction.shape)
    rays = np.concatenate([eye, direction], axis=-1).astype(np.float32)
    hit = np.isfinite(scene.mesh.caster.cast_rays(rays)["t_hit"].numpy())
    highest = np.where(hit, elevation + np.radians(0.5), 0.0).max(axis=-1)
    sky = np.median(highest, axis=-1)
    return np.column_stack([np.interp(trajectory.gps_time, times, column) for column in sky.T])


def static_scan(scene: Scene, rng: Generator) -> Mesh:
    """Make the mesh of a Scene's ground and walls, without cars, trees, posts and targets.

    Corners have errors of one millimeter, equal for coincident corners.

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
