"""Draw the diagrams of the manual: boxes and arrows, frames, maps.

    python benchmarks/pictures/diagrams.py [--picture NAME.png]

The name of the picture chooses the diagram: commands, folder, install, workflow, stages, frames,
north, two_scanners, overlap, city, cluster, object_store, control_list, clouds, ground_scale,
own_simulator, blind, atomic.
"""

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Circle, FancyBboxPatch, Polygon, Rectangle

PICTURES = Path(__file__).parents[2] / "build" / "pictures"
BLUE = "#0072b2"
ORANGE = "#d55e00"
GREEN = "#009e73"
GREY = "#7a8794"
INK = "#1b2733"
UNITS = 2.75  # of a sheet in an inch
PALE = "#e8f0f7"
WARM = "#fbeee6"


def sheet(width, height):
    """A figure without axes, in units of a text line."""
    figure, axes = plt.subplots(figsize=(width / UNITS, height / UNITS))
    axes.set_xlim(0, width)
    axes.set_ylim(0, height)
    axes.set_aspect("equal")
    axes.axis("off")
    figure.subplots_adjust(0, 0, 1, 1)
    return figure, axes


def box(axes, x, y, words, width=4.2, height=1.5, color=PALE, edge=BLUE, size=9):
    """A rounded box about its middle; a second line is smaller."""
    axes.add_patch(
        FancyBboxPatch(
            (x - width / 2, y - height / 2),
            width,
            height,
            boxstyle="round,pad=0,rounding_size=0.15",
            facecolor=color,
            edgecolor=edge,
            linewidth=1.1,
        )
    )
    title, _, more = words.partition("\n")
    lines = more.count("\n") + 1
    up = 0.22 * lines if more else 0.0
    axes.text(x, y + up, title, ha="center", va="center", size=size, color=INK, weight="bold")
    if more:
        below = y - 0.32
        axes.text(x, below, more, ha="center", va="center", size=size - 1.5, color="#44505c")


