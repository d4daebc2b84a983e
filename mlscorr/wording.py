"""Numbers, lengths and lists in words, as a surveyor writes them, for all reports.

A value that was not determined (None, NaN) becomes a dash.
"""

import math
import re
from collections.abc import Iterable, Sequence

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


def known(value: float | None) -> bool:
    """True if a value of a document was determined; None if it was not."""
    return value is not None and math.isfinite(value)


def number(value: float | None, decimals: int = 3) -> str:
    """Format a number with fixed decimals; a dash for None, no negative zero.

    Parameters
    ----------
    value : float or None
    decimals : int

    >>> number(-0.00004), number(None), number(531400.25, 1)
    ('0.000', '–', '531400.2')
    """
    if not known(value):
        return DASH
    text = f"{value:.{decimals}f}"
    if float(text) == 0:
        return text.lstrip("-")
    return text


def figures(value: float, count: int) -> str:
    """Format a number with a given count of significant figures, never in powers of ten.

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


def plain(value: float | None, factor: float = 1.0) -> str:
    """Format a number for tables: three figures, a dash for none.

    Parameters
    ----------
    value : float or None
    factor : float
        Multiplier of the value.

    >>> plain(-0.0045256), plain(None), plain(357726.276)
    ('-0.00453', '–', '357726.276')
    """
    if not known(value):
        return DASH
    value = factor * value
    if abs(value) >= 1e4:
        return number(value, 3)
    return figures(value, 3)


def thousands(value: float, decimals: int = 0) -> str:
    """Format a number with spaces between thousands.

    Parameters
    ----------
    value : float
    decimals : int

    >>> thousands(1847911), thousands(12345.67, 1)
    ('1 847 911', '12 345.7')
    """
    return f"{value:,.{decimals}f}".replace(",", " ")


def percent(share: float | None, decimals: int = 0) -> str:
    """Format a share in percent; near 0 and 100 with a decimal, and never rounded to these.

    Parameters
    ----------
    share : float or None
    decimals : int
        Minimum number.

    >>> percent(0.97), percent(0.9952), percent(None), percent(-0.1), percent(0.0)
    ('97 %', '99.5 %', '–', '−10 %', '0 %')
    >>> percent(0.0004), percent(0.9997), percent(0.0456, 1)
    ('less than 0.1 %', 'more than 99.9 %', '4.6 %')
    """
    if not known(share):
        return DASH
    if 0 < share < 0.0005:
        return "less than 0.1 %"
    if 0.9995 < share < 1:
        return "more than 99.9 %"
    is_extreme = 0 < abs(share) < 0.01 or 0.98 <= share < 1
    return f"{number(100 * share, max(decimals, int(is_extreme)))} %".replace("-", "−")


def size(value: float | None, sigma: float | None = None, unit: str = "m") -> str:
    """Format a size and its sigma; a dash if it was not determined.

    Parameters
    ----------
    value, sigma : float or None
    unit : str
        Of both; the text uses a suitable unit.

    >>> size(0.0045256, 0.000527, "s"), size(0.0932, 0.0041), size(1.7e-5, None, "s per s")
    ('4.5 ms ± 0.5 ms', '93 mm ± 4 mm', '17 ppm')
    >>> size(0.2134, 0.0123, "deg"), size(-2.3e-5, 0.0011), size(None, None)
    ('0.213° ± 0.012°', '0.0 mm ± 1.1 mm', '–')
    """
    if not known(value):
        return DASH
    factor, word = scale(value, sigma, unit)
    word = word if word == "°" else f" {word}".rstrip()
    if not known(sigma):
        return figures(factor * value, 2) + word
    return value_and_sigma(factor * value, factor * sigma, word)


def value_and_sigma(value: float, sigma: float, word: str = "") -> str:
    """Format a number ± its sigma, with the decimals that the sigma allows.

    Parameters
    ----------
    value, sigma : float
    word : str
        Unit, placed after both.

    >>> value_and_sigma(4.5256, 0.527), value_and_sigma(0.2134, 0.0123), value_and_sigma(-0.02, 1.1)
    ('4.5 ± 0.5', '0.213 ± 0.012', '0.0 ± 1.1')
    """
    places = _decimals(sigma)
    return f"{number(value, places)}{word} ± {number(sigma, places)}{word}"


def _decimals(sigma):
    """Number of decimals that shows one figure of a sigma, or two if it begins with 1 or 2.

    >>> _decimals(0.527), _decimals(0.0123), _decimals(40.0)
    (1, 3, 0)
    """
    if sigma <= 0:
        return 3
    first = math.floor(math.log10(sigma) + 1e-9)
    return max(0, -first + (sigma / 10.0**first < 2.95))


def scale(value: float, sigma: float | None, unit: str) -> tuple[float, str]:
    """Factor and name of the unit that suits a value, or its sigma if that is larger.

    Parameters
    ----------
    value : float
    sigma : float or None
    unit : str
        Of both; an unknown unit stays unchanged.
    """
    large = max(abs(value), abs(sigma) if known(sigma) else 0.0)
    scales = SCALES.get(unit, ((0.0, 1.0, unit),))
    return next((factor, word) for least, factor, word in scales if large >= least)


def column(values: Sequence[float | None], unit: str) -> tuple[list[str], str]:
    """Format numbers of a table in the unit that suits the largest, and return that unit.

    Lengths below a meter are all in mm, so that rows can be compared.

    Parameters
    ----------
    values : sequence of float or None
    unit : str
        Unit of the values.

    >>> column([-0.0045256, 0.000527, None], "s")
    (['-4.53', '0.527', '–'], 'ms')
    """
    large = max((abs(value) for value in values if known(value)), default=1.0)
    factor, word = scale(large, None, unit) if large < 1e4 else (1.0, unit)
    if word == "cm":
        factor = 1e3
        word = "mm"
    return [plain(value, factor) for value in values], word


def length_in_words(value: float) -> str:
    """Format a length: '7 mm', '4.6 cm', '1.23 m'.

    Parameters
    ----------
    value : float
        Units: m.

    >>> length_in_words(0.0071), length_in_words(0.046), length_in_words(1.234)
    ('7 mm', '4.6 cm', '1.23 m')
    """
    if value < 0.0095:
        return f"{1000 * value:.0f} mm"
    if value < 0.995:
        return f"{100 * value:.1f} cm"
    return f"{value:.2f} m"


def millimetres(value: float | None) -> str:
    """Format a length in millimeters without the unit, with a decimal if it is short.

    Parameters
    ----------
    value : float or None
        Units: m.

    >>> millimetres(0.00288), millimetres(0.42302), millimetres(None)
    ('2.9', '423', '–')
    """
    if not known(value):
        return DASH
    is_short = abs(value) < 0.01
    return number(1000 * value, int(is_short))


def signed(value: float | None, unit: str = "mm") -> str:
    """Format a signed difference with one decimal, two below one, and a true minus sign.

    Parameters
    ----------
    value : float or None
    unit : str

    >>> signed(-1.52), signed(None), signed(0.114, "%")
    ('−1.5 mm', '–', '0.11 %')
    """
    if not known(value):
        return DASH
    text = f"{value:.{1 + (abs(value) < 0.95)}f}"
    return (text.replace("-", "−") if float(text) else text.lstrip("-")) + f" {unit}"


def counted(number: int, noun: str) -> str:
    """Format a count with its noun.

    Parameters
    ----------
    number : int
    noun : str
        In the singular.

    >>> counted(1, "pass"), counted(2, "pass"), counted(3, "entry"), counted(0, "cloud file")
    ('1 pass', '2 passes', '3 entries', '0 cloud files')
    >>> counted(4, "dash"), counted(5, "epoch")
    ('4 dashes', '5 epochs')
    """
    ends = {"s": f"{noun}es", "sh": f"{noun}es", "y": f"{noun[:-1]}ies"}
    plural = ends.get(noun[-1]) or ends.get(noun[-2:], f"{noun}s")
    return f"{number} {noun if number == 1 else plural}"


def joined(words: Iterable[str], last: str = "and") -> str:
    """Join words to a list in words.

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


def with_articles(text: str) -> str:
    """Correct *a* to *an* before a vowel in a text made from parts.

    Parameters
    ----------
    text : str

    >>> with_articles("a easting error at a incidence angle, a scan angle")
    'an easting error at an incidence angle, a scan angle'
    """
    return re.sub(r"\ba (?=[aeio])", "an ", text)
