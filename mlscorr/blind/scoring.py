"""How often a diagnosis was right: answers against labels, with intervals and goals."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, bootstrap

from mlscorr.blind.mix import RANDOM
from mlscorr.blind.settings import SETTINGS
from mlscorr.gap.infer.settings import SETTINGS as INFERENCE


@dataclass(frozen=True)
class AnsweredCase:
    """One case: its label and what the diagnosis said, as dicts."""

    name: str
    label: dict
    answer: dict

    @property
    def document(self) -> dict | None:
        """That of gap.json; None of a diagnosis that failed."""
        return self.answer.get("document")

    @property
    def verdict(self) -> dict:
        """The verdict; of a diagnosis that failed a label that is never right."""
        failed = {"label": "failed", "probability": 1.0, "set": [], "p_value": None, "lead": ""}
        return self.document["verdict"] if self.document else failed

    @property
    def named(self) -> str:
        """The label that was named."""
        return self.verdict["label"]

    @property
    def kind(self) -> str:
        """That of the case."""
        return self.label["kind"]

    @property
    def mdb(self) -> float:
        """Size of the smallest cause, in minimal detectable biases."""
        return min(self.label["mdb"], default=0.0)

    @property
    def goal_size(self) -> float:
        """The size to the nearest half, at which goals are set."""
        return round(2 * self.mdb) / 2

    @property
    def is_clear(self) -> bool:
        """Whether its size is three or more."""
        return round(self.mdb, 2) >= 3

    @property
    def truth(self) -> str:
        """The label that is right."""
        mechanism = self.label["mechanism"]
        return mechanism["name"] if mechanism else "+".join(self.label["names"]) or "none"

    @property
    def is_noise(self) -> bool:
        """Whether none, or nothing but noise, was said to be there."""
        return set(self.named.split("+")) <= {"none", *RANDOM}


def score(cases: dict[str, tuple[dict, dict]]) -> dict:
    """Rates, figures and wrong cases of a blind check.

    Parameters
    ----------
    cases : dict of (dict, dict)
        By name: the label of a case, and its answer: {"document": gap.json} or {"error": text}.

    Returns
    -------
    score : dict
        ``rows``, each with name, cases, value, interval[2], goal[2] and reached; ``wrong``, cases
        not named rightly; ``failed``, sentences of diagnoses that gave up.
    """
    answered = [AnsweredCase(name, *case) for name, case in sorted(cases.items())]
    rows = [row for row in (*_rates(answered), *_figures(answered)) if row is not None]
    return {
        "rows": rows,
        "wrong": [_wrong(case) for case in answered if not is_right(case)],
        "failed": {case.name: case.answer["error"] for case in answered if not case.document},
    }


def names(case: AnsweredCase, label: str, by_class: bool = False) -> bool:
    """Whether a label is the truth.

    Parameters
    ----------
    case : AnsweredCase
    label : str
    by_class : bool
        Also what the geometry can't tell from it.
    """
    parts, truth = label.split("+"), case.label["names"] or ["none"]
    if len(parts) != len(truth):
        return False
    if not by_class:
        return sorted(parts) == sorted(truth)
    orders = (parts, parts[::-1])
    return any(all(map(_is_of_class, [case] * len(truth), truth, order)) for order in orders)


def _is_of_class(case, truth, name):
    return name == truth or case.label["likeness"].get(truth, {}).get(name, 0.0) > INFERENCE.same


def is_right(case: AnsweredCase) -> bool:
    """Whether the answer is what an honest diagnosis should say.

    Parameters
    ----------
    case : AnsweredCase
    """
    if case.kind == "outside":
        return case.named == "unknown"
    if case.kind == "withheld":
        stands_in = _resembles(case) > INFERENCE.same
        return case.named == "unknown" or set(case.named.split("+")) <= set(RANDOM) or stands_in
    return names(case, case.named, by_class=True)


def _resembles(case):
    """Largest squared correlation of the truth with what was named."""
    like = next(iter(case.label["likeness"].values()), {})
    return max(like.get(name, 0.0) for name in case.named.split("+"))


def _rates(answered):
    """Rows that are shares of cases."""
    clean, noise, single, pair, withheld, outside = (
        [case for case in answered if case.kind == kind]
        for kind in ("clean", "noise", "single", "pair", "withheld", "outside")
    )
    yield _share("clean: a cause claimed", [not case.is_noise for case in clean], maximum=0.01)
    yield _share("clean: noise claimed", [_only_noise(case) for case in clean])
    yield _share("noise: a cause claimed", [not case.is_noise for case in noise])
    yield _share("noise: named", [names(case, case.named) for case in noise])
    at_2 = [case for case in single if case.goal_size == 2]
    at_3 = [case for case in single if case.is_clear]
    for where, some, minimum in (("2 MDB", at_2, 0.92), ("3 MDB and more", at_3, 0.97)):
        strict, by_class = ([names(case, case.named, c) for case in some] for c in (False, True))
        yield _share(f"right at {where}", strict, minimum)
        yield _share(f"right at {where}, by class", by_class, minimum)
    held = [
        any(names(case, label, by_class=True) for label in case.verdict["set"])
        for case in at_2 + at_3
    ]
    yield _share("the 95 % set holds the truth", held, 0.95)
    noisy = [case.named == "unknown" or _only_noise(case) for case in withheld]
    yield _share("withheld: unknown or noise", noisy, 0.95)
    right = [is_right(case) for case in withheld]
    yield _share("withheld: unknown, noise or of its class", right, 0.95)
    far = [
        not case.is_noise
        and case.named not in ("unknown", "failed")
        and _resembles(case) < SETTINGS.unlikeness
        for case in withheld
    ]
    yield _share("withheld: wrongly named", far, maximum=0.05)
    flagged = [case for case in outside if case.named == "unknown"]
    yield _share("outside: unknown", [case.named == "unknown" for case in outside], 0.95)
    yield _share("outside: lead right where unknown", [_led(case) for case in flagged], 0.90)
    yield _share("both of a pair", [names(case, case.named) for case in pair], 0.93)
    by_class = [names(case, case.named, by_class=True) for case in pair]
    yield _share("both of a pair, by class", by_class, 0.93)
    inside = [hit for case in single if case.goal_size >= 2 for hit in _inside(case)]
    yield _share("95 % intervals hold the parameter", inside, 0.93, 0.97)


def _only_noise(case):
    """Whether noise and nothing else was named."""
    return case.is_noise and case.named != "none"


def _figures(answered):
    """Rows that are no shares: of them the interval is a bootstrap's."""
    single = [case for case in answered if case.kind == "single"]
    clear = [case for case in single if case.is_clear]
    sizes = [len(case.verdict["set"]) for case in single if case.goal_size >= 2]
    yield _figure("size of the 95 % set", sizes, np.mean, maximum=1.5)
    closed = [_closed(case) for case in clear]
    yield _figure("gap closed at 3 MDB and more, median", closed, np.median, 0.99)
    yield _figure(
        "gap closed at 3 MDB and more, p10", closed, lambda values: np.quantile(values, 0.1), 0.95
    )
    impostors = [_closed(case) for case in answered if case.kind == "withheld"]
    yield _figure("withheld: gap closed by the best known effect, median", impostors, np.median)
    at_3 = [case for case in clear if case.goal_size == 3 and names(case, case.named)]
    error = [e for e in map(_error, at_3) if e is not None]
    yield _figure("error of the parameters at 3 MDB, median", error, np.median, maximum=0.08)
    stated = [case for case in answered if case.document]
    probability = [case.verdict["probability"] for case in stated]
    right = [is_right(case) for case in stated]
    name = "calibration error of the probability"
    yield _figure(name, list(zip(probability, right, strict=True)), calibration_error, maximum=0.04)


