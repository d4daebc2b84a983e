"""Base of effects: a frozen value that changes one stage of a survey and describes itself.

A user's own effect is applied so that any failure of its code ends in a clear message.
"""

import re
import sys
from collections.abc import Callable
from dataclasses import MISSING, asdict, dataclass, fields, is_dataclass, replace
from functools import partial
from traceback import extract_tb
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.effects._quantity import Quantity, SizeEstimate, amplitude, vector
from mlscorr.effects.stages import STAGES, Reference
from mlscorr.wording import known, size


@dataclass(frozen=True)
class Effect:
    """Imperfection that turns the true value of its stage into the recorded one.

    A subclass is also a frozen dataclass, and defines the following. ``_error`` returns the term
    added to the field of its stage's value, recorded = true + error; a change that is not additive
    is in ``_change``. A magnitude of zero changes nothing.

    Parameters
    ----------
    magnitude : float or tuple of float
        Defined by ``quantity``: unit, limits, usual size and its source. Parameters ``time`` and
        ``width`` (s, from Reference.start) make it an event, ``phase`` (rad) a wave, of which both
        quadratures are estimated, and ``target`` an error of the target of that name.
    name : str
        Name in files; by default range_bias for RangeBias. A class variable, like all that follow.
    stage : str
        One of STAGES.
    title : str
        Title for tables.
    meaning : str
        Meaning in one sentence.
    sentence : str
        Sentence of a verdict, with {size} for the number, {side} for its direction, {where} for
        place or time.
    remedy : str
        Recommended action of the surveyor.
    random : bool
        True if it draws from a random stream.
    sides : tuple of str, or of pairs of str
        Words for above and below zero; for a vector, a pair for each component.
    parts : tuple of str
        Names of the components of the magnitude, if a diagnosis estimates more than one.
    worded_unit : str
        Unit of the size in the sentence, if the magnitude's own would be misleading.

    Raises
    ------
    ValueError
        If a parameter is impossible.
    """

    magnitude: float | tuple[float, ...]

    name: ClassVar[str]
    stage: ClassVar[str]
    title: ClassVar[str]
    meaning: ClassVar[str]
    sentence: ClassVar[str]
    remedy: ClassVar[str]
    random: ClassVar[bool] = False
    sides: ClassVar[tuple] = ("", "")
    parts: ClassVar[tuple[str, ...]] = ("magnitude",)
    worded_unit: ClassVar[str] = ""

    def __init_subclass__(cls) -> None:
        if "name" not in vars(cls):
            cls.name = re.sub("(?<!^)(?=[A-Z])", "_", cls.__name__).lower()

    def __post_init__(self):
        for name, kind in self.quantities().items():
            if name == "magnitude":
                label = self.name
            else:
                label = f"{name} of {self.name}"
            object.__setattr__(self, name, kind.checked(label, getattr(self, name)))

    # ---- change of the survey

    def apply(
        self, value: Any, reference: Reference, rng: np.random.Generator | None = None
    ) -> Any:
        """Return the recorded value of this stage, of the same type.

        Parameters
        ----------
        value
            Value without the effect; see the table of stages in mlscorr.effects.
        reference : Reference
        rng : numpy.random.Generator, optional
            For a random effect.

        Raises
        ------
        ValueError
            If the code of a user's own effect fails, or returns an unusable value.
        """
        is_own = not type(self).__module__.startswith(f"{__package__}.")
        if is_own:
            change = partial(_checked_change, self, self._change)
        else:
            change = self._change
        if np.any(self.magnitude):
            return change(value, reference, rng)
        return value

    def _change(self, value, reference, rng):
        """Apply a magnitude that is not zero; see apply."""
        name = STAGES[self.stage]
        column = getattr(value, name)
        error = self._error(value, reference, rng)
        return replace(value, **{name: column + np.broadcast_to(error, column.shape)})

    def _error(self, value, reference, rng):
        """Return the term added to the field of the stage's value named in STAGES."""
        raise NotImplementedError(f"{type(self).__name__} has neither _error nor _change.")

    def document(self) -> dict[str, Any]:
        """Return name and parameters as in scenario.toml."""
        return {"name": self.name, **asdict(self)}

    # ---- role in an observation

    @classmethod
    def quantities(cls) -> dict[str, Quantity]:
        """Return the Quantity of each numeric parameter, by its name."""
        return {f.name: f.metadata["quantity"] for f in fields(cls) if "quantity" in f.metadata}

    @classmethod
    def circumstances(cls) -> tuple[str, ...]:
        """Names of the parameters that must be known besides the magnitude: time, position."""
        required = (f.name for f in fields(cls) if f.default is MISSING)
        return tuple(name for name in required if name != "magnitude")

    @classmethod
    def moment(cls) -> tuple[str, ...]:
        """Names of the parameters for the time of an event; empty if it always acts."""
        return tuple(name for name in ("time", "width") if name in cls.circumstances())

    @classmethod
    def is_on_target(cls) -> bool:
        """True if it acts on a single target, given by the parameter ``target``."""
        return "target" in cls.circumstances()

    @classmethod
    def is_wave(cls) -> bool:
        """True if it has a phase, and thus two quadratures: magnitude cos(phase) and sin(phase)."""
        return "phase" in cls.quantities()

    @classmethod
    def is_scatter(cls) -> bool:
        """True if it scatters or thins out the points, so that no correction removes it."""
        return cls.random or cls.stage == "beam"

    @classmethod
    def is_of_pose(cls) -> bool:
        """True if it is noise of the POS, shared by everything observed at one time."""
        return cls.random and cls.stage == "pos"

    @classmethod
    def needs_mounting(cls) -> bool:
        """True if its effect depends on the mounting, which gives the beams."""
        return cls.stage in ("range", "angle", "mounting")

    # ---- words in a report

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Return the names of all parameters that a diagnosis may estimate for it."""
        return (*cls.parts, *cls.moment())

    @classmethod
    def describe(cls, parameters: dict[str, SizeEstimate], where: str = "") -> str:
        """Return the sentence with its numbers, or the meaning if there are none.

        Parameters
        ----------
        parameters : dict of SizeEstimate
            By name.
        where : str
            Place or time of its action, in words.
        """
        words = cls.size_in_words(parameters) if parameters else None
        if words:
            return cls.sentence.format(where=where, **words)
        return cls.meaning

    @classmethod
    def size_in_words(cls, parameters: dict[str, SizeEstimate]) -> dict[str, str] | None:
        """Words for {size} and {side} of the sentence; None if unknown.

        Parameters
        ----------
        parameters : dict of SizeEstimate
            By name.
        """
        if cls.is_wave():
            return {"size": amplitude(parameters.values())}
        if len(cls.parts) > 1:
            return {"size": vector(parameters, cls.parts, cls.sides)}
        number = parameters.get("magnitude")
        if number is None or not known(number.estimate):
            return None
        words = size(abs(number.estimate), number.sigma, cls.worded_unit or number.unit)
        return {"size": words, "side": cls.sides[number.estimate < 0]}


def _checked_change(effect: Any, change: Callable, value: Any, *given: Any) -> Any:
    """Change of the stage's value by a user's effect, which receives read-only columns."""
    columns = {}
    if is_dataclass(value):
        columns = {f.name: getattr(value, f.name) for f in fields(value)}
    arrays = [name for name, column in columns.items() if isinstance(column, np.ndarray)]
    views = {name: np.broadcast_to(columns[name], columns[name].shape) for name in arrays}
    try:
        guarded = value
        if views:
            guarded = replace(value, **views)
        changed = change(guarded, *given)
        if not all(hasattr(changed, name) for name in columns):
            raise TypeError(f"it returns a {type(changed).__name__}")
        same = {name: columns[name] for name in arrays if getattr(changed, name) is views[name]}
        if same:
            changed = replace(changed, **same)
        for name, column in columns.items() or [("divergence", value)]:
            _check(name, column, getattr(changed, name, changed))
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        file = getattr(sys.modules.get(type(effect).__module__), "__file__", "") or "no file"
        lines = [
            f"line {f.lineno}, " for f in extract_tb(error.__traceback__) if f.filename == file
        ]
        raise ValueError(
            f"The effect {effect.name} ({''.join(lines[-1:])}{file}) can't be applied to the "
            f"{type(value).__name__} of its stage, {effect.stage}: {type(error).__name__}: "
            f"{str(error).rstrip('.')}. Fix or remove it; docs/own-effect.md describes its "
            "input and output."
        ) from error
    return changed


def _check(name, old, new):
    """Refuse a column that cannot replace the old one."""
    if new is old:
        return
    old, new = map(_numbers, (old, new))
    if new.shape != old.shape or not np.can_cast(new.dtype, old.dtype, "same_kind"):
        raise ValueError(f"{name} is {new.dtype} {new.shape}, not {old.dtype} {old.shape}")
    if new.dtype.kind == "f" and (lost := np.isfinite(old) & ~np.isfinite(new)).any():
        raise ValueError(f"{lost.sum()} of {lost.size} values of {name} are not a number")


def _numbers(column):
    """Return a column as an array, attitudes as quaternions."""
    if isinstance(column, Rotation):
        return column.as_quat()
    return np.asarray(column)
