"""The sections of report.json and calibration.json on what two passes both saw."""

import numpy as np

from mlscorr.estimate import Estimate, TieResiduals, tie_value
from mlscorr.survey import TIE_KINDS


def tie_section(estimate: Estimate) -> dict[str, object] | None:
    """What ties did to an estimate, or the reason why there is none; None where nobody looked.

    ``pairs`` has the misclosures of each two passes before and after, of the ties that were used;
    ``share`` what control and ties each bring; ``sufficient_control`` with how many control points
    the drive would have been known about as well.

    Parameters
    ----------
    estimate : Estimate
    """
    residuals = estimate.ties
    if residuals is None:
        if estimate.untied:
            return {"n": 0, "used": 0, "reason": estimate.untied}
        return None
    value = tie_value(estimate)
    return {
        **misfit_section(residuals),
        "share": value.share,
        "sufficient_control": value.sufficient,
    }


def misfit_section(residuals: TieResiduals | None) -> dict[str, object] | None:
    """Numbers and misclosures of ties before and after; None where there is none.

    Parameters
    ----------
    residuals : TieResiduals or None
    """
    if residuals is None:
        return None
    ties = residuals.ties
    used = residuals.used
    return {
        "n": len(ties),
        "used": int(used.sum()),
        "kinds": {kind: int((ties.kind == kind).sum()) for kind in TIE_KINDS},
        "before": misfit(ties.misclosure[used]),
        "after": misfit(residuals.after[used]),
        "pairs": pair_rows(residuals),
    }


def pair_rows(residuals: TieResiduals) -> list[dict[str, object]]:
    """Numbers of ties of each two passes, and their misclosures before and after.

    Each scanner's passes have numbers of their own; scanners count from 1, as in survey.toml.

    Parameters
    ----------
    residuals : TieResiduals
    """
    ties = residuals.ties
    rows = []
    for passes in np.unique(ties.pass_number, axis=0):
        inside = (ties.pass_number == passes).all(axis=1)
        both = inside & residuals.used
        row = {
            "passes": passes.tolist(),
            "scanners": (ties.scanner[inside][0] + 1).tolist(),
            "n": int(inside.sum()),
            "used": int(both.sum()),
            "before": misfit(ties.misclosure[both]),
            "after": misfit(residuals.after[both]),
        }
        rows.append(row)
    return rows


def misfit(misclosure: np.ndarray) -> dict[str, float | None]:
    """Median size and root mean square of misclosures. Units: m.

    Parameters
    ----------
    misclosure : (n,) array
        Units: m.
    """
    if len(misclosure) == 0:
        return {"median": None, "rms": None}
    rms = np.sqrt(np.mean(misclosure**2))
    return {"median": float(np.median(np.abs(misclosure))), "rms": float(rms)}
