"""The page of two_pass_gap.py: what it says, its pictures and tables."""

from collections import Counter

import numpy as np
from page import counted, picture, words, write_page

from mlscorr.report.style import AFTER, BEFORE, BLUE, GREY, ORANGE

REAL = [
    (
        "Real",
        [
            "All points, and the position and attitude of the sensor at each of them.",
            "The misfit of planes that both passes saw. No estimate uses any other truth: there "
            "is none, as nothing was surveyed.",
            "The data are told to be without a boresight correction; that was the expectation, and "
            "no part of the diagnosis.",
        ],
    ),
    (
        "Simulated or believed",
        [
            "Noise of the scanner: 2 cm and 0.01 deg, as of a Velodyne HDL-32E (32 lasers, 10 Hz; "
            "the make is not told).",
            "The POS: 2 cm, and the attitude sigmas of our simulator's MEMS unit, as its make is "
            "not told.",
            "The null band: misfits of the same planes if all were as believed.",
        ],
    ),
    (
        "What these data can't tell",
        [
            "Times were derived from frame number and azimuth, absolute ones sure to 0.05-0.1 s "
            "only. A shift common to points and poses changes nothing here; a delay between "
            "both can't be told from what the file's poses already hold.",
            "A datum, and all that moves both passes alike: two passes see differences alone.",
            "Which part of a class: a scene of 5 m at 20 m distance is seen under few angles, so "
            "a turn of the scanner, an offset of its angle and a shift are nearly the same.",
            "The size of the boresight beyond its sigma: it is the best explanation of these "
            "planes, not a calibration.",
        ],
    ),
]


def write(out, scenes, result, turned):
    """Pictures and the page; turned are the points with the boresight taken out, or None."""
    parts = []
    for name, r in result.items():
        files = pictures(out, name, scenes[name], r, turned[name])
        parts.append({"title": name, "text": told(r), "pictures": files, "tables": tables(r)})
    write_page(
        out / "two_pass_gap.html", "Why two real passes don't meet",
        "Two passes of a UAV scanner over a car and over a tent: real misfit against simulated",
        [headline(name, r) for name, r in result.items()], REAL, parts,
    )  # fmt: skip
    return out / "two_pass_gap.html"


def pictures(out, name, one, r, xyz):
    """Files with captions."""
    files = [
        (
            picture(out / f"{name.lower()}.png", draw_misfit, (7.6, 3.2), r),
            "Left: misfit of each plane that both passes saw, first pass minus second along its "
            "normal, in the order of its size before. Right: RMS misfits of the same planes if "
            "all sensors were as believed (grey, simulated), and the real one before and after.",
        )
    ]
    if xyz is None:
        return files
    cut = picture(out / f"{name.lower()}_slice.png", draw_slice, (7.6, 2.6), one, xyz, r)
    caption = (
        "A slice, 0.3 m thick, through the real points of both passes: as delivered, and with "
        "the boresight that all planes together give taken out. The RMS misfits are of planes."
    )
    return [(cut, caption), *files]


def tables(r):
    """What was named, what else may be, and what these planes would show."""
    named = [
        (parameter_told(p, u), f"{v:.3f} {u}", f"{s:.3f}", f"{d:.3f}")
        for _, p, u, v, s, d in r["parameters"]
    ]
    return [
        (
            ("parameter", "estimate", "sigma", "detectable"),
            named,
            f"What was named ({words(r['verdict'])}), with sigmas. Detectable: found with 80 % at "
            "a significance of 0.1 %.",
        ),
        (
            ("explanation", "probability"),
            [(words(e), f"{p:.2g}") for e, p in r["causes"]],
            "Best explanations of the misfit.",
        ),
        (
            ("effect", "detectable"),
            [(n.replace("_", " "), f"{d:.3g} {u}") for n, d, u in r["detectable"]],
            "How large other causes would have to be, alone, for these planes to show them.",
        ),
    ]


