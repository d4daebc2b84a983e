"""Parameters of a cause: estimate, sigma, and what this survey could detect at all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.effects import PositionNoise
from mlscorr.gap.evidence._error_models import ErrorModel
from mlscorr.gap.evidence._windows import Window
from mlscorr.gap.evidence.labels import LabelEvidence
from mlscorr.gap.evidence.observations import Observations
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import Signature

UNITS = ("s", "s", "ratio")  # of a window's start, length and factor


@dataclass(frozen=True)
class CauseParameter:
    """One number of a cause; detectable is its minimal detectable bias (80 %, 0.1 %)."""

    name: str
    unit: str
    estimate: float
    sigma: float = float("nan")
    detectable: float = float("nan")


@dataclass(frozen=True)
class AmplitudeFit:
    """Amplitudes (p,) of some columns, their covariance, and 1 / sigma^2 (p,) of each alone."""

    estimate: np.ndarray
    covariance: np.ndarray
    information: np.ndarray


def fit_amplitudes(
    observations: Observations,
    models: Sequence[ErrorModel],
    log_weight: np.ndarray,
    residual: np.ndarray,
    columns: np.ndarray,
) -> AmplitudeFit:
    """Amplitudes of columns in a residual, averaged over error models.

    Parameters
    ----------
    observations : Observations
    models : sequence of s ErrorModel
    log_weight : (s,) array
        Of each.
    residual : (n,) array
        Units: m.
    columns : (n, p) array
    """
    weight = np.exp(log_weight - np.logaddexp.reduce(log_weight))
    used = np.flatnonzero(weight > 0.01 * weight.max())
    weight = weight[used] / weight[used].sum()
    p = columns.shape[1]
    means = []
    covariances = []
    information = np.zeros(p)
    for w, s in zip(weight, used.tolist(), strict=True):
        white = observations.whitener(models[s]).whiten(np.column_stack([columns, residual]))
        normal = white.product(white)
        information += w * np.diag(normal)[:p]
        covariance = np.linalg.inv(normal[:p, :p] + np.eye(p) / SETTINGS.free_sigma**2)
        means.append(covariance @ normal[:p, p])
        covariances.append(covariance)
    mean = weight @ np.array(means)
    apart = np.array(means) - mean
    spread = np.einsum("s,sp,sq->pq", weight, apart, apart)
    covariance = np.tensordot(weight, np.array(covariances), 1) + spread
    return AmplitudeFit(mean, covariance, information)


def effect_parameters(
    rows: Rows, evidence: LabelEvidence, members: Sequence[Signature], labels: Sequence[str]
) -> tuple[tuple[CauseParameter, ...], list[np.ndarray], np.ndarray]:
    """Parameters of signatures acting together.

    Parameters
    ----------
    rows : Rows
    evidence : LabelEvidence
    members : sequence of Signature
    labels : sequence of str
        Of these.

    Returns
    -------
    parameters : tuple of CauseParameter
    estimates : list of (p,) arrays
        Of each signature.
    shift : (m,) array
        What they make of the residuals.
    """
    jacobian = np.hstack([m.jacobian for m in members])
    observations = evidence.observations
    scale = np.abs(jacobian[rows.metric]).max(axis=0)
    scale[scale == 0] = 1.0
    named = [i for i, block in enumerate(evidence.table.blocks) if block.label in labels]
    weight = evidence.blocks.by_model[:, named].max(axis=1)
    residual = observations.columns(rows.residual[:, None])[:, 0]
    columns = observations.columns(jacobian / scale)
    fit = fit_amplitudes(observations, evidence.blocks.models, weight, residual, columns)
    value = fit.estimate / scale
    sigma = np.sqrt(np.diag(fit.covariance)) / scale
    detectable = SETTINGS.detectable / np.sqrt(np.maximum(fit.information, 1e-300)) / scale
    parameters = []
    estimates = []
    start = 0
    for member in members:
        part = slice(start, start + len(member.parameters))
        prefix = "" if len(members) == 1 else f"{member.name} "
        numbers = zip(
            member.parameters, member.units, value[part], sigma[part], detectable[part], strict=True
        )
        parameters += [
            CauseParameter(prefix + name, unit, *map(float, sizes))
            for name, unit, *sizes in numbers
        ]
        event = evidence.event(member.name, "+".join(labels))
        sigmas = {} if event is None else event.sigma
        parameters += [
            CauseParameter(key, "s", member.fixed[key], sigmas.get(key, np.nan))
            for key in member.kind.moment()
        ]
        estimates.append(value[part])
        start = part.stop
    return tuple(parameters), estimates, jacobian @ value


def window_parameters(windows: Sequence[Window]) -> tuple[CauseParameter, ...]:
    """Parameters of windows in which the POS is worse."""
    parameters = []
    for number, window in enumerate(windows, start=1):
        after = f" {number}" if len(windows) > 1 else ""
        for name, unit, value in zip(PositionNoise.WINDOW, UNITS, window[:3], strict=True):
            parameters.append(CauseParameter(name + after, unit, value))
    return tuple(parameters)


def most_probable_size(size: np.ndarray, score: np.ndarray) -> tuple[float, float]:
    """Size at the top of a log evidence by log size, and its sigma, by a parabola.

    Parameters
    ----------
    size, score : (x,) array
    """
    best = int(np.clip(np.argmax(score), 1, len(size) - 2))
    x = np.log(size[best - 1 : best + 2])
    curve, slope, _ = np.polyfit(x - x[1], score[best - 1 : best + 2] - score[best], 2)
    if curve >= 0:
        return float(size[np.argmax(score)]), float(size[np.argmax(score)])
    at = np.clip(-slope / (2 * curve), x[0] - x[1], x[2] - x[1])
    value = float(np.exp(x[1] + at))
    return value, value * float(min(1.0, np.sqrt(-0.5 / curve)))
