"""Score of a diagnosis: answers compared with labels, with intervals and goals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, bootstrap, kstest

from mlscorr.blind._mix import causes
from mlscorr.blind._settings import SETTINGS
from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.gap.evidence import calibration_error


@dataclass(frozen=True)
class AnsweredCase:
    """One case: its label and the answer of the diagnosis.

    Parameters
    ----------
    name : str
    label : dict
        From make_case.
    answer : dict
        {"document": gap.json} or {"error": text}.
    """

    name: str
    label: dict
    answer: dict

    @property
    def document(self) -> dict | None:
        """Document of gap.json; None for a failed diagnosis."""
        return self.answer.get("document")

    @property
    def verdict(self) -> dict:
        """Verdict; for a failed diagnosis a label that is never right."""
        failed = {"label": "failed", "probability": 1.0, "set": [], "p_value": None, "lead": ""}
        if self.document:
            return self.document["verdict"]
        return failed

    @property
    def named(self) -> str:
        """Named label."""
        return self.verdict["label"]

    @property
    def kind(self) -> str:
        """Kind of the case."""
        return self.label["kind"]

    @property
    def mdb(self) -> float:
        """Size of the smallest cause, in minimal detectable biases."""
        return min(self.label["mdb"], default=0.0)

    @property
    def goal_size(self) -> float:
        """Size rounded to the nearest half, for which goals are set."""
        return round(2 * self.mdb) / 2

    @property
    def is_clear(self) -> bool:
        """True if its size is three or more."""
        return round(self.mdb, 2) >= 3

    @property
    def truth(self) -> str:
        """Correct label."""
        mechanism = self.label["mechanism"]
        if mechanism:
            return mechanism["name"]
        return "+".join(self.label["names"]) or "none"

    @property
    def is_noise(self) -> bool:
        """True if the answer is none, or nothing but noise."""
        return set(self.named.split("+")) <= {"none", *causes(is_random=True)}

    @property
    def is_only_noise(self) -> bool:
        """True if only noise was named."""
        return self.is_noise and self.named != "none"

    @property
    def resemblance(self) -> float:
        """Largest squared correlation of the truth with the named cause."""
        like = next(iter(self.label["likeness"].values()), {})
        return max(like.get(name, 0.0) for name in self.named.split("+"))

    @property
    def is_right(self) -> bool:
        """True if the answer is correct for an honest diagnosis."""
        if self.kind == "outside":
            return self.named == "unknown"
        if self.kind == "withheld":
            is_random = set(self.named.split("+")) <= set(causes(is_random=True))
            return self.named == "unknown" or is_random or self.resemblance > INFERENCE.same
        return self.names(self.named, by_class=True)

    @property
    def is_hint_right(self) -> bool:
        """True if the hint has one of the words of each entry."""
        hint = self.verdict["lead"]
        entries = self.label["mechanism"]["lead"]
        return all(any(word in hint for word in entry.split("|")) for entry in entries)

    def names(self, label: str, by_class: bool = False) -> bool:
        """Return True if a label is the truth.

        Parameters
        ----------
        label : str
        by_class : bool
            True to accept labels that the geometry cannot separate from it.
        """
        parts = label.split("+")
        truth = self.label["names"] or ["none"]
        if len(parts) != len(truth):
            return False
        if not by_class:
            return sorted(parts) == sorted(truth)
        return any(all(map(self._is_of_class, truth, order)) for order in (parts, parts[::-1]))

    def _is_of_class(self, truth, name):
        likeness = self.label["likeness"].get(truth, {})
        return name == truth or likeness.get(name, 0.0) > INFERENCE.same


def score(cases: dict[str, tuple[dict, dict]]) -> dict:
    """Compute rates, figures and wrong cases of a blind check.

    Parameters
    ----------
    cases : dict of (dict, dict)
        By name: the label of a case, and its answer: {"document": gap.json} or {"error": text}.

    Returns
    -------
    score : dict
        ``rows``, each with name, cases, value, interval[2], goal[2] and reached; ``wrong``, cases
        with a wrong name; ``failed``, messages of failed diagnoses.
    """
    answered = [AnsweredCase(name, *case) for name, case in sorted(cases.items())]
    rows = [row for row in (*_rates(answered), *_figures(answered)) if row is not None]
    return {
        "rows": rows,
        "wrong": [_wrong(case) for case in answered if not case.is_right],
        "failed": {case.name: case.answer["error"] for case in answered if not case.document},
    }


def _rates(answered):
    """Rows that are shares of cases."""
    clean, noise, single, pair, withheld, outside = (
        [case for case in answered if case.kind == kind]
        for kind in ("clean", "noise", "single", "pair", "withheld", "outside")
    )
    yield from _alarms(clean)
    yield _share("noise: a cause claimed", [not case.is_noise for case in noise])
    yield _share("noise: named", [case.names(case.named) for case in noise], 0.85)
    at_2 = [case for case in single if case.goal_size == 2]
    at_3 = [case for case in single if case.is_clear]
    for where, some, goal, wider in (
        ("2 MDB", at_2, 0.85, 0.88),
        ("3 MDB and more", at_3, 0.95, 0.97),
    ):
        strict, by_class = ([case.names(case.named, c) for case in some] for c in (False, True))
        yield _share(f"right at {where}", strict, goal)
        yield _share(f"right at {where}, by class", by_class, wider)
    covered = [
        any(case.names(label, by_class=True) for label in case.verdict["set"])
        for case in at_2 + at_3
    ]
    yield _share("the 95 % set holds the truth", covered, 0.95)
    noisy = [case.named == "unknown" or case.is_only_noise for case in withheld]
    yield _share("withheld: unknown or noise", noisy, 0.85)
    right = [case.is_right for case in withheld]
    yield _share("withheld: unknown, noise or of its class", right, 0.92)
    far = [
        not case.is_noise
        and case.named not in ("unknown", "failed")
        and case.resemblance < SETTINGS.unlikeness
        for case in withheld
    ]
    yield _share("withheld: wrongly named", far, maximum=0.04)
    flagged = [case for case in outside if case.named == "unknown"]
    yield _share("outside: unknown", [case.named == "unknown" for case in outside], 0.80)
    yield _share(
        "outside: lead right where unknown", [case.is_hint_right for case in flagged], 0.75
    )
    yield _share("both of a pair", [case.names(case.named) for case in pair], 0.90)
    by_class = [case.names(case.named, by_class=True) for case in pair]
    yield _share("both of a pair, by class", by_class, 0.90)
    inside = [hit for case in single if case.goal_size >= 2 for hit in _inside(case)]
    yield _share("95 % intervals hold the parameter", inside, 0.93, 0.97)


def _alarms(clean):
    """Rows of surveys without effects."""
    yield _share("clean: a cause claimed", [not case.is_noise for case in clean], maximum=0.02)
    for sky in ("open", "bad"):
        alarms = [not case.is_noise for case in clean if case.label.get("sky") == sky]
        yield _share(f"clean, {sky} sky: a cause claimed", alarms, maximum=0.02)
    yield _share("clean: noise claimed", [case.is_only_noise for case in clean])


def _figures(answered):
    """Rows of figures that are not shares, with bootstrap intervals."""
    single = [case for case in answered if case.kind == "single"]
    clear = [case for case in single if case.is_clear]
    sizes = [len(case.verdict["set"]) for case in single if case.goal_size >= 2]
    yield _figure("size of the 95 % set", sizes, np.mean, maximum=1.5)
    closed = [share for share in map(_closed, clear) if share is not None]
    yield _figure("gap closed at 3 MDB and more, median", closed, np.median, 0.98)
    yield _figure(
        "gap closed at 3 MDB and more, p10", closed, lambda values: np.quantile(values, 0.1), 0.85
    )
    at_3 = [case for case in clear if case.goal_size == 3 and case.names(case.named)]
    error = [e for e in map(_error, at_3) if e is not None]
    yield _figure("error of the parameters at 3 MDB, median", error, np.median, maximum=0.08)
    pairs = [(case.verdict["probability"], case.is_right) for case in answered if case.document]
    name = "calibration error of the probability"
    yield _figure(name, pairs, lambda values: calibration_error(*values.T), maximum=0.04)
    stated = [c.verdict["p_value"] for c in answered if c.kind == "clean" and c.document]
    yield _figure("clean: p-values even (KS)", stated, lambda p: kstest(p, "uniform").pvalue, 0.01)


def _share(name, hits, minimum=None, maximum=None):
    """Row of a share; its interval is that of Wilson 1927, J. Am. Stat. Assoc. 22."""
    if not hits:
        return None
    interval = binomtest(sum(map(bool, hits)), len(hits)).proportion_ci(
        INFERENCE.confidence, method="wilson"
    )
    return _row(name, len(hits), float(np.mean(hits)), interval, minimum, maximum)


def _figure(name, values, statistic, minimum=None, maximum=None):
    """Row of a figure that is not a share, with a bootstrap interval."""
    if not values:
        return None
    values = np.array(values, dtype=float)
    value = float(statistic(values))
    number = np.arange(len(values))
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
        "name": name,
        "cases": cases,
        "value": value,
        "interval": [float(v) for v in interval],
        "goal": [minimum, maximum],
        "reached": reached,
    }


def _closed(case):
    """Share of the gap closed on held-out data, zero without a cause; None if the gap before
    was within chance.
    """
    if case.document:
        return case.document["closure"]["shrink"]
    return 0.0


def _estimates(case):
    """Estimated parameters of the named cause by name, or None if the truth was not named."""
    if case.document is None or not case.names(case.named):
        return None
    cause = next((c for c in case.document["causes"] if c["effect"] == case.named), None)
    if cause is None:
        return None
    return {p["name"]: p for p in cause["parameters"]}


def _inside(case):
    """Flag for each parameter if its 95 % interval contains the truth."""
    estimates = _estimates(case)
    true = case.label["parameters"]
    if estimates is None:
        return []
    return [
        abs(estimates[n]["estimate"] - v) <= INFERENCE.quantile * estimates[n]["sigma"]
        for n, v in true[case.named].items()
        if n in estimates and estimates[n]["sigma"] is not None
    ]


def _error(case):
    """Error of the magnitudes over their size, in the metric of the rows."""
    estimates = _estimates(case)
    true = case.label["parameters"][case.named]
    true = {name: value for name, value in true.items() if name not in ("time", "width")}
    if estimates is None or not set(true) <= set(estimates):
        return None
    normal = np.array(case.label["normal"][case.named])
    values = np.array(list(true.values()))
    off = np.array([estimates[name]["estimate"] for name in true]) - values
    return float(np.sqrt((off @ normal @ off) / (values @ normal @ values)))


def _wrong(case):
    """Wrong case, for analysis."""
    return {
        "case": case.name,
        "kind": case.kind,
        "truth": case.truth,
        "mdb": case.mdb,
        "said": case.named,
        "probability": case.verdict["probability"],
        "set": case.verdict["set"],
        "lead": case.verdict["lead"],
        "without": case.label["without"],
        "resembles": case.resemblance if case.label["likeness"] else None,
    }
