"""Contribution of ties to an estimate, compared with control points."""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.collocation import leave_each_out
from mlscorr.estimate._prediction import pose_rows
from mlscorr.estimate.factors import TARGET, TIE
from mlscorr.estimate.pos_error import Estimate
from mlscorr.estimate.settings import SETTINGS
from mlscorr.survey import TIE_KINDS


@dataclass(frozen=True)
class TieValue:
    """Contributions of control points and of ties.

    Parameters
    ----------
    share : dict
        Fraction of all information about the POS error, by kind: control, and TIE_KINDS. An
        observation contributes one minus its redundancy number, the part of an error that enters
        the result.
    sufficient : int or None
        Number of control points, evenly chosen, with which the drive's median sigma would have been
        no worse than a tenth of all of them; None without control.
    """

    share: dict[str, float]
    sufficient: int | None


@threadpool_limits.wrap(limits=1, user_api="blas")  # more threads would change the last digits
def tie_value(estimate: Estimate) -> TieValue:
    """Contributions of control points and of ties to an estimate.

    Parameters
    ----------
    estimate : Estimate
        With ties.
    """
    adjustment = estimate.adjustment
    residuals = estimate.ties
    if adjustment.ties is None or residuals is None:
        return TieValue({"control": 1.0}, None)
    solved = adjustment.solve(estimate.parameters)
    kinds = [factor.kind for factor in adjustment.observing]
    left_out = dict(zip(kinds, leave_each_out(solved), strict=True))
    absorbed = (1.0 - left_out[TIE].redundancy).ravel()
    kind = residuals.ties.kind[residuals.used]
    parts = {name: float(absorbed[kind == name].sum()) for name in TIE_KINDS}
    parts = {"control": float((1.0 - left_out[TARGET].redundancy).sum()), **parts}
    total = sum(parts.values())
    share = {name: part / total for name, part in parts.items()}
    return TieValue(share, _sufficient(adjustment, estimate.parameters, solved))


def _sufficient(adjustment, parameters, solved):
    """Smallest number of evenly chosen control points that approximately reach the sigma of all."""
    names = list(adjustment.target_rows)
    if len(names) < 2:
        return len(names) or None
    limit = SETTINGS.sufficient_ratio * _median_sigma(adjustment, parameters, solved)

    def suffices(number):
        chosen = {names[i] for i in np.linspace(0, len(names) - 1, number).round().astype(int)}
        part = adjustment.without([name for name in names if name not in chosen])
        return _median_sigma(part, parameters, part.solve(parameters)) <= limit

    return 1 + bisect_left(range(1, len(names)), True, key=suffices)


def _median_sigma(adjustment, parameters, solved):
    """Median 3D sigma of the corrected position along the drive. Units: m."""
    last = len(adjustment.trajectory) - 1
    rows = np.unique(np.linspace(0, last, SETTINGS.prediction_epochs).round().astype(int))
    covariance = solved.predict(*pose_rows(adjustment, parameters, rows))[1]
    return float(np.median(np.sqrt(np.einsum("qii->q", covariance[:, :3, :3]))))
