"""The page of two_pass_gap.py: its text, pictures and tables."""

import numpy as np
from page import picture, words, write_page

from mlscorr.report.style import AFTER, BEFORE, BLUE, GREY, ORANGE

AXES = ("right", "forward", "up")  # of the body, about which the scanner is turned
REAL = [
    (
        "Real",
        [
            "All points, and the position and attitude of the sensor at each of them.",
            "The misfit of planes that both passes saw. No estimate uses any other truth: there "
            "is none, as nothing was surveyed.",
            "The data come without a boresight correction, their makers say.",
        ],
    ),
    (
        "Simulated or believed",
        [
            "Noise of the scanner: 2 cm and 0.01 deg, as of a Velodyne HDL-32E (32 lasers, 10 Hz; "
            "the make is not stated).",
            "The POS: 2 cm, and the attitude sigmas of our simulator's MEMS unit, as its make is "
            "not stated.",
            "The lever arm: the file has the position of the sensor itself, so it should be zero; "
            "it is estimated beside the boresight all the same.",
        ],
    ),
    (
        "What these data can't tell",
        [
            "Times were derived from frame number and azimuth, absolute ones sure to 0.05-0.1 s "
            "only. A shift common to points and poses changes nothing here; a delay between "
            "both can't be told from what the file's poses already hold.",
            "A datum, and all that moves both passes alike: two passes see differences alone.",
            "Whether the mounting or a steady error of the POS's attitude is wrong: both turn all "
            "points alike.",
            "A turn about up, where nothing but the ground was seen twice: the sigmas say so.",
        ],
    ),
]


def write(out, scenes, result, turned):
    """Write pictures and the page; turned are the points after correction of the boresight."""
    parts = [
        {
            "title": name,
            "text": paragraphs(r),
            "pictures": pictures(out, name, scenes[name], r, turned[name]),
            "tables": tables(r),
        }
        for name, r in result.items()
    ]
    write_page(
        out / "two_pass_gap.html",
        "Why two real passes don't meet",
        "Two passes of a UAV scanner over a car and over a tent: the mounting, and what it leaves",
        [headline(name, r) for name, r in result.items()],
        REAL,
        parts,
    )
    return out / "two_pass_gap.html"


def pictures(out, name, scene, r, xyz):
    """Files with captions."""
    cut = picture(out / f"{name.lower()}_slice.png", draw_slice, (7.6, 2.6), scene, xyz, r)
    misfit = picture(out / f"{name.lower()}.png", draw_misfit, (7.6, 3.2), r)
    return [
        (
            cut,
            "A slice, 0.3 m thick, through the real points of both passes: as delivered, and with "
            "the boresight that all planes together give taken out.",
        ),
        (
            misfit,
            "Misfit of each plane that both passes saw, along its normal, in the order of its size "
            "before: as delivered, and under the boresight that the planes of other squares of the "
            "ground give.",
        ),
    ]


def tables(r):
    """Tables of the boresight, and of possible causes in the planes of the calibrated cloud."""
    turned = zip(AXES, r["boresight"], r["sigma"], strict=True)
    rows = [(f"turned about {axis}", f"{v:.3f} deg", f"{s:.3f} deg") for axis, v, s in turned]
    causes = [] if r["left"] is None else r["left"]["causes"]
    return [
        (
            ("boresight", "estimate", "sigma"),
            rows,
            "What the recorded mounting lacks, by planes of both passes.",
        ),
        (
            ("explanation", "probability"),
            [(words(effect), f"{p:.2g}") for effect, p in causes],
            "Best explanations of what is left once the boresight is out.",
        ),
    ]


def turns(r):
    """The boresight in words."""
    both = zip(AXES, r["boresight"], r["sigma"], strict=True)
    return ", ".join(f"{v:.3f} ± {s:.3f} deg about {axis}" for axis, v, s in both)


def medians(r):
    """Medians of the misfit (mm) before and after."""
    return [float(np.median(np.abs(r[key]))) for key in ("before", "after")]


def headline(name, r):
    """The result of a scene, in a sentence."""
    before, after = medians(r)
    return (
        f"{name}: the boresight is off by {turns(r)}. The misfit of {before:.0f} mm falls to "
        f"{after:.0f} mm (medians) on planes that were held out."
    )


def paragraphs(r):
    """Paragraphs of a scene."""
    text = [
        f"{r['points']:,} points were put where the pose at their time says; 95 % of them lie "
        f"within {r['pose_check']:.1f} mm of where the file has them. {r['planes']} planes of 1 m "
        "that both passes saw agree with each other. Misfit is how far apart the passes put such "
        "a plane.",
        "The boresight was estimated from the planes of three quarters of the ground in turn, and "
        "the misfit measured on those of the fourth quarter.",
    ]
    rest = r["left"]
    if rest is not None:
        text.append(
            f"Compared with a simulator that believes in its sensors, {rest['planes']} planes of "
            f"the calibrated cloud ({rest['median']:.0f} mm, median) show: "
            f"{words(rest['verdict'])} (probability {rest['probability']:.2f})."
        )
    return text


def draw_misfit(figure, r):
    """Draw the misfit of each plane before and after."""
    axes = figure.subplots()
    before = np.array(r["before"])
    after = np.array(r["after"])
    order = np.argsort(before)
    place = np.arange(len(order))
    axes.axhline(0, color=GREY, lw=0.8)
    axes.plot(place, before[order], "o", color=BEFORE, ms=4, label="as delivered")
    axes.plot(place, after[order], "o", color=AFTER, ms=4, label="held out, boresight taken out")
    axes.set(xlabel="plane, by its misfit as delivered", ylabel="misfit (mm)")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)


def draw_slice(figure, scene, xyz, r):
    """Draw a slice across the drive through both passes, before and after."""
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    first = scene.passes == 0
    moment = np.array([scene.cloud.gps_time[first].mean()])
    attitude = scene.survey.trajectory.at(moment).attitude.as_matrix()[0]
    axes = attitude[:, :2].T * [1.0, 1.0, 0.0]  # right, forward
    middle = np.median(scene.cloud.xyz, axis=0)
    before, after = medians(r)
    for panel, points, title in (
        (panels[0], scene.cloud.xyz, f"As delivered: misfit {before:.0f} mm"),
        (panels[1], xyz, f"Boresight taken out: {after:.0f} mm (held-out planes)"),
    ):
        across, along = axes @ (points - middle).T
        up = points[:, 2] - middle[2]
        for part, color, label in ((first, ORANGE, "first pass"), (~first, BLUE, "second pass")):
            rows = np.flatnonzero(part & (np.abs(along) < 0.15))
            panel.plot(across[rows], up[rows], ".", color=color, ms=1.6, label=label)
        panel.set(title=title, xlabel="across the first pass (m)")
        panel.set_aspect("equal")
    panels[0].set_ylabel("height (m)")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, markerscale=5
    )
