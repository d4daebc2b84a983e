"""Sizes as a surveyor says them: a unit that suits, and as many figures as sigma allows."""

import math
import re
from collections.abc import Iterable
from typing import NamedTuple

from mlscorr.effects._settings import SETTINGS

SCALES = {  # unit of a document: (from which absolute value on, factor, its word)
    "s": ((1.0, 1.0, "s"), (1e-3, 1e3, "ms"), (0.0, 1e6, "µs")),
    "m": ((1.0, 1.0, "m"), (0.1, 1e2, "cm"), (0.0, 1e3, "mm")),
    "deg": ((0.0, 1.0, "°"),),
    "rad": ((1e-4, 1e3, "mrad"), (0.0, 1e6, "µrad")),
    "ratio": ((5e-3, 1e2, "%"), (0.0, 1e6, "ppm")),
    "s per s": ((0.0, 1e6, "ppm"),),
    "m per decade": ((0.0, 1e3, "mm per decade"),),
}
DASH = "–"


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


def known(value: float | None) -> bool:
    """Whether a value of a document is a number: what was not determined is None there."""
    return value is not None and math.isfinite(value)


def size(value: float | None, sigma: float | None = None, unit: str = "m") -> str:
    """A size and its sigma in words; a dash where it was not determined.

    Parameters
    ----------
    value, sigma : float or None
    unit : str
        Of both; the words have one that suits them.

    >>> size(0.0045256, 0.000527, "s"), size(0.0932, 0.0041), size(1.7e-5, None, "s per s")
    ('4.5 ms ± 0.5 ms', '93 mm ± 4 mm', '17 ppm')
    >>> size(0.2134, 0.0123, "deg"), size(-2.3e-5, 0.0011), size(None, None)
    ('0.213° ± 0.012°', '0.0 mm ± 1.1 mm', '–')
    """
    if not known(value):
        return DASH
    factor, word = scale(value, sigma, unit)
    value = factor * value
    word = word if word == "°" else f" {word}".rstrip()
    if not known(sigma):
        return figures(value, 2) + word
    sigma = factor * sigma
    places = _decimals(sigma)
    value = round(value, places) + 0.0  # no -0.0
    return f"{value:.{places}f}{word} ± {sigma:.{places}f}{word}"


def scale(value: float, sigma: float | None, unit: str) -> tuple[float, str]:
    """Factor and word of the unit that suits a value, or its sigma where that is larger.

    Parameters
    ----------
    value : float
    sigma : float or None
    unit : str
        Of both; one that nobody else writes stays as it is.
    """
    large = max(abs(value), abs(sigma) if known(sigma) else 0.0)
    scales = SCALES.get(unit, ((0.0, 1.0, unit),))
    return next((factor, word) for least, factor, word in scales if large >= least)


def _decimals(sigma):
    """Decimals that show one figure of a sigma, two of one that begins with 1 or 2.

    >>> _decimals(0.527), _decimals(0.0123), _decimals(40.0)
    (1, 3, 0)
    """
    if sigma <= 0:
        return 3
    first = math.floor(math.log10(sigma) + 1e-9)
    return max(0, -first + (sigma / 10.0**first < 2.95))


def figures(value: float, count: int) -> str:
    """A number with so many significant figures, never in powers of ten.

    Parameters
    ----------
    value : float
    count : int

    >>> figures(0.004526, 2), figures(1234.5, 2), figures(0.0, 2)
    ('0.0045', '1234', '0')
    """
    if value == 0:
        return "0"
    return f"{value:.{max(0, count - 1 - math.floor(math.log10(abs(value))))}f}"


def percent(share: float | None) -> str:
    """A share in percent, with a decimal near nothing and near all.

    Parameters
    ----------
    share : float or None

    >>> percent(0.97), percent(0.9952), percent(None), percent(-0.1), percent(0.0004)
    ('97 %', '99.5 %', '–', '−10 %', '0.0 %')
    """
    if not known(share):
        return DASH
    fine = 0 < abs(share) < 0.01 or 0.98 <= share < 1
    return f"{100 * share:.{int(fine)}f} %".replace("-", "−")


def with_articles(text: str) -> str:
    """A text put together of parts, with *an* before a vowel.

    Parameters
    ----------
    text : str

    >>> with_articles("a easting error at a incidence angle, a scan angle")
    'an easting error at an incidence angle, a scan angle'
    """
    return re.sub(r"\ba (?=[aeio])", "an ", text)


def joined(words: Iterable[str], last: str = "and") -> str:
    """Words in a row.

    Parameters
    ----------
    words : iterable of str
    last : str
        The word before the last of them.

    >>> joined(["a", "b", "c"]), joined(["a", "b"], "or"), joined([])
    ('a, b and c', 'a or b', '')
    """
    *first, final = list(words) or [""]
    if first:
        return f"{', '.join(first)} {last} {final}"
    return final


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
