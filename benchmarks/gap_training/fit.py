"""Training of a decision on records, and its rate of correct labels on unseen worlds."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from gap_training.records import Record
from mlscorr.gap.evidence import Costs, calibration_error
from mlscorr.gap.evidence.decision import BINS, LearnedDecision, cheapest, features
from mlscorr.gap.evidence.labels import KINDS, kind_of

PENALTIES = (0.01, 0.03, 0.1, 0.3, 1.0)  # inverse ones of squared weights, chosen out of fold
SHARPNESS = np.linspace(0.2, 1.5, 27)  # factors on scores within a kind that are tried
SHARES = (0.002, 0.01, 0.03, 0.06, 0.1, 0.2)  # shares of what no evidence tells that are tried
FOLDS = 8  # of worlds


def fit(records: Sequence[Record]) -> LearnedDecision:
    """Fit the LearnedDecision of highest likelihood to records.

    Parameters
    ----------
    records : sequence of Record
    """
    x, names, y = _table(records)
    decision = _fitted(records, x, y, names, _best_penalty(records))
    return replace(decision, p_value=_of_p_values(records))


def out_of_fold(records: Sequence[Record]) -> list[dict[str, float]]:
    """Probabilities of each record by a LearnedDecision that was not trained on its world.

    Parameters
    ----------
    records : sequence of Record
    """
    return _out_of_fold(records, _best_penalty(records))


def _best_penalty(records):
    """Penalty under which truths are most probable out of fold."""
    return max(PENALTIES, key=lambda penalty: np.mean(_scores(records, penalty)))


def _table(records):
    """Features (n, f), their names, and the number of each truth's kind (n,)."""
    values = [features(r.joint) for r in records]
    names = tuple(values[0])
    y = np.array([KINDS.index(kind_of(r.truth, r.joint.noisy)) for r in records])
    return np.array([[v[name] for name in names] for v in values]), names, y


def _fitted(records, x, y, names, penalty):
    """LearnedDecision of some records."""
    from sklearn.linear_model import LogisticRegression

    kinds = len(KINDS)
    sharpness = _sharpness(records)
    empty = np.zeros((kinds, x.shape[1])), np.zeros(kinds)
    plain = LearnedDecision(
        names, x.mean(axis=0), np.maximum(x.std(axis=0), 1e-6), *empty, sharpness
    )
    model = LogisticRegression(C=penalty, max_iter=5000).fit(plain.standardised(x), y)
    weights = empty[0]
    bias = np.full(kinds, -1e3)
    weights[model.classes_] = model.coef_
    bias[model.classes_] = model.intercept_
    return replace(plain, weights=weights, bias=bias)


def _sharpness(records):
    """By kind, the factor on scores and the floor of each label that best fit the true labels."""
    best = {}
    for kind in ("noise", "effect", "pair"):
        of_kind = []
        for r in records:
            scores = r.joint.of_kind(kind)
            true = [v for name, v in scores.items() if r.is_right(name)]
            if true:
                of_kind.append((true[0], np.array(list(scores.values()))))
        if of_kind:
            best[kind] = max(product(SHARPNESS, SHARES), key=lambda pair: _fit_of(of_kind, *pair))
    return {kind: (float(factor), float(floor)) for kind, (factor, floor) in best.items()}


def _fit_of(of_kind, factor, floor):
    """Log probability of true labels among their kind."""
    shares = [np.exp(factor * true - np.logaddexp.reduce(factor * s)) for true, s in of_kind]
    number = np.array([len(scores) for _, scores in of_kind])
    return float(np.log((1 - floor) * np.array(shares) + floor / number).sum())


def _out_of_fold(records, penalty):
    x, names, y = _table(records)
    fold = np.unique(np.array([r.world for r in records]), return_inverse=True)[1] % FOLDS
    probabilities: list = [None] * len(records)
    for number in np.unique(fold):
        train = np.flatnonzero(fold != number)
        known = [records[i] for i in train]
        decision = _fitted(known, x[train], y[train], names, penalty)
        for i in np.flatnonzero(fold == number):
            probabilities[i] = decision.probabilities(records[i].joint)
    return probabilities


