"""Weighing of all labels: none, each effect, noise and unknown, and pairs of causes.

Labels are weighed in a survey and in replicas of it; pairs follow, given the best single causes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.effects import PositionNoise, effect_class
from mlscorr.gap.evidence._events import RefinedEvent, refine_events
from mlscorr.gap.evidence._noise import NoiseEvidence, draw_channels, noisy_pos_models, weigh_noise
from mlscorr.gap.evidence._windows import models_with_windows, weigh_windows
from mlscorr.gap.evidence.evidence import (
    BlockEvidence,
    ColumnTable,
    column_table,
    steady_columns,
    suited_models,
    weigh_blocks,
    without_known,
)
from mlscorr.gap.evidence.observations import (
    ErrorModel,
    Observations,
    error_models,
    model_likelihood,
    shares,
)
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.evidence.tails import without_tails
from mlscorr.gap.evidence.unknown import unknown_blocks
from mlscorr.gap.residuals import Background, Rows
from mlscorr.gap.signatures import Signature
from mlscorr.survey import Survey

KINDS = ("none", "noise", "effect", "pair", "unknown")


@dataclass(frozen=True)
class LabelEvidence:
    """Compared evidence, and the likelihood of each label.

    Parameters
    ----------
    observations : Observations
    table : ColumnTable
    hints : tuple of str
        Hint of each unknown block, in words.
    blocks : BlockEvidence
        Evidence of the residuals (first column) and of replicas without any effect.
    noise : tuple of NoiseEvidence
    refined : dict of RefinedEvent
        Significant events by label: their own, or that of the pair in which they are significant.
    score : dict
        Log of prior times evidence over that of none, (k,) for each label; none is there too.
    p_value : float
        p-value of none.
    tail : (o,) int array
        Rows treated as a tail of the noise.
    """

    observations: Observations
    table: ColumnTable
    hints: tuple[str, ...]
    blocks: BlockEvidence
    noise: tuple[NoiseEvidence, ...]
    refined: dict[str, RefinedEvent]
    score: dict[str, np.ndarray]
    p_value: float
    tail: np.ndarray

    @property
    def noisy(self) -> set[str]:
        """Labels of noise classes."""
        return {each.label for each in self.noise}

    def best(self, label: str) -> int:
        """Return the index of a label's block that explains the residuals best."""
        return self.table.best(label, self.blocks.gain[:, 0])

    def event(self, name: str, label: str) -> RefinedEvent | None:
        """Return the event that is, or is part of, a label; None if it is not significant."""
        known = (self.refined.get(key) for key in (label, name))
        return next((each for each in known if each and each.signature.name == name), None)

    def hint(self) -> tuple[str, np.ndarray]:
        """Return the hint of the best unknown block, in words, and its column indices."""
        block = self.table.blocks[self.best("unknown")]
        return self.hints[block.member], block.columns

    def likely_model(self, label: str) -> ErrorModel:
        """Return the most probable ErrorModel when a label, or the first of two, acts."""
        name = label.split("+", maxsplit=1)[0]
        score = self.blocks.none[:, 0]
        if name in self.table.labels:
            score = self.blocks.by_model[:, self.table.of(name)].max(axis=1)
        return self.blocks.models[int(np.argmax(score))]


# Hundreds of products of small matrices: threads of BLAS would wait for each other longer than they
# work.
@threadpool_limits.wrap(limits=1, user_api="blas")
def weigh_labels(
    rows: Rows,
    background: Background,
    survey: Survey,
    signatures: Sequence[Signature],
    rng: np.random.Generator,
    replicas: int = SETTINGS.replicas,
) -> LabelEvidence:
    """Weigh the evidence of all labels for the residuals of a survey and for replicas of it.

    Parameters
    ----------
    rows : Rows
    background : Background
    survey : Survey
    signatures : sequence of Signature
    rng : numpy.random.Generator
    replicas : int
        Number of surveys of the same geometry without effects.

    Raises
    ------
    ValueError
        If no row has a residual in m, or a sigma is zero.
    """
    observations = Observations.of(rows, background)
    unknown = unknown_blocks(rows, survey)
    table = column_table(rows, signatures, unknown, observations.sigma)
    hints = tuple(block.hint for block in unknown)
    del unknown  # their columns are in the table
    table = without_known(observations, table)
    observations, tail = without_tails(observations, rows, steady_columns(observations, table))
    residual = observations.columns(rows.residual[:, None])
    models = suited_models(observations, table, error_models(), residual)
    residual = np.hstack([residual, _replicas(observations, models, residual, rng, replicas)])
    blocks = weigh_blocks(observations, models, residual, table)
    channels = draw_channels(rows, rng, replicas)
    noise = weigh_noise(observations, rows, signatures, blocks, residual, channels)
    noise += weigh_windows(observations, signatures, blocks, residual, residual[:, :0])
    score = _scores(table, blocks, noise)
    p = p_value(score)  # before events are refined, as in the replicas
    refined = refine_events(rows, survey, observations, table, blocks, signatures)
    for label, event in refined.items():
        prior = np.log(dict(SETTINGS.prior)["effect"] / len(table.effects))
        score[label][0] = np.logaddexp(score[label][0], prior + event.gain)
    return LabelEvidence(observations, table, hints, blocks, noise, refined, score, p, tail)


