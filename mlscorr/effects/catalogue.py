"""All known effects, including users' own: creation by name, and application in order."""

import sys
from collections.abc import Iterable
from dataclasses import MISSING, fields
from difflib import get_close_matches
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from string import Formatter
from types import ModuleType
from typing import Any

import numpy as np

from mlscorr.effects import _control as control
from mlscorr.effects import _encoder as encoder
from mlscorr.effects import _timing as timing
from mlscorr.effects import mounting, ranging, vehicle
from mlscorr.effects.effect import Effect
from mlscorr.effects.stages import STAGES, Reference

EFFECTS = (  # one or two lines per stage, in order of action
    ranging.BeamDivergence,
    *(timing.TimeOffset, timing.ClockDrift, timing.TimeJitter),
    *(ranging.RangeScale, ranging.RangeBias, ranging.RangeWalk),
    *(ranging.IncidenceBias, ranging.RangeNoise),
    *(encoder.AngleScale, encoder.AngleEccentricity, encoder.AngleNoise),
    ranging.Dropout,
    *(vehicle.HeadingDrift, vehicle.PositionStep, vehicle.PositionBump, vehicle.PositionNoise),
    *(mounting.Boresight, mounting.LeverArm),
    *(control.MapRotation, control.MapScale),
    *(control.HorizontalDatum, control.VerticalDatum, control.TargetOutlier),
)
SYSTEMATIC = tuple(kind.name for kind in EFFECTS if not kind.is_scatter())
RANDOM = tuple(kind.name for kind in EFFECTS if kind.random)
_registered: dict[str, type[Effect]] = {}  # a user's own, which act after these


def known_effects() -> tuple[type[Effect], ...]:
    """Return the classes of all effects: EFFECTS, then registered ones in order."""
    return (*EFFECTS, *_registered.values())


def effects_by_name() -> dict[str, type[Effect]]:
    """Return the classes of all effects by name."""
    return {kind.name: kind for kind in known_effects()}


def effect_class(name: str) -> type[Effect]:
    """Return the class of an effect by its name.

    Parameters
    ----------
    name : str

    Raises
    ------
    ValueError
        If the name is unknown; the message has the most similar one.
    """
    by_name = effects_by_name()
    if name not in by_name:
        near = get_close_matches(str(name), by_name, n=1, cutoff=0.0)[0]
        raise ValueError(
            f"{name!r} is an unknown effect; the nearest known one is {near}. If it is your own, "
            "give its file: --effects FILE."
        )
    return by_name[name]


def make_effect(name: str, **parameters: Any) -> Effect:
    """Make an effect by name with its parameters, in the units of its class.

    Parameters
    ----------
    name : str
    **parameters
        Parameters named as in the class.

    Raises
    ------
    ValueError
        For an unknown name (with the most similar one), unknown or missing parameters, and values
        beyond the largest credible one.

    Examples
    --------
    >>> from mlscorr.effects import make_effect
    >>> make_effect("time_offset", magnitude=0.002)
    TimeOffset(magnitude=0.002)
    >>> make_effect("boresight", magnitude=[200, 0, 0])
    Traceback (most recent call last):
    ValueError: boresight of 200 deg exceeds 10 deg; drawings give a mounting to a degree.
    """
    kind = effect_class(name)
    known = {field.name: field for field in fields(kind)}
    unknown = [key for key in parameters if key not in known]
    missing = [key for key, f in known.items() if f.default is MISSING and key not in parameters]
    if unknown or missing:
        fault = f"has no parameter {unknown[0]!r}" if unknown else f"needs {missing[0]}"
        raise ValueError(f"{name} {fault}; its parameters are {_describe(kind)}.")
    return kind(**parameters)


def _describe(kind):
    """List parameters of an effect with their units: "magnitude (m), time (s)"."""
    kinds = kind.quantities()
    return ", ".join(f"{f.name} ({kinds.get(f.name, 'a name')})" for f in fields(kind))


