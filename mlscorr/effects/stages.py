"""Stages of a measurement, and the data types that effects change."""

from dataclasses import dataclass

import numpy as np

from mlscorr.survey import Columns

STAGES = {  # in the order of a survey, with the field to which an error is added
    "beam": None,
    "clock": "gps_time",
    "range": "range",
    "angle": "angle",
    "return": None,
    "pos": "position",
    "mounting": None,
    "control": "position",
}
BODY = ("right", "forward", "up")  # components of a vector
MAP = ("easting", "northing", "height")
EAST_NORTH_UP = (
    ("to the east", "to the west"),
    ("to the north", "to the south"),
    ("upward", "downward"),
)


@dataclass(frozen=True)
class Reference:
    """Reference time and position of effects.

    Parameters
    ----------
    start, end : float
        First and last gps_time of the survey. Units: s.
    place : (3,) array
        Center of rotation and scaling of the map. Units: m.
    """

    start: float
    end: float
    place: np.ndarray


@dataclass(frozen=True, repr=False)
class Returns(Columns):
    """Returns of a scanner in scan order, as seen and changed by effects.

    Parameters
    ----------
    gps_time : (n,) array
        Time of the scanner's clock. Units: s.
    angle, range : (n,) array
        From the zero beam in the scan plane. Units: rad, m.
    intensity : (n,) array
        Scaled to 16 bits, as in LAS files.
    incidence : (n,) array
        Cosine of the angle between beam and surface normal.
    kept : (n,) bool array
        False for lost returns.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    range: np.ndarray
    intensity: np.ndarray
    incidence: np.ndarray
    kept: np.ndarray


def noise_by_pulse(returns: Returns, rng: np.random.Generator) -> np.ndarray:
    """Unit noise (n,), the same for all returns of a pulse, drawn in scan order.

    Parameters
    ----------
    returns : Returns
        n of them.
    rng : numpy.random.Generator
    """
    if (returns.gps_time[1:] > returns.gps_time[:-1]).all():  # one return each: nothing to sort
        return rng.standard_normal(len(returns))
    number = pulse_number(returns)
    return rng.standard_normal(number.max(initial=-1) + 1)[number]


def pulse_number(returns: Returns) -> np.ndarray:
    """Index (n,) of the pulse of each return, in order of first appearance.

    Parameters
    ----------
    returns : Returns
        n returns. Those of a pulse have the same time and angle, and need not be adjacent.
    """
    shot = returns.gps_time + 1j * returns.angle
    _, first, number = np.unique(shot, return_index=True, return_inverse=True)
    return first.argsort().argsort()[number]
