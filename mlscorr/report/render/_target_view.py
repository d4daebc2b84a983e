"""The view of a target close up."""

import numpy as np

from mlscorr.evaluate import TargetRow
from mlscorr.report.render.view import Mark, PictureOptions, View
from mlscorr.report.settings import SETTINGS
from mlscorr.survey import ControlPoints, Trajectory
from mlscorr.wording import length_in_words


def target_view(
    rows: list[TargetRow],
    normal: np.ndarray,
    points: ControlPoints,
    trajectory: Trajectory,
    options: PictureOptions,
) -> View:
    """A target close up, turned so that its misclosure is seen at full length.

    Parameters
    ----------
    rows : list of TargetRow
        Of this target, one for each pass.
    normal : (3,) array
        Of the target, either sign; NaN where it isn't known.
    points : ControlPoints
        Among them the target.
    trajectory : Trajectory
    options : PictureOptions
    """
    row = max(rows, key=lambda row: np.linalg.norm(row.before))  # the pass that is worst off
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
    """How far off the target was and is, at most where it was seen several times."""
    before, after = (
        max(np.linalg.norm(getattr(row, state)) for row in rows) for state in ("before", "after")
    )
    group = rows[0].group
    role = "not used" if group == "unused" else f"{group} point"
    often = f" in {len(rows)} passes" if len(rows) > 1 else ""
    if group == "control":
        made = " (the correction was made with it)"
    else:
        made = ""
    at_most = " at most" if len(rows) > 1 else ""
    were = length_in_words(before)
    are = length_in_words(after)
    return f"{rows[0].name}, {role}{often}:{at_most} {were} off before, {are} after{made}"


def _facing(normal, to_vehicle):
    """The side of a target that was scanned: its unit normal towards the vehicle."""
    if not np.isfinite(normal).all():
        return to_vehicle / np.linalg.norm(to_vehicle)
    if normal @ to_vehicle >= 0:
        return normal
    return -normal


def _direction(facing, misclosure):
    """Where to look from: across the misclosure, and as near to face on as that allows."""
    length = np.linalg.norm(misclosure)
    if length < SETTINGS.visible:
        return facing
    along = misclosure / length
    across = facing - (facing @ along) * along
    if np.linalg.norm(across) < 1e-3:  # the target moves straight to the eye
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
    direction[2] = max(direction[2], 0.0)  # not from under the road
    return direction / np.linalg.norm(direction)


def _outline(kind, size, normal):
    """A disc's or an upright square's outline about the origin: (n, 3) in m."""
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
