"""Targets, trajectories, misclosures and ties as Open3D lines, in the colors of the report."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from mlscorr.correction import Correction
from mlscorr.report.render import colour_table, percentiles
from mlscorr.report.style import BLUE, MARKS, VERMILLION
from mlscorr.survey import Matched, TargetObservations, Ties, Trajectory, line_geometry

CORNERS = 48  # of a circle as a polygon that looks smooth
ROUND = ("circle", "hole")  # kinds with a circular outline


def target_lines(
    observations: TargetObservations, origin: np.ndarray | None, enlarged: float
) -> Any:
    """Outlines of targets, with an ellipsoid of one sigma around each center.

    Parameters
    ----------
    observations : TargetObservations
    origin : (3,) array or None
        See ``PointCloud.to_open3d``.
    enlarged : float
        Magnification of ellipsoids.

    Returns
    -------
    open3d.t.geometry.LineSet
        Outlines blue, ellipsoids red.
    """
    loops = []
    colors = []
    for row in range(len(observations)):
        centre = observations.position[row]
        loops.append(centre + _outline(observations, row))
        colors.append(BLUE)
        values, axes = np.linalg.eigh(observations.covariance[row])
        half = enlarged * np.sqrt(np.maximum(values, 0.0)) * axes
        for first, second in ((0, 1), (1, 2), (2, 0)):
            loops.append(centre + _circle() @ np.stack([half[:, first], half[:, second]]))
            colors.append(VERMILLION)
    return _loops(loops, colors, origin)


def misclosure_lines(control: Matched, check: Matched, origin: np.ndarray | None) -> Any:
    """Lines from observed centers to surveyed positions, control black and check points red.

    Parameters
    ----------
    control, check : Matched
    origin : (3,) array or None
        See ``PointCloud.to_open3d``.
    """
    roles = control, check
    observed = [matched.observations.position for matched in roles]
    surveyed = [matched.surveyed.position for matched in roles]
    places = np.vstack([*observed, *surveyed])
    pairs = np.arange(len(places)).reshape(2, -1).T
    colors = np.array(
        [to_rgb(MARKS["control"]["color"])] * len(control)
        + [to_rgb(MARKS["check"]["color"])] * len(check)
    ).reshape(-1, 3)
    return line_geometry(places, pairs, origin, {"colors": colors})


def tie_lines(ties: Ties, origin: np.ndarray | None, enlarged: float) -> Any:
    """Lines between both views of each tie, colored by their distance.

    Parameters
    ----------
    ties : Ties
    origin : (3,) array or None
        See ``PointCloud.to_open3d``.
    enlarged : float
        Magnification of lines, about their middles.

    Returns
    -------
    open3d.t.geometry.LineSet
        With the attribute ``misclosure`` of the lines, in m.
    """
    middle = ties.place.mean(axis=1, keepdims=True)
    places = (middle + enlarged * (ties.place - middle)).reshape(-1, 3)
    pairs = np.arange(len(places)).reshape(-1, 2)
    attributes = {"misclosure": ties.misclosure}
    if len(ties):
        attributes["colors"] = _scale_colors(np.abs(ties.misclosure))
    return line_geometry(places, pairs, origin, attributes)


def correction_lines(correction: Correction, origin: np.ndarray | None, color: str) -> Any:
    """Corrected trajectory, colored by the size of the correction or by its sigma.

    Parameters
    ----------
    correction : Correction
    origin : (3,) array or None
        See ``PointCloud.to_open3d``.
    color : str
        ``correction`` or ``sigma``.

    Raises
    ------
    ValueError
        If the color is unknown, or the correction has no sigma.
    """
    corrected = correction.corrected
    if color == "correction":
        values = np.linalg.norm(corrected.position - correction.recorded.position, axis=1)
    elif color == "sigma":
        if corrected.position_sigma is None:
            raise ValueError("The corrected trajectory has no sigma. Use color='correction'.")
        values = np.linalg.norm(corrected.position_sigma, axis=1)
    else:
        raise ValueError(f"color = {color!r} must be 'correction' or 'sigma'.")
    return path_lines(corrected, origin, {color: values})


def _scale_colors(values):
    """Colors (n, 3) of values on the scale of sigmas."""
    low, high = percentiles(values)
    share = np.clip((values - low) / max(high - low, np.finfo(float).tiny), 0, 1)
    return colour_table("sigma")[np.rint(255 * share).astype(int)] / 255


def path_lines(
    trajectory: Trajectory, origin: np.ndarray | None, values: dict[str, np.ndarray]
) -> Any:
    """Trajectory as lines between epochs, broken at its gaps.

    Parameters
    ----------
    trajectory : Trajectory
    origin : (3,) array or None
        See ``PointCloud.to_open3d``.
    values : dict
        One array (n,) of the epochs by name, which colors the lines and is their attribute.
    """
    pairs = trajectory.line_pairs
    attributes = {}
    for name, of_epoch in values.items():
        of_line = of_epoch[pairs].mean(axis=1)
        attributes["colors"] = _scale_colors(of_line)
        attributes[name] = of_line
    return line_geometry(trajectory.position, pairs, origin, attributes)


def _outline(observations, row):
    """Corners (k, 3) of a target's outline, relative to its center. Units: m."""
    normal = observations.normal[row]
    up = np.array([0.0, 0.0, 1.0])
    if abs(normal @ up) > np.sqrt(0.5):
        up = np.array([0.0, 1.0, 0.0])
    across = np.cross(up, normal)
    across /= np.linalg.norm(across)
    axes = observations.size[row] / 2 * np.stack([across, np.cross(normal, across)])
    if observations.kind[row] in ROUND:
        return _circle() @ axes
    return np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) @ axes


def _circle():
    """Points (k, 2) of the unit circle."""
    angle = np.linspace(0, 2 * np.pi, CORNERS, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _loops(loops, colors, origin):
    """Closed polygons as a line set."""
    pairs = [np.empty((0, 2), int)]
    start = 0
    for loop in loops:
        number = start + np.arange(len(loop))
        pairs.append(np.column_stack([number, np.roll(number, -1)]))
        start += len(loop)
    shades = [np.tile(to_rgb(c), (len(loop), 1)) for c, loop in zip(colors, loops, strict=True)]
    points = np.concatenate([np.empty((0, 3)), *loops])
    shade = np.concatenate([np.empty((0, 3)), *shades])
    return line_geometry(points, np.concatenate(pairs), origin, {"colors": shade})