def in_order(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Sort effects into the order in which they act.

    Parameters
    ----------
    effects : iterable of Effect
        Known effects.

    Raises
    ------
    ValueError
        If a random effect occurs twice, because both would draw from one stream.
    """
    order = {kind.name: number for number, kind in enumerate(known_effects())}
    stages = list(STAGES)
    ordered = sorted(effects, key=lambda e: (stages.index(e.stage), order[e.name], repr(e)))
    random = [effect.name for effect in ordered if effect.random]
    for name in random:
        if random.count(name) > 1:
            raise ValueError(
                f"{name} is listed {random.count(name)} times. Give it once, with the root of "
                "the sum of squares of the magnitudes."
            )
    return tuple(ordered)


def apply_effects(
    effects: Iterable[Effect],
    stage: str,
    value: Any,
    reference: Reference,
    streams: dict[str, np.random.Generator],
) -> Any:
    """Apply all effects of a stage to its value, in their fixed order.

    Parameters
    ----------
    effects : iterable of Effect
    stage : str
        One of STAGES.
    value
        Value of the stage; see the table of stages in mlscorr.effects.
    reference : Reference
    streams : dict
        Generator by effect name, from effect_streams; they continue from block to block, so that
        results do not depend on block size.

    Raises
    ------
    ValueError
        If the stage is unknown.
    """
    _known_stage(stage)
    for effect in in_order(effects):
        if effect.stage == stage:
            value = effect.apply(value, reference, streams[effect.name])
    return value


def _known_stage(stage):
    if stage not in STAGES:
        raise ValueError(f"{stage!r} is an unknown stage; known are {', '.join(STAGES)}.")


def effect_streams(rng: np.random.Generator) -> dict[str, np.random.Generator]:
    """Make a random stream for every known effect by name, whether it is used or not.

    Streams of registered effects derive from the last of the others, whose draws they do not
    change.

    Parameters
    ----------
    rng : numpy.random.Generator
    """
    streams = rng.spawn(len(EFFECTS))
    streams += streams[-1].spawn(len(_registered))
    return {kind.name: s for kind, s in zip(known_effects(), streams, strict=True)}


def register(kind: type[Effect]) -> type[Effect]:
    """Register a user's effect by its name, for simulator, diagnosis and report.

    Parameters
    ----------
    kind : class of an Effect
        Frozen dataclass with everything that Effect requires. It replaces a registered class of the
        same name.

    Returns
    -------
    class of an Effect
        The same class, for use as a decorator.

    Raises
    ------
    ValueError
        If a definition is missing, or an effect of this library has the name.

    Notes
    -----
    A vehicle body that rises with the square of the speed, for everything in this process::

        @register
        @dataclass(frozen=True)
        class Squat(Effect):
            "The body rises with the square of the speed: recorded = true + magnitude v^2."

            name: ClassVar = "squat"
            stage: ClassVar = "pos"
            title: ClassVar = "Squatting vehicle"
            meaning: ClassVar = "The body of the vehicle rises when it is fast."
            sentence: ClassVar = "At 1 m/s the body of the vehicle is {size} too {side}."
            remedy: ClassVar = "Drive at one speed."
            sides: ClassVar = ("high", "low")
            magnitude: float = quantity(
                "m per (m/s)^2", 0.01, "no car flies", typical=1e-4,
                source="estimate: 1 cm at 10 m/s",
            )

            def _error(self, value, reference, rng):
                velocity = np.gradient(value.position, value.gps_time, axis=0)
                return self.magnitude * (velocity**2).sum(axis=1)[:, None] * [0.0, 0.0, 1.0]
    """
    required = ("name", "stage", "title", "meaning", "sentence", "remedy", "sides")
    missing = [key for key in required if not getattr(kind, key, "")]
    if missing:
        raise ValueError(f"{kind.__name__} does not define {', '.join(missing)}; see Effect.")
    size = kind.quantities().get("magnitude")
    if size is None or not size.typical or not size.source:
        raise ValueError(f"{kind.name} has no magnitude with unit, typical size and its source.")
    if not kind.name.isidentifier() or kind.name in ("none", "noise", "unknown"):
        raise ValueError(
            f"{kind.name!r} can't be the name of an effect: use letters, digits and _, and not "
            "none, noise or unknown."
        )
    if kind.name in {known.name for known in EFFECTS}:
        raise ValueError(f"{kind.name} is a built-in effect of mlscorr; choose another name.")
    _known_stage(kind.stage)
    count = 2 if kind.is_wave() else size.count
    if len(kind.parts) != count or (count == size.count and len(kind.sides) != max(count, 2)):
        raise ValueError(f"{kind.name} has {len(kind.parts)} parts and sides for {count}.")
    words = ("size", "where", *["side"] * (count == 1))
    if strange := {word for _, word, *_ in Formatter().parse(kind.sentence)} - {None, *words}:
        raise ValueError(
            f"The sentence of {kind.name} may contain {', '.join(words)}, not {min(strange)}."
        )
    _registered[kind.name] = kind
    return kind


def register_file(path: Path | str) -> tuple[type[Effect], ...]:
    """Run a file that registers effects, which are then known.

    Parameters
    ----------
    path : path
        Python code, which is executed: use only files that you trust.

    Returns
    -------
    tuple of Effect classes
        Registered classes.

    Raises
    ------
    ValueError
        If the file cannot be run, or registers nothing.
    FileNotFoundError
        If there is no such file.
    """
    path = Path(path)
    before = set(known_effects())
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist. Give a file that registers effects.")
    run_file(path)
    effects = tuple(kind for kind in known_effects() if kind not in before)
    if not effects:
        raise ValueError(
            f"{path} registers no effect. Call mlscorr.effects.register with your class, as in "
            "docs/own-effect.md."
        )
    return effects


def run_file(path: Path) -> ModuleType:
    """Run a Python file of the user and return its module.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ValueError
        With the file and its error.
    """
    spec = spec_from_file_location(f"user.{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path} is not a Python file: its name must end in .py.")
    module = sys.modules[spec.name] = module_from_spec(spec)  # dataclasses search for it there
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        line = ""
        if isinstance(error, SyntaxError) and error.lineno:
            line = f" (line {error.lineno})"
        raise ValueError(f"{path} can't be run{line}: {type(error).__name__}: {error}") from error
    return module
