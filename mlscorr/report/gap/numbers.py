"""Numbers of a document for tables, figures and sentences; what was not determined is a dash."""

from collections.abc import Iterable, Sequence

import numpy as np

from mlscorr.effects import DASH, figures, known, scale


def numbers(values: Iterable[float | None]) -> np.ndarray:
    """Numbers of a document as an array, NaN where it has none.

    Parameters
    ----------
    values : iterable of float or None
    """
    return np.array([v if known(v) else np.nan for v in values], dtype=float)


def column(values: Sequence[float | None], unit: str) -> tuple[list[str], str]:
    """Numbers of a row of a table in the unit that suits the largest, and that unit.

    Lengths below a metre are all in mm, so that rows can be compared.

    Parameters
    ----------
    values : sequence of float or None
    unit : str
        Of the values.

    >>> column([-0.0045256, 0.000527, None], "s")
    (['-4.53', '0.527', '–'], 'ms')
    """
    large = max((abs(value) for value in values if known(value)), default=1.0)
    factor, word = scale(large, None, unit) if large < 1e4 else (1.0, unit)
    if word == "cm":
        factor = 1e3
        word = "mm"
    return [plain(value, factor) for value in values], word


def plain(value: float | None, factor: float = 1.0) -> str:
    """A number for tables: three figures, a dash for none.

    Parameters
    ----------
    value : float or None
    factor : float
        By which it is multiplied.

    >>> plain(-0.0045256), plain(None), plain(357726.276)
    ('-0.00453', '–', '357726.276')
    """
    if not known(value):
        return DASH
    value = factor * value
    if abs(value) >= 1e4:
        return f"{value:.3f}"
    return figures(value, 3)


def signed(value: float | None, unit: str = "mm") -> str:
    """A signed gap with one decimal, two below one; below zero it has a true minus sign.

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
