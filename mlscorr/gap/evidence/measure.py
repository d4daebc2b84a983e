"""Size of the gap beyond chance, in the unit of its kind of cause.

systematic mm: of the squared residuals, in the metric of V^-1, the most that any one cause, known
or unknown, could explain, minus the part by chance position mm: mean of sigma_i^2 (u_i^2 - 1) of
the innovations u: more than all sigmas predict scatter mm: mean excess variance of the points about
their planes returns percent: mean excess share of pulses that return

All are signed squares that are zero on average when nothing is wrong.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mlscorr.effects import effect_class
from mlscorr.gap.evidence.evidence import ColumnTable, block_groups
from mlscorr.gap.evidence.observations import STATED, ErrorModel, Observations, window_growth
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Rows

UNITS = {"systematic": "mm", "position": "mm", "scatter": "mm", "returns": "%"}


@dataclass(frozen=True)
class Predicted:
    """Prediction of the rows by a simulator with a cause.

    Parameters
    ----------
    shift : (m,) array
        Shift of the residuals, in their unit.
    growth : (m,) array
        For roughness rows: added variance about the plane over the assumed one.
    extra : (m,) array
        Variance added to the rows' own noise. Units: m^2.
    model : ErrorModel
        Of the POS's covariance.
    """

    shift: np.ndarray
    growth: np.ndarray
    extra: np.ndarray
    model: ErrorModel = STATED

    @classmethod
    def nothing(cls, rows: Rows) -> Predicted:
        """Return the prediction of the unchanged simulator."""
        zero = np.zeros(len(rows))
        return cls(zero, zero, zero)


def gap_kind(label: str, noisy: Iterable[str], rows: Rows) -> str:
    """Measure of a label's gap, one of UNITS.

    Parameters
    ----------
    label : str
    noisy : iterable of str
        Names of noise classes.
    rows : Rows
    """
    parts = set(label.split("+"))
    if not parts <= set(noisy):
        return "systematic"
    kinds = [effect_class(part) for part in parts]
    if all(kind.stage == "return" for kind in kinds):
        return "returns"
    rough = (rows.channel == "roughness").any()
    if rough and not any(kind.is_of_pose() for kind in kinds):
        return "scatter"
    return "position"


def signed_root(square: np.ndarray, unit: str = "mm") -> np.ndarray:
    """sign(g) |g|^(1/2) of a square in m^2 (in mm) or of shares (in percent)."""
    scale = {"mm": 1e3, "%": 1e2}[unit]
    return scale * np.sign(square) * np.sqrt(np.abs(square))


@dataclass(frozen=True)
class Explanations:
    """Explained part of innovations for each block of a table.

    Parameters
    ----------
    table : ColumnTable
    columns : (n, c) array
        Innovations of its columns.
    modes : tuple
        For blocks of equal size: indices (h,), columns (h, p) and, for each normal matrix,
        eigenvalues (h, p) and eigenvectors (h, p, p).
    """

    table: ColumnTable
    columns: np.ndarray
    modes: tuple

    @classmethod
    def of(cls, table: ColumnTable, columns: np.ndarray) -> Explanations:
        """Make the explanations; see the class."""
        normal = columns.T @ columns
        modes = []
        for index, numbers, _ in block_groups(table):
            value, vector = np.linalg.eigh(normal[index[:, :, None], index[:, None, :]])
            modes.append((numbers, index, np.maximum(value, 0.0), vector))
        return cls(table, columns, tuple(modes))

    def largest(self, innovations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Largest part of the squares that any block explains, and this block.

        The number of columns is subtracted for each block, as the part explained by chance.

        Parameters
        ----------
        innovations : (n, k) array

        Returns
        -------
        square : (k,) array
        block : (k,) int array
        """
        free = SETTINGS.free_sigma
        projected = self.columns.T @ innovations
        k = innovations.shape[1]
        scores = [np.full((1, k), -np.inf)]
        numbers = [np.array([-1])]
        for number, index, value, vector in self.modes:
            square = (vector.swapaxes(1, 2) @ projected[index]) ** 2
            explained = (square / (value + free**-2)[:, :, None]).sum(axis=1)
            scores.append(explained - (value * free**2 > 1).sum(axis=1)[:, None])
            numbers.append(number)
        score = np.vstack(scores)
        number = np.concatenate(numbers)
        best = score.argmax(axis=0)
        return score[best, np.arange(k)], number[best]

    def fit(self, number: int, innovations: np.ndarray) -> np.ndarray:
        """Return the fit of one block to innovations (n,)."""
        columns = self.columns[:, self.table.blocks[number].columns]
        normal = columns.T @ columns + np.eye(columns.shape[1]) / SETTINGS.free_sigma**2
        return columns @ np.linalg.solve(normal, columns.T @ innovations)


def position_terms(
    observations: Observations, predicted: Predicted, residual: np.ndarray
) -> np.ndarray:
    """Terms sigma^2 (u^2 - 1) of residuals minus predictions.

    Parameters
    ----------
    observations : Observations
    predicted : Predicted
    residual : (n, k) array

    Returns
    -------
    terms : (n, k) array
        Units: m^2.
    """
    extra = predicted.extra[observations.row] * observations.half
    shift = observations.columns(predicted.shift[:, None])
    u, sigma = observations.whitener(predicted.model, extra).innovations(residual - shift)
    return sigma[:, None] ** 2 * (u**2 - 1)


def scatter_terms(rows: Rows, predicted: Predicted, residual: np.ndarray) -> np.ndarray:
    """Excess variance about the planes of roughness rows, zero elsewhere.

    Parameters
    ----------
    rows : Rows
    predicted : Predicted
    residual : (m, k) array

    Returns
    -------
    terms : (m, k) array
        Units: m^2.
    """
    rough = (rows.channel == "roughness")[:, None]
    assumed = np.where(rough, rows.assumed[:, None], 0.0)
    return assumed * (np.exp(np.where(rough, residual, 0.0)) - 1 - predicted.growth[:, None])


def simulated_variance(
    observations: Observations, model: ErrorModel, extra: np.ndarray | None = None
) -> np.ndarray:
    """Variance (n,) of observations under a model: the diagonal of V. Units: m^2.

    Parameters
    ----------
    observations : Observations
    model : ErrorModel
    extra : (m,) array, optional
        Variance added to the rows' own noise. Units: m^2.
    """
    e = observations.errors
    position = (e.scaled_position(model.increased) ** 2).sum(axis=1)
    growth = np.hypot(window_growth(model.windows, e.gps_time), e.growth)[:, 0]
    variance = model.scale**2 * position + growth**2 * (e.position**2).sum(axis=1)
    variance += model.attitude[0] ** 2 * (e.attitude**2).sum(axis=1)
    variance += model.fixes**2 * (e.place**2).sum(axis=1) + model.noise**2 * e.own
    variance += (observations.shared**2).sum(axis=1)
    if extra is None:
        return variance
    return variance + extra[observations.row] * observations.half
