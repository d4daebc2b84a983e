"""What can't be estimated from, and what is done where the POS doesn't state its sigmas."""

from dataclasses import replace

import numpy as np

NO_NOISE = 1e-6  # m; less than any file's rounding, and a covariance that can't be inverted


def checked(trajectory, observations, control, pos, order):
    """The trajectory with all its sigmas, and sentences on those that were filled in.

    Raises ValueError without any observation, for an order below zero, and for sigmas that can't
    be: negative ones, or none at all of a control point and its observation together.
    """
    if len(observations) == 0:
        raise ValueError(
            "There is no observation of a control point to estimate a correction from."
        )
    if order < 0:
        raise ValueError(f"The trend's order is {order}; it should be 0 (a shift) or more.")
    _check_noise(observations, control)
    if pos.position_sigma < 0 or np.any(np.asarray(pos.attitude_sigma) < 0):
        raise ValueError(
            f"The believed sigmas of the POS are {pos.position_sigma} m and "
            f"{np.degrees(pos.attitude_sigma).tolist()} deg; none may be negative."
        )
    return _filled(trajectory)


def _check_noise(observations, control):
    """Refuse noise that is negative, not a number, or nothing."""
    row = [control.name.index(name) for name in observations.name]
    sigma = control.sigma[row]
    variance = sigma**2 + np.einsum("nii->ni", observations.covariance)
    wrong = ~(sigma >= 0).all(axis=1) | ~(variance >= NO_NOISE**2).all(axis=1)
    if wrong.any():
        first = int(np.argmax(wrong))
        raise ValueError(
            f"{wrong.sum()} of {len(row)} observed control points have a sigma that is negative, "
            f"not a number, or zero together with that of their observation (first: "
            f"{observations.name[first]}, {sigma[first].tolist()} m). No survey is free of noise: "
            "give sigma_horizontal and sigma_vertical, 0.002 m at least with a total station."
        )


def _filled(trajectory):
    """Sigmas of zero at some epochs are taken from the epochs beside; zero at all means perfect."""
    notes, columns = [], {}
    for name, unit in (("position_sigma", "m"), ("attitude_sigma", "deg")):
        sigma = getattr(trajectory, name)
        if sigma is None:
            continue
        if (sigma < 0).any():
            raise ValueError(
                f"{(sigma < 0).any(axis=1).sum()} of {len(trajectory)} trajectory epochs have a "
                f"negative {name}. Is the file's column order right?"
            )
        stated = (sigma > 0).all(axis=1)
        if stated.all() or not stated.any():
            continue
        columns[name] = np.column_stack(
            [
                np.interp(trajectory.gps_time, trajectory.gps_time[stated], v[stated])
                for v in sigma.T
            ]
        )
        first = trajectory.gps_time[np.argmin(stated)]
        notes.append(
            f"{(~stated).sum()} of {len(trajectory)} trajectory epochs state a {name} of 0 {unit} "
            f"(first at {first:.3f} s), which means that it is missing: those of the epochs before "
            "and after are used there."
        )
    return (replace(trajectory, **columns) if columns else trajectory), tuple(notes)
