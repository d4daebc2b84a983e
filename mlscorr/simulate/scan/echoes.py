"""Echoes of each pulse: one for a thin beam, or several for a beam with a footprint.

Rays are cast in float32 about a local origin (Open3D); all measurements are computed in float64 on
the plane of the triangle that was hit.
"""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.simulate.scan.rays import Rays
from mlscorr.simulate.scan.threads import Workspace, in_slices
from mlscorr.simulate.scene import Mesh
from mlscorr.simulate.settings import SETTINGS

NO_TRIANGLE = np.uint32(0xFFFFFFFF)  # Open3D's triangle of a ray that hits nothing

# Sub-rays of a beam and their shares of its power: the rule of Radon for a Gaussian, exact to
# degree 5 with a center of 1/2 and a hexagon of 1/12 each at two sigma, where the power is 1/e^2,
# as in the definition of divergence.
ANGLES = np.arange(6) * np.pi / 3
SUB_RAYS = np.vstack([[0.0, 0.0], np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])])
POWER = np.array([1 / 2] + [1 / 12] * 6)


@dataclass(frozen=True)
class Hits:
    """Echoes of n pulses: one row for the first echo of each, received or not, then later ones.

    Parameters
    ----------
    range : (n + m,) array
        0 without a return. Units: m.
    incidence : (n + m,) array
        Cosine of the angle between beam and normal.
    strength : (n + m,) array
        1 for a white, perpendicular, near surface.
    triangle : (n + m,) int array
        Triangle of the strongest part.
    point : (n + m, 3) array
        Point of the beam's axis at this range, in map coordinates. Units: m.
    pulse : (m,) int array
        Pulse of each later echo.
    """

    range: np.ndarray
    incidence: np.ndarray
    strength: np.ndarray
    triangle: np.ndarray
    point: np.ndarray
    pulse: np.ndarray


@dataclass(frozen=True)
class Surfaces:
    """Mesh that rays can hit."""

    mesh: Mesh

    @cached_property
    def _planes(self):
        """Unit normal, distance from the origin (m) and reflectance of each triangle: (n, 5)."""
        return np.column_stack([self.mesh.normal, self.mesh.offset, self.mesh.reflectance])

    def cast(self, rays: np.ndarray) -> np.ndarray:
        """Return the triangle (n,) that each float32 ray (n, 6) hits first, NO_TRIANGLE for none.

        Parameters
        ----------
        rays : (n, 6) float32 array
            Start relative to the local origin (m), and direction.
        """
        return self.mesh.caster.cast_rays(rays)["primitive_ids"].numpy()

    def hits(
        self, rays: Rays, origin: np.ndarray, divergence: float, max_range: float, room: Workspace
    ) -> Hits:
        """Compute the Hits of Rays.

        Parameters
        ----------
        rays : Rays
        origin : (3,) array
            Map coordinates of the local origin. Units: m.
        divergence : float
            Full angle between the directions of 1/e^2 power; 0 for one thin ray. Units: rad.
        max_range : float
            Units: m.
        room : Workspace
            Memory of the Hits until the next ones.
        """
        n = len(rays)
        limits = (SETTINGS.no_return_cosine, SETTINGS.fading)
        hit = room.array("hit", n, dtype=np.int32)
        first = room.array("met", n, 3), hit, room.array("point", n, 3)
        if divergence == 0:
            rows = rays.ray, self.cast(rays.single), *first
            in_slices(n, _thin, rows, (origin, self._planes, *limits, max_range))
            return Hits(*first[0].T, *first[1:], np.empty(0, np.int64))
        fan = room.array("fan", n, len(SUB_RAYS), 6, dtype=np.float32)
        offsets = SUB_RAYS * divergence / 2
        in_slices(n, _fan, (rays.ray, fan), (offsets,))
        triangle = self.cast(fan.reshape(-1, 6)).reshape(n, -1)
        constants = origin, offsets, POWER, self._planes, *limits, max_range, SETTINGS.pulse_length
        later = in_slices(n, _wide, (rays.ray, triangle, *first), constants)
        pulse = np.concatenate([start + rows[0] for start, rows in later])
        more = np.concatenate([rows[1] for _, rows in later])
        hit = np.concatenate([rows[2] for _, rows in later])
        point = origin + rays.ray[pulse, :3] + more[:, :1] * rays.ray[pulse, 3:6]
        whole = [np.concatenate(pair) for pair in zip(first, (more, hit, point), strict=True)]
        return Hits(*whole[0].T, *whole[1:], pulse)


@loop(inline="always")
def _meet(rays, p, x, y, z, planes, t, grazing, fading, max_range):
    """Range, cosine of incidence and strength where a ray meets a plane.

    Strength falls with the cosine (Lambert) and with the square of the range, beyond a near field.
    """
    a = planes[t, 0]
    b = planes[t, 1]
    c = planes[t, 2]
    slope = a * x + b * y + c * z
    if abs(slope) < grazing:
        return 0.0, 0.0, 0.0
    distance = (planes[t, 3] - (a * rays[p, 0] + b * rays[p, 1] + c * rays[p, 2])) / slope
    if not 0.0 < distance < max_range:
        return 0.0, 0.0, 0.0
    spread = 1.0 + distance * distance / fading**2
    return distance, abs(slope), planes[t, 4] * abs(slope) / spread


