"""What an effect is: a frozen value that changes one stage of a survey, and says so in words.

A user's own effect is applied so that whatever its code does ends in a sentence.
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
    """An imperfection that turns what is true into what is recorded, at its stage alone.

    A subclass is a frozen dataclass too, and says everything about itself in what follows.
    ``_error`` is what it adds to the field of its stage's value, recorded = true + error; where it
    does more than add, it has ``_change``. A magnitude of zero changes nothing.

    Parameters
    ----------
    magnitude : float or tuple of float
        By ``quantity``: its unit, limits, usual size and the source of that. Parameters ``time``
        and ``width`` (s, from Reference.start) make it an event, ``phase`` (rad) a wave, of which
        both quadratures are estimated, and ``target`` an error of the target of that name.
    name : str
        In files, of the class, as all that follow; unless it says another, range_bias of RangeBias.
    stage : str
        Of STAGES.
    title : str
        For tables.
    meaning : str
        What it is, in a sentence.
    sentence : str
        Of a verdict: {size} stands for the number, {side} for its direction, {where} for the place
        or the time.
    remedy : str
        What a surveyor can do about it.
    random : bool
        Whether it draws from a random stream.
    sides : tuple of str, or of pairs of str
        Words for above and below zero; of a vector, a pair for each part.
    parts : tuple of str
        Names of the parts of the magnitude, where a diagnosis estimates more than one.
    worded_unit : str
        Of the size in the sentence, where the magnitude's own would be misread.

    Raises
    ------
    ValueError
        For parameters that no survey can have.
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

    # ---- how it changes the survey

    def apply(
        self, value: Any, reference: Reference, rng: np.random.Generator | None = None
    ) -> Any:
        """The value of this stage as recorded: an object of the same type.

        Parameters
        ----------
        value
            As it is without the effect; see the table of stages in mlscorr.effects.
        reference : Reference
        rng : numpy.random.Generator, optional
            Of a random effect.

        Raises
        ------
        ValueError
            Where the code of a user's own effect raises, or makes what can't be used.
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
        """As apply, of a magnitude that is not zero."""
        name = STAGES[self.stage]
        column = getattr(value, name)
        error = self._error(value, reference, rng)
        return replace(value, **{name: column + np.broadcast_to(error, column.shape)})

    def _error(self, value, reference, rng):
        """What is added to the field of the stage's value that STAGES names."""
        raise NotImplementedError(f"{type(self).__name__} has neither _error nor _change.")

    def document(self) -> dict[str, Any]:
        """Name and parameters, as scenario.toml has them."""
        return {"name": self.name, **asdict(self)}

    # ---- how it enters an observation

    @classmethod
    def quantities(cls) -> dict[str, Quantity]:
        """The Quantity of each parameter that is a number, by the parameter's name."""
        return {f.name: f.metadata["quantity"] for f in fields(cls) if "quantity" in f.metadata}

    @classmethod
    def circumstances(cls) -> tuple[str, ...]:
        """Names of the parameters that must be known besides the magnitude: when, where."""
        required = (f.name for f in fields(cls) if f.default is MISSING)
        return tuple(name for name in required if name != "magnitude")

    @classmethod
    def moment(cls) -> tuple[str, ...]:
        """Names of the parameters that say when an event acts; none of what acts always."""
        return tuple(name for name in ("time", "width") if name in cls.circumstances())

    @classmethod
    def is_on_target(cls) -> bool:
        """Whether it acts on one target alone, by the parameter ``target``."""
        return "target" in cls.circumstances()

    @classmethod
    def is_wave(cls) -> bool:
        """Whether it has a phase, and so two quadratures: magnitude cos(phase) and sin(phase)."""
        return "phase" in cls.quantities()

    @classmethod
    def is_scatter(cls) -> bool:
        """Whether it widens or thins out the points, so that no correction takes it off."""
        return cls.random or cls.stage == "beam"

    @classmethod
    def is_of_pose(cls) -> bool:
        """Whether it is noise of the POS, which all that is seen at a moment shares."""
        return cls.random and cls.stage == "pos"

    @classmethod
    def needs_mounting(cls) -> bool:
        """Whether nobody can tell what it does without the mounting, which gives the beams."""
        return cls.stage in ("range", "angle", "mounting")

    # ---- how a report says it

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Names of all parameters that a diagnosis may give for it."""
        return (*cls.parts, *cls.moment())

    @classmethod
    def describe(cls, parameters: dict[str, SizeEstimate], where: str = "") -> str:
        """The sentence with its numbers; what it is, where there are none.

        Parameters
        ----------
        parameters : dict of SizeEstimate
            By name.
        where : str
            Where or when it acts, in words.
        """
        words = cls.size_in_words(parameters) if parameters else None
        if words:
            return cls.sentence.format(where=where, **words)
        return cls.meaning

    @classmethod
    def size_in_words(cls, parameters: dict[str, SizeEstimate]) -> dict[str, str] | None:
        """What {size} and {side} of the sentence stand for; None where nobody knows.

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
    """What a user's effect makes of the value of its stage, whose columns it can't write into."""
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
            f"{str(error).rstrip('.')}. Fix or remove it; docs/own-simulator.md describes its "
            "input and output."
        ) from error
    return changed


def _check(name, old, new):
    """Refuse a column that can't take the place of the old one."""
    if new is old:
        return
    old, new = map(_numbers, (old, new))
    if new.shape != old.shape or not np.can_cast(new.dtype, old.dtype, "same_kind"):
        raise ValueError(f"{name} is {new.dtype} {new.shape}, not {old.dtype} {old.shape}")
    if new.dtype.kind == "f" and (lost := np.isfinite(old) & ~np.isfinite(new)).any():
        raise ValueError(f"{lost.sum()} of {lost.size} values of {name} are not a number")


def _numbers(column):
    """A column as an array, attitudes as quaternions."""
    if isinstance(column, Rotation):
        return column.as_quat()
    return np.asarray(column)
