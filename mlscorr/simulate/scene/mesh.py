"""User's own mesh as a scene: reading, checks, ground heights; targets on posts beside the way."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from mlscorr.io.clouds import announced_faces
from mlscorr.simulate.scenario import Scenario, SceneScenario
from mlscorr.simulate.scene._dimensions import TargetHeight
from mlscorr.simulate.scene.centre_line import CentreLine
from mlscorr.simulate.scene.placing import Placed, TargetSpot, eyes
from mlscorr.simulate.scene.shapes import UP, Mesh, sees

ON_POSTS = TargetHeight(least=1.0, below=0.3, span=1.0)  # m
STEEPEST = 1.5  # m, height of a post's foot above or below the way, at most


def read_mesh(scene: SceneScenario, origin: ArrayLike) -> Mesh:
    """Read the mesh of a scene's PLY or OBJ, relative to an origin, without degenerate triangles.

    Parameters
    ----------
    scene : SceneScenario
        Names the file.
    origin : (3,) array
        Map coordinates of the local origin. Units: m.

    Raises
    ------
    ValueError
        An unknown suffix, no triangles, or vertices that are not numbers.
    """
    path = Path(str(scene.file))
    readers = {".ply": _read_ply, ".obj": _read_obj}
    if path.suffix.lower() not in readers:
        raise ValueError(
            f"{path} has the unknown suffix '{path.suffix}'; a mesh is {' or '.join(readers)}."
        )
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist; scene.file must be a PLY or an OBJ.")
    vertices, corners = readers[path.suffix.lower()](path)
    if not len(corners):
        raise ValueError(
            f"{path} has {len(vertices)} vertices but no triangles; a surface is needed."
        )
    if corners.min() < 0 or corners.max() >= len(vertices):
        raise ValueError(
            f"{path} has triangles with vertices that do not exist (it has {len(vertices)})."
        )
    bad = ~np.isfinite(vertices).all(axis=1)
    if bad.any():
        raise ValueError(
            f"{bad.sum()} of {len(bad)} vertices of {path} are not numbers "
            f"(first: vertex {np.argmax(bad) + 1})."
        )
    triangles = vertices[corners] - np.array(origin)
    edges = triangles[:, 1:] - triangles[:, :1]
    flat = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) < 1e-12
    triangles = triangles[~flat]
    if not len(triangles):
        raise ValueError(f"All {len(corners)} triangles of {path} have zero area.")
    return Mesh(triangles, np.full(len(triangles), scene.reflectance))


def _read_ply(path):
    """Vertices (n, 3) and triangles' vertex numbers (m, 3) of a PLY."""
    import open3d as o3d

    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        mesh = o3d.io.read_triangle_mesh(str(path))
    vertices = np.asarray(mesh.vertices, float)
    triangles = np.asarray(mesh.triangles, np.int64)
    if 0 < len(triangles) < (faces := announced_faces(path)):
        raise ValueError(
            f"{path} is truncated: it has {len(triangles)} of the {faces} faces stated in its "
            "header. Copy the file again."
        )
    return vertices, triangles


def _read_obj(path):
    """Read the same from an OBJ. Open3D's float32 reader errs by half a meter at map
    coordinates.
    """
    vertices = []
    corners = []
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, text in enumerate(file, start=1):
            words = text.split()
            if not words or words[0] not in ("v", "f"):
                continue
            try:
                if words[0] == "v":
                    vertices.append([float(word) for word in words[1:4]])
                    continue
                face = [int(word.split("/")[0]) for word in words[1:]]
            except ValueError:
                raise ValueError(
                    f"Line {number} of {path} is not a vertex or face: '{text.strip()[:60]}'."
                ) from None
            face = [i - 1 if i > 0 else len(vertices) + i for i in face]
            corners += [[face[0], *pair] for pair in pairwise(face[1:])]
    return (
        np.array(vertices, dtype=float).reshape(-1, 3),
        np.array(corners, dtype=np.int64).reshape(-1, 3),
    )