@loop
def _thin(rays, triangle, met, hit, point, origin, planes, grazing, fading, max_range):
    for p in range(len(rays)):
        x = rays[p, 3]
        y = rays[p, 4]
        z = rays[p, 5]
        away = 0.0
        slant = 0.0
        strength = 0.0
        if triangle[p] != NO_TRIANGLE:
            away, slant, strength = _meet(
                rays, p, x, y, z, planes, triangle[p], grazing, fading, max_range
            )
        hit[p] = triangle[p] if away > 0.0 else -1
        met[p, 0] = away
        met[p, 1] = slant
        met[p, 2] = strength
        point[p, 0] = origin[0] + (rays[p, 0] + away * x)
        point[p, 1] = origin[1] + (rays[p, 1] + away * y)
        point[p, 2] = origin[2] + (rays[p, 2] + away * z)


@loop(inline="always")
def _sub_ray(rays, p, u, v):
    """Unit direction (3,) of a sub-ray, u along the sweep and v across it. Units: rad."""
    dx = rays[p, 3]
    dy = rays[p, 4]
    dz = rays[p, 5]
    ex = rays[p, 6]
    ey = rays[p, 7]
    ez = rays[p, 8]
    x = dx + u * ex + v * (dy * ez - dz * ey)
    y = dy + u * ey + v * (dz * ex - dx * ez)
    z = dz + u * ez + v * (dx * ey - dy * ex)
    length = sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


@loop
def _fan(rays, fan, offsets):
    for p in range(len(rays)):
        for k in range(len(offsets)):
            for axis in range(3):
                fan[p, k, axis] = rays[p, axis]
            x, y, z = _sub_ray(rays, p, offsets[k, 0], offsets[k, 1])
            fan[p, k, 3] = x
            fan[p, k, 4] = y
            fan[p, k, 5] = z


@loop
def _wide(
    rays,
    triangle,
    met,
    hit,
    point,
    origin,
    offsets,
    power,
    planes,
    grazing,
    fading,
    max_range,
    pulse_length,
):
    """Fill the rows of the first echoes; return pulse, met and hit of the later ones."""
    parts = np.empty((len(offsets), 4))
    pulse = np.empty(64, np.int64)
    later = np.empty((64, 3))
    later_hit = np.empty(64, np.int32)
    count = 0
    for p in range(len(rays)):
        filled = _parts(
            rays, p, triangle, offsets, power, planes, grazing, fading, max_range, parts
        )
        met[p, 0] = 0.0
        met[p, 1] = 0.0
        met[p, 2] = 0.0
        hit[p] = -1
        start = 0
        while start < filled:
            end, away, slant, strength, main = _echo(parts, start, filled, pulse_length)
            if start == 0:
                met[p, 0] = away
                met[p, 1] = slant
                met[p, 2] = strength
                hit[p] = main
            else:
                if count == len(pulse):
                    pulse = np.concatenate((pulse, pulse))
                    later = np.concatenate((later, later))
                    later_hit = np.concatenate((later_hit, later_hit))
                later[count, 0] = away
                later[count, 1] = slant
                later[count, 2] = strength
                pulse[count] = p
                later_hit[count] = main
                count += 1
            start = end
        for axis in range(3):
            point[p, axis] = origin[axis] + (rays[p, axis] + met[p, 0] * rays[p, 3 + axis])
    return pulse[:count], later[:count], later_hit[:count]


@loop(inline="always")
def _parts(rays, p, triangle, offsets, power, planes, grazing, fading, max_range, parts):
    """Results of each sub-ray, nearest first: rows range, incidence, strength, triangle."""
    filled = 0
    for k in range(len(offsets)):
        t = triangle[p, k]
        if t == NO_TRIANGLE:
            continue
        x, y, z = _sub_ray(rays, p, offsets[k, 0], offsets[k, 1])
        distance, incidence, strength = _meet(
            rays, p, x, y, z, planes, t, grazing, fading, max_range
        )
        if distance == 0.0:
            continue
        at = filled
        while at > 0 and parts[at - 1, 0] > distance:
            for column in range(4):
                parts[at, column] = parts[at - 1, column]
            at -= 1
        parts[at, 0] = distance
        parts[at, 1] = incidence
        parts[at, 2] = strength * power[k]
        parts[at, 3] = t
        filled += 1
    return filled


@loop(inline="always")
def _echo(parts, start, filled, pulse_length):
    """Echo that starts with a part: the row after it, range, incidence, strength, triangle.

    Parts within a pulse length of the current echo are merged into it, at the mean weighted by
    strength, so echoes are at least that far apart.
    """
    first = parts[start, 0]
    end = start
    total = 0.0
    mixed = 0.0
    slant = 0.0
    strongest = -1.0
    main = -1
    while end < filled:
        away = parts[end, 0] - first
        if total > 0.0 and away - mixed / total >= pulse_length:
            break
        strength = max(parts[end, 2], 1e-12)  # a surface without reflection also needs a weight
        total += strength
        mixed += strength * away
        slant += strength * parts[end, 1]
        if strength > strongest:
            strongest = strength
            main = int(parts[end, 3])
        end += 1
    return end, first + mixed / total, slant / total, total, main
