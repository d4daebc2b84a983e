"""How often a diagnosis was right: answers against labels, with intervals and goals."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.mix import RANDOM
from mlscorr.gap.separability import SAME

Z = 1.96  # of 95 %
BINS = 5  # of the stated probability
DRAWS = 1000  # of the bootstrap
FAR = 0.5  # squared correlation below which another effect is wrongly named
NEAR_2, NEAR_3, CLEAR = (1.75, 2.25), (2.75, 3.25), 2.999  # MDB


@dataclass(frozen=True)
class Answered:
    """One case: its label and what the diagnosis said, as dicts."""

    name: str
    label: dict
    answer: dict

    @property
    def document(self):
        return self.answer.get("document")

    @property
    def verdict(self):
        """The verdict; of a diagnosis that failed a label that is never right."""
        failed = {"label": "failed", "probability": 1.0, "set": [], "p_value": None, "lead": ""}
        return self.document["verdict"] if self.document else failed

    @property
    def said(self):
        return self.verdict["label"]

    @property
    def kind(self):
        return self.label["kind"]

    @property
    def mdb(self):
        return min(self.label["mdb"], default=0.0)

    @property
    def truth(self):
        mechanism = self.label["mechanism"]
        return mechanism["name"] if mechanism else "+".join(self.label["names"]) or "none"

    @property
    def is_noise(self):
        """Whether none, or nothing but noise, was said to be there."""
        return set(self.said.split("+")) <= {"none", *RANDOM}


def score(cases):
    """Rates, figures and wrong cases of a blind check.

    Parameters
    ----------
    cases : dict of (dict, dict)
        By name: the label of a case, and its answer: {"document": gap.json} or {"error": text}.

    Returns a dict: ``rows``, each with name, cases, value, interval[2], goal[2] and reached;
    ``wrong``, cases not named rightly; ``failed``, sentences of diagnoses that gave up.
    """
    several = [Answered(name, *case) for name, case in sorted(cases.items())]
    rows = [row for row in (*_rates(several), *_figures(several)) if row is not None]
    return {
        "rows": rows,
        "wrong": [_wrong(one) for one in several if not is_right(one)],
        "failed": {one.name: one.answer["error"] for one in several if one.document is None},
    }


def wilson(hits, number):
    """95 % interval of a share (Wilson 1927, J. Am. Stat. Assoc. 22).

    >>> [round(limit, 3) for limit in wilson(0, 60)]
    [0.0, 0.06]
    """
    share = hits / number
    middle = share + Z**2 / (2 * number)
    half = Z * np.sqrt(share * (1 - share) / number + Z**2 / (4 * number**2))
    low, high = (middle + sign * half for sign in (-1, 1))
    grown = 1 + Z**2 / number
    return max(0.0, float(low / grown)), min(1.0, float(high / grown))


def names(one, label, by_class=False):
    """Whether a label is the truth; by class also what the geometry can't tell from it."""
    said, truth = label.split("+"), one.label["names"] or ["none"]
    if len(said) != len(truth):
        return False
    if not by_class:
        return sorted(said) == sorted(truth)
    orders = (said, said[::-1])
    return any(all(map(_alike, [one] * len(truth), truth, order)) for order in orders)


def _alike(one, truth, said):
    return said == truth or one.label["likeness"].get(truth, {}).get(said, 0.0) > SAME


def is_right(one):
    """Whether the answer is what an honest diagnosis should say."""
    if one.kind == "outside":
        return one.said == "unknown"
    if one.kind == "withheld":
        stands_in = _resembles(one, one.said) > SAME
        return one.said == "unknown" or set(one.said.split("+")) <= set(RANDOM) or stands_in
    return names(one, one.said, by_class=True)


def _resembles(one, said):
    """Largest squared correlation of the truth with what was named."""
    like = next(iter(one.label["likeness"].values()), {})
    return max(like.get(name, 0.0) for name in said.split("+"))


def _rates(several):
    """Rows that are shares of cases."""
    clean, noise, single, pair, withheld, outside = (
        [one for one in several if one.kind == kind]
        for kind in ("clean", "noise", "single", "pair", "withheld", "outside")
    )
    yield _share("clean: a cause claimed", [not one.is_noise for one in clean], most=0.01)
    yield _share("clean: noise claimed", [one.is_noise and one.said != "none" for one in clean])
    yield _share("noise: a cause claimed", [not one.is_noise for one in noise])
    yield _share("noise: named", [names(one, one.said) for one in noise])
    at_2 = [one for one in single if NEAR_2[0] <= one.mdb <= NEAR_2[1]]
    at_3 = [one for one in single if one.mdb >= CLEAR]
    for where, some, least in (("2 MDB", at_2, 0.92), ("3 MDB and more", at_3, 0.97)):
        strict, alike = ([names(one, one.said, c) for one in some] for c in (False, True))
        yield _share(f"right at {where}", strict, least)
        yield _share(f"right at {where}, by class", alike, least)
    held = [
        any(names(one, label, by_class=True) for label in one.verdict["set"]) for one in at_2 + at_3
    ]
    yield _share("the 95 % set holds the truth", held, 0.95)
    noisy = [one.said == "unknown" or (one.is_noise and one.said != "none") for one in withheld]
    yield _share("withheld: unknown or noise", noisy, 0.95)
    right = [is_right(one) for one in withheld]
    yield _share("withheld: unknown, noise or of its class", right, 0.95)
    named = [not one.is_noise and one.said not in ("unknown", "failed") for one in withheld]
    far = [n and _resembles(o, o.said) < FAR for n, o in zip(named, withheld, strict=True)]
    yield _share("withheld: wrongly named", far, most=0.05)
    flagged = [one for one in outside if one.said == "unknown"]
    yield _share("outside: unknown", [one in flagged for one in outside], 0.95)
    yield _share("outside: lead right where unknown", [_led(one) for one in flagged], 0.90)
    yield _share("both of a pair", [names(one, one.said) for one in pair], 0.93)
    alike = [names(one, one.said, by_class=True) for one in pair]
    yield _share("both of a pair, by class", alike, 0.93)
    inside = [hit for one in single if one.mdb >= NEAR_2[0] for hit in _inside(one)]
    yield _share("95 % intervals hold the parameter", inside, 0.93, 0.97)


