"""What a notebook shows of a value: one line, for a survey holds millions of numbers."""

from dataclasses import Field, fields, is_dataclass
from typing import Any, ClassVar

import numpy as np

LONGEST = 60  # characters of a field: three of them fill a line of a notebook


class Summary:
    """Dataclasses (``repr=False``) whose repr has the sizes of arrays, not their numbers.

    >>> import numpy as np
    >>> from mlscorr.frames import attitude_from_angles
    >>> from mlscorr.survey import Trajectory
    >>> seconds, still = np.arange(413200.0, 413210.0), np.zeros(10)
    >>> Trajectory(seconds, np.zeros((10, 3)), attitude_from_angles(still, still, still))
    Trajectory(gps_time=array (10,), position=array (10, 3), attitude=Rotation, \
position_sigma=None, attitude_sigma=None)
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __repr__(self) -> str:
        parts = (f"{field.name}={_short(getattr(self, field.name))}" for field in fields(self))
        return f"{type(self).__name__}({', '.join(parts)})"


def _short(value):
    """A field's value in a few words."""
    if isinstance(value, np.ndarray):
        return f"array {value.shape}" if value.size > 3 else repr(value)
    if is_dataclass(value) and hasattr(value, "__len__"):
        return f"{type(value).__name__}({len(value)} rows)"
    if isinstance(value, tuple | list | dict) and len(repr(value)) > LONGEST:
        return f"{type(value).__name__} of {len(value)}"
    text = repr(value)
    return text if len(text) <= LONGEST else type(value).__name__
