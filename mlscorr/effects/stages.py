"""What effects act on: the stages of a measurement, and the values that are not nouns yet."""

from dataclasses import dataclass

import numpy as np

from mlscorr.survey import Columns

STAGES = {  # in the order of a survey, and the field of the stage's value that an error adds to
    "beam": None,
    "clock": "gps_time",
    "range": "range",
    "angle": "angle",
    "return": None,
    "pos": "position",
    "mounting": None,
    "control": "position",
}
BODY = ("right", "forward", "up")  # parts of a vector
MAP = ("easting", "northing", "height")
EAST_NORTH_UP = (
    ("to the east", "to the west"),
    ("to the north", "to the south"),
    ("upward", "downward"),
)


@dataclass(frozen=True)
class Reference:
    """What effects refer to.

    Parameters
    ----------
    start, end : float
        First and last gps_time of the survey. Units: s.
    place : (3,) array
        About which the map is turned and scaled. Units: m.
    """

    start: float
    end: float
    place: np.ndarray


@dataclass(frozen=True, repr=False)
class Returns(Columns):
    """Returns of a scanner in scan order, as the effects see and change them.

    Parameters
    ----------
    gps_time : (n,) array
        By the scanner's clock. Units: s.
    angle, range : (n,) array
        From the zero beam in the scan plane. Units: rad, m.
    intensity : (n,) array
        Scaled to 16 bits, as in LAS files.
    incidence : (n,) array
        Cosine of the angle between beam and surface normal.
    kept : (n,) bool array
        False for returns that got lost.
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
    """Number (n,) of the pulse that each return came from, counted as they first appear.

    Parameters
    ----------
    returns : Returns
        n of them. Those of a pulse have one time and one angle; they need not stand side by side.
    """
    shot = returns.gps_time + 1j * returns.angle
    _, first, number = np.unique(shot, return_index=True, return_inverse=True)
    return first.argsort().argsort()[number]