def _figures(several):
    """Rows that are no shares: of them the interval is a bootstrap's."""
    single = [one for one in several if one.kind == "single"]
    clear = [one for one in single if one.mdb >= CLEAR]
    seen = [one for one in single if one.mdb >= NEAR_2[0]]
    size = [len(one.verdict["set"]) for one in seen]
    yield _figure("size of the 95 % set", size, np.mean, most=1.5)
    closed = [_closed(one) for one in clear]
    yield _figure("gap closed at 3 MDB and more, median", closed, np.median, 0.99)
    yield _figure("gap closed at 3 MDB and more, p10", closed, _tenth, 0.95)
    impostors = [_closed(one) for one in several if one.kind == "withheld"]
    yield _figure("withheld: gap closed by the best known effect, median", impostors, np.median)
    at_3 = [one for one in clear if one.mdb <= NEAR_3[1] and names(one, one.said)]
    error = [e for e in map(_error, at_3) if e is not None]
    yield _figure("error of the parameters at 3 MDB, median", error, np.median, most=0.08)
    stated = [(one.verdict["probability"], is_right(one)) for one in several if one.document]
    yield _figure("calibration error of the probability", stated, calibration_error, most=0.04)


def calibration_error(stated):
    """Mean distance of stated probabilities from how often they were right, over five bins.

    stated is a list of (probability, whether right).
    """
    probability, right = np.array(stated, dtype=float).T
    number = np.clip((probability * BINS).astype(int), 0, BINS - 1)
    return sum(
        abs(probability[number == b].mean() - right[number == b].mean()) * (number == b).mean()
        for b in np.unique(number)
    )


def _tenth(values):
    return np.quantile(values, 0.1)


def _share(name, hits, least=None, most=None):
    if not hits:
        return None
    value = float(np.mean(hits))
    return _row(name, len(hits), value, wilson(sum(map(bool, hits)), len(hits)), least, most)


def _figure(name, values, statistic, least=None, most=None):
    if not values:
        return None
    values, rng = np.array(values, dtype=float), np.random.default_rng(0)
    drawn = [statistic(values[rng.integers(len(values), size=len(values))]) for _ in range(DRAWS)]
    interval = tuple(float(limit) for limit in np.quantile(drawn, [0.025, 0.975]))
    return _row(name, len(values), float(statistic(values)), interval, least, most)


def _row(name, cases, value, interval, least, most):
    reached = None
    if least is not None or most is not None:
        reached = (least is None or value >= least) and (most is None or value <= most)
    return {
        "name": name, "cases": cases, "value": value, "interval": list(interval),
        "goal": [least, most], "reached": reached,
    }  # fmt: skip


def _led(one):
    """Whether the lead has one of the words of each entry."""
    lead = one.verdict["lead"]
    return all(any(w in lead for w in e.split("|")) for e in one.label["mechanism"]["lead"])


def _closed(one):
    """Share of the gap that closed on held-out data; nothing where nothing was found."""
    shrink = one.document["closure"]["shrink"] if one.document else None
    return 0.0 if shrink is None else shrink


def _estimates(one):
    """Estimated parameters of the named cause by name, or None where the truth wasn't named."""
    if one.document is None or not names(one, one.said):
        return None
    cause = next((c for c in one.document["causes"] if c["effect"] == one.said), None)
    return None if cause is None else {p["name"]: p for p in cause["parameters"]}


def _inside(one):
    """For each parameter, whether its 95 % interval holds the truth."""
    estimates, true = _estimates(one), one.label["parameters"]
    if estimates is None:
        return []
    told = [(estimates[n], v) for n, v in true[one.said].items() if n in estimates]
    return [abs(p["estimate"] - v) <= Z * p["sigma"] for p, v in told if p["sigma"] is not None]


def _error(one):
    """Error of the magnitudes over their size, in the metric of what the rows show."""
    estimates = _estimates(one)
    normal, true = np.array(one.label["normal"][one.said]), one.label["parameters"][one.said]
    true = {name: value for name, value in true.items() if name not in ("time", "width")}
    if estimates is None or not set(true) <= set(estimates):
        return None
    values = np.array(list(true.values()))
    off = np.array([estimates[name]["estimate"] for name in true]) - values
    return float(np.sqrt((off @ normal @ off) / (values @ normal @ values)))


def _wrong(one):
    """A case to learn from."""
    return {
        "case": one.name, "kind": one.kind, "truth": one.truth, "mdb": one.mdb, "said": one.said,
        "probability": one.verdict["probability"], "set": one.verdict["set"],
        "lead": one.verdict["lead"], "without": one.label["without"],
        "resembles": _resembles(one, one.said) if one.label["likeness"] else None,
    }  # fmt: skip