def calibration_error(stated: Iterable[tuple[float, bool]]) -> float:
    """Mean distance of stated probabilities from how often they were right, over five bins.

    Parameters
    ----------
    stated : iterable of (probability, whether right)
    """
    probability, right = np.array(list(stated), dtype=float).T
    number = np.clip((probability * SETTINGS.bins).astype(int), 0, SETTINGS.bins - 1)
    return sum(
        abs(probability[number == b].mean() - right[number == b].mean()) * (number == b).mean()
        for b in np.unique(number)
    )


def _share(name, hits, minimum=None, maximum=None):
    """Row of a share; its interval is that of Wilson 1927, J. Am. Stat. Assoc. 22."""
    if not hits:
        return None
    interval = binomtest(sum(map(bool, hits)), len(hits)).proportion_ci(
        INFERENCE.confidence, method="wilson"
    )
    return _row(name, len(hits), float(np.mean(hits)), interval, minimum, maximum)


def _figure(
    name: str, values: Sequence, statistic: Callable, minimum: float | None = None, maximum=None
):
    if not values:
        return None
    values = np.array(values, dtype=float)
    value, number = float(statistic(values)), np.arange(len(values))
    interval = (value, value)
    if len(values) > 1:
        drawn = bootstrap(
            (number,),
            lambda index: statistic(values[index]),
            confidence_level=INFERENCE.confidence,
            n_resamples=1000,
            method="percentile",
            vectorized=False,
            random_state=np.random.default_rng(0),
        )
        interval = drawn.confidence_interval
    return _row(name, len(values), value, interval, minimum, maximum)


