"""Checks of the inputs of an estimate, and defaults for missing sigmas of the POS."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from mlscorr.estimate.settings import SETTINGS
from mlscorr.survey import Matched, Pos, Statement, Trajectory


def checked_inputs(
    trajectory: Trajectory, matched: Matched, pos: Pos, order: int
) -> tuple[Trajectory, tuple[Statement, ...]]:
    """Return the trajectory with all its sigmas, and Statements on those that were filled in.

    Parameters
    ----------
    trajectory : Trajectory
    matched : Matched
    pos : Pos
    order : int
        Of the trend.

    Raises
    ------
    ValueError
        Without any observation, for an invalid order, and for invalid sigmas: negative ones, or
        zero for both a control point and its observation.
    """
    if len(matched) == 0:
        raise ValueError("No control point was observed, so no correction can be estimated.")
    check_order(order)
    _check_noise(matched)
    if pos.position_sigma < 0 or np.any(np.asarray(pos.attitude_sigma) < 0):
        raise ValueError(
            f"The sigmas of the POS under [pos] are {pos.position_sigma} m and "
            f"{np.degrees(pos.attitude_sigma).tolist()} deg; none may be negative."
        )
    return filled_sigmas(trajectory)


def check_order(order: int) -> None:
    """Reject an order of the trend that is not a whole number from 0 on.

    Parameters
    ----------
    order : int

    Raises
    ------
    ValueError
    """
    if not isinstance(order, int | np.integer) or isinstance(order, bool) or order < 0:
        raise ValueError(
            f"The order of the trend is {order!r}; it must be a whole number of 0 (a shift) or "
            "more."
        )


def _check_noise(matched):
    """Reject noise that is negative, not a number, or zero."""
    sigma = matched.surveyed.sigma
    wrong = ~(sigma >= 0).all(axis=1) | ~(matched.variance >= SETTINGS.resolution**2).all(axis=1)
    if wrong.any():
        first = int(np.argmax(wrong))
        raise ValueError(
            f"{wrong.sum()} of {len(matched)} observed control points have a sigma that is "
            "negative, not a number, or zero for both survey and observation (first: "
            f"{matched.name[first]}, {sigma[first].tolist()} m). Set sigma_horizontal and "
            "sigma_vertical, at least 0.002 m with a total station."
        )


def filled_sigmas(trajectory: Trajectory) -> tuple[Trajectory, tuple[Statement, ...]]:
    """Return the trajectory with all its sigmas, and Statements on those that were filled in.

    Sigmas of zero, and those that jump at single epochs, are taken from the adjacent epochs; zero
    at all epochs counts as missing.

    Parameters
    ----------
    trajectory : Trajectory

    Raises
    ------
    ValueError
        For negative sigmas.
    """
    notes: list[Statement] = []
    columns: dict[str, np.ndarray | None] = {}
    for name, unit in (("position_sigma", "m"), ("attitude_sigma", "deg")):
        sigma = getattr(trajectory, name)
        if sigma is None:
            continue
        if (sigma < 0).any():
            raise ValueError(
                f"{(sigma < 0).any(axis=1).sum()} of {len(trajectory)} trajectory epochs have a "
                f"negative {name}. Check the order of the columns."
            )
        stated = (sigma > 0).all(axis=1)
        if not stated.any():
            columns[name] = None
            values = {"epochs": len(trajectory), "column": name, "unit": unit}
            notes.append(Statement("zero sigmas", "warning", values))
            continue
        stated &= ~_is_lone_jump(sigma)
        if stated.all():
            continue
        columns[name] = np.column_stack(
            [
                np.interp(trajectory.gps_time, trajectory.gps_time[stated], v[stated])
                for v in sigma.T
            ]
        )
        values = {
            "filled": int((~stated).sum()),
            "epochs": len(trajectory),
            "column": name,
            "unit": unit,
            "first": float(trajectory.gps_time[np.argmin(stated)]),
        }
        notes.append(Statement("filled sigmas", "warning", values))
    if columns:
        trajectory = replace(trajectory, **columns)
    return trajectory, tuple(notes)


def _is_lone_jump(sigma):
    """Mask (n,) of epochs with sigmas (n, 3) far from those on both sides."""
    usual = median_filter(sigma, size=(SETTINGS.median_epochs, 1), mode="nearest")
    ratio = np.divide(sigma, usual, out=np.ones_like(sigma), where=usual > 0)
    return ((ratio > SETTINGS.lone_jump) | (ratio < 1 / SETTINGS.lone_jump)).any(axis=1)
