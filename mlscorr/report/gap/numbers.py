"""Numbers of a document for tables, figures and sentences; what was not determined is a dash."""

from collections.abc import Iterable

import numpy as np

from mlscorr.wording import known


def numbers(values: Iterable[float | None]) -> np.ndarray:
    """Numbers of a document as an array, NaN where it has none.

    Parameters
    ----------
    values : iterable of float or None
    """
    return np.array([v if known(v) else np.nan for v in values], dtype=float)
