"""The verdict: none, a noise class, an effect, two of them, or unknown; with what probability."""

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.background import Epochs, epochs, settings
from mlscorr.gap.bursts import burst_evidence, with_bursts
from mlscorr.gap.events import refine
from mlscorr.gap.evidence import Evidence, Table, evidence, novel, table
from mlscorr.gap.noise import draw_channels, noise_evidence, position_settings
from mlscorr.gap.replicas import p_value, replicate
from mlscorr.gap.tails import without_tails
from mlscorr.gap.unknown import unknown_blocks
from mlscorr.gap.weighing import FREE, nuisance, relevant

# Prior probabilities; shares of a kind are split evenly among its labels. A wrong alarm costs more
# than a small effect that is missed, and drift has shapes that no Setting has: hence the first one.
# Chosen on seeds of their own: python benchmarks/gap_study.py --seed 5000, 6000 and 7000
NONE, NOISE, EFFECT, UNKNOWN = 0.92, 0.03, 0.04, 0.01
PAIR, NOISE_TOO, UNKNOWN_TOO = 0.05, 0.03, 0.03  # given one cause
REPLICAS = 100
TRIED = 0.05  # probability from which on a cause is tried together with another
FIRSTS = 2  # causes that are, at most
SET = 0.95


@dataclass(frozen=True)
class Found:
    """What was compared, and how likely each label made it.

    Parameters
    ----------
    epochs : Epochs
    table : Table
    unknown : tuple of UnknownBlock
    evidence : Evidence
        Of the residuals (first column) and of replicas without any effect.
    noise : tuple of NoiseEvidence
    refined : dict of Refined
        Events that stand out, by label.
    score : dict
        Log of prior times evidence over that of none, (k,) for each label; none is there too.
    p_value : float
        Of none.
    odd : (o,) int array
        Rows taken for a tail of the noise.
    """

    epochs: Epochs
    table: Table
    unknown: tuple
    evidence: Evidence
    noise: tuple
    refined: dict
    score: dict
    p_value: float
    odd: np.ndarray


@dataclass(frozen=True)
class Verdict:
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
    """

    label: str
    probability: float
    set: tuple[str, ...]
    p_value: float
    lead: str


# Hundreds of products of small matrices: threads of BLAS wait for each other longer than they work.
@threadpool_limits.wrap(limits=1, user_api="blas")
def compare(rows, background, survey, signatures, rng, replicas=REPLICAS):
    """Evidence of all labels for the residuals of a survey and for replicas of it: Found.

    Parameters
    ----------
    rows : Rows
    background : Background
    survey : Survey
    signatures : tuple of Signature
    rng : numpy.random.Generator
    replicas : int
        Surveys of the same geometry in which nothing acts.
    """
    observed, unknown = epochs(rows, background), unknown_blocks(rows, survey)
    columns = novel(observed, table(rows, signatures, unknown, observed.sigma))
    constant, slow = nuisance(observed, columns)
    observed, odd = without_tails(observed, rows, FREE * constant)
    residual = observed.columns(rows.residual[:, None])
    none = constant[:, :0]
    choice = relevant(observed, settings(), residual, [none, np.hstack([constant, slow])])
    residual = np.hstack([residual, replicate(observed, choice, residual, rng, replicas)])
    found = evidence(observed, choice, residual, columns)
    channels = draw_channels(rows, rng, replicas)
    noise = noise_evidence(observed, rows, signatures, found, residual, channels)
    if any(one.is_common for one in signatures):
        noise += burst_evidence(observed, found, residual)
    score = scores(columns, found, noise)
    chance = p_value(score)  # before events are refined, as those of replicas are not
    events = refine(rows, survey, observed, residual[:, :1], columns, found, signatures)
    for label, event in events.items():
        prior = np.log(EFFECT / (len(columns.labels) - bool(unknown)))
        score[label][0] = np.logaddexp(score[label][0], prior + event.gain)
    return Found(observed, columns, unknown, found, noise, events, score, chance, odd)


def scores(columns, found, noise):
    """Log of prior times evidence, over the evidence of none, for each label: (k,) each."""
    weighed = columns.weighed(found.gain)
    told = {"none": np.full(found.none.shape[1], np.log(NONE))}
    effects = [name for name in columns.labels if name != "unknown"]
    for name in columns.labels:
        prior = UNKNOWN if name == "unknown" else EFFECT / len(effects)
        told[name] = np.log(prior) + np.logaddexp.reduce(weighed[columns.of(name)], axis=0)
    return told | _noise_scores(noise, NOISE)


def _noise_scores(noise, prior):
    """Scores of noise classes; several of one label are averaged."""
    names, told = list(dict.fromkeys(one.label for one in noise)), {}
    for name in names:
        gain = [one.gain for one in noise if one.label == name]
        mean = np.logaddexp.reduce(gain, axis=0) - np.log(len(gain))
        told[name] = np.log(prior / len(names)) + mean
    return told


@threadpool_limits.wrap(limits=1, user_api="blas")
def pairs(rows, signatures, found):
    """Probabilities of all labels: those compared, and the best causes together with another.

    Each of the best causes is taken as accepted, its size as free; then noise classes, effects and
    unknown are compared again on what it leaves. What only unknown explains there is unknown: a
    cause that leaves it impersonates another.
    """
    score = {name: float(value[0]) for name, value in found.score.items()}
    # unknown is left out of the sum: its blocks can hold two effects that are a pair
    total = np.logaddexp.reduce([value for name, value in score.items() if name != "unknown"])
    order = sorted(score, key=score.get, reverse=True)
    firsts = [n for n in order if n not in ("none", "unknown")]
    firsts = [n for n in firsts if score[n] - total > np.log(TRIED)][:FIRSTS]
    noisy = {one.label for one in found.noise}
    for first in firsts:
        if first in noisy and first != "position_noise":
            continue
        regained, told = _given(rows, signatures, found, first)
        base = score[first] = score[first] + regained
        for name, gain in told.items():
            if name == first:
                continue
            label = "unknown" if name == "unknown" else _joined(found, first, name)
            score[label] = np.logaddexp(score.get(label, -np.inf), base + gain)
    values = np.array(list(score.values()))
    share = np.exp(values - np.logaddexp.reduce(values))
    order = np.argsort(-share, kind="stable")
    names = list(score)
    return {names[i]: float(share[i]) for i in order}


def _joined(found, *names):
    order = [*found.table.labels, *(one.label for one in found.noise)]
    return "+".join(sorted(names, key=order.index))


def accepted(found, name):
    """Columns (m, p), scaled, of one label's best member; an event's is refined."""
    if name in found.refined:
        return found.refined[name].table.columns
    best = found.table.blocks[_best(found, name)].member
    mine = np.flatnonzero(found.table.of(name))
    several = [b for b in (found.table.blocks[i] for i in mine) if b.member == best]
    return found.table.columns[:, max(several, key=lambda block: len(block.columns)).columns]


def member(found, signatures, name):
    """The signature of one label that explains the residuals best; an event's is refined."""
    if name in found.refined:
        return found.refined[name].signature
    return signatures[found.table.blocks[_best(found, name)].member]


