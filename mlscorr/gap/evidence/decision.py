"""Conversion of evidence to calibrated probabilities, and to one label.

decision.json contains the results of training on synthetic surveys (benchmarks/train_decision.py):
weights of features of the evidence, which give the probability of each kind of label, and the power
of evidence to separate labels of one kind. No mechanism used for grading was used in training.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

import numpy as np
from scipy.special import betainc

from mlscorr.gap.evidence.labels import KINDS, JointScore, LabelEvidence, kind_of
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Absence

BINS = 5  # of the stated probability: 300 cases of a blind check fill no more
ABSENT = -20.0  # log evidence for an absent item: less than any that matters
BEND = 2.0  # log evidence beyond which it has less weight: odds of seven to one
FARTHEST = 3.0  # standard deviations of a feature: no training data beyond


@dataclass(frozen=True)
class Costs:
    """Costs of wrong answers, in units of an effect mistaken for another one.

    Parameters
    ----------
    false_alarm : float
        Cost of a cause, or unknown, if nothing is wrong.
    miss : float
        Cost of none, or noise, if there is a cause.
    unknown : float
        Cost of unknown if there is a known cause.
    """

    false_alarm: float = 4.0
    miss: float = 1.0
    unknown: float = 0.9


OPERATING_POINTS = {
    "sensitive": Costs(false_alarm=1.0, miss=1.0, unknown=1.0),
    "default": Costs(),
    "careful": Costs(false_alarm=10.0),
}


def features(joint: JointScore) -> dict[str, float]:
    """Features for the probabilities, by name.

    Parameters
    ----------
    joint : JointScore
    """
    base = joint.score["none"]
    by_kind = _by_kind(joint.single, joint.noisy)
    effects = sorted(by_kind["effect"], reverse=True)
    noise = _total(by_kind["noise"]) - base
    unknown = _total(by_kind["unknown"]) - base
    effect, pair, joined = (
        _total(joint.of_kind(kind).values()) - base for kind in ("effect", "pair", "unknown")
    )
    beside = _by_kind(joint.beside, joint.noisy)
    cause = max(effect, pair)
    evidence = {
        "effect": effect,
        "unknown": unknown,
        "noise": noise,
        "pair": pair,
        "unknown beside": max(beside["unknown"], default=ABSENT),
        "noise beside": max(beside["noise"], default=ABSENT),
        "effect beside": max(beside["effect"], default=ABSENT),
        "best to next effect": effects[0] - effects[1] if len(effects) > 1 else -ABSENT,
        "effect to unknown": effect - unknown,
        "effect to noise": effect - noise,
        "noise to unknown": noise - unknown,
        "pair to effect": pair - effect,
        "pair to unknown": pair - joined,
        "unknown to single": joined - unknown,
        "cause to noise": cause - noise,
        "cause to unknown": cause - unknown,
    }
    bent = {n: float(np.arcsinh(v / BEND)) for n, v in (evidence | joint.facts).items()}
    # evidence of an event has less weight, as it may be drift
    bent["effect: event"] = bent["effect"] * joint.facts["event"]
    return bent


def _by_kind(score, noisy):
    """Values by KINDS."""
    kinds: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for name, value in score.items():
        kinds[kind_of(name, noisy)].append(value)
    return kinds


def _total(values: Iterable[float]) -> float:
    values = list(values)
    if values:
        return float(np.logaddexp.reduce(values))
    return ABSENT


@dataclass(frozen=True)
class LearnedDecision:
    """Learned decision parameters.

    Parameters
    ----------
    names : tuple of f str
        Of features.
    mean, scale : (f,) array
        For their standardization.
    weights : (5, f) array
        Weights of each of KINDS; with ``bias`` they give the log probability up to a constant.
    bias : (5,) array
    sharpness : dict
        By kind: factor on the scores of its labels, and the share that all labels have regardless
        of their scores.
    p_value : tuple of (a, b)
        Parameters of the beta distribution of p-values from replicas without effects.
    """

    names: tuple[str, ...]
    mean: np.ndarray
    scale: np.ndarray
    weights: np.ndarray
    bias: np.ndarray
    sharpness: dict[str, tuple[float, float]]
    p_value: tuple[float, float] = (1.0, 1.0)

    @classmethod
    def of(cls, document: dict) -> LearnedDecision:
        """Make the LearnedDecision from a document such as decision.json."""
        mean, scale, weights, bias = (
            np.array(document[key]) for key in ("mean", "scale", "weights", "bias")
        )
        a, b = document["p_value"]
        names = tuple(document["names"])
        sharpness = document["sharpness"]
        return cls(names, mean, scale, weights, bias, sharpness, (a, b))

    def standardised(self, values: Sequence[float]) -> np.ndarray:
        """Standardize features (f,), limited to the range of the training data.

        Parameters
        ----------
        values : (f,) or (n, f) array
        """
        return np.clip((np.asarray(values) - self.mean) / self.scale, -FARTHEST, FARTHEST)

    def by_kind(self, joint: JointScore) -> np.ndarray:
        """Return the probability (5,) of each of KINDS; zero without such a label."""
        values = features(joint)
        score = self.weights @ self.standardised([values[name] for name in self.names]) + self.bias
        score[[not joint.of_kind(kind) for kind in KINDS]] = -np.inf
        return np.exp(score - np.logaddexp.reduce(score))

    def probabilities(self, joint: JointScore) -> dict[str, float]:
        """Return the probability of every label, most probable first.

        Parameters
        ----------
        joint : JointScore
        """
        share: dict[str, float] = {}
        for kind, probability in zip(KINDS, self.by_kind(joint), strict=True):
            labels = joint.of_kind(kind)
            factor, floor = self.sharpness.get(kind, (1.0, 0.0))
            score = factor * np.array(list(labels.values()))
            if len(score):
                parts = np.exp(score - np.logaddexp.reduce(score))
            else:
                parts = score
            parts = (1.0 - floor) * parts + floor / max(len(score), 1)
            share |= dict(zip(labels, probability * parts, strict=True))
        return {name: float(share[name]) for name in sorted(share, key=lambda n: -share[n])}

    def calibrated(self, p_value: float) -> float:
        """Return the probability of such a small p-value from replicas without effects.

        Parameters
        ----------
        p_value : float
        """
        return float(betainc(*self.p_value, np.clip(p_value, 0.0, 1.0)))


@lru_cache(maxsize=1)
def learned() -> LearnedDecision:
    """Return the LearnedDecision of the package."""
    text = (files("mlscorr.gap.evidence") / "decision.json").read_text(encoding="utf-8")
    return LearnedDecision.of(json.loads(text))


def cheapest(probability: dict[str, float], noisy: Collection[str], costs: Costs) -> str:
    """Label with the smallest expected cost.

    Parameters
    ----------
    probability : dict
        Probability of all labels, most probable first.
    noisy : collection of str
        Labels of noise classes.
    costs : Costs
    """
    calm = {n: kind_of(n, noisy) in ("none", "noise") for n in probability}
    none = probability["none"]
    no_cause = sum(p for name, p in probability.items() if calm[name])

    def cost(label):
        right = probability[label]
        if calm[label]:
            return costs.miss * (1 - no_cause) + no_cause - right
        wrong = costs.unknown if label == "unknown" else 1.0
        # if noise is the truth, something is wrong: a cause is a wrong name, not a false alarm
        return costs.false_alarm * none + no_cause - none + wrong * (1 - no_cause - right)

    return min(probability, key=cost)


@dataclass(frozen=True)
class GapVerdict:
    """Verdict of a diagnosis.

    Parameters
    ----------
    label : str
        none, unknown, an effect, or two joined by +.
    probability : float
    set : tuple of str
        Smallest set of labels with 95 % probability.
    p_value : float
        p-value of none, from replicas of this survey, calibrated without effects.
    hint : str
        Hint of unknown, such as "height error that grows with speed squared"; otherwise empty.
    is_hidden : bool
        True if only targets without a residual indicate unknown, and no row does.
    """

    label: str
    probability: float
    set: tuple[str, ...]
    p_value: float
    hint: str
    is_hidden: bool = False


def with_absence(probability: dict[str, float], absence: Absence) -> dict[str, float]:
    """Add targets without a residual to the probabilities, most probable first.

    A run of them is either chance or due to something unknown that no row shows. An effect remains
    a cause in addition to that, but none does not. Regardless of the chance, none is ranked after
    unknown, because what was not observed cannot be confirmed.

    Parameters
    ----------
    probability : dict
        Probability of all labels, from the rows.
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
    """Decide on a verdict from probabilities.

    Parameters
    ----------
    evidence : LabelEvidence
    probability : dict
        Probability of all labels from the rows, most probable first.
    absence : Absence, optional
        Absence of targets without a row.
    costs : Costs, optional
        Costs of wrong answers.
    """
    by_rows = probability
    is_hidden = False
    if absence is not None:
        probability = with_absence(by_rows, absence)
        is_hidden = bool(absence.runs) and by_rows["none"] > by_rows["unknown"]
    cumulative = np.cumsum(list(probability.values()))
    number = int(np.searchsorted(cumulative, SETTINGS.confidence)) + 1
    label = cheapest(probability, evidence.noisy, costs or Costs())
    if is_hidden and label == "none":
        label = "unknown"
    hint = evidence.hint()[0] if label == "unknown" else ""
    is_hidden &= label == "unknown"
    if is_hidden:
        hint = absence.runs[0].hint
    labels = tuple(dict.fromkeys((*tuple(probability)[:number], label)))
    p_value = learned().calibrated(evidence.p_value)
    return GapVerdict(label, probability[label], labels, p_value, hint, is_hidden)


def calibration_error(stated: np.ndarray, hit: np.ndarray) -> float:
    """Mean difference between stated probabilities and hit rates, over bins.

    Parameters
    ----------
    stated : (n,) array
    hit : (n,) array
        One for hits, otherwise zero.
    """
    bins = np.clip((stated * BINS).astype(int), 0, BINS - 1)
    return float(
        sum(abs(np.sum(stated[bins == b] - hit[bins == b])) for b in range(BINS)) / len(stated)
    )
