"""Returns of one laser pulse: they share what is random in its time and angle."""

import numpy as np

from mlscorr.effects.stages import Returns


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
