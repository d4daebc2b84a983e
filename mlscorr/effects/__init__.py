"""Imperfections of a survey as values: each turns what is true into what is recorded.

An effect has a magnitude in a unit, a source for its usual size, and acts at one stage of the
measurement, on that stage's value:

=========  =====================================  ===========================================
stage      value                                  changed
=========  =====================================  ===========================================
beam       full divergence, rad                   it
clock      Returns                                gps_time
range      Returns                                range
angle      Returns                                angle
return     Returns                                kept
pos        Trajectory, as recorded                position or attitude
mounting   Mounting                               lever_arm or boresight
control    ControlPoints                          position (map_rotation: normal too)
=========  =====================================  ===========================================

Recorded = true + effect, but for the mounting: there the magnitude is the correction that the
recorded one lacks, true = recorded + magnitude.
"""

from dataclasses import MISSING, fields
from difflib import get_close_matches

from mlscorr.effects import control, scan, vehicle
from mlscorr.effects.effect import STAGES, Effect, Quantity, Reference, Returns

__all__ = [
    "EFFECTS",
    "STAGES",
    "Effect",
    "Quantity",
    "Reference",
    "Returns",
    "apply_effects",
    "effect_streams",
    "in_order",
    "make_effect",
]

EFFECTS = (  # by stage; within one, in the order in which they act
    scan.BeamDivergence,
    scan.TimeOffset,
    scan.ClockDrift,
    scan.TimeJitter,
    scan.RangeScale,
    scan.RangeBias,
    scan.RangeWalk,
    scan.IncidenceBias,
    scan.RangeNoise,
    scan.AngleScale,
    scan.AngleEccentricity,
    scan.AngleNoise,
    scan.Dropout,
    vehicle.HeadingDrift,
    vehicle.PositionStep,
    vehicle.PositionBump,
    vehicle.PositionNoise,
    vehicle.Boresight,
    vehicle.LeverArm,
    control.MapRotation,
    control.MapScale,
    control.HorizontalDatum,
    control.VerticalDatum,
    control.TargetOutlier,
)
_ORDER = {kind.name: number for number, kind in enumerate(EFFECTS)}


def make_effect(name, **parameters):
    """The effect of a name with its parameters, in the units that its class states.

    Raises ValueError in one sentence for an unknown name (with the nearest known one), unknown
    or missing parameters, and values beyond the largest credible one.

    >>> make_effect("time_offset", magnitude=0.002)
    TimeOffset(magnitude=0.002)
    >>> make_effect("boresight", magnitude=[200, 0, 0])
    Traceback (most recent call last):
    ValueError: boresight of 200 deg exceeds 10 deg; a mounting is known from its drawing to a
    degree.
    """
    if name not in _ORDER:
        near = get_close_matches(str(name), _ORDER, n=1, cutoff=0.0)[0]
        raise ValueError(f"{name!r} is an unknown effect; the nearest known one is {near}.")
    kind = EFFECTS[_ORDER[name]]
    known = {field.name: field for field in fields(kind)}
    unknown = [key for key in parameters if key not in known]
    missing = [key for key, f in known.items() if f.default is MISSING and key not in parameters]
    if unknown or missing:
        fault = f"has no parameter {unknown[0]!r}" if unknown else f"lacks {missing[0]}"
        raise ValueError(f"{name} {fault}; its parameters are {_describe(kind)}.")
    return kind(**parameters)


def in_order(effects):
    """Effects in the order in which they act, however they were listed.

    Raises ValueError when a random one is there twice: both would draw from one stream.
    """
    ordered = sorted(effects, key=lambda effect: (_ORDER[effect.name], repr(effect)))
    random = [effect.name for effect in ordered if effect.random]
    for name in random:
        if random.count(name) > 1:
            raise ValueError(
                f"{name} is listed {random.count(name)} times; give one, with the root of the sum "
                "of squares of the magnitudes."
            )
    return tuple(ordered)


def apply_effects(effects, stage, value, reference, streams):
    """A stage's value after all effects of that stage, in their fixed order.

    Parameters
    ----------
    effects : iterable of Effect
    stage : str
        One of STAGES.
    value
        What the stage works on (see the module).
    reference : Reference
    streams : dict
        Generator of each effect's name, as effect_streams gives them; they go on from block to
        block, so that blocks of any size give the same.
    """
    if stage not in STAGES:
        raise ValueError(f"{stage!r} is an unknown stage; known are {', '.join(STAGES)}.")
    for effect in in_order(effects):
        if effect.stage == stage:
            value = effect.apply(value, reference, streams[effect.name])
    return value


def effect_streams(rng):
    """A random stream for every known effect by its name, whether it is used or not."""
    return {kind.name: s for kind, s in zip(EFFECTS, rng.spawn(len(EFFECTS)), strict=True)}


def _describe(kind):
    """Parameters of an effect with their units: "magnitude (m), time (s)"."""
    kinds = kind.quantities()
    return ", ".join(f"{f.name} ({kinds.get(f.name, 'a name')})" for f in fields(kind))
