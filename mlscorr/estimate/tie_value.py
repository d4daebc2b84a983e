"""What ties bring to an estimate beside control points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.collocation import leave_each_out
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.pos_error import Estimate
from mlscorr.estimate.prediction import predict_under
from mlscorr.estimate.settings import SETTINGS


@dataclass(frozen=True)
class TieValue:
    """What control points and ties each bring.

    Parameters
    ----------
    share : dict
        Of what both tell of the POS error, by kind: control, plane, pole. An observation tells what
        its redundancy number lacks to one, the part of an error in it that the result takes up.
    sufficient : int or None
        Number of control points, evenly chosen, with which the drive's median sigma would have been
        no worse than a tenth of all of them; None without control.
    """

    share: dict[str, float]
    sufficient: int | None


@threadpool_limits.wrap(limits=1, user_api="blas")  # more threads, other last digits
def tie_value(estimate: Estimate) -> TieValue:
    """What control points and ties each bring to an estimate.

    Parameters
    ----------
    estimate : Estimate
        With ties.
    """
    equations, residuals = estimate.equations, estimate.ties
    if equations.ties is None or residuals is None:
        return TieValue({"control": 1.0}, None)
    control, ties = leave_each_out(equations.solve(estimate.parameters))
    absorbed = (1.0 - ties.redundancy).ravel()
    kind = residuals.ties.kind[residuals.used]
    parts = {name: float(absorbed[kind == name].sum()) for name in ("plane", "pole")}
    parts = {"control": float((1.0 - control.redundancy[: len(equations.names)]).sum()), **parts}
    total = sum(parts.values())
    return TieValue({name: part / total for name, part in parts.items()}, _sufficient(estimate))


def _sufficient(estimate):
    """The least number of evenly chosen control points that reach the sigma of all, about."""
    names = list(estimate.equations.target_rows)
    if len(names) < 2:
        return len(names) or None
    limit = SETTINGS.sufficient_ratio * _median_sigma(estimate, estimate.equations)
    low, high = 1, len(names)
    while low < high:
        number = (low + high) // 2
        chosen = {names[i] for i in np.linspace(0, len(names) - 1, number).round().astype(int)}
        part = estimate.equations.without([name for name in names if name not in chosen])
        if _median_sigma(estimate, part.affordable()) <= limit:
            high = number
        else:
            low = number + 1
    return low


def _median_sigma(estimate: Estimate, equations: Equations) -> float:
    """Median 3D sigma of the corrected position along the drive. Units: m."""
    last = len(equations.trajectory) - 1
    rows = np.unique(np.linspace(0, last, SETTINGS.prediction_epochs).round().astype(int))
    covariance = predict_under(equations, estimate.parameters, rows)[1]
    return float(np.median(np.sqrt(np.einsum("qii->q", covariance[:, :3, :3]))))
