"""The views of a whole survey, and of a wall in section."""

from collections.abc import Iterator

import numpy as np

from mlscorr.estimate import TieResiduals
from mlscorr.evaluate import TargetRow
from mlscorr.report.render._scout import Scouted
from mlscorr.report.render.section import find_place
from mlscorr.report.render.view import Mark, PictureOptions, View
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import nice
from mlscorr.wording import counted, length_in_words

VIEWS = ("overview", "targets", "section")


def overview(scouted: Scouted, rows: list[TargetRow], options: PictureOptions) -> View:
    """The whole survey with the misclosures as enlarged arrows.

    Parameters
    ----------
    scouted : Scouted
    rows : list of TargetRow
        Those observed.
    options : PictureOptions
    """
    xyz = scouted.before.xyz
    low, high = np.percentile(xyz, [0.5, 99.5], axis=0)
    focus = np.append((low + high)[:2] / 2, np.median(xyz[:, 2]))
    from_above = (high - low)[:2].min() > SETTINGS.largest_street
    azimuth, elevation = (0.0, 90.0) if from_above else (_along(xyz[:, :2]), 45.0)
    unit = options.camera(focus, azimuth, elevation, 1.0)
    inside = xyz[((xyz >= low) & (xyz <= high)).all(axis=1)]
    flat = (inside - focus) @ unit.axes[:2].T
    ends = np.stack([flat.min(axis=0), flat.max(axis=0)])
    focus = focus + ends.mean(axis=0) @ unit.axes[:2]
    across, up = np.ptp(ends, axis=0)
    is_long = across > 1.8 * up  # so that both pictures fit one above the other
    if options.wide and is_long:
        size = options.wide
    else:
        size = options.size
    scale = float(min(size[0] / across, size[1] / up) / 1.12)
    longest = max((np.linalg.norm(v) for row in rows for v in (row.before, row.after)), default=0)
    room = 0.16 * np.sqrt(size[0] * size[1]) / scale
    times = nice(room / longest) if longest > 0 else 0.0
    return View(
        "overview",
        _overview_title(rows),
        "",
        options.camera(focus, azimuth, elevation, scale, size),
        options.colour or "correction",
        marks=(tuple(_symbols(rows, "before", times)), tuple(_symbols(rows, "after", times))),
    )


def _along(plan):
    """The azimuth that lets a street of points (n, 2) run from left to right, north up."""
    east, north = np.linalg.eigh(np.cov((plan - plan[0]).T))[1][:, 1]
    azimuth = np.degrees(np.arctan2(east, north)) - 90.0
    return float(np.round((azimuth + 90.0) % 180.0 - 90.0))  # whole degrees, in [-90, 90]


def _overview_title(rows):
    """How far off the independent targets were and are; of a fit there is nothing to boast."""
    if any(row.role == "check" for row in rows):
        role = "check"
    else:
        role = "control"
    rows = [row for row in rows if row.role == role]
    if not rows:
        return "The whole survey; no target was seen"
    left_out = [row for row in rows if np.isfinite(row.left_out).all()]
    state, words = ("after", "after") if role == "check" else ("left_out", "when left out in turn")
    rows = left_out if role == "control" and left_out else rows
    were, are = (
        length_in_words(np.sqrt(np.mean([np.sum(getattr(row, name) ** 2) for row in rows])))
        for name in ("before", state)
    )
    points = len({row.name for row in rows})
    if points == len(rows):
        often = ""
    else:
        often = f", seen {len(rows)} times"
    start = f"{counted(points, f'{role} point')}{often}: {were} off before"
    if role == "control" and not left_out:
        return f"{start} (3D RMSE); the correction was made with {'it' if points == 1 else 'them'}"
    return f"{start}, {are} {words} (3D RMSE)"


def _symbols(rows, state, times) -> Iterator[Mark]:
    """Arrows first, then a symbol for each target over them."""
    for row in rows:
        arrow = [row.surveyed, row.surveyed + times * getattr(row, state)]
        yield Mark("residual", np.stack(arrow), f"{times:,.0f}")
    yield from (Mark(row.group, row.surveyed[None], row.name) for row in rows)


def section(
    scouted: Scouted, options: PictureOptions, ties: TieResiduals | None = None
) -> View | None:
    """A cut through the wall where the correction shows best; None where there is no wall.

    Parameters
    ----------
    scouted : Scouted
    options : PictureOptions
    ties : TieResiduals, optional
        Walls that passes both saw come first.
    """
    place = find_place(scouted, ties)
    if place is None:
        return None
    across = place.normal
    half = abs(place.shift @ across) + 4 * place.moved  # so much room is beside the misfit
    half = float(np.clip(half, *SETTINGS.section_half_width))
    azimuth = float(np.degrees(np.arctan2(across[1], -across[0])))  # along the wall
    scale = options.size[0] / 2 / half
    high = options.size[1] / scale  # m
    focus = place.focus - place.shift / 2
    if place.foot - place.ground < high / 2:
        base = place.ground
    else:
        base = place.foot
    focus[2] = base - place.shift[2] / 2 + 0.35 * high
    if place.splits:
        number = len(place.splits) + 1
        often = "twice" if number == 2 else f"{number} times"
        before, after = (length_in_words(value) for value in (place.before, place.after))
        title = f"Cross-section of a wall scanned {often}: {before} apart before, {after} after"
    else:
        moved = length_in_words(place.moved)
        title = f"Cross-section of a wall: the correction moves it by {moved}"
    half_slab = float(np.clip(half / 5, 0.25, 0.5))  # m: enough points, and little of a curve
    east, north = place.focus[:2]
    return View(
        "section",
        title,
        f"At {east:.0f} E, {north:.0f} N. The same points on both sides: {2 * half_slab:.1f} m of "
        "the wall, end on.",
        options.camera(focus, azimuth, 0.0, scale),
        options.colour or ("visit" if place.splits else "state"),
        half_depth=half_slab,
        is_cut=True,
        splits=place.splits,
        visits=_visits(place),
    )


def _visits(place):
    """What the visits of a place are called: by their passes, or by their order."""
    if place.passes:
        return tuple(f"scanned by pass {number}" for number in place.passes)
    if len(place.splits) < 2:
        return View.visits
    return tuple(f"scanned at visit {k + 1}" for k in range(len(place.splits) + 1))
