"""Views of a cloud: whole survey, section of a wall, and close-up of a target."""

from collections.abc import Iterator

import numpy as np

from mlscorr.estimate import TieResiduals
from mlscorr.evaluate import TargetRow
from mlscorr.report.render._scout import Scouted
from mlscorr.report.render.section import find_place
from mlscorr.report.render.view import Mark, PictureOptions, View
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import nice
from mlscorr.survey import ControlPoints, Trajectory
from mlscorr.wording import counted, length_in_words

VIEWS = ("overview", "targets", "section")


def overview(scouted: Scouted, rows: list[TargetRow], options: PictureOptions) -> View:
    """Make the view of the whole survey with the misclosures as enlarged arrows.

    Parameters
    ----------
    scouted : Scouted
    rows : list of TargetRow
        Observed targets.
    options : PictureOptions
    """
    step = -(-len(scouted.before) // SETTINGS.framing_points)
    xyz = scouted.before.xyz[::step]
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
    is_long = across > 1.8 * up  # so that both pictures fit in a stack
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
    """Azimuth at which a street of points (n, 2) runs from left to right, north up."""
    east, north = np.linalg.eigh(np.cov((plan - plan[0]).T))[1][:, 1]
    azimuth = np.degrees(np.arctan2(east, north)) - 90.0
    return float(np.round((azimuth + 90.0) % 180.0 - 90.0))  # whole degrees, in [-90, 90]


def _overview_title(rows):
    """Title with the accuracy at independent targets; without numbers for a mere fit."""
    if any(row.role == "check" for row in rows):
        role = "check"
    else:
        role = "control"
    rows = [row for row in rows if row.role == role]
    if not rows:
        return "The whole survey; no target was found"
    left_out = [row for row in rows if np.isfinite(row.left_out).all()]
    if role == "control" and left_out:
        rows = left_out
    points = len({row.name for row in rows})
    if points == len(rows):
        often = ""
    else:
        often = f", {len(rows)} observations"
    start = f"3D RMSE at {counted(points, f'{role} point')}{often}: {_rmse(rows, 'before')} before"
    if role == "check":
        return f"{start}, {_rmse(rows, 'after')} after the correction"
    if left_out:
        return f"{start}, {_rmse(rows, 'left_out')} leave-one-out"
    them = "they were"
    if points == 1:
        them = "it was"
    return f"{start}; {them} used for the correction"


def _rmse(rows, state):
    """3D RMSE of misclosures in words."""
    squares = [np.sum(getattr(row, state) ** 2) for row in rows]
    return length_in_words(np.sqrt(np.mean(squares)))


def _symbols(rows, state, times) -> Iterator[Mark]:
    """Yield arrows first, then a symbol for each target over them."""
    for row in rows:
        arrow = [row.surveyed, row.surveyed + times * getattr(row, state)]
        yield Mark("residual", np.stack(arrow), f"{times:,.0f}")
    yield from (Mark(row.group, row.surveyed[None], row.name) for row in rows)


def section(
    scouted: Scouted, options: PictureOptions, ties: TieResiduals | None = None
) -> View | None:
    """Make a section of the wall with the largest visible correction; None without a wall.

    Parameters
    ----------
    scouted : Scouted
    options : PictureOptions
    ties : TieResiduals, optional
        Walls in overlaps have priority.
    """
    place = find_place(scouted, ties)
    if place is None:
        return None
    across = place.normal
    half = abs(place.shift @ across) + 4 * place.moved  # space next to the misclosure
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
        title = (
            f"Cross-section of a wall scanned {often}: {before} apart before, {after} after the "
            "correction"
        )
    else:
        moved = length_in_words(place.moved)
        title = f"Cross-section of a wall: moved {moved} by the correction"
    half_slab = float(np.clip(half / 5, 0.25, 0.5))  # m: enough points, and little of a curve
    east, north = place.focus[:2]
    return View(
        "section",
        title,
        f"At {east:.0f} E, {north:.0f} N. The same points on both sides: {2 * half_slab:.1f} m "
        "of the wall, seen end-on.",
        options.camera(focus, azimuth, 0.0, scale),
        options.colour or ("visit" if place.splits else "state"),
        half_depth=half_slab,
        is_cut=True,
        splits=place.splits,
        visits=_visits(place),
    )


def _visits(place):
    """Names of the visits of a position: their passes, or their order."""
    if place.passes:
        return tuple(f"scanned in pass {number}" for number in place.passes)
    if len(place.splits) < 2:
        return View.visits
    return tuple(f"scan {k + 1} of this place" for k in range(len(place.splits) + 1))


def target_view(
    rows: list[TargetRow],
    normal: np.ndarray,
    points: ControlPoints,
    trajectory: Trajectory,
    options: PictureOptions,
) -> View:
    """Make a close-up of a target, with its misclosure visible at full length.

    Parameters
    ----------
    rows : list of TargetRow
        Rows of this target, one for each pass.
    normal : (3,) array
        Normal of the target, with either sign; NaN if unknown.
    points : ControlPoints
        Points including the target.
    trajectory : Trajectory
    options : PictureOptions
    """
    row = max(rows, key=lambda row: np.linalg.norm(row.before))  # the worst pass
    k = points.name.index(row.name)
    kind = points.kind[k]
    size = points.size[k]
    facing = _facing(normal, trajectory.at(row.gps_time).position[0] - row.observed)
    eye = _direction(facing, row.before)
    elevation = np.degrees(np.arcsin(eye[2]))
    if elevation > 89.0:
        azimuth = 0.0
    else:
        azimuth = np.degrees(np.arctan2(-eye[0], -eye[1]))
    half = np.linalg.norm(row.before) / 2 + 1.1 * size
    outline = Mark("surveyed", row.surveyed + _outline(kind, size, facing))
    before, after = (
        tuple(
            Mark("offset", np.stack([row.surveyed - getattr(r, state), row.surveyed])) for r in rows
        )
        for state in ("before", "after")
    )
    middle = (row.surveyed + row.observed) / 2
    return View(
        f"target-{row.name}",
        _target_title(rows),
        f"{kind.capitalize()} of {size:g} m.",
        options.camera(middle, azimuth, elevation, min(options.size) / 2 / half),
        options.colour or "intensity",
        half_depth=2 * half,
        marks=((outline, *before), (outline, *after)),
    )


def _target_title(rows):
    """Title with the error of the target before and after, the largest of several passes."""
    before, after = (
        max(np.linalg.norm(getattr(row, state)) for row in rows) for state in ("before", "after")
    )
    group = rows[0].group
    role = "not used" if group == "unused" else f"{group} point"
    often = f" in {len(rows)} passes" if len(rows) > 1 else ""
    if group == "control":
        made = " (used for the correction)"
    else:
        made = ""
    at_most = " at most" if len(rows) > 1 else ""
    were = length_in_words(before)
    are = length_in_words(after)
    return f"{rows[0].name}, {role}{often}: misclosure{at_most} {were} before, {are} after{made}"


def _facing(normal, to_vehicle):
    """Scanned side of a target: its unit normal toward the vehicle."""
    if not np.isfinite(normal).all():
        return to_vehicle / np.linalg.norm(to_vehicle)
    if normal @ to_vehicle >= 0:
        return normal
    return -normal


def _direction(facing, misclosure):
    """Viewing direction: perpendicular to the misclosure, and as frontal as possible."""
    length = np.linalg.norm(misclosure)
    if length < SETTINGS.visible:
        return facing
    along = misclosure / length
    across = facing - (facing @ along) * along
    if np.linalg.norm(across) < 1e-3:  # the target moves directly toward the eye
        if abs(facing[2]) > 0.7:
            across = np.array([0.0, -1.0, 0.0])
        else:
            across = np.array([0.0, 0.0, 1.0])
        across = across - (across @ facing) * facing
    across /= np.linalg.norm(across)
    angle = min(np.arccos(np.clip(facing @ across, -1, 1)), np.radians(SETTINGS.sideways_angle))
    turned = across - (across @ facing) * facing
    if np.linalg.norm(turned) > 1e-9:
        turned /= np.linalg.norm(turned)
    direction = np.cos(angle) * facing + np.sin(angle) * turned
    direction[2] = max(direction[2], 0.0)  # not from below the road
    return direction / np.linalg.norm(direction)


def _outline(kind, size, normal):
    """Outline of a disc or an upright square about the origin: (n, 3) in m."""
    if abs(normal[2]) > 0.9:
        up = np.array([0.0, 1.0, 0.0])
    else:
        up = np.array([0.0, 0.0, 1.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    up = np.cross(normal, right)
    if kind == "square":
        corners = size / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    else:
        angle = np.linspace(0, 2 * np.pi, 96)
        corners = size / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    return corners @ np.stack([right, up])
