"""Accuracy of the diagnosis over many synthetic surveys at feature level.

    OMP_NUM_THREADS=1 python benchmarks/gap_study.py [--cases 24] [--seed 1000]

Two opposite passes, 40 targets and 200 patches seen by a line scanner, with effects at finite size,
noise, or mechanisms of no library (gap_mechanisms.py). MDB is the minimal detectable bias of each
effect there.
"""

import argparse
import pickle
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from feature_errors import errors
from gap_mechanisms import ACTUAL, NOISES, STUDIED, Outside, metric, noisy, sized
from gap_training.features import Geometry, geometry

from mlscorr.gap.evidence import Observations, cause_of, compare_signatures, weigh_labels
from mlscorr.gap.evidence.decision import decide, learned
from mlscorr.gap.evidence.labels import joint_score
from mlscorr.gap.signatures import signatures


@dataclass(frozen=True)
class Bed:
    """A geometry with its signatures."""

    g: Geometry
    signs: tuple
    size: object
    separable: object

    @classmethod
    def of(cls, seed):
        g = geometry(seed, shared=bool(seed % 2))
        signs, _ = signatures(g.rows, g.survey)
        observed = Observations.of(g.rows, g.background)
        return cls(g, signs, metric(g), compare_signatures(observed, signs, ACTUAL))


def _rho(bed, told, label):
    """Squared correlation of the truth with the named effect; zero for unknown."""
    compared = bed.separable
    if len(told) != 1 or label not in compared.effects:
        return 0.0
    name, (way, _) = next(iter(told.items()))
    if name in compared.effects:
        return compared.share(name, way, label)
    return 0.0


def _off(bed, rows, signs, evidence, told, name, m):
    """Error of a named cause: share of its signal, and of each parameter in sigmas."""
    cause = cause_of(rows, signs, evidence, name, 1.0)
    way, fixed = told
    part, estimate = cause.parts[0]
    if "target" in fixed and part.fixed != fixed:
        return None
    same = part.fixed == fixed
    if same:
        difference = part.jacobian @ (estimate - way)
    else:
        difference = cause.shift - part.jacobian @ way
    z = [(p.estimate - t) / p.sigma for p, t in zip(cause.parameters, way, strict=False)]
    return bed.size(difference) / m, z


def case(bed, rng, kind, effects=(), m=3.0, withheld=None, outside=None, noise=None, replicas=0):
    """Diagnose one survey, and return a dict of truth and answers."""
    g = bed.g
    rows = bed.g.rows
    residual = errors(g, rng, kind)
    told = {}
    for name in effects:
        shift, way, fixed = sized(g, bed.signs, name, m, rng, bed.size)
        residual += shift
        told[name] = (way, fixed)
    if outside:
        shift = Outside(g).shift(outside, rng)
        residual += shift * m / bed.size(shift)
    if noise:
        shift, variance = noisy(g, noise, rng)
        residual += shift
        rows = replace(rows, noise=rows.noise + variance)
    rows = replace(rows, residual=residual)
    signs = tuple(s for s in bed.signs if s.name != withheld)
    evidence = weigh_labels(rows, g.background, g.survey, signs, rng, replicas)
    joint, evidence = joint_score(rows, g.survey, signs, evidence)
    probability = learned().probabilities(joint)
    answer = decide(evidence, probability)
    truth = "+".join(effects) or outside or noise or "none"
    off = None
    if len(effects) == 1 and answer.label == truth:
        off = _off(bed, rows, signs, evidence, told[truth], truth, m)
    return {
        "truth": truth,
        "m": m,
        "kind": kind,
        "withheld": withheld,
        "told": told,
        "label": answer.label,
        "probability": probability,
        "set": answer.set,
        "p": answer.p_value,
        "lead": evidence.hint()[0],
        "score": {k: float(v[0]) for k, v in evidence.score.items()},
        "off": off,
        "rho": _rho(bed, told, answer.label),
        "same": {
            n: bed.separable.same(n, w if n in bed.separable.effects else None)
            for n, (w, _) in told.items()
        },
    }