def parameter_told(name, unit):
    """A parameter in words: turns are about an axis of the vehicle, noise has a size."""
    if unit == "deg":
        return f"turned about {name}"
    return "noise of the position" if name == "magnitude" else name


def headline(name, r):
    """What came out of one scene, in a sentence."""
    inside = r["after"] <= r["null_band"][1]
    rest = "as much as believed sensors leave" if inside else "more than believed sensors leave"
    return (
        f"{name}: {words(r['verdict'])}. The misfit of {1e3 * r['before']:.0f} mm falls to "
        f"{1e3 * r['after']:.0f} mm on planes that were held out: {rest} (at most "
        f"{1e3 * r['null_band'][1]:.0f} mm)."
    )


def told(r):
    """Paragraphs of one scene."""
    alike = "; ".join(", ".join(words(effect) for effect in c) for c in r["classes"])
    low, high = r["shrink_interval"]
    return [
        f"{r['points']:,} points were put where the pose at their time says; 95 % of them lie "
        f"within {r['pose_check']:.1f} mm of where the file has them. {r['planes']} planes of 1 m "
        "were seen by both passes. Misfit is how far apart the passes put such a plane.",
        "The cause was looked for on three quarters of the planes in turn (named: "
        f"{counted(Counter(r['effects']))}), put into the simulator, and the misfit "
        f"measured on the fourth quarter. {r['shrink']:.0%} of its square is gone (95 % by "
        f"jackknife over the four: {low:.0%} to {high:.0%}).",
        f"This geometry can't tell apart: {alike or 'nothing of note'}. The diagnosis is the most "
        "probable of each class by what is usual, not by these data.",
    ]


def draw_misfit(figure, r):
    """Misfit of each plane before and after, and the null band."""
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    before, after = np.array(r["rows"]["before"]), np.array(r["rows"]["after"])
    order = np.argsort(before)
    place = np.arange(len(order))
    left.axhline(0, color=GREY, lw=0.8)
    left.plot(place, before[order], "o", color=BEFORE, ms=4, label="as delivered")
    left.plot(place, after[order], "o", color=AFTER, ms=4, label="held out, cause taken out")
    left.set(xlabel="plane, by its misfit as delivered", ylabel="misfit (mm)")
    left.set_title("First pass minus second")
    left.xaxis.get_major_locator().set_params(integer=True)
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    right.hist(r["drawn"], bins=30, color=GREY, label="simulated as believed")
    for value, color, label in (
        (r["before"], BEFORE, "real, before"),
        (r["after"], AFTER, "after"),
    ):
        right.axvline(1e3 * value, color=color, lw=2, label=label)
    right.set(xlabel="RMS misfit (mm)", ylabel="simulated surveys", title="Against chance")
    right.set_xlim(left=0)
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=3)


def draw_slice(figure, one, xyz, r):
    """A slice across the drive through both passes, before and after."""
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    first = one.passes == 0
    moment = np.array([one.cloud.gps_time[first].mean()])
    attitude = one.survey.trajectory.at(moment).attitude.as_matrix()[0]
    axes = attitude[:, :2].T * [1.0, 1.0, 0.0]  # right, forward
    middle = np.median(one.cloud.xyz, axis=0)
    for panel, points, title in (
        (panels[0], one.cloud.xyz, f"As delivered: misfit {1e3 * r['before']:.0f} mm"),
        (panels[1], xyz, f"Boresight taken out: {1e3 * r['after']:.0f} mm (held-out planes)"),
    ):  # fmt: skip
        across, along = axes @ (points - middle).T
        up = points[:, 2] - middle[2]
        for mine, color, label in ((first, ORANGE, "first pass"), (~first, BLUE, "second pass")):
            rows = np.flatnonzero(mine & (np.abs(along) < 0.15))
            panel.plot(across[rows], up[rows], ".", color=color, ms=1.6, label=label)
        panel.set(title=title, xlabel="across the first pass (m)")
        panel.set_aspect("equal")
    panels[0].set_ylabel("height (m)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2,
                  markerscale=5)  # fmt: skip
