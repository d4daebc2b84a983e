"""Pulses that met nothing: no file has them, those beside them tell of them."""

import numpy as np

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.simulate.scan import RecordedPulses


def unreturned(pulses: RecordedPulses, span: tuple[float, float], opening: float) -> RecordedPulses:
    """Pulses that were fired between recorded ones, and beside them, and met nothing.

    Parameters
    ----------
    pulses : RecordedPulses
        About one place, in order of time.
    span : (float, float)
        Times between which they are wanted. Units: s.
    opening : float
        Angle about the recorded ones. Units: rad.

    Times and angles go on in the steps of those recorded. None where these are not regular (rings
    of beams, jitter, a thinned cloud): then a target before the sky has only the beams that met
    it.
    """
    none = pulses[:0]
    start = pulses.gps_time[0]
    pause = np.diff(pulses.gps_time)
    if len(pause) < SETTINGS.line_pulses or np.ptp(pulses.elevation) > SETTINGS.level:
        return none
    step = np.percentile(pause, 25)
    single = np.abs(pause - step) < 0.1 * step
    regular = max(OBSERVE.rule * (pause < 1.5 * step).sum(), SETTINGS.delivered * len(pause))
    if single.sum() < regular:
        return none
    number = np.append(0, np.cumsum(np.round(pause / pause[single].mean()).astype(int)))
    first, step = _line(number, pulses.gps_time - start)
    if np.abs(pulses.gps_time - start - first - step * number).max() > 0.3 * step:
        return none
    turned = np.mod(np.diff(pulses.angle) + np.pi, 2 * np.pi) - np.pi
    rate = turned[single].mean()
    left = np.unwrap(np.mod(pulses.angle - rate * number, 2 * np.pi))
    zero, more = _line(number, left)
    uneven = np.std(left - zero - more * number) > max(0.5 * abs(rate), 1e-3)
    if uneven or rate + more == 0:
        return none
    middle = np.angle(np.exp(1j * pulses.angle).mean())
    width = np.abs(np.mod(pulses.angle - middle + np.pi, 2 * np.pi) - np.pi).max() + opening
    ends = np.ceil((np.array(span) - start - first) / step).astype(int)
    every = _each_turn(zero - middle, rate + more, width, ends)
    angle = np.mod(zero + (rate + more) * every + np.pi, 2 * np.pi) - np.pi
    beside = np.abs(np.mod(angle - middle + np.pi, 2 * np.pi) - np.pi) <= width
    lost = np.flatnonzero(beside & ~np.isin(every, number))
    n = len(lost)
    return RecordedPulses(
        gps_time=start + first + step * every[lost],
        angle=angle[lost],
        elevation=np.full(n, np.median(pulses.elevation)),
        range=np.full(n, np.nan),
        intensity=np.zeros(n),
        incidence=np.ones(n),
    )


def _each_turn(zero, rate, width, ends):
    """Numbers between ends whose angle, zero and so much more by each, is within a width of a whole
    turn, or next to it: a scanner is turned away most of the time.
    """
    first, last = np.sort(zero + rate * ends) / (2 * np.pi)
    turns = 2 * np.pi * np.arange(np.floor(first), np.ceil(last) + 1)
    starts, stops = np.sort(np.sort((turns - zero + [[-width], [width]]) / rate, axis=0))
    starts, stops = (np.clip(n, *ends).astype(int) for n in (np.floor(starts), stops + 2))
    starts[1:] = np.maximum(starts[1:], stops[:-1])
    return np.concatenate(list(map(np.arange, starts, stops)))


def _line(x, y):
    """Value at 0 and slope of the straight line through points (n,), by least squares."""
    slope = np.cov(x, y)[0, 1] / np.var(x, ddof=1)
    return y.mean() - slope * x.mean(), slope