def _replicas(observations, models, residual, rng, number):
    """Residuals (n, number) without effects, under models drawn by probability, with the tails
    of these residuals.
    """
    score = np.array([model_likelihood(observations, model, residual)[0] for model in models])
    count = rng.multinomial(number, shares(score))
    best = observations.whitener(models[int(np.argmax(score))])
    tails = best.innovations(residual)[0][:, 0]
    replicas = [
        observations.whitener(model).draw(rng, times, tails)
        for model, times in zip(models, count, strict=True)
    ]
    return np.hstack(replicas)


def _scores(table, blocks, noise):
    """Log of prior times evidence, over the evidence of none, for each label: (k,) each."""
    prior = dict(SETTINGS.prior)
    scores = {"none": np.full(blocks.none.shape[1], np.log(prior["none"]))}
    scores |= block_scores(table, blocks, prior["effect"] / max(1, len(table.effects)), prior)
    return scores | _noise_scores(noise, prior)


def block_scores(
    table: ColumnTable, blocks: BlockEvidence, effect: float, prior: dict[str, float]
) -> dict[str, np.ndarray]:
    """Log of prior times evidence, over that of none, of each label of a table: (k,) each.

    Parameters
    ----------
    table : ColumnTable
    blocks : BlockEvidence
    effect : float
        Prior probability of each effect.
    prior : dict
        Contains the prior of unknown.
    """
    weighed = table.weighed(blocks.gain)
    return {
        label: np.log(prior["unknown"] if label == "unknown" else effect)
        + np.logaddexp.reduce(weighed[table.of(label)], axis=0)
        for label in table.labels
    }


def _noise_scores(noise: Sequence[NoiseEvidence], prior: dict[str, float]) -> dict[str, np.ndarray]:
    """Scores of noise classes, which share their prior evenly; several of one class are averaged.

    Parameters
    ----------
    noise : sequence of NoiseEvidence
    prior : dict
        Contains the prior of noise.
    """
    labels = list(dict.fromkeys(each.label for each in noise))
    scores = {}
    for label in labels:
        gain = [each.gain for each in noise if each.label == label]
        mean = np.logaddexp.reduce(gain, axis=0) - np.log(len(gain))
        scores[label] = np.log(prior["noise"] / len(labels)) + mean
    return scores


def p_value(score: dict[str, np.ndarray]) -> float:
    """Probability of scores against none as high as the first column's, without effects.

    From replicas; beyond the highest ones from an exponential tail through their upper fifth.

    Parameters
    ----------
    score : dict of (1 + k,) arrays
        By label, none among them.
    """
    against = [values for label, values in score.items() if label != "none"]
    against = np.logaddexp.reduce(against, axis=0)
    observed = against[0]
    replicas = np.sort(against[1:])
    if len(replicas) == 0:
        return float("nan")
    upper = replicas[int(0.8 * len(replicas)) :]
    if observed <= upper[0] or len(upper) < 3:
        return float((1 + (replicas >= observed).sum()) / (1 + len(replicas)))
    scale = max(upper.mean() - upper[0], 0.5)
    return float(len(upper) / len(replicas) * np.exp(-(observed - upper[0]) / scale))