def jobs(cases, rng):
    """Studied cases: keyword arguments of `case`, in cells."""
    cells = {"clean": [{"replicas": 50}] * (3 * cases)}
    cells["noise"] = [{"noise": n} for n in NOISES for _ in range(max(1, cases // 8))]
    for m in (2.0, 3.0, 5.0):
        cells[f"single {m:g} MDB"] = [{"effects": (n,), "m": m} for n in _cycle(rng, 2 * cases)]
    cells["withheld 4 MDB"] = [
        {"effects": (n,), "m": 4.0, "withheld": n} for n in _cycle(rng, 2 * cases)
    ]
    names = [Outside.names[i % len(Outside.names)] for i in range(cases)]
    cells["outside 4 MDB"] = [{"outside": n, "m": 4.0} for n in names]
    cells["pairs 4 MDB"] = [
        {"effects": tuple(str(n) for n in rng.choice(STUDIED, 2, replace=False)), "m": 4.0}
        for _ in range(cases)
    ]
    return cells


def _cycle(rng, number):
    names = [n for _ in range(number // len(STUDIED) + 1) for n in rng.permutation(STUDIED)]
    return [str(n) for n in names[:number]]


def run(cases, seed, beds=4, save=None):
    """Run all cells, and return lists of `case` results."""
    ground = [Bed.of(seed + i) for i in range(beds)]
    rng = np.random.default_rng(seed)
    results = {}
    count = 0
    for cell, several in jobs(cases, rng).items():
        results[cell] = []
        for job in several:
            kind = ("sines", "walk")[count // beds % 2]
            chance = np.random.default_rng([seed, count])
            results[cell].append(case(ground[count % beds], chance, kind, **job))
            count += 1
        print(report(cell, results[cell]), flush=True)
        if save:
            Path(save).write_bytes(pickle.dumps(results))
    print(calibration(results))
    return results


def right(one):
    """True if a label is the truth, or one that the geometry cannot distinguish from it."""
    parts = one["label"].split("+")
    truth = one["truth"].split("+")
    strict = sorted(parts) == sorted(truth)
    alike = len(parts) == len(truth) and all(
        any(p == t or p in one["same"].get(t, ()) for p in parts) for t in truth
    )
    return strict, alike


def report(cell, results):
    """One line of the table."""
    n = len(results)
    label = [one["label"] for one in results]
    size = np.mean([len(one["set"]) for one in results])
    if cell == "clean":
        claimed = [x for x in label if x not in ("none", *NOISES)]
        noise = [x for x in label if x in NOISES]
        low = np.mean([one["p"] < 0.05 for one in results])
        return (
            f"clean: {n} cases, a cause claimed on {_share(len(claimed), n)} {claimed}, noise on "
            f"{len(noise)}, p < 0.05 in {low:.0%}"
        )
    if cell.startswith("withheld"):
        good = sum(x in ("unknown", "none") or x.split("+")[0] in NOISES for x in label)
        unknown = sum(x == "unknown" for x in label)
        false = [
            (o["truth"], o["label"], round(o["rho"], 2))
            for o in results
            if o["label"] not in ("unknown", "none", *NOISES)
        ]
        far = sum(one[2] < 0.5 for one in false)
        return (
            f"{cell}: {n} cases, unknown or noise {_share(good, n)} (unknown {unknown}), another "
            f"named whose squared correlation is below 0.5 {_share(far, n)}; all {false}"
        )
    if cell.startswith("outside"):
        flagged = [o for o in results if o["label"] == "unknown"]
        led = [o for o in flagged if _led(o)]
        missed = [(o["truth"], o["label"]) for o in results if o["label"] != "unknown"]
        missed += [(o["truth"], o["lead"]) for o in flagged if not _led(o)]
        return (
            f"{cell}: {n} cases, unknown {_share(len(flagged), n)}, lead right {len(led)} of "
            f"{len(flagged)} {missed}"
        )
    hits = np.array([right(one) for one in results])
    held = sum(any(right({**one, "label": name})[1] for name in one["set"]) for one in results)
    wrong = [(o["truth"], o["label"]) for o, hit in zip(results, hits, strict=True) if not hit[1]]
    line = (
        f"{cell}: {n} cases, right {_share(hits[:, 0].sum(), n)}, by class "
        f"{_share(hits[:, 1].sum(), n)}, set holds it {_share(held, n)}, set size {size:.2f}"
    )
    off = [one["off"] for one in results if one.get("off")]
    if off:
        error = np.median([o[0] for o in off])
        z = np.concatenate([o[1] for o in off])
        line += f", error {error:.0%}, 95 % interval holds {np.mean(np.abs(z) < 1.96):.0%}"
    return f"{line} {wrong}"


def _led(one):
    what, by = Outside.leads[one["truth"]]
    return any(w in one["lead"] for w in what.split("|")) and any(
        w in one["lead"] for w in by.split("|")
    )


def _share(k, n):
    """Share with its 95 % Wilson interval."""
    z = 1.96
    p = k / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return f"{p:.1%} [{max(middle - half, 0):.0%}, {min(middle + half, 1):.0%}]"


def calibration(results):
    """Stated probability of the label against the rate of correct labels, over all cells."""
    stated = []
    hit = []
    for cell, several in results.items():
        for one in several:
            if cell.startswith(("withheld", "outside")):
                good = one["label"] == "unknown"
            else:
                good = right(one)[1]
            stated.append(one["probability"][one["label"]])
            hit.append(good)
    stated = np.array(stated)
    hit = np.array(hit, dtype=float)
    bins = np.clip((stated * 5).astype(int), 0, 4)
    error = 0.0
    lines = []
    for b in np.unique(bins):
        mine = bins == b
        error += abs(stated[mine].mean() - hit[mine].mean()) * mine.mean()
        lines.append(
            f"  stated {stated[mine].mean():.2f}, right {hit[mine].mean():.2f} of {mine.sum()}"
        )
    return "\n".join([f"calibration error {error:.3f}", *lines])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--save", help="file for the results, pickled")
    given = parser.parse_args()
    run(given.cases, given.seed, save=given.save)


if __name__ == "__main__":
    main()