class Ground:
    """Heights of a mesh's surfaces below and above positions."""

    def __init__(self, mesh):
        self._mesh = mesh
        self._floor = mesh.triangles[..., 2].min() - 1.0

    def levels(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the heights of all surfaces at each position (n, 2+), as a list of n arrays. m.

        Parameters
        ----------
        points : (n, 2+) array
            Units: m.
        """
        start = np.column_stack([points[:, :2], np.full(len(points), self._floor)])
        rays = np.hstack([start, np.broadcast_to(UP, start.shape)]).astype(np.float32)
        hits = self._mesh.caster.list_intersections(rays)
        splits = hits["ray_splits"].numpy()
        height = hits["t_hit"].numpy() + self._floor
        return [height[a:b] for a, b in pairwise(splits)]

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """Return the height (n,) of the surface nearest to each point (n, 3); NaN without one.

        Parameters
        ----------
        points : (n, 3) array
            Units: m.
        """
        hits = zip(self.levels(points), points[:, 2], strict=True)
        return np.array([_nearest(heights, height) for heights, height in hits])


def _nearest(heights, height):
    if len(heights):
        return heights[np.argmin(np.abs(heights - height))]
    return np.nan


def line_on_mesh(scenario: Scenario, line: CentreLine, length: float) -> CentreLine:
    """Make a CentreLine with the heights of the mesh's ground, starting nearest to the origin.

    Raises ValueError if the way leaves the mesh.

    Parameters
    ----------
    scenario : Scenario
    line : CentreLine
    length : float
        Of the drive along the line. Units: m.

    Raises
    ------
    ValueError
        If the way leaves the mesh.
    """
    mesh = read_mesh(scenario.scene, scenario.origin)
    s = np.arange(line.curve.x[0], line.curve.x[-1] + 1e-9, 1.0)
    place = line.curve(s)
    levels = Ground(mesh).levels(place)
    height = np.full(len(s), np.nan)
    start = int(np.argmin(np.abs(s)))
    for order in (range(start, len(s)), range(start, -1, -1)):
        last = 0.0
        for i in order:  # the surface that continues the previous one, not a roof or a cellar
            height[i] = _nearest(levels[i], last)
            last = height[i] if len(levels[i]) else last
    _check_ground(scenario, mesh, s, place, height, length)
    known = np.isfinite(height)
    smoothed = gaussian_filter1d(np.interp(s, s[known], height[known]), 2.0, mode="nearest")
    return CentreLine(CubicSpline(s, np.column_stack([place[:, :2], smoothed])))


def _check_ground(scenario, mesh, s, place, height, length, hole=5.0):
    """Refuse a drive that leaves the mesh by more than a hole (m), as cars cause in scans."""
    inside = (s >= 0) & (s <= length)
    lost = inside & ~np.isfinite(height)
    known = np.append(s[np.isfinite(height)], [-np.inf, np.inf])
    far = lost & (np.abs(s[:, None] - known[None]).min(axis=1) > hole / 2)
    if not far.any():
        return
    origin = np.array(scenario.origin)
    low, high = (f(mesh.triangles, axis=(0, 1)) + origin for f in (np.min, np.max))
    first = place[np.argmax(far)] + origin
    raise ValueError(
        f"The drive leaves the mesh: {lost.sum()} of {inside.sum()} m have no ground below "
        f"(first {s[np.argmax(far)]:.0f} m after the start, E {first[0]:.1f}, N {first[1]:.1f}); "
        f"{scenario.scene.file} extends from E {low[0]:.1f}, N {low[1]:.1f} to E {high[0]:.1f}, "
        f"N {high[1]:.1f}. Set origin to a place on the mesh, or shorten the drive."
    )


class MeshSite:
    """User's mesh; `spot` finds positions for targets on posts, `furniture` makes these posts."""

    post_distance = (2.5, 6.0)  # m from the drive to a target's post

    def __init__(self, scenario: Scenario, line: CentreLine, length, rng):
        self.line = line
        self.length = length
        self.mesh = read_mesh(scenario.scene, scenario.origin)
        self._ground = Ground(self.mesh)

    def spot(
        self, s: float, side: int, support: str, half: float, rng: Generator
    ) -> TargetSpot | None:
        """Find a TargetSpot on a post, visible from the drive and without intersections, or None.

        Parameters
        ----------
        s : float
            Along the line. Units: m.
        side : int
            -1 left, 1 right.
        support : str
            Support of the target: post, wall or road.
        half : float
            From the center to the edge of the target. Units: m.
        rng : Generator
        """
        _, forward, _ = self.line.frame(s)
        u = -side * (forward - forward[2] * UP) / np.linalg.norm(forward[:2])
        for lateral in side * rng.uniform(*self.post_distance, 8):
            foot = self.line.place(s, lateral, 0.0)
            ground = self._ground.nearest(foot[None])[0]
            if not np.isfinite(ground) or abs(ground - foot[2]) > STEEPEST:
                continue
            centre = np.array([*foot[:2], ground + ON_POSTS.draw(half, rng)])
            if (
                self._is_free(centre, s, half, u)
                and self.line.distance(centre) > self.post_distance[0] - 0.5
            ):
                return TargetSpot("post", s, lateral, centre, u, UP, ground)
        return None

    def _is_free(self, centre, s, half, u):
        """True if a target is visible from the drive, and its board, at any angle, touches
        nothing.
        """
        eye = eyes(self.line, s)
        if not sees(self.mesh.caster, eye, np.broadcast_to(centre, eye.shape)).all():
            return False
        angle = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)[:, None]
        rim = np.cos(angle) * u + np.sin(angle) * np.cross(u, UP)
        ends = np.vstack([centre + 1.5 * half * (rim + z * UP) for z in (-0.6, 0.0, 0.6)])
        return sees(self.mesh.caster, np.broadcast_to(centre, ends.shape), ends).all()

    def furniture(self, placed: Placed) -> Mesh:
        """Make the mesh of the targets' posts.

        Parameters
        ----------
        placed : Placed
            The targets.
        """
        return placed.posts