def kind_of(label: str, noisy: Collection[str]) -> str:
    """Kind of a label, one of KINDS: the number of its effects, ignoring noise.

    Parameters
    ----------
    label : str
    noisy : collection of str
        Labels of noise classes.
    """
    if label in ("none", "unknown"):
        return label
    effects = [part for part in label.split("+") if part not in noisy]
    return ("noise", "effect", "pair")[len(effects)]


@dataclass(frozen=True)
class JointScore:
    """Log of prior times evidence over none, for all labels and given the best effect.

    Parameters
    ----------
    score : dict
        By label, including none and pairs.
    single : dict
        By label, before pairs were tried.
    beside : dict
        By label: gain of each in addition to the best single effect; empty without an effect.
    facts : dict
        Properties of the survey that matter for the weight of evidence, by name.
    noisy : set of str
        Labels of noise classes.
    """

    score: dict[str, float]
    single: dict[str, float]
    beside: dict[str, float]
    facts: dict[str, float]
    noisy: Collection[str]

    def of_kind(self, kind: str) -> dict[str, float]:
        """Return scores of the labels of one of KINDS."""
        return {n: v for n, v in self.score.items() if kind_of(n, self.noisy) == kind}


@threadpool_limits.wrap(limits=1, user_api="blas")
def joint_score(
    rows: Rows, survey: Survey, signatures: Sequence[Signature], evidence: LabelEvidence
) -> tuple[JointScore, LabelEvidence]:
    """Compute scores of all labels, including pairs, and the evidence with further refined events.

    Each of the best causes is accepted with a free size; then noise classes, effects and unknown
    are compared again on the remaining residuals. If only unknown explains these, the label is
    unknown, because the cause then mimics another one.

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
    """Effect with the largest score, or None without any."""
    return max(evidence.table.effects, key=lambda name: evidence.score[name][0], default=None)


def _accepted(evidence, score, best):
    """Best effect, and the one or two best causes that are probable enough to be tried in pairs."""
    # unknown is excluded from the sum: its blocks can contain a pair of effects
    total = np.logaddexp.reduce([value for name, value in score.items() if name != "unknown"])
    order = [n for n in sorted(score, key=score.get, reverse=True) if n not in ("none", "unknown")]
    causes = [name for name in order if score[name] - total > np.log(1 - SETTINGS.confidence)][:2]
    noisy = evidence.noisy
    causes = [name for name in causes if name not in noisy or effect_class(name).is_of_pose()]
    if best is None or best in causes:
        return causes
    return [best, *causes]


def _facts(rows, evidence, best):
    """Properties of the survey that matter for the weight of evidence."""
    observations = evidence.observations
    increased = observations.errors.increased >= 0
    is_event = best is not None and bool(effect_class(best).moment())
    moved = np.zeros(len(increased))
    if is_event:
        moved = (_best_columns(evidence, best)[observations.row] ** 2).sum(axis=1)
    return {
        "rough": float((rows.channel == "roughness").any()),
        "raised": float(increased.mean()),
        "event": float(is_event),
        "event in raised": float(moved[increased].sum() / max(moved.sum(), 1e-300)),
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
    """Signature of an effect that explains the residuals best; that of an event is refined.

    Parameters
    ----------
    signatures : sequence of Signature
    evidence : LabelEvidence
    name : str
        Name of the effect.
    label : str
        Label with the effect.
    """
    event = evidence.event(name, label)
    best = evidence.table.blocks[evidence.best(name)]
    if event is None:
        return signatures[best.member]
    return event.signature


def _best_columns(evidence, name):
    """Scaled columns (m, p) of a label's best member; those of an event are refined."""
    if name in evidence.refined:
        return evidence.refined[name].table.columns
    table = evidence.table
    member = evidence.table.blocks[evidence.best(name)].member
    blocks = [b for b in table.blocks if b.label == name and b.member == member]
    return table.columns[:, max(blocks, key=lambda block: len(block.columns)).columns]


def _given(rows, survey, signatures, evidence, first):
    """Gain of one label, scores of the others given it, and further significant events.

    Scores are logs of prior times evidence over that of the single label.
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
        scores |= _noise_scores(noise, prior)
    return regained, {name: float(values[0]) for name, values in scores.items()}, events


def _regained(evidence, name, models, residual):
    """Increase of the log evidence of a label over none with suitable models."""
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
