"""True closure of the gap by a found cause, compared with the stated closure.

    OMP_NUM_THREADS=1 python benchmarks/closure_study.py [--cases 36] [--seed 8000]

Synthetic surveys of features: two opposite passes, 40 targets, of which 6 are check points, and 200
patches, with one effect of 3 to 8 minimal detectable biases. The truth is free of noise: the share
of the squared shift of all rows by the effect that a prediction removes, in the metric of the
simulated drift. It is compared with the stated share.
"""

import argparse
from dataclasses import replace

import numpy as np
from feature_errors import errors
from gap_mechanisms import STUDIED, sized
from gap_study import Bed

from mlscorr.gap.closure import FoundCause, cause_for_simulator, close_gap
from mlscorr.gap.closure.folds import make_folds, predict_whole
from mlscorr.gap.evidence import Observations, infer_causes
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import expected, select

SIZES = (3.0, 5.0, 8.0)  # MDB
CHECKED = 6  # targets that are check points


def case(bed, rng, kind, name, m):
    """One survey: label, and stated and true shares of the effect's square that are removed."""
    g = bed.g
    shift, _, _ = sized(g, bed.signs, name, m, rng, bed.size)
    rows = replace(g.rows, residual=errors(g, rng, kind) + shift)
    used = ~np.isin(rows.survey_item, np.arange(CHECKED))
    part = rows.select(used)
    signs = select(bed.signs, rows, used)
    inference = infer_causes(part, background(part, g.survey), g.survey, signs, rng, 0)
    label = inference.verdict.label
    cause = cause_for_simulator(part, signs, inference)

    def simulated(effects):
        return expected(rows, g.survey, effects).shift

    evidence = inference.evidence
    found = FoundCause(rows, used, g.survey, bed.signs, evidence, cause)
    closure = close_gap(found, simulated, rng)
    observed = Observations.of(rows, background(rows, g.survey))
    whole = predict_whole(found, simulated)
    model = evidence.likely_model(cause.effect)
    folds = make_folds(found, whole, observed, model, simulated, rng)
    truth = [_gone(bed, shift, p.shift) for p in (folds.whole, *folds.predicted)]
    return {
        "name": name,
        "m": m,
        "label": label,
        "effect": closure.effect,
        "stated": closure.shrink,
        "interval": closure.interval,
        "whole": truth[0],
        "held": float(np.mean(truth[1:])),
        "before": closure.before,
        "after": closure.after,
    }


def _gone(bed, shift, predicted):
    """Share of the square of a shift (m,) that a prediction removes."""
    return 1.0 - (bed.size(shift - predicted) / bed.size(shift)) ** 2


def run(cases, seed, beds=4):
    """Results of all cases, each effect and size in turn."""
    ground = [Bed.of(seed + i) for i in range(beds)]
    results = []
    for count in range(cases):
        name = STUDIED[count % len(STUDIED)]
        m = SIZES[count // len(STUDIED) % len(SIZES)]
        rng = np.random.default_rng([seed, count])
        kind = ("sines", "walk")[count // beds % 2]
        try:
            results.append(case(ground[count % beds], rng, kind, name, m))
        except ValueError as error:  # larger than any survey can have
            print(name, m, error)
    return results


def report(results):
    """Lines of true and stated closure, over all cases and over correctly named ones."""
    for words, part in (
        ("all", results),
        ("named rightly", [r for r in results if r["name"] in r["label"].split("+")]),
    ):
        print(f"{words}: {len(part)} cases of {SIZES[0]:g} MDB and more")
        for key, title in (
            ("whole", "truly closed by the size found in all blocks"),
            ("held", "truly closed by sizes found without the judging blocks"),
            ("stated", "stated"),
        ):
            value = np.array([r[key] for r in part])
            print(
                f"  {title}: median {np.median(value):.3f}, 10th percentile "
                f"{np.percentile(value, 10):.3f}, range {value.min():.2f} to "
                f"{value.max():.2f}"
            )
        off = np.array([r["stated"] - r["held"] for r in part])
        held = np.mean([r["interval"][0] <= r["held"] <= r["interval"][1] + 1e-9 for r in part])
        print(
            f"  stated less true: median {np.median(off):+.3f}, 90 % within "
            f"{np.percentile(np.abs(off), 90):.3f}; 95 % intervals that hold the true share "
            f"{held:.0%}; after below zero {sum(r['after'] < 0 for r in part)}"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=36)
    parser.add_argument("--seed", type=int, default=8000)
    parser.add_argument("--list", action="store_true", help="each case, too")
    given = parser.parse_args()
    results = run(given.cases, given.seed)
    if given.list:
        for r in results:
            numbers = " ".join(f"{r[k]:7.3f}" for k in ("whole", "held", "stated"))
            low, high = r["interval"]
            print(
                f"{r['name']:20s}{r['m']:2g} {r['label']:34s}{numbers}  {low:.3f} {high:.3f} "
                f"{r['before']:6.1f} {r['after']:6.1f}"
            )
    report(results)


if __name__ == "__main__":
    main()
