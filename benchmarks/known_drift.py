"""Limit of correct names of effects: the rate with the true covariance of all errors.

    OMP_NUM_THREADS=1 python benchmarks/known_drift.py [--seed 20000] [--worlds 40] [--cases 24]

Synthetic surveys of features whose errors are drawn from the stated sigmas of POS, survey and
extraction, which no real POS guarantees. The raw posterior of nothing, 18 effects and unknown,
without a trained decision, is computed twice: with the true covariance, and with the family of
covariances that a diagnosis averages over, as it doesn't know the true one. MDB is the minimal
detectable bias by the known one. Noise and pairs are neither drawn nor tried.
"""

import argparse
from dataclasses import replace

import numpy as np
from gap_training.features import geometry

from mlscorr.effects import effect_class
from mlscorr.effects.catalogue import SYSTEMATIC
from mlscorr.gap.evidence import (
    SETTINGS,
    Costs,
    Observations,
    column_table,
    error_models,
    unknown_blocks,
)
from mlscorr.gap.evidence._events import refine_events
from mlscorr.gap.evidence.decision import cheapest
from mlscorr.gap.evidence.evidence import suited_models, weigh_blocks, without_known
from mlscorr.gap.evidence.labels import block_scores
from mlscorr.gap.evidence.observations import STATED
from mlscorr.gap.plan import Ruler
from mlscorr.gap.plan.draws import draw_effect
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import signatures

CLEAN = 0.3  # share of cases in which nothing acts
SIZES = (1.0, 8.0)  # MDB, between which sizes are drawn evenly by their logs, as in training


class Bed:
    """A geometry with all hypotheses about it."""

    def __init__(self, seed):
        rng = np.random.default_rng([seed, 0])
        targets = int(rng.integers(14, 45))
        passes = int(rng.integers(1, 3))
        patches = int(np.exp(rng.uniform(*np.log((60, 600)))))
        made = geometry(seed, targets, patches, passes, duration=float(rng.uniform(45.0, 80.0)))
        self.rows = made.rows
        self.survey = made.survey
        self.observations = Observations.of(made.rows, background(made.rows, made.survey))
        self.signatures, _ = signatures(made.rows, made.survey)
        unknown = unknown_blocks(self.rows, self.survey)
        table = column_table(self.rows, self.signatures, unknown, self.observations.sigma)
        self.table = without_known(self.observations, table)
        known = self.observations.whitener(STATED)
        self.ruler = Ruler(self.rows, self.survey, self.observations, known)

    def case(self, rng):
        """Rows with drawn errors, the effect that acts on them, and its size in MDB."""
        drawn = self.observations.whitener(STATED).draw(rng, 1)[:, 0]
        sized = None
        residual = np.zeros(len(self.rows))
        residual[self.observations.row] = drawn
        if rng.random() > CLEAN:
            size = float(np.exp(rng.uniform(*np.log(SIZES))))
            kind = effect_class(str(rng.choice(SYSTEMATIC)))
            sized = draw_effect(self.ruler, kind, size, rng)
        if sized is None:
            return replace(self.rows, residual=residual), "none", 0.0
        return replace(self.rows, residual=residual + sized.shift), sized.effect.name, sized.mdb

    def label(self, rows, is_known):
        """Cheapest label by the posterior, for rows with a possible effect."""
        observations = self.observations
        prior = dict(SETTINGS.prior)
        residual = observations.columns(rows.residual[:, None])
        models = (STATED,)
        if not is_known:
            models = suited_models(observations, self.table, error_models(), residual)
        blocks = weigh_blocks(observations, models, residual, self.table)
        share = prior["effect"] / len(self.table.effects)
        scores = block_scores(self.table, blocks, share, prior)
        events = refine_events(rows, self.survey, observations, self.table, blocks, self.signatures)
        score = {name: values[0] for name, values in scores.items()}
        score |= {
            name: np.logaddexp(score[name], np.log(share) + event.gain)
            for name, event in events.items()
        }
        score["none"] = np.log(prior["none"])
        total = np.logaddexp.reduce(list(score.values()))
        order = sorted(score, key=lambda name: -score[name])
        return cheapest({name: float(np.exp(score[name] - total)) for name in order}, (), Costs())


def figures(results):
    """Shares of correct labels in results (truth, mdb, labels by both)."""

    def rate(good, some):
        hits = [
            [good(truth, label) for label in labels]
            for truth, mdb, labels in results
            if some(truth, mdb)
        ]
        return (*(np.mean(hits, axis=0) if hits else (np.nan, np.nan)), len(hits))

    def right(truth, label):
        return truth == label

    def is_event(name):
        return name != "none" and bool(effect_class(name).moment())

    return {
        "clean: a cause claimed": rate(lambda _, n: n != "none", lambda t, _: t == "none"),
        "right at 1.6 to 2.5 MDB": rate(right, lambda _, mdb: 1.6 <= mdb < 2.5),
        "right at 3 MDB and more": rate(right, lambda _, mdb: mdb >= 3.0),
        "of these, events": rate(right, lambda t, mdb: mdb >= 3.0 and is_event(t)),
        "of these, all others": rate(right, lambda t, mdb: mdb >= 3.0 and not is_event(t)),
    }


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=20000)
    parser.add_argument("--worlds", type=int, default=40)
    parser.add_argument("--cases", type=int, default=24)
    given = parser.parse_args()
    results = []
    for seed in range(given.seed, given.seed + given.worlds):
        bed = Bed(seed)
        for number in range(given.cases):
            rows, truth, mdb = bed.case(np.random.default_rng([seed, 1, number]))
            results.append((truth, mdb, [bed.label(rows, is_known) for is_known in (True, False)]))
    print("| | cases | covariance known | averaged over |\n|---|---|---|---|")
    for name, (known, averaged, count) in figures(results).items():
        print(f"| {name} | {count} | {100 * known:.0f} % | {100 * averaged:.0f} % |")


if __name__ == "__main__":
    main()
