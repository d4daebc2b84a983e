"""Events between the times and widths of the bank: the best one, refined."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.changes import Bench
from mlscorr.gap.evidence import Table, evidence, table
from mlscorr.gap.signatures import Signature, signature

STEPS = (0.5, 0.25, 0.12)  # of an event's time (in widths) and half of its log width
LONE_STEP = 2.0  # s: of the time of an event without a width
MOST = 3  # settings under which events are compared
WORTH = 3.0  # least gain of a bank's best member that is refined
CELL = 3.0  # refined, an event fills a third of its cell of the bank


@dataclass(frozen=True)
class Refined:
    """The most probable time and width of an event.

    Parameters
    ----------
    signature : Signature
    table : Table
        Of it alone.
    gain : float
        Log evidence over that of none, counted as the bank's are.
    sigma : dict
        Of time and width, by the curvature of the evidence. Units: s.
    """

    signature: Signature
    table: Table
    gain: float
    sigma: dict


def refine(rows, survey, epochs, residual, bank, found, signatures):
    """Refined events by their labels, where the bank has one that stands out.

    Parameters
    ----------
    rows, survey, epochs, signatures
        Of one survey.
    residual : (n, 1) array
        Of the Epochs.
    bank : Table
    found : Evidence
        Of the residual, first column, by the bank.
    """
    refined = {}
    weighed = bank.weighed(found.gain[:, :1])[:, 0]
    for label in bank.labels:
        mine = np.flatnonzero(bank.of(label))
        best = mine[np.argmax(weighed[mine])]
        one = bank.blocks[best]
        if label == "unknown" or "time" not in signatures[one.member].fixed:
            continue
        if found.gain[best, 0] < WORTH:
            continue
        several = [i for i in mine if bank.blocks[i].member == one.member]
        score = found.by_setting[:, several].max(axis=1)
        choice = tuple(found.settings[s] for s in np.argsort(-score)[:MOST])
        share = sum(bank.blocks[i].weight for i in several)
        search = _Search(rows, survey, epochs, residual, choice)
        refined[label] = search.best(signatures[one.member], share)
    return refined


@dataclass(frozen=True)
class _Search:
    rows: object
    survey: object
    epochs: object
    residual: np.ndarray
    settings: tuple

    def score(self, one):
        """Log evidence over none of a signature, and its Table."""
        alone = table(self.rows, (one,), (), self.epochs.sigma)
        told = evidence(self.epochs, self.settings, self.residual, alone)
        return float(np.logaddexp.reduce(alone.weighed(told.gain)[:, 0])), alone

    def changed(self, one, key, step):
        """The signature at another time or width, or None where there is none."""
        fixed = dict(one.fixed)
        if key == "time":
            fixed["time"] = round(fixed["time"] + step * fixed.get("width", LONE_STEP), 3)
        else:
            fixed["width"] = float(fixed["width"] * np.exp(2 * step))
        try:
            new = signature(
                Bench(self.rows, self.survey), one.kind, fixed, np.random.default_rng(0)
            )
        except ValueError:  # a time in no pass, or a width beyond its limits
            return None
        return new if new.jacobian[self.rows.metric].any() else None

    def best(self, one, share):
        gain, alone = self.score(one)
        keys = [key for key in ("time", "width") if key in one.fixed]
        for step in STEPS:
            for key in keys:
                for sign in (-step, step):
                    tried = self.changed(one, key, sign)
                    if tried is None:
                        continue
                    new, its = self.score(tried)
                    if new > gain:
                        one, gain, alone = tried, new, its
        sigma = {key: self._sigma(one, key, gain) for key in keys}
        return Refined(one, alone, gain + np.log(share / CELL), sigma)

    def _sigma(self, one, key, gain):
        """By the fall of the evidence one step to both sides; the step itself where there is
        none."""
        step = STEPS[-1]
        scale = one.fixed.get("width", LONE_STEP) if key == "time" else 2 * one.fixed["width"]
        sides = [self.changed(one, key, sign) for sign in (-step, step)]
        falls = [gain - self.score(tried)[0] for tried in sides if tried is not None]
        fall = np.mean(falls) if falls else 0.0
        return float(step * scale * (1 / np.sqrt(2 * fall) if fall > 0.01 else 1 / step))
