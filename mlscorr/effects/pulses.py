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
    order = np.lexsort((returns.angle, returns.gps_time))
    time, angle = returns.gps_time[order], returns.angle[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(time) != 0) | (np.diff(angle) != 0)
    first = np.empty_like(order)
    first[order] = order[new][np.cumsum(new) - 1]  # the sort is stable: the first one's row
    appeared = np.cumsum(first == np.arange(len(first))) - 1
    return appeared[first]


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
