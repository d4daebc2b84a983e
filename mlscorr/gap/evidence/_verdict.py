"""The verdict: none, a noise class, an effect, two of them, or unknown; with what probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.effects import PositionNoise, effect_class
from mlscorr.gap.evidence._error_models import error_models
from mlscorr.gap.evidence._events import refine_events
from mlscorr.gap.evidence._noise import draw_channels, noisy_pos_models, weigh_noise
from mlscorr.gap.evidence._windows import models_with_windows, weigh_windows
from mlscorr.gap.evidence.columns import ColumnTable
from mlscorr.gap.evidence.decision import Costs, JointScore, cheapest, learned
from mlscorr.gap.evidence.evidence import suited_models, weigh_blocks
from mlscorr.gap.evidence.labels import LabelEvidence, block_scores, noise_scores
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Absence, Rows
from mlscorr.gap.signatures import Signature
from mlscorr.survey import Survey


@dataclass(frozen=True)
class GapVerdict:
    """The answer.

    Parameters
    ----------
    label : str
        none, unknown, an effect, or two joined by +.
    probability : float
    set : tuple of str
        The smallest set of labels that holds 95 %.
    p_value : float
        Of none, from replicas of this very survey, and by how these lie where nothing acts.
    lead : str
        Where unknown points: "height error that grows with speed squared"; else empty.
    is_hidden : bool
        Whether unknown is what targets without a residual tell of, and no row does.
    """

    label: str
    probability: float
    set: tuple[str, ...]
    p_value: float
    lead: str
    is_hidden: bool = False


def with_absence(probability: dict[str, float], absence: Absence) -> dict[str, float]:
    """Probabilities that know of targets without a residual, most probable first.

    Whatever acts in the rows, a run of them is chance, or something unknown that no row shows has
    made it. An effect stays what it is with that beside it; none doesn't. However likely the
    chance, none stays behind unknown: of what was not seen nobody knows that it is right.

    Parameters
    ----------
    probability : dict
        Of all labels, by the rows.
    absence : Absence
    """
    if not absence.runs:
        return probability
    prior = dict(SETTINGS.prior)
    none = probability["none"]
    hidden = prior["unknown"] / prior["none"]
    moved = none * hidden / (hidden + min(absence.chance, hidden))
    weight = probability | {"none": none - moved, "unknown": probability["unknown"] + moved}
    order = sorted(weight, key=lambda label: (-weight[label], label == "none"))
    return {label: weight[label] for label in order}


def decide(
    evidence: LabelEvidence,
    probability: dict[str, float],
    absence: Absence | None = None,
    costs: Costs | None = None,
) -> GapVerdict:
    """Verdict from probabilities.

    Parameters
    ----------
    evidence : LabelEvidence
    probability : dict
        Of all labels by the rows, most probable first.
    absence : Absence, optional
        Of targets that have none.
    costs : Costs, optional
        Of wrong answers.
    """
    by_rows = probability
    is_hidden = False
    if absence is not None:
        probability = with_absence(by_rows, absence)
        is_hidden = bool(absence.runs) and by_rows["none"] > by_rows["unknown"]
    held = np.cumsum(list(probability.values()))
    number = int(np.searchsorted(held, SETTINGS.confidence)) + 1
    label = cheapest(probability, evidence.noisy, Costs() if costs is None else costs)
    if is_hidden and label == "none":
        label = "unknown"
    lead = evidence.lead()[0] if label == "unknown" else ""
    is_hidden &= label == "unknown"
    if is_hidden:
        lead = absence.runs[0].lead
    labels = tuple(dict.fromkeys((*tuple(probability)[:number], label)))
    p_value = learned().calibrated(evidence.p_value)
    return GapVerdict(label, probability[label], labels, p_value, lead, is_hidden)


@threadpool_limits.wrap(limits=1, user_api="blas")
def joint_score(
    rows: Rows, survey: Survey, signatures: Sequence[Signature], evidence: LabelEvidence
) -> tuple[JointScore, LabelEvidence]:
    """Scores of all labels, two of them together included; and the evidence with the events that
    were refined beside another cause.

    Each of the best causes is taken as accepted, its size as free; then noise classes, effects and
    unknown are compared again on what it leaves. What only unknown explains there is unknown: a
    cause that leaves it impersonates another.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    signatures : sequence of Signature
    evidence : LabelEvidence
        Of these.
    """
    score = {name: float(values[0]) for name, values in evidence.score.items()}
    single = dict(score)
    best = _best_effect(evidence)
    given = {}
    refined = {}
    for first in _accepted(evidence, score, best):
        regained, beside, events = _given(rows, survey, signatures, evidence, first)
        base = score[first] = score[first] + regained
        given[first] = {name: gain for name, gain in beside.items() if name != first}
        for name, gain in given[first].items():
            if name == "unknown":
                label = "unknown"
            else:
                label = _joined(evidence, first, name)
            score[label] = np.logaddexp(score.get(label, -np.inf), base + gain)
            if name in events:
                refined[label] = events[name]
    facts = _facts(rows, evidence, best)
    joint = JointScore(score, single, given.get(best, {}), facts, evidence.noisy)
    return joint, replace(evidence, refined=refined | evidence.refined)


def _best_effect(evidence):
    """The effect with the largest score, or None without any."""
    return max(evidence.table.effects, key=lambda name: evidence.score[name][0], default=None)


def _accepted(evidence, score, best):
    """The best effect, and the one or two best causes, if probable enough to be tried with
    another.
    """
    # unknown is left out of the sum: its blocks can hold two effects that are a pair
    total = np.logaddexp.reduce([value for name, value in score.items() if name != "unknown"])
    order = [n for n in sorted(score, key=score.get, reverse=True) if n not in ("none", "unknown")]
    causes = [name for name in order if score[name] - total > np.log(1 - SETTINGS.confidence)][:2]
    noisy = evidence.noisy
    causes = [name for name in causes if name not in noisy or effect_class(name).is_of_pose()]
    if best is None or best in causes:
        return causes
    return [best, *causes]


def _facts(rows, evidence, best):
    """What tells how evidence is to be taken."""
    observations = evidence.observations
    raised = observations.errors.raised >= 0
    is_event = best is not None and bool(effect_class(best).moment())
    moved = np.zeros(len(raised))
    if is_event:
        moved = (_best_columns(evidence, best)[observations.row] ** 2).sum(axis=1)
    return {
        "rough": float((rows.channel == "roughness").any()),
        "raised": float(raised.mean()),
        "event": float(is_event),
        "event in raised": float(moved[raised].sum() / max(moved.sum(), 1e-300)),
        "scale": float(np.log(evidence.likely_model("none").scale)),
        "size": float(np.log(len(observations))),
        "odd": len(evidence.tail) / len(observations),
    }


def _joined(evidence, *names):
    order = [*evidence.table.labels, *(each.label for each in evidence.noise)]
    return "+".join(sorted(names, key=order.index))


def best_member(
    signatures: Sequence[Signature], evidence: LabelEvidence, name: str, label: str
) -> Signature:
    """The signature of an effect that explains the residuals best; an event's is refined.

    Parameters
    ----------
    signatures : sequence of Signature
    evidence : LabelEvidence
    name : str
        Of the effect.
    label : str
        That it is part of.
    """
    event = evidence.event(name, label)
    best = evidence.table.blocks[evidence.best(name)]
    if event is None:
        return signatures[best.member]
    return event.signature


def _best_columns(evidence, name):
    """Columns (m, p), scaled, of one label's best member; an event's is refined."""
    if name in evidence.refined:
        return evidence.refined[name].table.columns
    table = evidence.table
    member = evidence.table.blocks[evidence.best(name)].member
    blocks = [b for b in table.blocks if b.label == name and b.member == member]
    return table.columns[:, max(blocks, key=lambda block: len(block.columns)).columns]


def _given(rows, survey, signatures, evidence, first):
    """What one label gains by models that suit it, the scores of others given it, and the events
    that stand out beside it.

    Scores are logs of prior times evidence over that of the one alone.
    """
    observations = evidence.observations
    table = evidence.table
    residual = observations.columns(rows.residual[:, None])
    regained = 0.0
    prior = dict(SETTINGS.prior_beside)
    is_noise = first == PositionNoise.name
    if is_noise:
        models = noisy_pos_models() + models_with_windows(evidence.noise)
        models = suited_models(observations, table, models, residual)
    else:
        columns = observations.columns(_best_columns(evidence, first))
        observations = observations.with_shared(columns)
        models = suited_models(observations, table, error_models(), residual)
        regained = _regained(evidence, first, models, residual)
    blocks = weigh_blocks(observations, models, residual, table)
    of_effect = prior["effect"] / max(1, len(table.labels) - 1)
    scores = block_scores(table, blocks, of_effect, prior)
    events = refine_events(rows, survey, observations, table, blocks, signatures)
    for name, event in events.items():
        scores[name] = np.logaddexp(scores[name], np.log(of_effect) + event.gain)
    if not is_noise:
        channels = draw_channels(rows, None, 0)
        noise = weigh_noise(observations, rows, signatures, blocks, residual, channels)
        accepted = SETTINGS.free_sigma * columns
        noise += weigh_windows(observations, signatures, blocks, residual, accepted)
        scores |= noise_scores(noise, prior)
    return regained, {name: float(values[0]) for name, values in scores.items()}, events


def _regained(evidence, name, models, residual):
    """By how much the log evidence of a label over none grows with models that suit it."""
    columns = _best_columns(evidence, name)
    block = evidence.table.blocks[evidence.best(name)]
    table = ColumnTable(columns, (replace(block, columns=np.arange(columns.shape[1])),))
    known = evidence.blocks.models
    blocks = weigh_blocks(
        evidence.observations, tuple(dict.fromkeys(known + models)), residual, table
    )
    after, before = (
        np.logaddexp.reduce(blocks.by_model[part, 0]) - np.logaddexp.reduce(blocks.none[part, 0])
        for part in (slice(None), slice(len(known)))
    )
    return float(after - before)
