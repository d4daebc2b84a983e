"""The gap between a simulated and a REAL POS error: its place, its cause, and its closure.

    python benchmarks/real/pos_gap.py [--windows N] [--layouts N] [--seed S] [--out FOLDER]
                                    [--picture FILE.png]

Real are the drive (GNSS_RTK.pos) and the error of a MEMS GNSS/INS on it (OB_GINS_TXT.err of
i2Nav-WHU/OB_GINS), from which GNSS was withheld 60 s in every 150 s. The error series is the
observation: surveyed targets along the real drive are displaced by that error. Targets, their
survey and their extraction are simulated. The assumed POS is of that grade and never loses GNSS;
the diagnosis has no knowledge of the outages. Without the two files the script ends with a message.
"""

import argparse
import json
from collections import Counter
from pathlib import Path

import numpy as np
from page import ROOT, counted, needed, picture, words
from pos_drive import DATA, FILES, belief, outage_models, real_drive, spans, window_rows
from pos_figures import draw_summary
from pos_measure import (
    diagnosed,
    measure,
    simulated_gaps,
    summary,
    verdict_of,
    what_stays,
    within,
)
from pos_page import interval, most_chosen, windows_told, write


def main():
    arguments = parse()
    needed(DATA, FILES, "dataset/ of i2Nav-WHU/OB_GINS")
    out = arguments.out
    rng = np.random.default_rng(arguments.seed)
    one = real_drive(rng)
    believed = belief(one, arguments.seed)
    models = outage_models(one, arguments.seed)
    cycles, quiet = spans(one, arguments.windows)
    pairs = [(a[0], b[1]) for a, b in zip(cycles[::2], cycles[1::2], strict=False)]
    kinds = {"one outage": cycles, "two outages": pairs, "no outage": quiet}
    every = cycles + quiet + pairs
    rows = {span: window_rows(one, span, one.recorded, believed, rng) for span in every}
    told = {span: diagnosed(*rows[span], rng) for span in rows}
    measured = measure(cycles, rows, one, models, rng)
    simulated = simulated_gaps(one, cycles, believed, arguments.seed)
    result = summary(cycles, told, measured, rng) | {
        "believed": plain(believed),
        "pairs": [verdict_of(one, span, told[span]) for span in pairs],
        "quiet": [verdict_of(one, span, told[span]) for span in quiet],
        "within_2_sigma": within(one, believed, measured, models),
        "layouts": arguments.layouts,
        "named": named_over(kinds, told, believed, arguments),
        "stays": what_stays(one, measured, models),
        "simulated": {
            "median": float(np.median(simulated)),
            "range": np.percentile(simulated, [5, 95]).tolist(),
        },
    }
    out.mkdir(parents=True, exist_ok=True)
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    (out / "pos_gap.json").write_text(json.dumps(result, indent=1) + "\n")
    show(result)
    print(f"Page: {write(out, one, result, cycles, measured, believed, models)}")
    drawn = (one, believed, models[most_chosen(measured)], cycles, result)
    print(f"Picture: {picture(arguments.picture, draw_summary, (7.6, 6.4), *drawn)}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--windows", type=int, default=8, help="outages that are looked at")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--layouts", type=int, default=1, help="of targets, to count verdicts over")
    parser.add_argument("-o", "--out", type=Path, default=Path("pos_gap"))
    parser.add_argument(
        "--picture", type=Path, default=ROOT / "build" / "pictures" / "real_pos_gap.png"
    )
    return parser.parse_args()


def plain(believed):
    """Assumptions about the POS, in m, deg and s."""
    return {
        "position_sigma": believed.position_sigma,
        "attitude_sigma_deg": np.degrees(believed.attitude_sigma).tolist(),
        "correlation_time": believed.correlation_time,
    }


def named_over(kinds, told, believed, arguments):
    """Counts of each label by kind of window, over several layouts of targets."""
    counts = {kind: Counter(told[s].verdict.label for s in spans) for kind, spans in kinds.items()}
    for number in range(1, arguments.layouts):
        rng = np.random.default_rng([arguments.seed, number])
        other = real_drive(rng)
        for kind, several in kinds.items():
            for span in several:
                rows, survey = window_rows(other, span, other.recorded, believed, rng)
                counts[kind][diagnosed(rows, survey, rng).verdict.label] += 1
    return {kind: dict(count.most_common()) for kind, count in counts.items()}


def show(r):
    """The result as text."""
    print(
        f"{'outage from':14s}{'diagnosis, shown this outage alone':44s}"
        "gap before   after (mm)   shrink"
    )
    for row in r["cycles"]:
        print(
            f"{row['outage'][0]:.0f} s      {words(row['verdict']):44s}{row['before']:10.0f} "
            f"{row['after']:12.0f} {row['shrink']:8.0%}"
        )
    for row in r["pairs"]:
        print(
            f"two outages, {row['span'][0]:.0f} to {row['span'][1]:.0f} s: "
            f"{words(row['verdict'])} (probability {row['probability']:.2f}); "
            f"windows {windows_told(row)}"
        )
    for row in r["quiet"]:
        print(
            f"no outage, {row['span'][0]:.0f} to {row['span'][1]:.0f} s: "
            f"{words(row['verdict'])}; gap {row['gap']:.0f} mm, {row['null_band'][0]:.0f} to "
            f"{row['null_band'][1]:.0f} mm if nothing is wrong"
        )
    for kind, count in r["named"].items():
        print(f"{kind}, over {r['layouts']} layout(s) of targets: {counted(count)}")
    show_whole(r)


def show_whole(r):
    """The results for all outages together, as text."""
    m = r["medians"]
    print(
        f"median over {len(r['cycles'])} outages: gap {interval(m['before'])} -> "
        f"{interval(m['after'])} mm, shrink {interval(m['shrink'], 100)} %"
    )
    print(
        f"all together: {r['shrink_all']:.0%} of the gap's square gone "
        f"[{r['shrink_interval'][0]:.0%}, {r['shrink_interval'][1]:.0%}]; "
        f"{r['plain_in_outages']:.1%} of the excess square lies in the outages "
        f"({r['rows_in_outages']:.0%} of the targets); errors within 2 sigma: "
        f"{r['within_2_sigma'][0]:.0%} -> {r['within_2_sigma'][1]:.0%}"
    )
    print(
        "in outages the error is {:.1f} / {:.1f} / {:.1f} times the simulated sigma (E / N / H); "
        "height ends positive in {} of {}".format(
            *r["stays"]["over_sigma"], r["stays"]["positive"][2], len(r["cycles"])
        )
    )
    print(f"the simulator with outages makes a gap of {r['simulated']['median']:.0f} mm (median)")


if __name__ == "__main__":
    main()
