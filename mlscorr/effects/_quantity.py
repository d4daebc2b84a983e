"""Parameters of effects: unit, limits and usual size, and the estimated size in words."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mlscorr.effects._settings import SETTINGS
from mlscorr.wording import DASH, joined, known, size


@dataclass(frozen=True)
class Quantity:
    """Parameter of an effect: unit, number of components, limits, usual size and its source.

    Parameters
    ----------
    unit : str
    largest : float
        Largest absolute value; more is refused, because
    why : str
        of this.
    typical : float, optional
        Usual size if the effect occurs.
    source : str
        Source of the usual size.
    count : int
        Number of components.
    least : float, optional
        Smallest value; minus the largest by default.
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
        """Return the value as a float, or as a tuple of count floats.

        Parameters
        ----------
        label : str
            Start of an error's sentence.
        value : number or sequence of numbers

        Raises
        ------
        ValueError
            If the value is not a number, or is outside the limits.
        """
        try:
            numbers = np.asarray(value)
        except ValueError:  # lists within lists
            numbers = np.array(None)
        shape = () if self.count == 1 else (self.count,)
        if numbers.dtype.kind not in "iuf" or numbers.shape != shape:
            raise ValueError(f"{label} of {value!r} is invalid: it must be {self._description}.")
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
    """Make a dataclass field that is a Quantity; required unless it has a default.

    Parameters
    ----------
    unit, largest, why, **more
        See Quantity.
    default : float, optional
    """
    metadata = {"quantity": Quantity(unit, largest, why, **more)}
    if default is None:
        return field(metadata=metadata)
    return field(default=default, metadata=metadata)


class SizeEstimate(NamedTuple):
    """Estimate of one parameter of an effect by a diagnosis; None or NaN if undetermined.

    Parameters
    ----------
    estimate, sigma : float or None
        In this unit.
    unit : str
    """

    estimate: float | None
    sigma: float | None
    unit: str


def vector(
    parameters: dict[str, SizeEstimate], names: tuple[str, ...], sides: tuple[tuple[str, str], ...]
) -> str:
    """Describe the components of a vector that differ from zero, or all if none does.

    Parameters
    ----------
    parameters : dict of SizeEstimate
        By name; missing or unknown ones are omitted.
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
        side = below if value < 0 else above
        texts.append(f"{size(abs(value), sigma, unit)} {side}")
        if known(sigma) and abs(value) > SETTINGS.certain_sigmas * sigma:
            certain.append(texts[-1])
    return joined(certain or texts) or DASH


def amplitude(quadratures: Iterable[SizeEstimate]) -> str:
    """Describe the amplitude of a wave from its two quadratures, with sigma.

    Parameters
    ----------
    quadratures : iterable of SizeEstimate
        With one unit.
    """
    values, sigmas, units = zip(*quadratures, strict=True)
    if not all(map(known, values)):
        return DASH
    length = sum(value**2 for value in values) ** 0.5
    sigma = None
    if all(map(known, sigmas)) and length > 0:
        sigma = sum((v * s) ** 2 for v, s in zip(values, sigmas, strict=True)) ** 0.5 / length
    return size(length, sigma, units[0])
