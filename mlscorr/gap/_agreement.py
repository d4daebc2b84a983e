"""How far observed things lie from where they belong, beside what the accuracies state."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.residuals import Background, Rows


@dataclass(frozen=True)
class Agreement:
    """Of the things of one channel, as recorded, less the effects that the simulator has.

    Parameters
    ----------
    channel : str
        target, surface or shared.
    things : int
    rms_mm : float
        Of the residuals, along each axis or normal. Units: mm.
    stated_mm : float
        The same by the stated accuracies of POS, survey and extraction. Units: mm.
    """

    channel: str
    things: int
    rms_mm: float
    stated_mm: float


def agreements(rows: Rows, background: Background) -> list[Agreement]:
    """An Agreement of each channel that has a residual in m.

    Parameters
    ----------
    rows : Rows
    background : Background
        Of these rows.
    """
    variance = rows.noise + rows.survey
    legs = background.position**2 + background.attitude**2
    np.add.at(variance, background.row, legs.sum(axis=1))
    parts = []
    for channel in dict.fromkeys(rows.channel[rows.metric].tolist()):
        of = rows.metric & (rows.channel == channel)
        sizes = (1e3 * np.sqrt(np.mean(values[of])) for values in (rows.residual**2, variance))
        parts.append(Agreement(channel, len(np.unique(rows.item[of])), *map(float, sizes)))
    return parts
