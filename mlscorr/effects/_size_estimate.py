"""Sizes of the parameters of effects, and the words of those that have several parts."""

from collections.abc import Iterable
from typing import NamedTuple

from mlscorr.effects._settings import SETTINGS
from mlscorr.wording import DASH, joined, known, size


class SizeEstimate(NamedTuple):
    """What a diagnosis says of one parameter of an effect; None or NaN where it can't.

    Parameters
    ----------
    estimate, sigma : float or None
        In the unit.
    unit : str
    """

    estimate: float | None
    sigma: float | None
    unit: str


def vector(
    parameters: dict[str, SizeEstimate], names: tuple[str, ...], sides: tuple[tuple[str, str], ...]
) -> str:
    """The parts of a vector that differ from zero, in words; all, when none does.

    Parameters
    ----------
    parameters : dict of SizeEstimate
        By name; what is missing or not known is left out.
    names : tuple of p str
    sides : tuple of p pairs of str
        Words for above and below zero.
    """
    texts = []
    certain = []
    for name, (above, below) in zip(names, sides, strict=True):
        value, sigma, unit = parameters.get(name, (None, None, ""))
        if not known(value):
            continue
        texts.append(f"{size(abs(value), sigma, unit)} {below if value < 0 else above}")
        if known(sigma) and abs(value) > SETTINGS.certain_sigmas * sigma:
            certain.append(texts[-1])
    return joined(certain or texts) or DASH


def amplitude(quadratures: Iterable[SizeEstimate]) -> str:
    """Length of the two quadratures of a wave, and its sigma, in words.

    Parameters
    ----------
    quadratures : iterable of SizeEstimate
        Of one unit.
    """
    values, sigmas, units = zip(*quadratures, strict=True)
    if not all(map(known, values)):
        return DASH
    length = sum(value**2 for value in values) ** 0.5
    sigma = None
    if all(map(known, sigmas)) and length > 0:
        sigma = sum((v * s) ** 2 for v, s in zip(values, sigmas, strict=True)) ** 0.5 / length
    return size(length, sigma, units[0])
