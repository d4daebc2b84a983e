"""A parameter of an effect: a number with a unit, limits, its usual size and the source."""

from dataclasses import MISSING, dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Quantity:
    """A parameter of an effect: unit, how many numbers, limits, its usual size and the source.

    Parameters
    ----------
    unit : str
    largest : float
        Absolute value; more is refused, because
    why : str
        of this.
    typical : float, optional
        Usual size where it occurs.
    source : str
        Of the usual size.
    count : int
        How many numbers.
    least : float, optional
        Smallest value; without it, as far below zero as above.
    """

    unit: str
    largest: float
    why: str
    typical: float | None = None
    source: str = ""
    count: int = 1
    least: float | None = None

    def __str__(self):
        if self.count == 1:
            return self.unit
        return f"{self.count} numbers in {self.unit}"

    def checked(self, label: str, value: Any) -> float | tuple[float, ...]:
        """The value as a float, or as a tuple of as many as count says.

        Parameters
        ----------
        label : str
            With which an error's sentence opens.
        value : number or sequence of numbers

        Raises
        ------
        ValueError
            For what is no number, or beyond the limits.
        """
        try:
            numbers = np.asarray(value)
        except ValueError:  # lists within lists
            numbers = np.array(None)
        shape = () if self.count == 1 else (self.count,)
        if numbers.dtype.kind not in "iuf" or numbers.shape != shape:
            raise ValueError(f"{label} of {value!r} can't be used: it must be {self._description}.")
        if not np.isfinite(numbers).all():
            raise ValueError(f"{label} of {value!r} is not finite; it must be {self._description}.")
        largest = float(numbers.flat[np.argmax(np.abs(numbers))])
        if abs(largest) > self.largest:
            raise ValueError(
                f"{label} of {largest:g} {self.unit} exceeds {self.largest:g} {self.unit}; "
                f"{self.why}."
            )
        if self.least is not None and numbers.min() < self.least:
            raise ValueError(
                f"{label} of {numbers.min():g} {self.unit} is less than {self.least:g} {self.unit}."
            )
        if self.count == 1:
            return float(numbers)
        return tuple(map(float, numbers))

    @property
    def _description(self):
        if self.count == 1:
            return f"one number in {self.unit}"
        return str(self)


def quantity(unit: str, largest: float, why: str, default: float | None = None, **more: Any) -> Any:
    """A dataclass field that is a Quantity; required unless it has a default.

    Parameters
    ----------
    unit, largest, why, **more
        Of the Quantity.
    default : float, optional
    """
    metadata = {"quantity": Quantity(unit, largest, why, **more)}
    return field(default=MISSING if default is None else default, metadata=metadata)
