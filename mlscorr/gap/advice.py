"""Advice on a verdict, and agreement of observations with their stated accuracies."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from mlscorr.gap.closure import Closure
from mlscorr.gap.evidence import SETTINGS, Cause, CauseParameter, Inference
from mlscorr.gap.plan import NextData
from mlscorr.gap.residuals import Background, Rows
from mlscorr.survey import Statement


@dataclass(frozen=True)
class Agreement:
    """Agreement of one channel's observations, as recorded, without the simulator's effects.

    Parameters
    ----------
    channel : str
        target, surface or shared.
    things : int
    rms_mm : float
        Of the residuals, along each axis or normal. Units: mm.
    stated_mm : float
        The same by the stated accuracies of POS, survey and extraction. Units: mm.
    """

    channel: str
    things: int
    rms_mm: float
    stated_mm: float


def agreements(rows: Rows, background: Background) -> list[Agreement]:
    """Make an Agreement of each channel with residuals in m.

    Parameters
    ----------
    rows : Rows
    background : Background
        Of these rows.
    """
    variance = rows.noise + rows.survey
    legs = background.position**2 + background.attitude**2
    np.add.at(variance, background.row, legs.sum(axis=1))
    parts = []
    for channel in dict.fromkeys(rows.channel[rows.metric].tolist()):
        of = rows.metric & (rows.channel == channel)
        sizes = (1e3 * np.sqrt(np.mean(values[of])) for values in (rows.residual**2, variance))
        parts.append(Agreement(channel, len(np.unique(rows.item[of])), *map(float, sizes)))
    return parts


OF_EXCESS = {  # key of the advice without a cause, by what the residuals exceed
    "": "nothing to do",
    "stated": "errors above stated",
    "chance": "gap above chance",
}


def excess_of(
    inference: Inference, closure: Closure, agreement: Iterable[Agreement], is_stated: bool = True
) -> str:
    """Threshold that the residuals exceed without a named cause: stated, chance, or nothing.

    Parameters
    ----------
    inference : Inference
    closure : Closure
        Of its verdict.
    agreement : iterable of Agreement
    is_stated : bool
        True if the sigmas of the POS were stated; defaults cannot be exceeded.
    """
    if inference.verdict.label != "none":
        return ""
    worse = [part for part in agreement if part.rms_mm > SETTINGS.quantile * part.stated_mm]
    if is_stated and (worse or closure.over_sigma.beyond):
        return "stated"
    gaps = closure.gap, inference.where
    if any(gap.before > gap.null_band[1] for gap in gaps):
        return "chance"
    return ""


def distinct_parameters(cause: Cause) -> tuple[CauseParameter, ...]:
    """Parameters of a cause; those with the same name are prefixed by their effect.

    Parameters
    ----------
    cause : Cause
        With parts in the order of its parameters.
    """
    often = Counter(parameter.name for parameter in cause.parameters)
    parts = [(part.name, {*part.parameters, *part.kind.moment()}) for part, _ in cause.parts]
    owners = {
        name: iter([part for part, names in parts if name in names])
        for name, count in often.items()
        if count > 1
    }
    return tuple(
        replace(p, name=f"{next(owners[p.name])} {p.name}") if p.name in owners else p
        for p in cause.parameters
    )


def advice_of(
    inference: Inference,
    closure: Closure,
    next_data: Sequence[NextData],
    excess: str,
    is_stated: bool = True,
    left_out: Mapping[str, Statement] = MappingProxyType({}),
) -> list[Statement]:
    """Return the advice on a verdict.

    Parameters
    ----------
    inference : Inference
    closure : Closure
        Of its verdict.
    next_data : sequence of NextData
    excess : str
        From ``excess_of``.
    is_stated : bool
        True if the sigmas of the POS were stated.
    left_out : mapping of str to Statement
        Reasons why effects were not judged.
    """
    verdict = inference.verdict
    advice = []
    if verdict.label == "none":
        if not is_stated and not excess:
            advice.append(Statement("drift of a default"))
        else:
            advice.append(Statement(OF_EXCESS[excess]))
    elif verdict.is_hidden:
        advice.append(Statement("unmatched targets"))
    elif verdict.label == "unknown":
        unjudged = sum(why.key == "no mounting" for why in left_out.values())
        if unjudged:
            advice.append(Statement("unstated mounting", values={"effects": unjudged}))
        advice.append(Statement("unknown error", values={"lead": verdict.hint}))
        if closure.effect != "none":  # it mimics the cause
            share = None if closure.is_within_noise else max(0.0, closure.shrink)
            values = {"effect": closure.effect, "share": share}
            advice.append(Statement("nearest effect", "warning", values))
    else:
        parts = verdict.label.split("+")
        advice += [Statement("remedy", values={"effect": part}) for part in parts]
        low, high = closure.null_band
        if closure.shrink < 0 and not low <= closure.after <= high:
            values = {"before": closure.before, "after": closure.after, "unit": closure.unit}
            advice.append(Statement("grown gap", "warning", values))
    labels = (*verdict.set, *inference.same)
    open_question = tuple(name for name in labels if name not in ("none", verdict.label))
    if open_question and next_data:
        advice = without_nothing_to_do(advice)
        addition = {"survey": next_data[0].survey, "why": next_data[0].why}
        advice.append(Statement("addition", values={"labels": open_question} | addition))
    return advice


def without_nothing_to_do(advice: Iterable[Statement]) -> list[Statement]:
    """Remove "nothing to do" from an advice with further statements.

    Parameters
    ----------
    advice : iterable of Statement
    """
    return [statement for statement in advice if statement.key != "nothing to do"]
