"""The verdict: none, a noise class, an effect, two of them, or unknown; with what probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.effects import effect_class
from mlscorr.effects.vehicle import PositionNoise
from mlscorr.gap.infer.error_models import error_models
from mlscorr.gap.infer.evidence import ColumnTable, weigh_blocks
from mlscorr.gap.infer.labels import LabelEvidence, block_scores, noise_scores
from mlscorr.gap.infer.noise import draw_channels, noisy_pos_models, weigh_noise
from mlscorr.gap.infer.observations import relevant_models
from mlscorr.gap.infer.settings import SETTINGS
from mlscorr.gap.infer.windows import models_with_windows
from mlscorr.gap.observe.absence import Absence
from mlscorr.gap.observe.rows import Rows
from mlscorr.gap.signatures.signatures import Signature


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
        Of none, from replicas of this very survey.
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
    prior, none = dict(SETTINGS.prior), probability["none"]
    hidden = prior["unknown"] / prior["none"]
    moved = none * hidden / (hidden + min(absence.chance, hidden))
    weight = probability | {"none": none - moved, "unknown": probability["unknown"] + moved}
    order = sorted(weight, key=lambda label: (-weight[label], label == "none"))
    return {label: weight[label] for label in order}


def decide(
    evidence: LabelEvidence, probability: dict[str, float], absence: Absence | None = None
) -> GapVerdict:
    """Verdict from probabilities.

    Parameters
    ----------
    evidence : LabelEvidence
    probability : dict
        Of all labels by the rows, most probable first.
    absence : Absence, optional
        Of targets that have none.
    """
    by_rows, is_hidden = probability, False
    if absence is not None:
        probability = with_absence(by_rows, absence)
        is_hidden = bool(absence.runs) and by_rows["none"] > by_rows["unknown"]
    held = np.cumsum(list(probability.values()))
    number = int(np.searchsorted(held, SETTINGS.confidence)) + 1
    label = next(iter(probability))
    lead = evidence.lead()[0] if label == "unknown" else ""
    is_hidden &= label == "unknown"
    if is_hidden:
        lead = absence.runs[0].lead
    labels = tuple(probability)[:number]
    return GapVerdict(label, probability[label], labels, evidence.p_value, lead, is_hidden)


@threadpool_limits.wrap(limits=1, user_api="blas")
def weigh_pairs(
    rows: Rows, signatures: Sequence[Signature], evidence: LabelEvidence
) -> dict[str, float]:
    """Probabilities of all labels, two of them together included, most probable first.

    Each of the best causes is taken as accepted, its size as free; then noise classes, effects and
    unknown are compared again on what it leaves. What only unknown explains there is unknown: a
    cause that leaves it impersonates another.

    Parameters
    ----------
    rows : Rows
    signatures : sequence of Signature
    evidence : LabelEvidence
        Of these.
    """
    score = {name: float(values[0]) for name, values in evidence.score.items()}
    for first in _accepted(evidence, score):
        regained, beside = _given(rows, signatures, evidence, first)
        base = score[first] = score[first] + regained
        for name, gain in beside.items():
            if name != first:
                label = "unknown" if name == "unknown" else _joined(evidence, first, name)
                score[label] = np.logaddexp(score.get(label, -np.inf), base + gain)
    values = np.array(list(score.values()))
    share, names = np.exp(values - np.logaddexp.reduce(values)), list(score)
    return {names[i]: float(share[i]) for i in np.argsort(-share, kind="stable")}


def _accepted(evidence, score):
    """The one or two best causes, probable enough to be tried together with another."""
    # unknown is left out of the sum: its blocks can hold two effects that are a pair
    total = np.logaddexp.reduce([value for name, value in score.items() if name != "unknown"])
    order = [n for n in sorted(score, key=score.get, reverse=True) if n not in ("none", "unknown")]
    causes = [name for name in order if score[name] - total > np.log(1 - SETTINGS.confidence)][:2]
    noisy = evidence.noisy
    return [name for name in causes if name not in noisy or effect_class(name).is_of_pose()]


def _joined(evidence, *names):
    order = [*evidence.table.labels, *(each.label for each in evidence.noise)]
    return "+".join(sorted(names, key=order.index))


def best_member(signatures: Sequence[Signature], evidence: LabelEvidence, name: str) -> Signature:
    """The signature of one label that explains the residuals best; an event's is refined.

    Parameters
    ----------
    signatures : sequence of Signature
    evidence : LabelEvidence
    name : str
    """
    if name in evidence.refined:
        return evidence.refined[name].signature
    return signatures[evidence.table.blocks[evidence.best(name)].member]


def _best_columns(evidence, name):
    """Columns (m, p), scaled, of one label's best member; an event's is refined."""
    if name in evidence.refined:
        return evidence.refined[name].table.columns
    table, member = evidence.table, evidence.table.blocks[evidence.best(name)].member
    blocks = [b for b in table.blocks if b.label == name and b.member == member]
    return table.columns[:, max(blocks, key=lambda block: len(block.columns)).columns]


def _given(rows, signatures, evidence, first):
    """What one label gains by models that suit it, and the scores of others given it.

    These are logs of prior times evidence over that of the one alone.
    """
    observations, table = evidence.observations, evidence.table
    residual, regained = observations.columns(rows.residual[:, None]), 0.0
    nothing, prior = [np.zeros((len(residual), 0))], dict(SETTINGS.prior_beside)
    is_noise = first == PositionNoise.name
    if is_noise:
        models = noisy_pos_models() + models_with_windows(evidence.noise)
        models = relevant_models(observations, models, residual, nothing)
    else:
        observations = observations.with_shared(
            observations.columns(_best_columns(evidence, first))
        )
        models = relevant_models(observations, error_models(), residual, nothing)
        regained = _regained(evidence, first, models, residual)
    blocks = weigh_blocks(observations, models, residual, table)
    scores = block_scores(table, blocks, prior["effect"] / max(1, len(table.labels) - 1), prior)
    if not is_noise:
        channels = draw_channels(rows, None, 0)
        noise = weigh_noise(observations, rows, signatures, blocks, residual, channels)
        scores |= noise_scores(noise, prior)
    return regained, {name: float(values[0]) for name, values in scores.items()}


def _regained(evidence, name, models, residual):
    """By how much the log evidence of a label over none grows with models that suit it."""
    columns, block = _best_columns(evidence, name), evidence.table.blocks[evidence.best(name)]
    table = ColumnTable(columns, (replace(block, columns=np.arange(columns.shape[1])),))
    known = evidence.blocks.models
    blocks = weigh_blocks(
        evidence.observations, tuple(dict.fromkeys(known + models)), residual, table
    )
    after, before = (
        np.logaddexp.reduce(blocks.by_model[part, 0]) - np.logaddexp.reduce(blocks.none[part, 0])
        for part in (slice(None), slice(len(known)))
    )
    return float(block.trust * (after - before))
