"""Patches of the cloud against a reference surface: where the believed beams meet it."""

from dataclasses import dataclass

import numpy as np

from mlscorr.correction import Correction
from mlscorr.gap.residuals._covariates import scanner_origin
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.selection import consistent, gate, places, support
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.simulate import SceneScenario
from mlscorr.simulate.scene import read_mesh
from mlscorr.survey import Columns, Survey


@dataclass(frozen=True, repr=False)
class OnReference(Columns):
    """Patches that the reference surface has too.

    Parameters
    ----------
    patch : (m,) int array
        Their numbers.
    direction : (m, 3) array
        Normal of the reference, towards the scanner.
    residual : (m,) array
        How far they lie from it along the direction. Units: m.
    noise : (m,) array
        Variance of that. Units: m^2.
    """

    patch: np.ndarray
    direction: np.ndarray
    residual: np.ndarray
    noise: np.ndarray


def on_reference(
    survey: Survey, patches: Patches, correction: Correction | None = None
) -> OnReference:
    """Compare patches with [scene] reference: OnReference.

    Each patch's beams are cast into the reference from where the scanner is believed to have
    been. The residual is the mean distance of the patch's plane from the facets met, where the
    beams met them. Patches that meet nothing parallel within the gate are something that the
    reference lacks, and so are those that disagree with all others about their time.

    Parameters
    ----------
    survey : Survey
        With a reference.
    patches : Patches
    correction : Correction, optional
        By which patches find their like in the mesh, where more do than as recorded: control
        points may be what is off.

    Raises
    ------
    ValueError
        For a mesh that can't be used, and for one in other coordinates.
    """
    origin = np.round(patches.centre.mean(axis=0))
    mesh = read_mesh(SceneScenario(kind="mesh", file=survey.reference), origin)
    both = places(survey, patches, correction)
    tried = [(near, *_compare(there, near, mesh, origin)) for there, near in both]
    near, direction, residual, met = max(tried, key=lambda place: support(place[2][place[3]]))
    if met.sum() < max(1, SETTINGS.overlap * len(patches)):
        raise ValueError(_elsewhere(survey, patches, mesh, origin))
    met[met] = consistent(patches.gps_time[met], direction[met], residual[met])
    residual += np.einsum("pi,pi->p", direction, patches.centre - near.centre)
    noise = patches.variance / patches.points + SETTINGS.surface_sigma**2
    return OnReference(np.flatnonzero(met), direction[met], residual[met], noise[met])


def _compare(survey, patches, mesh, origin):
    """Direction (p, 3), residual (p,) and whether the patch met its like in the mesh (p,)."""
    p, samples = patches.time.shape
    start = scanner_origin(survey, patches.time.ravel()) - origin
    end = patches.xyz.reshape(-1, 3) - origin
    rays = np.hstack([start, end - start]).astype(np.float32)
    triangle = mesh.caster.cast_rays(rays)["primitive_ids"].numpy()
    hit = triangle < len(mesh)
    triangle = np.where(hit, triangle, 0)
    own = np.repeat(patches.normal, samples, axis=0)
    normal = mesh.normal[triangle]
    offset = mesh.offset[triangle]
    cosine = np.einsum("ni,ni->n", normal, own)
    facing = normal * np.sign(cosine)[:, None]
    off = np.einsum("ni,ni->n", own, end - np.repeat(patches.centre - origin, samples, axis=0))
    distance = np.einsum("ni,ni->n", normal, end - own * off[:, None]) - offset
    distance *= np.sign(cosine)
    limit = np.repeat(gate(survey, patches.gps_time), samples)
    used = hit & (np.abs(cosine) >= np.cos(SETTINGS.parallel)) & (np.abs(distance) <= limit)
    used = used.reshape(p, samples)
    count = np.maximum(used.sum(axis=1), 1)
    residual = (used * distance.reshape(p, samples)).sum(axis=1) / count
    direction = (used[..., None] * facing.reshape(p, samples, 3)).sum(axis=1)
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    met = (used.sum(axis=1) >= SETTINGS.facet_share * samples) & (length[:, 0] > 0)
    return direction / np.where(length > 0, length, 1.0), residual, met


def _elsewhere(survey, patches, mesh, origin):
    """The sentence for a reference surface that lies where the cloud is not."""
    centre = (patches.centre - origin).astype(np.float32)
    apart = mesh.caster.compute_closest_points(centre)["points"].numpy() - centre
    distance = np.median(np.linalg.norm(apart, axis=1))
    up = np.median(apart[:, 2])
    if abs(up) > 0.9 * distance:
        what = "in another height datum"
    else:
        what = "in another CRS or place"
    limit = float(np.median(gate(survey, patches.gps_time)))
    return (
        f"Of {len(patches)} flat patches of the cloud hardly any lies within {limit:.2f} m of the "
        f"reference surface {survey.reference}: it is {distance:.1f} m away in the median "
        f"({up:+.1f} m in height), so it seems to be {what}. Give it in the cloud's coordinates."
    )