def _row(name, cases, value, interval, minimum, maximum):
    reached = None
    if minimum is not None or maximum is not None:
        reached = (minimum is None or value >= minimum) and (maximum is None or value <= maximum)
    return {
        "name": name, "cases": cases, "value": value, "interval": [float(v) for v in interval],
        "goal": [minimum, maximum], "reached": reached,
    }  # fmt: skip


def _led(case):
    """Whether the lead has one of the words of each entry."""
    lead = case.verdict["lead"]
    return all(any(w in lead for w in e.split("|")) for e in case.label["mechanism"]["lead"])


def _closed(case):
    """Share of the gap that closed on held-out data; nothing where nothing was found."""
    shrink = case.document["closure"]["shrink"] if case.document else None
    return 0.0 if shrink is None else shrink


def _estimates(case):
    """Estimated parameters of the named cause by name, or None where the truth wasn't named."""
    if case.document is None or not names(case, case.named):
        return None
    cause = next((c for c in case.document["causes"] if c["effect"] == case.named), None)
    return None if cause is None else {p["name"]: p for p in cause["parameters"]}


def _inside(case):
    """For each parameter, whether its 95 % interval holds the truth."""
    estimates, true = _estimates(case), case.label["parameters"]
    if estimates is None:
        return []
    pairs = [(estimates[n], v) for n, v in true[case.named].items() if n in estimates]
    return [
        abs(p["estimate"] - v) <= INFERENCE.quantile * p["sigma"]
        for p, v in pairs
        if p["sigma"] is not None
    ]


def _error(case):
    """Error of the magnitudes over their size, in the metric of what the rows show."""
    estimates, true = _estimates(case), case.label["parameters"][case.named]
    true = {name: value for name, value in true.items() if name not in ("time", "width")}
    if estimates is None or not set(true) <= set(estimates):
        return None
    normal, values = np.array(case.label["normal"][case.named]), np.array(list(true.values()))
    off = np.array([estimates[name]["estimate"] for name in true]) - values
    return float(np.sqrt((off @ normal @ off) / (values @ normal @ values)))


def _wrong(case):
    """A case to learn from."""
    return {
        "case": case.name, "kind": case.kind, "truth": case.truth, "mdb": case.mdb,
        "said": case.named, "probability": case.verdict["probability"], "set": case.verdict["set"],
        "lead": case.verdict["lead"], "without": case.label["without"],
        "resembles": _resembles(case) if case.label["likeness"] else None,
    }  # fmt: skip