def arrow(axes, start, end, color=GREY, words="", style="-|>", dashed=False):
    """An arrow with words at its middle."""
    axes.annotate(
        "",
        end,
        start,
        arrowprops={
            "arrowstyle": style,
            "color": color,
            "linewidth": 1.3,
            "linestyle": "--" if dashed else "-",
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )
    if words:
        x, y = np.mean([start, end], axis=0)
        axes.text(x, y + 0.3, words, ha="center", va="bottom", size=8, color=color)


def note(axes, x, y, words, color=INK, size=8.5, **style):
    """Words at a place."""
    axes.text(
        x, y, words, ha=style.pop("ha", "center"), va="center", size=size, color=color, **style
    )


def commands():
    figure, axes = sheet(24, 10.4)
    for x, words in (
        (2.6, "files\nclouds, trajectory,\ncontrol"),
        (8.0, "init\nwrites survey.toml"),
        (13.0, "check\nreports problems"),
        (18.0, "correct\nmoves every point"),
    ):
        box(axes, x, 6.2, words, 4.0, 2.0, WARM if x < 3 else PALE, ORANGE if x < 3 else BLUE)
    box(axes, 22.2, 6.2, "results\nclouds, report", 3.0, 2.0, "#e6f4ee", GREEN)
    for a, b in ((4.6, 6.0), (10.0, 11.0), (15.0, 16.0), (20.0, 20.7)):
        arrow(axes, (a, 6.2), (b, 6.2))
    for x, words in ((5.0, "plan\nbefore the drive"), (10.5, "simulate\na survey with truth")):
        box(axes, x, 9.2, words, 4.4, 1.6)
    arrow(axes, (10.5, 8.4), (12.2, 7.2), dashed=True)
    arrow(axes, (5.0, 8.4), (3.4, 7.2), dashed=True)
    for x, words in (
        (3.0, "extract\ntargets in the cloud"),
        (7.9, "ties\noverlap of passes"),
        (12.8, "calibrate\nlever arm, boresight"),
        (17.5, "diagnose, apply\nfind and remove errors"),
        (21.9, "compare, render\nmethods, pictures"),
    ):
        box(axes, x, 2.2, words, 4.5 if x < 20 else 3.7, 1.7)
    arrow(axes, (13.0, 5.2), (13.0, 3.2), dashed=True)
    note(axes, 13.3, 4.1, "any time, with the same survey.toml", ha="left", color=GREY)
    return figure


def folder():
    figure, axes = sheet(22, 7.6)
    for x, title, names, color, edge in (
        (
            4.0,
            "FOLDER",
            [
                "survey.toml",
                "pass-1.laz, pass-2.laz",
                "trajectory.csv (or SBET ...)",
                "control.csv",
            ],
            WARM,
            ORANGE,
        ),
        (
            17.5,
            "corrected",
            [
                "pass-1.laz, pass-2.laz",
                "trajectory.csv with sigmas",
                "report.html, report.json",
                "targets.csv, weak.csv, pictures",
            ],
            "#e6f4ee",
            GREEN,
        ),
    ):
        axes.add_patch(
            FancyBboxPatch(
                (x - 3.8, 0.5),
                7.6,
                6.4,
                boxstyle="round,pad=0,rounding_size=0.2",
                facecolor=color,
                edgecolor=edge,
                linewidth=1.2,
            )
        )
        note(axes, x, 6.2, title, weight="bold", size=11)
        for i, name in enumerate(names):
            note(axes, x - 3.3, 4.9 - 1.2 * i, name, ha="left", size=9.5, family="monospace")
    arrow(axes, (8.1, 3.9), (13.4, 3.9), BLUE, "mlscorr correct")
    note(axes, 10.75, 3.3, "FOLDER stays as it is", color=GREY)
    return figure


def install():
    figure, axes = sheet(22, 6.9)
    for y, words in (
        (5.2, "pip install ."),
        (3.8, "uv tool install ."),
        (2.4, "conda + pip"),
        (1.0, "make demo"),
    ):
        box(axes, 3.2, y, words, 5.0, 1.1, WARM, ORANGE)
        arrow(axes, (5.7, y), (8.7, 3.2 + (y - 3.1) * 0.25))
    box(axes, 11.0, 3.1, "mlscorr\n1 GB, no GPU,\nno display", 4.6, 2.6)
    for y, words in (
        (5.2, "[e57]  [excel]"),
        (3.8, "[pandas]"),
        (2.4, "[remote]"),
        (1.0, "[cluster]"),
    ):
        box(axes, 18.5, y, words, 5.0, 1.1, "#ffffff", GREY)
        arrow(axes, (16.0, y), (13.3, 3.2 + (y - 3.1) * 0.25), dashed=True)
    note(axes, 18.5, 6.4, "extras, if a file needs them", color=GREY)
    return figure


def workflow():
    figure, axes = sheet(25, 6.2)
    stages = (
        ("cloud\nread once", WARM, ORANGE),
        ("targets\nfind_targets", PALE, BLUE),
        ("matches\nmatch_targets", PALE, BLUE),
        ("POS error\nestimate_pos_error", PALE, BLUE),
        ("points\ncorrection.apply", "#e6f4ee", GREEN),
    )
    for i, (words, color, edge) in enumerate(stages):
        box(axes, 2.5 + 5.0 * i, 4.2, words, 4.2, 1.8, color, edge)
        if i:
            arrow(axes, (5.0 * i - 0.4, 4.2), (5.0 * i + 0.4, 4.2))
    box(axes, 10.0, 1.2, "ties\nfind_ties (optional)", 4.6, 1.5, "#ffffff")
    arrow(axes, (2.5, 3.3), (7.7, 1.5), dashed=True)
    arrow(axes, (12.3, 1.5), (16.4, 3.3), dashed=True)
    box(axes, 20.5, 1.2, "check points\nscore", 4.6, 1.5, "#ffffff", GREEN)
    arrow(axes, (17.5, 3.3), (19.4, 1.95), dashed=True)
    return figure


def stages():
    figure, axes = sheet(25, 7.0)
    chain = (
        ("beam", "divergence"),
        ("clock", "time offset,\ndrift, jitter"),
        ("range", "bias, scale,\nwalk, noise"),
        ("angle", "scale, eccen-\ntricity, noise"),
        ("return", "dropout"),
        ("pos", "heading drift, step,\nbump, noise"),
        ("mounting", "boresight,\nlever arm"),
        ("control", "datum, rotation,\nscale, outlier"),
    )
    for i, (stage, effects) in enumerate(chain):
        x = 1.65 + 3.1 * i
        box(axes, x, 5.0, stage, 2.5, 1.3)
        note(axes, x, 3.0, effects, size=8, color=ORANGE)
        axes.plot([x, x], [3.75, 4.3], color=ORANGE, linewidth=1)
        if i:
            arrow(axes, (x - 1.85, 5.0), (x - 1.25, 5.0))
    note(axes, 12.5, 6.5, "from the laser pulse to the coordinates of a survey", color=GREY, size=9)
    note(axes, 12.5, 1.2, "recorded = true + effect", color=INK, size=10)
    return figure


def vehicle(axes, x, y, width=2.0, length=4.4):
    """A vehicle from above, its front up."""
    axes.add_patch(
        FancyBboxPatch(
            (x - width / 2, y - length / 2),
            width,
            length,
            boxstyle="round,pad=0,rounding_size=0.35",
            facecolor="#f2f4f6",
            edgecolor=GREY,
        )
    )
    axes.add_patch(
        Polygon(
            [(x - 0.75, y + 0.9), (x + 0.75, y + 0.9), (x + 0.6, y + 1.5), (x - 0.6, y + 1.5)],
            facecolor="#d5dde4",
            edgecolor=GREY,
            linewidth=0.6,
        )
    )


def frames():
    figure, axes = sheet(24, 8.6)
    arrow(axes, (1.2, 1.4), (1.2, 4.6), INK)
    arrow(axes, (1.2, 1.4), (4.4, 1.4), INK)
    note(axes, 1.2, 5.1, "N", weight="bold")
    note(axes, 4.8, 1.4, "E", weight="bold")
    axes.add_patch(Circle((1.2, 1.4), 0.16, facecolor="white", edgecolor=INK))
    note(axes, 0.6, 0.8, "H up")
    note(axes, 2.8, 7.6, "map", weight="bold", size=11)
    vehicle(axes, 10.2, 4.0, 3.0, 6.4)
    note(axes, 9.4, 8.1, "body", weight="bold", size=11)
    pos, scanner = (10.2, 4.4), (10.8, 1.9)
    axes.add_patch(Circle(pos, 0.18, color=BLUE))
    note(axes, 8.9, 4.1, "POS", color=BLUE)
    arrow(axes, pos, (10.2, 7.2), BLUE, style="-|>")
    arrow(axes, pos, (13.0, 4.4), BLUE, style="-|>")
    note(axes, 11.1, 6.9, "Y forward", color=BLUE)
    note(axes, 13.9, 4.8, "X right, Z up", color=BLUE)
    arrow(axes, pos, scanner, ORANGE)
    note(axes, 12.9, 3.0, "lever arm", color=ORANGE, size=9)
    axes.add_patch(Rectangle((scanner[0] - 0.3, scanner[1] - 0.3), 0.6, 0.6, color=ORANGE))
    note(axes, 12.6, 1.7, "scanner", color=ORANGE)
    center = np.array([18.9, 4.0])
    axes.add_patch(Circle(center, 2.5, facecolor="none", edgecolor=ORANGE, linestyle="--"))
    for angle, words in ((20, "X: zero beam"), (110, "Y: a quarter\nturn later")):
        end = center + 3.1 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        arrow(axes, center, end, ORANGE)
        note(axes, end[0] + 0.3, end[1] + 0.55, words, color=ORANGE)
    axes.add_patch(Circle(center, 0.18, facecolor="white", edgecolor=ORANGE))
    note(axes, 19.1, 3.3, "Z: across the scan plane", color=ORANGE)
    note(axes, 18.9, 8.1, "scanner, in its scan plane", weight="bold", size=11)
    return figure


def north():
    figure, axes = sheet(24, 8.4)
    origin = np.array([6.0, 1.2])

    def ray(degrees, length, color, dashed=False):
        direction = np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
        arrow(axes, origin, origin + length * direction, color, dashed=dashed)
        return origin + length * direction

    end = ray(0, 6.0, INK)
    note(axes, end[0] + 0, end[1] + 0.5, "grid north", weight="bold")
    end = ray(-14, 6.0, GREY, dashed=True)
    note(axes, end[0] - 1.0, end[1] + 0.5, "true north", color=GREY, weight="bold")
    end = ray(48, 6.0, BLUE)
    note(axes, end[0] + 1.2, end[1] + 0.3, "forward", color=BLUE, weight="bold")
    for radius, start, color in ((2.6, 0, INK), (3.9, -14, GREY)):
        angles = np.radians(np.linspace(start, 48, 60))
        axes.plot(
            origin[0] + radius * np.sin(angles), origin[1] + radius * np.cos(angles), color=color
        )
    note(
        axes,
        13.0,
        3.2,
        "heading from true north (SBET, POF, Inertial Explorer)",
        ha="left",
        color=GREY,
        size=7.5,
    )
    axes.plot([8.9, 12.8], [4.2, 3.25], color=GREY, linewidth=0.7)
    note(axes, 13.0, 2.2, "heading from grid north (trajectory.csv)", ha="left", size=7.5)
    axes.plot([7.6, 12.8], [3.3, 2.25], color=INK, linewidth=0.7)
    angles = np.radians(np.linspace(-14, 0, 20))
    axes.plot(
        origin[0] + 5.3 * np.sin(angles),
        origin[1] + 5.3 * np.cos(angles),
        color=ORANGE,
        linewidth=2,
    )
    note(axes, 2.3, 5.6, "meridian\nconvergence", color=ORANGE)
    axes.plot([3.5, 5.2], [5.8, 6.35], color=ORANGE, linewidth=0.7)
    note(
        axes,
        13.0,
        6.6,
        "grid heading = true heading - convergence",
        ha="left",
        weight="bold",
        size=8.5,
    )
    return figure


def two_scanners():
    figure, axes = sheet(22, 8.4)
    vehicle(axes, 7.0, 4.2, 2.4, 5.6)
    for x, side, color, words in ((6.3, 1, BLUE, "left"), (7.7, -1, ORANGE, "right")):
        axes.add_patch(Rectangle((x - 0.25, 2.0), 0.5, 0.5, color=color))
        direction = np.array([np.cos(np.radians(35)) * side, np.sin(np.radians(35))])
        for sign in (1, -1):
            end = np.array([x, 2.25]) + sign * 5.6 * direction
            axes.plot([x, end[0]], [2.25, end[1]], color=color, linewidth=1.3, alpha=0.8)
        note(axes, x + side * 4.2, 6.3, f"scan plane,\n{words} scanner", color=color)
    axes.add_patch(Rectangle((0.4, 0.2), 0.35, 8.0, facecolor="#c9d1d8"))
    axes.add_patch(Rectangle((13.2, 0.2), 0.35, 8.0, facecolor="#c9d1d8"))
    arrow(axes, (7.0, 7.1), (7.0, 8.2), GREY)
    for y, color, words in ((5.8, BLUE, "left-*.laz"), (2.6, ORANGE, "right-*.laz")):
        box(axes, 18.2, y, f"[[scanner]]\n{words}, own mounting", 6.0, 1.8, "#ffffff", color)
    note(axes, 18.2, 4.2, "one drift for both", color=GREY)
    return figure


def overlap():
    figure, axes = sheet(24, 7.6)
    x = np.linspace(0.8, 23.2, 200)
    there = 3.1 + 0.12 * np.sin(x / 2)
    back = 4.5 + 0.12 * np.sin(x / 2)
    for left, right in ((1, 6), (7.5, 13), (14.5, 22.5)):
        axes.add_patch(Rectangle((left, 6.5), right - left, 0.7, facecolor="#c9d1d8"))
    for left, right in ((2, 9), (11, 16), (17.5, 23)):
        axes.add_patch(Rectangle((left, 0.4), right - left, 0.7, facecolor="#c9d1d8"))
    axes.plot(x, there, color=BLUE, linewidth=2)
    axes.plot(x, back, color=ORANGE, linewidth=2)
    arrow(axes, (22.6, there[-1]), (23.6, there[-1]), BLUE)
    arrow(axes, (1.6, back[0]), (0.5, back[0]), ORANGE)
    for at in (3.5, 7.9, 10.0, 15.2, 18.5, 21.0):
        axes.plot([at, at + 0.6], [3.2, 6.4], color=BLUE, linewidth=0.7, alpha=0.8)
        axes.plot([at + 1.2, at + 0.6], [4.6, 6.4], color=ORANGE, linewidth=0.7, alpha=0.8)
        axes.plot(at + 0.6, 6.5, "s", color=GREEN, markersize=6)
    for at in (5.0, 12.0, 19.5):
        axes.plot(at, 1.7, "o", color=INK, markersize=7)
    note(axes, 5.0, 2.25, "control", size=8)
    note(axes, 13.9, 5.7, "tie feature:\none wall, two views", color=GREEN, size=8.5)
    note(axes, 9.5, 2.55, "pass 1", color=BLUE)
    note(axes, 18.0, 4.95, "pass 2, opposite", color=ORANGE)
    return figure


def city():
    figure, axes = sheet(22, 9.0)
    for i in range(6):
        for j in range(3):
            axes.add_patch(
                Rectangle(
                    (0.6 + 3.5 * i, 0.4 + 2.7 * j),
                    3.5,
                    2.7,
                    facecolor="#f4f7fa",
                    edgecolor="#d3dbe2",
                    linewidth=0.8,
                )
            )
    lines = (
        (BLUE, [(1, 1.2), (8, 1.2), (8, 6.8), (11.6, 6.8)], "monday"),
        (ORANGE, [(5, 7.4), (5, 3.2), (15.5, 3.2), (15.5, 7.6)], "tuesday"),
        (GREEN, [(12, 0.8), (12, 4.6), (18.4, 4.6)], "wednesday"),
    )
    for color, points, words in lines:
        x, y = zip(*points, strict=True)
        axes.plot(x, y, color=color, linewidth=3, solid_joinstyle="round", alpha=0.85)
        axes.text(x[-1] + 0.2, y[-1] + 0.45, words, size=9, color=color, weight="bold")
    for x, y in ((2.2, 1.2), (6.0, 1.2), (8, 5.2), (10.5, 3.2)):
        axes.plot(x, y, "o", color=INK, markersize=8, markeredgecolor="white")
    for x, y in ((8, 3.2), (12, 3.2), (15.5, 4.6)):
        axes.plot(x, y, "D", color="white", markersize=10, markeredgecolor=INK)
    note(axes, 3.0, 8.75, "● control", size=9)
    note(axes, 8.6, 8.75, "◇ ties where drives overlap", size=9)
    note(axes, 16.5, 8.75, "□ tiles", size=9, color=GREY)
    return figure


def cluster():
    figure, axes = sheet(23, 7.6)
    box(axes, 3.2, 5.6, "mlscorr correct\nmatching, estimate", 5.0, 1.8, WARM, ORANGE)
    box(axes, 11.0, 5.6, "scheduler\nhands out tasks", 4.6, 1.8)
    arrow(axes, (5.7, 5.6), (8.7, 5.6))
    for y in (6.6, 4.9, 3.2):
        box(axes, 19.2, y, "worker\none file or one area", 5.2, 1.3)
        arrow(axes, (13.3, 5.6), (16.6, y))
    box(
        axes,
        11.0,
        1.2,
        "shared disk or object store\nclouds, trajectories, OUT",
        9.0,
        1.7,
        "#e6f4ee",
        GREEN,
    )
    arrow(axes, (3.2, 4.7), (7.0, 2.05), dashed=True)
    arrow(axes, (19.2, 2.5), (15.5, 1.5), dashed=True)
    return figure


def object_store():
    figure, axes = sheet(22, 6.4)
    axes.add_patch(
        FancyBboxPatch(
            (0.5, 0.6),
            7.4,
            5.2,
            boxstyle="round,pad=0,rounding_size=0.3",
            facecolor=WARM,
            edgecolor=ORANGE,
        )
    )
    note(axes, 4.2, 5.2, "s3://city", weight="bold", size=11)
    for i, name in enumerate(("project.toml", "monday/*.laz", "monday/sbet.out", "corrected/")):
        note(axes, 1.2, 4.2 - 0.95 * i, name, ha="left", family="monospace", size=9.5)
    box(axes, 17.6, 3.2, "any machine\ntemporary folder:\none cloud per worker", 6.4, 2.4)
    arrow(axes, (7.9, 4.3), (14.4, 3.9), BLUE, "ranges of 64 KiB to 1 MiB")
    arrow(axes, (14.4, 2.4), (7.9, 1.7), GREEN)
    note(axes, 11.2, 1.3, "complete files only", color=GREEN)
    return figure


def control_list():
    figure, axes = sheet(24, 6.6)
    cells = (
        ("Punkt", "Rechtswert", "Hochwert", "Höhe", "Art", "Bemerkung"),
        ("P1", "532009,265", "3373993,638", "42,398", "Scheibe 0,6", ""),
        ("P2", "532010,182", "3373984,026", "43,882", "Tafel 0,6", "Kontr."),
    )
    meanings = ("name", "easting", "northing", "height", "kind, size", "role")
    for j in range(6):
        x = 0.6 + 3.85 * j
        for i, row in enumerate(cells):
            axes.add_patch(
                Rectangle(
                    (x, 3.9 - 0.95 * i),
                    3.85,
                    0.95,
                    facecolor=PALE if i == 0 else "white",
                    edgecolor="#b9c5cf",
                    linewidth=0.8,
                )
            )
            note(axes, x + 1.92, 4.37 - 0.95 * i, row[j], size=9, family="monospace")
        arrow(axes, (x + 1.92, 1.9), (x + 1.92, 1.2), GREEN)
        note(axes, x + 1.92, 0.75, meanings[j], color=GREEN, size=9.5, weight="bold")
    note(
        axes,
        12,
        5.7,
        "Scheibe 0,6 = circle 0.6 · Tafel 0,6 = square 0.6 · Kontr. = check",
        color=ORANGE,
        size=9,
    )
    return figure


def clouds():
    figure, axes = sheet(22, 6.4)
    for y, words, out in (
        (5.2, "LAS, LAZ", "LAS, LAZ"),
        (3.2, "COPC", "COPC, new octree"),
        (1.2, "E57, PLY", "LAZ"),
    ):
        box(axes, 3.0, y, words, 4.8, 1.3, WARM, ORANGE)
        box(axes, 18.8, y, out, 5.4, 1.3, "#e6f4ee", GREEN)
        arrow(axes, (5.4, y), (8.4, 3.2 + 0.35 * (y - 3.2)))
        arrow(axes, (13.6, 3.2 + 0.35 * (y - 3.2)), (16.1, y))
    box(
        axes,
        11.0,
        3.2,
        "corrected by gps_time\nsame points, same order,\nother fields unchanged",
        5.2,
        2.6,
    )
    return figure


def ground_scale():
    figure, axes = sheet(22, 6.6)
    x = np.linspace(2, 20, 5)
    axes.plot([1, 21], [4.6, 4.6], color=BLUE, linewidth=2)
    axes.plot([1, 21], [2.0, 2.0], color=ORANGE, linewidth=2)
    for at in x:
        far = 11 + (at - 11) * 1.07
        axes.plot(at, 4.6, "o", color=BLUE, markersize=8)
        axes.plot(far, 2.0, "o", color=ORANGE, markersize=8)
        if at != 11:
            arrow(axes, (at, 4.3), (far, 2.35), GREY)
    note(axes, 11, 5.5, "points on the map (UTM: up to -0.4 mm per m)", color=BLUE, size=9)
    note(
        axes,
        11,
        1.0,
        "the same points in ground distances: 40 mm per 100 m longer at worst",
        color=ORANGE,
        size=9,
    )
    return figure


def own_simulator():
    figure, axes = sheet(24, 6.8)
    box(axes, 3.4, 3.4, "survey\nrecorded clouds", 5.2, 1.8, WARM, ORANGE)
    box(axes, 12.4, 5.4, "your simulator: run-1\nsame trajectory and targets", 7.4, 1.8)
    box(axes, 12.4, 1.4, "your simulator: run-2\nafter your change", 7.4, 1.8)
    box(axes, 21.0, 3.4, "gap\ncause, closure", 4.6, 1.8, "#e6f4ee", GREEN)
    arrow(axes, (6.0, 3.9), (8.7, 5.2))
    arrow(axes, (6.0, 2.9), (8.7, 1.6))
    arrow(axes, (16.1, 5.2), (18.7, 3.9))
    arrow(axes, (16.1, 1.6), (18.7, 2.9), dashed=True)
    arrow(axes, (6.0, 3.4), (18.7, 3.4))
    return figure


def blind():
    figure, axes = sheet(24, 6.6)
    box(axes, 3.4, 3.9, "make\nsurveys with errors", 5.4, 1.8)
    box(axes, 12.0, 3.9, "run\ndiagnose each folder", 5.4, 1.8)
    box(axes, 20.6, 3.9, "score\ncompare with labels", 5.4, 1.8)
    arrow(axes, (6.1, 3.9), (9.3, 3.9), words="surveys only")
    arrow(axes, (14.7, 3.9), (17.9, 3.9), words="answers")
    box(axes, 3.4, 1.0, "key.json\nlabels, sealed by SHA-256", 6.0, 1.5, WARM, ORANGE)
    arrow(axes, (3.4, 3.0), (3.4, 1.75), ORANGE)
    arrow(axes, (6.4, 1.0), (20.6, 3.0), ORANGE, dashed=True)
    note(axes, 12.6, 1.3, "opened only here", color=ORANGE)
    return figure


def atomic():
    figure, axes = sheet(23, 5.2)
    box(
        axes,
        3.4,
        3.0,
        "hidden folder\nfiles are written, synced,\nread again and counted",
        6.0,
        2.6,
        "#ffffff",
        GREY,
    )
    box(axes, 18.6, 4.0, "OUT\ncomplete", 5.0, 1.6, "#e6f4ee", GREEN)
    box(axes, 18.6, 1.4, "nothing\nthe next run cleans up", 6.2, 1.6, WARM, ORANGE)
    arrow(axes, (6.4, 3.3), (16.1, 4.0), GREEN, "rename, when all is complete")
    arrow(axes, (6.4, 2.6), (15.5, 1.5), ORANGE)
    note(axes, 10.6, 1.35, "kill, full disk, Ctrl-C", color=ORANGE)
    return figure


DIAGRAMS = {
    one.__name__: one
    for one in (
        *(commands, folder, install, workflow, stages, frames, north, two_scanners, overlap, city),
        *(cluster, object_store, control_list, clouds, ground_scale, own_simulator, blind, atomic),
    )
}


def main():
    picture = parse().picture
    figure = DIAGRAMS[picture.stem]()
    figure.savefig(picture, dpi=130)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "commands.png")
    arguments = parser.parse_args()
    if arguments.picture.stem not in DIAGRAMS:
        parser.error(f"{arguments.picture.stem}: none of {', '.join(DIAGRAMS)}")
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()
