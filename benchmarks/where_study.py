"""Agreement of the interval that a diagnosis names with the one in which an effect acts.

    OMP_NUM_THREADS=1 python benchmarks/where_study.py [--seeds 6] [--seed 9000] [--size 4]

Synthetic surveys of features in which something acts in one interval of time, distance, range,
incidence or scan angle alone: events of the library, a POS that is worse for a while, and
mechanisms that no library knows. For each the interval reported for that covariate is compared with
the true one, in which the effect is at least half of its maximum: intersection over union, zero if
none is reported.
"""

import argparse
from dataclasses import replace

import numpy as np
from feature_errors import errors
from gap_mechanisms import sized
from gap_study import Bed
from gap_training.errors import process

from mlscorr.gap import headline
from mlscorr.gap.evidence import infer_causes
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import displacements

HALF = np.sqrt(2 * np.log(2))  # of a Gaussian's sigma, at which it is half as large
BANDS = {  # direction of the error, covariate, share of the rows, times the size, by name
    "range error in a band of ranges": ("beam", "range", 0.25, 1),
    "range error in a sector of angles": ("beam", "scan_angle", 0.2, 1),
    "range error in a band of incidence": ("beam", "incidence", 0.25, 1),
    "subsidence of a stretch of road": ("height", "location", 0.2, 3),  # drift hides it
    "error to the right for a while": ("right", "time", 0.12, 3),
}
EVENTS = ("position_bump", "position_step", "worse POS for a while")


def confined(bed, name, rng, m):
    """Shift (m,) of rows, covariate and its true interval."""
    g = bed.g
    if name in ("position_bump", "position_step"):
        shift, _, fixed = sized(g, bed.signs, name, m, rng, bed.size)
        time = g.survey.trajectory.gps_time
        if "width" in fixed:
            away = HALF * fixed["width"]
            return shift, "time", (fixed["time"] - away, fixed["time"] + away)
        number = g.survey.trajectory.segment(time[0] + fixed["time"])
        return shift, "time", (fixed["time"], g.survey.trajectory.passes[number][1] - time[0])
    if name == "worse POS for a while":
        start = rng.uniform(10, 60)
        length = rng.uniform(20, 40)
        time = g.rows.covariates["time"]
        inside = (time >= start) & (time < start + length)
        moved = np.array([process(rng, g.rows.gps_time, "sines") for _ in range(3)])
        shift = inside * np.einsum("mi,im->m", g.rows.partials[:, :3], moved)
        return shift * 3 * m / bed.size(shift), "time", (start, start + length)
    direction, by, width, times = BANDS[name]
    values = g.rows.covariates[by]
    views = displacements(g.rows, g.survey)
    if by in ("scan_angle", "incidence"):
        values = np.degrees(values)
    first = rng.uniform(0.05, 0.95 - width)
    start, end = np.quantile(values[g.rows.metric], [first, first + width])
    shift = np.zeros(len(g.rows))
    at = {item: k for k, item in enumerate(views.item) if views.sign[k] > 0}
    for i in np.flatnonzero(g.rows.metric & (values >= start) & (values <= end)):
        shift[i] = g.rows.direction[i] @ views.directions[direction][at[g.rows.item[i]]]
    return shift * times * m / bed.size(shift), by, (start, end)


def overlap(extent, truth):
    """Intersection over union of two intervals."""
    if extent is None:
        return 0.0
    shares = []
    for turn in (-360.0, 0.0):  # an angle may be told as one of the next turn
        low, high = np.array([extent.low, extent.high]) + turn
        both = max(min(high, truth[1]) - max(low, truth[0]), 0.0)
        shares.append(both / (max(high, truth[1]) - min(low, truth[0])))
    return max(shares)


def case(bed, rng, kind, name, m):
    """Label, intersection over union, and whether the headline names the covariate."""
    g = bed.g
    shift, by, truth = confined(bed, name, rng, m)
    rows = replace(g.rows, residual=errors(g, rng, kind) + shift)
    signs = bed.signs
    inference = infer_causes(rows, background(rows, g.survey), g.survey, signs, rng, 20)
    split = next(split for split in inference.where.splits if split.by == by)
    verdict = inference.verdict
    words = {
        "scan_angle": "scan angles",
        "incidence": "incidence angles",
        "time": "gps_time",
        "location": "chainage",
    }
    said = headline(inference.where, verdict.label, verdict.hint, rows.reference.start)
    return {
        "label": verdict.label,
        "iou": overlap(split.extent, truth),
        "truth": truth,
        "extent": split.extent,
        "headline": said,
        "named": words.get(by, f"{by}s") in said,
    }


def run(seeds, seed, m, beds=2):
    """Yield names and their results."""
    ground = [Bed.of(seed + 2 * i) for i in range(beds)]
    for number, name in enumerate((*EVENTS, *BANDS)):
        results = []
        for k in range(seeds):
            rng = np.random.default_rng([seed, number, k])
            bed = ground[k % beds]
            kind = ("sines", "walk")[k // beds % 2]
            results.append(case(bed, rng, kind, name, m))
        yield name, results


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--seed", type=int, default=9000)
    parser.add_argument("--size", type=float, default=4.0, help="minimal detectable biases")
    parser.add_argument("--list", action="store_true", help="each case, too")
    given = parser.parse_args()
    for name, several in run(given.seeds, given.seed, given.size):
        iou = [r["iou"] for r in several]
        silent = sum(r["label"] == "none" for r in several)
        print(
            f"{name:36s} median IoU {np.median(iou):.2f}, least {min(iou):.2f}, named by the "
            f"headline {sum(r['named'] for r in several)} of {len(several)}, nothing told "
            f"{silent}",
            flush=True,
        )
        for r in several if given.list else ():
            e = r["extent"]
            if e is None:
                told = "-"
            else:
                told = f"{e.low:.1f} to {e.high:.1f} ({e.share:.2f})"
            print(
                f"   {r['iou']:.2f} {r['label']:30s} truth {r['truth'][0]:.1f} to "
                f"{r['truth'][1]:.1f}, told {told}; {r['headline'][:90]}"
            )


if __name__ == "__main__":
    main()
