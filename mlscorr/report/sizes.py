"""Sizes as a surveyor says them: a unit that suits, and as many figures as sigma allows."""

import math

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


def known(value):
    """Whether a value of a document is a number: what was not determined is None there."""
    return value is not None and math.isfinite(value)


def size(value, sigma=None, unit="m"):
    """A size and its sigma in words; a dash where it was not determined.

    >>> size(0.0045256, 0.000527, "s"), size(0.0932, 0.0041), size(1.7e-5, None, "s per s")
    ('4.5 ms ± 0.5 ms', '93 mm ± 4 mm', '17 ppm')
    >>> size(0.2134, 0.0123, "deg"), size(None, None)
    ('0.213° ± 0.012°', '–')
    """
    if not known(value):
        return DASH
    factor, word = scale(value, sigma, unit)
    value = factor * value
    word = word if word == "°" else f" {word}".rstrip()
    if not known(sigma):
        return figures(value, 2) + word
    sigma = factor * sigma
    places = decimals(sigma)
    return f"{value:.{places}f}{word} ± {sigma:.{places}f}{word}"


def scale(value, sigma, unit):
    """Factor and word of the unit that suits a value, or its sigma where that is larger."""
    large = max(abs(value), abs(sigma) if known(sigma) else 0.0)
    for least, factor, word in SCALES.get(unit, ((0.0, 1.0, unit),)):
        if large >= least:
            return factor, word
    raise AssertionError("each list of scales ends with zero")


def decimals(sigma):
    """Decimals that show one figure of a sigma, two of one that begins with 1 or 2.

    >>> decimals(0.527), decimals(0.0123), decimals(40.0)
    (1, 3, 0)
    """
    if sigma <= 0:
        return 3
    first = math.floor(math.log10(sigma) + 1e-9)
    return max(0, -first + (sigma / 10.0**first < 2.95))


def figures(value, count):
    """A number with so many significant figures, never in powers of ten.

    >>> figures(0.004526, 2), figures(1234.5, 2), figures(0.0, 2)
    ('0.0045', '1234', '0')
    """
    if value == 0:
        return "0"
    return f"{value:.{max(0, count - 1 - math.floor(math.log10(abs(value))))}f}"


def column(values, unit):
    """Numbers of one row of a table in the unit that suits the largest, and that unit.

    >>> column([-0.0045256, 0.000527, None], "s")
    (['-4.526', '0.5270', '–'], 'ms')
    """
    large = max((abs(value) for value in values if known(value)), default=1.0)
    factor, word = scale(large, None, unit) if large < 1e4 else (1.0, unit)
    return [plain(value, factor) for value in values], word


def plain(value, factor=1.0):
    """A number for tables: four figures, a dash for none.

    >>> plain(-0.0045256), plain(None), plain(357726.276)
    ('-0.004526', '–', '357726.276')
    """
    if not known(value):
        return DASH
    value = factor * value
    return f"{value:.3f}" if abs(value) >= 1e4 else figures(value, 4)


def signed(value, unit="mm"):
    """A signed gap with one decimal, two below one; below zero it has a true minus sign.

    >>> signed(-1.52), signed(None), signed(0.114, "%")
    ('−1.5 mm', '–', '0.11 %')
    """
    if not known(value):
        return DASH
    text = f"{value:.{1 + (abs(value) < 0.95)}f}"
    return (text.replace("-", "−") if float(text) else text.lstrip("-")) + f" {unit}"


def percent(share):
    """A share in percent, with a decimal near nothing and near all.

    >>> percent(0.97), percent(0.9952), percent(None), percent(-0.1), percent(0.0004)
    ('97 %', '99.5 %', '–', '−10 %', '0.0 %')
    """
    if not known(share):
        return DASH
    fine = 0 < abs(share) < 0.01 or 0.98 <= share < 1
    return f"{100 * share:.{int(fine)}f} %".replace("-", "−")
