"""How large the gap is, beyond chance, in the unit in which its kind of cause shows.

systematic   mm: of the squared residuals, in the metric of V^-1, the most that any one cause, known
             or unknown, could explain, less what it explains by chance
position     mm: mean of sigma_i^2 (u_i^2 - 1) of the innovations u: more than all sigmas predict
scatter      mm: mean excess variance of the points about their planes
returns      percent: mean excess share of pulses that return

All are signed squares that are zero on average when nothing is wrong.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from mlscorr.gap.background import BELIEVED, Epochs, Setting
from mlscorr.gap.evidence import Table, groups
from mlscorr.gap.weighing import FREE
from mlscorr.gap.whitening import whitener

UNITS = {"systematic": "mm", "position": "mm", "scatter": "mm", "returns": "%"}
REPLICAS = 100
BAND = (2.5, 97.5)  # percent


@dataclass(frozen=True)
class Predicted:
    """What a simulator with a cause in it expects of the rows.

    Parameters
    ----------
    shift : (m,) array
        Of the residuals, in their unit.
    growth : (m,) array
        Of roughness rows: variance about the plane that is added, over the believed one.
    extra : (m,) array
        Variance that is added to the rows' own noise. Units: m^2.
    setting : Setting
        Of the POS's covariance.
    """

    shift: np.ndarray
    growth: np.ndarray
    extra: np.ndarray
    setting: Setting = BELIEVED

    @classmethod
    def nothing(cls, rows):
        """Of the simulator as it is."""
        zero = np.zeros(len(rows))
        return cls(zero, zero, zero)


def kind_of(label, noisy, rows):
    """How the gap of a label is measured; noisy are the names of noise classes."""
    parts = set(label.split("+"))
    if not parts <= set(noisy):
        return "systematic"
    if parts == {"dropout"}:
        return "returns"
    rough = (rows.channel == "roughness").any()
    return "scatter" if rough and "position_noise" not in parts else "position"


def signed_root(square, unit="mm"):
    """sign(g) |g|^(1/2) of a square in m^2 (in mm) or of shares (in percent)."""
    return (1e3 if unit == "mm" else 1e2) * np.sign(square) * np.sqrt(np.abs(square))


def systematic(observed: Epochs, setting: Setting, table: Table, residual):
    """The most that any block of a table explains of the squares of residuals (n, k): (k,).

    In the metric of V^-1. Each block counts as it does in the evidence: by its trust, less its
    number of columns, which is what it explains by chance.
    """
    k, most = residual.shape[1], np.full(residual.shape[1], -np.inf)
    both = np.hstack([residual, observed.columns(table.columns)])
    white = whitener(observed, setting).whiten(both)
    y, a = white[slice(k)], white[slice(k, None)]
    projected = a.product(y)
    for index, numbers, _ in groups(table):
        value, vector = np.linalg.eigh(a.blocks(index))
        value = np.maximum(value, 0.0)
        square = (vector.swapaxes(1, 2) @ projected[index]) ** 2
        told = (square / (value + FREE**-2)[:, :, None]).sum(axis=1)
        counted = (value * FREE**2 > 1).sum(axis=1)
        trust = np.array([table.blocks[i].trust for i in numbers])
        most = np.maximum(most, (trust[:, None] * told - counted[:, None]).max(axis=0))
    return most


def length(observed: Epochs, setting: Setting):
    """Square of the length that a sum of squares of one has, spread over all rows. Units: m^2.

    The sigma is that of the median innovation.
    """
    _, sigma = whitener(observed, setting).innovations(np.zeros((len(observed), 1)))
    return float(np.median(sigma) ** 2 / len(observed))


def position(observed: Epochs, predicted: Predicted, residual):
    """sigma^2 (u^2 - 1) (n, k) of residuals (n, k) less what is predicted. Units: m^2."""
    extra = predicted.extra[observed.row] * observed.half
    shift = observed.columns(predicted.shift[:, None])
    u, sigma = whitener(observed, predicted.setting, extra).innovations(residual - shift)
    return sigma[:, None] ** 2 * (u**2 - 1)


def scatter(rows, predicted: Predicted, residual):
    """Excess variance (m, k) about the planes of roughness rows, zero elsewhere. Units: m^2."""
    rough = (rows.channel == "roughness")[:, None]
    believed = np.where(rough, rows.believed[:, None], 0.0)
    return believed * (np.exp(np.where(rough, residual, 0.0)) - 1 - predicted.growth[:, None])


def without(observed: Epochs, keep):
    """Epochs of some observations, (n,) bool, in which their errors in common stay."""
    arrays = {
        one.name: getattr(observed, one.name)[keep]
        for one in fields(Epochs)
        if isinstance(getattr(observed, one.name), np.ndarray)
    }
    return replace(observed, **arrays)
