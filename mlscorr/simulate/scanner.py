"""A line scanner on a moving vehicle: pulses one by one, cast into the scene."""

from dataclasses import dataclass

import numpy as np

from mlscorr.simulate.scenario import LEAD

BLOCK = 400_000  # pulses in memory at a time
GRAZING = 0.01  # cosine of incidence below which nothing returns
FADING = 10.0  # m where the intensity has fallen to a half; a receiver's near field is flat
SPECKLE = 0.08  # relative, one sigma, as in the shared surveys
FULL_SCALE = 65535


@dataclass(frozen=True)
class Pulses:
    """Measured returns in scan order, and what they truly hit.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    angle, range : (n,) array
        As measured, from the zero beam. Units: rad, m.
    intensity : (n,) uint16 array
    point : (n, 3) array
        True point in map coordinates. Units: m.
    triangle : (n,) int array
        Triangle of the scene that was hit.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    range: np.ndarray
    intensity: np.ndarray
    point: np.ndarray
    triangle: np.ndarray

    def __len__(self):
        return len(self.gps_time)

    @property
    def scanner_xyz(self):
        """X_L (n, 3) = range (cos angle, sin angle, 0). Units: m."""
        beam = _beam(self.angle)
        return self.range[:, None] * beam

    @property
    def scan_angle(self):
        """Measured angle (n,) from -180 to 180 deg."""
        return np.degrees(np.mod(self.angle + np.pi, 2 * np.pi) - np.pi)


def scan(scene, origin, trajectory, mounting, scenario, rng, block=BLOCK):
    """Pulses of a drive along a true trajectory.

    Memory is one block of pulses and the returns. Rays are cast in float32 about the local origin
    (Open3D); the range is computed again in float64 on the plane of the triangle that was hit.
    """
    caster = _caster(scene)
    streams = rng.spawn(3)  # one for each noise, so that blocks of any size give the same
    duration = trajectory.gps_time[-1] - trajectory.gps_time[0] - 2 * LEAD
    pulses = int(duration * scenario.lines_per_second) * scenario.points_per_line
    blocks = []
    for start in range(0, pulses, block):
        number = np.arange(start, min(start + block, pulses))
        angle = 2 * np.pi * (number % scenario.points_per_line) / scenario.points_per_line
        rate = scenario.lines_per_second * scenario.points_per_line
        gps_time = trajectory.gps_time[0] + LEAD + number / rate
        rays = _rays(trajectory, mounting, origin, gps_time, angle)
        hit = _cast(caster, scene, *rays, scenario.max_range)
        blocks.append(_measure(scene, origin, gps_time, angle, rays, hit, scenario, streams))
    return Pulses(*(np.concatenate(column) for column in zip(*blocks, strict=True)))


def _beam(angle):
    """Unit vectors (n, 3) in the scanner frame."""
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])


def _caster(scene):
    """Open3D's ray caster of the scene's triangles, in their order."""
    import open3d as o3d

    corners = scene.mesh.triangles.reshape(-1, 3).astype(np.float32)
    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(corners, np.arange(len(corners), dtype=np.uint32).reshape(-1, 3))
    return caster


def _rays(trajectory, mounting, origin, gps_time, angle):
    """Start (n, 3), about the local origin, and unit direction (n, 3) of each pulse."""
    pose = trajectory.at(gps_time)
    start = pose.position - origin + pose.attitude.apply(mounting.lever_arm)
    return start, pose.attitude.apply(mounting.boresight.apply(_beam(angle)))


def _cast(caster, scene, start, direction, max_range):
    """Which rays return, and for these the triangle, the range (m) and the cosine of incidence."""
    answer = caster.cast_rays(np.hstack([start, direction]).astype(np.float32))
    returns = np.flatnonzero(answer["t_hit"].numpy() < max_range)
    triangle = answer["primitive_ids"].numpy()[returns].astype(np.int64)
    normal = scene.normal[triangle]
    slope = np.einsum("ij,ij->i", normal, direction[returns])
    seen = np.abs(slope) > GRAZING
    returns, triangle, normal, slope = returns[seen], triangle[seen], normal[seen], slope[seen]
    to_plane = scene.mesh.triangles[triangle, 0] - start[returns]
    distance = np.einsum("ij,ij->i", normal, to_plane) / slope
    return returns, triangle, distance, np.abs(slope)


def _measure(scene, origin, gps_time, angle, rays, hit, scenario, streams):
    """The columns of Pulses for one block: what was hit, with noise on range and angle."""
    start, direction = rays
    returns, triangle, distance, incidence = hit
    range_rng, angle_rng, speckle_rng = streams
    strength = scene.mesh.reflectance[triangle] * incidence / (1 + (distance / FADING) ** 2)
    strength *= 1 + SPECKLE * speckle_rng.standard_normal(len(returns))
    noise = np.radians(scenario.angle_noise) * angle_rng.standard_normal(len(returns))
    return (
        gps_time[returns],
        angle[returns] + noise,
        distance + scenario.range_noise * range_rng.standard_normal(len(returns)),
        np.clip(FULL_SCALE * strength, 0, FULL_SCALE).astype(np.uint16),
        origin + start[returns] + distance[:, None] * direction[returns],
        triangle,
    )
