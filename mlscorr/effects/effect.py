"""What an effect is: a frozen value with a magnitude, a unit, limits, and a stage it acts on."""

from dataclasses import MISSING, dataclass, field, fields
from typing import ClassVar

import numpy as np

STAGES = ("beam", "clock", "range", "angle", "return", "pos", "mounting", "control")


@dataclass(frozen=True)
class Reference:
    """What effects refer to: start and end, first and last gps_time of the survey (s), and the
    place (3,) about which the map is turned and scaled (m)."""

    start: float
    end: float
    place: np.ndarray


@dataclass(frozen=True)
class Returns:
    """Returns of a scanner in scan order, as the effects see and change them.

    Parameters
    ----------
    gps_time : (n,) array
        By the scanner's clock. Units: s.
    angle, range : (n,) array
        From the zero beam in the scan plane. Units: rad, m.
    intensity : (n,) array
        Scaled to 16 bits, as in LAS files.
    incidence : (n,) array
        Cosine of the angle between beam and surface normal.
    kept : (n,) bool array
        False for returns that got lost.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    range: np.ndarray
    intensity: np.ndarray
    incidence: np.ndarray
    kept: np.ndarray

    def __len__(self):
        return len(self.gps_time)


@dataclass(frozen=True)
class Quantity:
    """A parameter of an effect: unit, how many numbers, limits, its usual size and the source."""

    unit: str
    largest: float  # of the absolute value; more is refused, because ...
    why: str
    typical: float | None = None
    source: str = ""
    count: int = 1
    least: float | None = None  # None: as far below zero as above

    def __str__(self):
        return self.unit if self.count == 1 else f"{self.count} numbers in {self.unit}"

    def checked(self, label, value):
        """The value as a float, or as a tuple of several.

        Raises ValueError, opening with the label, for what is no number or beyond the limits.
        """
        try:
            numbers = np.asarray(value)
        except ValueError:  # lists within lists
            numbers = np.array(None)
        shape = () if self.count == 1 else (self.count,)
        if numbers.dtype.kind not in "iuf" or numbers.shape != shape:
            raise ValueError(f"{label} of {value!r} can't be used: it must be {self._wanted}.")
        if not np.isfinite(numbers).all():
            raise ValueError(f"{label} of {value!r} is not finite; it must be {self._wanted}.")
        worst = float(numbers.flat[np.argmax(np.abs(numbers))])
        if abs(worst) > self.largest:
            raise ValueError(
                f"{label} of {worst:g} {self.unit} exceeds {self.largest:g} {self.unit}; "
                f"{self.why}."
            )
        if self.least is not None and numbers.min() < self.least:
            raise ValueError(
                f"{label} of {numbers.min():g} {self.unit} is less than {self.least:g} {self.unit}."
            )
        return float(numbers) if self.count == 1 else tuple(map(float, numbers))

    @property
    def _wanted(self):
        return f"one number in {self.unit}" if self.count == 1 else str(self)


def quantity(unit, largest, why, default=None, **more):
    """A dataclass field that is a Quantity; required unless it has a default."""
    metadata = {"quantity": Quantity(unit, largest, why, **more)}
    return field(default=MISSING if default is None else default, metadata=metadata)


@dataclass(frozen=True)
class Effect:
    """An imperfection that turns what is true into what is recorded, at its stage alone.

    A subclass says name and stage, its parameters (one of them the magnitude) and the change.
    A magnitude of zero returns the very value that came in. ``random`` ones draw from rng.
    Raises ValueError for parameters that no survey can have.
    """

    name: ClassVar[str]
    stage: ClassVar[str]
    random: ClassVar[bool] = False

    def __post_init__(self):
        for name, kind in self.quantities().items():
            label = self.name if name == "magnitude" else f"{name} of {self.name}"
            object.__setattr__(self, name, kind.checked(label, getattr(self, name)))

    @classmethod
    def quantities(cls):
        """The Quantity of each parameter that is a number, by the parameter's name."""
        return {f.name: f.metadata["quantity"] for f in fields(cls) if "quantity" in f.metadata}

    @property
    def is_nothing(self):
        """Whether the magnitude is zero."""
        return not np.any(self.magnitude)

    def apply(self, value, reference, rng=None):
        """The value of this stage as recorded: an object of the same type."""
        return value if self.is_nothing else self._change(value, reference, rng)

    def _change(self, value, reference, rng):
        raise NotImplementedError