def _best(found, label):
    """Number of the block of a label that explains the residuals best."""
    mine = np.flatnonzero(found.table.of(label))
    weighed = found.table.weighed(found.evidence.gain[:, :1])[mine, 0]
    return int(mine[np.argmax(weighed)])


def _given(rows, signatures, found, first):
    """What one label gains by Settings that suit it, and the scores of others given it.

    These are logs of prior times evidence over that of the one alone.
    """
    residual = found.epochs.columns(rows.residual[:, None])
    if first == "position_noise":
        observed, regained = found.epochs, 0.0
        choice = position_settings() + with_bursts(found.noise)
        choice = relevant(observed, choice, residual, [np.zeros((len(residual), 0))])
    else:
        columns = found.epochs.columns(accepted(found, first))
        observed = found.epochs.with_shared(FREE * columns)
        choice = relevant(observed, settings(), residual, [np.zeros((len(residual), 0))])
        regained = _regained(found, first, choice, residual)
    again = evidence(observed, choice, residual, found.table)
    weighed, told = found.table.weighed(again.gain)[:, 0], {}
    for name in found.table.labels:
        prior = UNKNOWN_TOO if name == "unknown" else PAIR / max(1, len(found.table.labels) - 1)
        told[name] = np.log(prior) + np.logaddexp.reduce(weighed[found.table.of(name)])
    if first != "position_noise":
        channels = draw_channels(rows, None, 0)
        noise = noise_evidence(observed, rows, signatures, again, residual, channels)
        told |= {k: float(v[0]) for k, v in _noise_scores(noise, NOISE_TOO).items()}
    return regained, told


def _regained(found, name, choice, residual):
    """By how much the log evidence of a label over none grows with Settings that suit it."""
    columns, trust = accepted(found, name), found.table.blocks[_best(found, name)].trust
    block = replace(found.table.blocks[_best(found, name)], columns=np.arange(columns.shape[1]))
    alone = Table(columns, np.ones(columns.shape[1]), (block,))
    several = tuple(dict.fromkeys(found.evidence.settings + choice))
    told = evidence(found.epochs, several, residual, alone)
    old = slice(len(found.evidence.settings))
    after, before = (
        np.logaddexp.reduce(told.by_setting[some, 0]) - np.logaddexp.reduce(told.none[some, 0])
        for some in (slice(None), old)
    )
    return float(trust * (after - before))


def verdict(found, probability):
    """Verdict from probabilities of labels, most probable first."""
    names, set_, held = list(probability), [], 0.0
    for name in names:
        set_.append(name)
        held += probability[name]
        if held >= SET:
            break
    label = names[0]
    lead = best_lead(found)[0] if label == "unknown" else ""
    return Verdict(label, probability[label], tuple(set_), found.p_value, lead)


def best_lead(found):
    """What the best of the unknown blocks says in words, and its column numbers."""
    best = found.table.blocks[_best(found, "unknown")]
    return found.unknown[best.member].lead, best.columns
