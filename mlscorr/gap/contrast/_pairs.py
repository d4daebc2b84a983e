"""Cells of a real and of a simulated cloud side by side, told apart by nothing but their origin.

Range, slant and brightness of a cell are those of both together: whatever is chosen by them is
chosen from both alike, so that twins differ by chance alone.
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.contrast._blocks import block_of
from mlscorr.gap.contrast.sample import ChannelSample
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.survey import Columns, Survey


@dataclass(frozen=True, repr=False)
class PairedCells(Columns):
    """Cells in which either cloud has points.

    Parameters
    ----------
    points : (c, 2) array
        Of the real and of the simulated cloud.
    brightness : (c, 2) array
        Mean log10 of the intensity; NaN where either has too few points.
    range : (c,) array
        Units: m.
    incidence : (c,) array
        NaN where the cell is not flat. Units: deg.
    block : (c,) int array
    """

    points: np.ndarray
    brightness: np.ndarray
    range: np.ndarray
    incidence: np.ndarray
    block: np.ndarray


def paired_cells(survey: Survey, real: ChannelSample, simulated: ChannelSample) -> PairedCells:
    """PairedCells of the ground of which both samples have all cells.

    Parameters
    ----------
    survey : Survey
    real, simulated : ChannelSample
    """
    share = min(real.share, simulated.share)
    clouds = [each.cells[each.cells.chance < share] for each in (real, simulated)]
    key = np.union1d(*(cells.key for cells in clouds))
    places = [np.searchsorted(key, cells.key) for cells in clouds]

    def spread(values):
        table = np.zeros((2, len(key), *values[0].shape[1:]))
        for side, (place, of_cells) in enumerate(zip(places, values, strict=True)):
            table[side, place] = of_cells
        return table

    points = spread([cells.points for cells in clouds])
    total = np.maximum(points.sum(axis=0), 1.0)

    def mean(values):
        return (points[..., None] * spread(values)).sum(axis=0) / total[:, None]

    sight = mean([cells.sight(survey) for cells in clouds])
    scatter = spread([cells.scatter for cells in clouds]).sum(axis=0)
    brightness = spread([cells.brightness for cells in clouds])
    brightness[:, (points < OBSERVE.samples).any(axis=0)] = np.nan
    return PairedCells(
        points=points.T,
        brightness=brightness.T,
        range=np.linalg.norm(sight, axis=1),
        incidence=_incidence(sight, scatter, total),
        block=block_of(mean([cells.centre for cells in clouds])),
    )


def _incidence(sight, scatter, points):
    """Angle (c,) between beams and normals, in deg; NaN for cells that are not flat."""
    values, axes = np.linalg.eigh(scatter / points[:, None, None])
    cosine = np.abs(np.einsum("ci,ci->c", sight, axes[:, :, 0]))
    cosine /= np.maximum(np.linalg.norm(sight, axis=1), 1e-9)
    is_flat = (values[:, 0] <= OBSERVE.roughest**2) & (values[:, 1] >= OBSERVE.narrowest_patch**2)
    is_flat &= points >= 2 * OBSERVE.plane_points
    return np.where(is_flat, np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))), np.nan)