def _scores(records, penalty):
    """Log probability of each truth, out of fold."""
    return [
        np.log(max(max((p for n, p in each.items() if r.is_right(n)), default=0.0), 1e-4))
        for r, each in zip(records, _out_of_fold(records, penalty), strict=True)
    ]


def _of_p_values(records):
    """Parameters of the beta distribution of p-values of clean records, by their moments."""
    p = np.array([r.p_value for r in records if r.kind == "clean" and r.p_value is not None])
    if len(p) < 2 * BINS:
        return 1.0, 1.0
    count = (mean := p.mean()) * (1 - mean) / p.var() - 1
    return float(mean * count), float((1 - mean) * count)


def figures(
    records: Sequence[Record], probabilities: Sequence[dict[str, float]], costs: Costs
) -> dict[str, tuple[float, int]]:
    """Rates, each with its number of cases, and the calibration error.

    Parameters
    ----------
    records : sequence of Record
    probabilities : sequence of dict
        Of each record.
    costs : Costs
    """
    labels = [
        cheapest(p, r.joint.noisy, costs) for r, p in zip(records, probabilities, strict=True)
    ]
    pairs = list(zip(records, labels, strict=True))

    def rate(kind: str, low: float, high: float, good: Callable, some: Callable = bool):
        hits = [good(r, n) for r, n in pairs if r.kind == kind and low <= r.mdb < high and some(r)]
        return (float(np.mean(hits)) if hits else float("nan"), len(hits))

    def claimed(r, label):
        return kind_of(label, r.joint.noisy) not in ("none", "noise")

    def right(r, label):
        return r.is_right(label)

    def unnamed(r, label):
        return kind_of(label, r.joint.noisy) in ("unknown", "noise")

    everything = (0.0, np.inf)
    rates = {
        "clean, open sky: a cause claimed": rate(
            "clean", *everything, claimed, lambda r: r.is_open
        ),
        "clean, bad sky: a cause claimed": rate(
            "clean", *everything, claimed, lambda r: not r.is_open
        ),
        "clean: noise named": rate(
            "clean", *everything, lambda r, n: n != "none" and not claimed(r, n)
        ),
        "one effect right at 1.6 to 2.5 MDB": rate("single", 1.6, 2.5, right),
        "one effect right at 3 MDB and more": rate("single", 3.0, np.inf, right),
        "both of a pair at 3 MDB and more": rate("pair", 3.0, np.inf, right),
        "noise named at 3 MDB and more": rate("noise", 3.0, np.inf, right),
        "withheld effect at 3 MDB and more: unknown": rate("withheld", 3.0, np.inf, right),
        "withheld at 3 MDB and more: unknown or noise": rate("withheld", 3.0, np.inf, unnamed),
        "mechanism at 3 MDB and more: unknown": rate("outside", 3.0, np.inf, right),
    }
    stated = np.array([p[label] for p, label in zip(probabilities, labels, strict=True)])
    hit = np.array([right(r, label) for r, label in pairs], dtype=float)
    rates["calibration error"] = (calibration_error(stated, hit), len(records))
    return rates


def document(decision: LearnedDecision, made_of: dict) -> dict:
    """A LearnedDecision and its provenance, in the layout of decision.json.

    Parameters
    ----------
    decision : LearnedDecision
    made_of : dict
        Seeds, cases, hashes.
    """
    content = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in vars(decision).items()
    }
    rounded = {
        name: np.round(content[name], 6).tolist() for name in ("mean", "scale", "weights", "bias")
    }
    return {"made_of": made_of} | content | rounded


def hash_of(texts: Iterable[str]) -> str:
    """SHA-256 of concatenated texts.

    Parameters
    ----------
    texts : iterable of str
    """
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()
