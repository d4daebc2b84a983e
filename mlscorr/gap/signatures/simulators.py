"""Survey with a simulator's assumptions, and the simulator with an added cause."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import reduce
from typing import Any

import numpy as np

from mlscorr.effects import Boresight, Dropout, Effect, LeverArm, in_order
from mlscorr.simulate import Simulator, beliefs_of
from mlscorr.survey import Survey, SurveyFileError


def as_assumed(survey: Survey, simulator: Simulator) -> tuple[Survey, tuple[Effect, ...]]:
    """Return a survey with a simulator's scanner and POS, and the simulator's effects.

    A mounting in the simulator that differs from the survey's is treated as the true one: the
    difference becomes the effects lever_arm and boresight. If the trajectory has its own sigmas,
    the simulator's factor on those of survey.toml is applied to them.

    Parameters
    ----------
    survey : Survey
    simulator : Simulator

    Raises
    ------
    ValueError
        If mountings differ by an impossible amount, or only the simulator has a mounting.
    """
    recorded = survey.mounting
    assumed = simulator.mounting
    effects = list(simulator.effects)
    if assumed is not None and recorded is None:
        raise SurveyFileError(
            f"The simulator has a [mounting] and {survey.path} has none. Add it there, so that "
            "the beams are known."
        )
    if assumed is not None:
        arm = assumed.lever_arm - recorded.lever_arm
        turn = (assumed.boresight * recorded.boresight.inv()).as_rotvec()
        if np.abs(arm).max() > 1e-9:
            effects.append(LeverArm(magnitude=arm.tolist()))
        if np.abs(turn).max() > 1e-9:
            effects.append(Boresight(magnitude=np.degrees(turn).tolist()))
    trajectory = survey.trajectory
    old = survey.pos
    new = simulator.pos
    scales = {
        "position_sigma": new.position_sigma / old.position_sigma,
        "attitude_sigma": np.asarray(new.attitude_sigma) / np.asarray(old.attitude_sigma),
    }
    stated = {name: getattr(trajectory, name) for name in scales}
    scaled = {n: sigma * scales[n] for n, sigma in stated.items() if sigma is not None}
    trajectory = replace(trajectory, **scaled)
    assumed = replace(survey, trajectory=trajectory, scanner=simulator.scanner, pos=new)
    return assumed, in_order(effects)


def with_cause(simulator: Simulator, survey: Survey, cause: Any) -> Simulator:
    """Add a cause to a simulator, for simulator.toml.

    Parameters
    ----------
    simulator : Simulator
    survey : Survey
    cause : Cause
        Its effects and its model of the POS errors.

    Raises
    ------
    ValueError
        If a size is impossible.
    """
    added = cause.effects
    if simulator.mounting is not None:  # differences of the mounting have become effects
        added += as_assumed(survey, replace(simulator, effects=()))[1]
    effects = reduce(joined, added, list(simulator.effects))
    scale = cause.model.scale
    pos = simulator.pos
    if scale != 1.0:  # an estimated value is no longer a default
        sigmas = "position_sigma", "attitude_sigma"
        pos = replace(
            pos,
            position_sigma=pos.position_sigma * scale,
            attitude_sigma=np.asarray(pos.attitude_sigma) * scale,
            assumed=tuple(name for name in pos.assumed if name not in sigmas),
        )
    pos = replace(pos, windows=(*pos.windows, *cause.model.windows))
    mounting = beliefs_of(survey).mounting
    return replace(simulator, mounting=mounting, pos=pos, effects=in_order(effects))


def joined(effects: Sequence[Effect], new: Effect) -> list[Effect]:
    """Add an effect to others; it is merged with one of the same kind and target.

    Parameters
    ----------
    effects : sequence of Effect
    new : Effect
    """
    fixed = _fixed(new)
    for i, old in enumerate(effects):
        if old.name == new.name and _fixed(old) == fixed:
            a = np.asarray(old.magnitude, float)
            b = np.asarray(new.magnitude, float)
            total = np.hypot(a, b) if new.random else a + b
            if new.name == Dropout.name:  # of the remaining pulses
                total = a + b - a * b
            size = float(total) if total.ndim == 0 else total.tolist()
            return [*effects[:i], replace(old, magnitude=size), *effects[i + 1 :]]
    return [*effects, new]


def _fixed(effect):
    return {name: value for name, value in asdict(effect).items() if name != "magnitude"}
