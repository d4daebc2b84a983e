"""Check that control and trajectory are close to each other."""

import warnings
from itertools import permutations
from pathlib import Path

import numpy as np

from mlscorr.io.settings import SETTINGS
from mlscorr.survey import AXES, SEARCH_RADIUS, ControlPoints, Trajectory

FOOT = 0.3048  # m; the US survey foot is longer by 2 ppm


def check_together(path: Path, points: ControlPoints, trajectory: Trajectory) -> None:
    """Refuse control kilometers away from the trajectory, with coordinates as given or swapped.

    Parameters
    ----------
    path : Path
        Path of the control, for messages.
    points : ControlPoints
    trajectory : Trajectory

    Raises
    ------
    ValueError
        Names the swapped columns, or the distance.

    Warns
    -----
    UserWarning
        If heights seem to be in feet.
    """
    distance = distance_of(points.position[:, :2], trajectory)
    if distance > SETTINGS.near:
        _check_order(path, points.position, trajectory, distance)
    if distance > SETTINGS.far:
        raise ValueError(
            f"The nearest control point is {distance / 1e3:.1f} km from the trajectory (limit "
            f"{SETTINGS.far / 1e3:.0f} km): {path} and the trajectory may be in different CRS or "
            "zones. Transform both to the crs of "
            f"survey.toml.{_likely_change(points.position[:, :2], trajectory)}"
        )
    if owner := _heights_in_feet(path, points.position, trajectory):
        warnings.warn(
            f"The heights of {owner} may be in feet: control and trajectory agree only if they "
            f"are multiplied by {FOOT}. Convert them to m, or both to one height system.",
            stacklevel=2,
        )


def _check_order(path, position, trajectory, distance):
    """Refuse columns that are near the trajectory if they are swapped."""
    usual = (1, 0, 2)
    for order in (usual, *permutations(range(3))):
        swapped = distance_of(position[:, order[:2]], trajectory)
        if swapped >= SETTINGS.near:
            continue
        under = [f"{AXES[i]} in {AXES[column]}" for i, column in enumerate(order)]
        what = f"Columns ({', '.join(under)})"
        columns = "columns"
        if order == usual:
            what = "Easting and northing"
            columns = "two columns"
        raise ValueError(
            f"{what} seem to be swapped in {path}: its nearest point is {distance / 1e3:.0f} km "
            f"from the trajectory, and {swapped:.0f} m when they are exchanged. Exchange the "
            f"{columns}, or set them under [control.columns] in survey.toml."
        )


def _heights_in_feet(path, position, trajectory):
    """Source of heights that match the others as feet but not as given, otherwise empty."""
    distance, epoch = nearest_epochs(position[:, :2], trajectory)
    near = distance < SETTINGS.near
    up = position[near, 2]
    driven = trajectory.position[epoch[near], 2]
    if not near.any() or (height_difference := abs(np.median(up - driven))) < SEARCH_RADIUS:
        return ""
    feet = {path: up * FOOT - driven, "the trajectory": up - driven * FOOT}
    owners = (
        owner for owner, high in feet.items() if abs(np.median(high)) < FOOT * height_difference
    )
    return next(owners, "")


def _likely_change(position, trajectory):
    """Sentence on a change that moves points (n, 2) near the trajectory; empty without one."""
    # Zone numbers precede six digits
    zone = round(float(np.median(position[:, 0] - trajectory.position[0, 0])) / 1e6)
    owners = ("these points", "the trajectory")
    number = f"the zone number {abs(zone)} removed from the eastings of {owners[zone < 0]}"
    feet = f"multiply the coordinates by {FOOT} (by 1200/3937 for US survey feet)"
    for what, factor, offset, remedy in (
        (number, 1.0, zone * 1e6, f"they are {abs(zone)} 000 000 m too large"),
        (f"{owners[0]} taken as feet", FOOT, 0.0, feet),
        (f"{owners[1]} taken as feet", 1 / FOOT, 0.0, feet),
    ):
        distance = distance_of(position * factor - [offset, 0], trajectory) * min(1.0, 1.0 / factor)
        if distance < SETTINGS.near:
            return f" With {what}, the distance is {distance:.0f} m: {remedy}."
    return ""


def far_cloud(name: str, box: np.ndarray, trajectory: Trajectory) -> tuple[str, bool]:
    """Sentence on a cloud far from the trajectory, and flag if it explains the cause.

    Parameters
    ----------
    name : str
        Name of the cloud.
    box : (2, 2) array
        Lowest and highest easting and northing from its header. Units: m.
    trajectory : Trajectory

    Returns
    -------
    sentence : str
        Empty if the cloud is near.
    is_explained : bool
    """
    separation = _box_distance(box, trajectory)
    if separation < SETTINGS.near:
        return "", False
    sentence = f"{name} is {separation / 1e3:.1f} km from the trajectory, by its header"
    for change, other in (
        ("its coordinates taken as feet", box * FOOT),
        ("easting and northing exchanged", box[:, ::-1]),
    ):
        if _box_distance(other, trajectory) < SETTINGS.near:
            return f"{sentence}, but near it with {change}. Transform both to one CRS.", True
    return f"{sentence}. It may be in another CRS, or belong to another survey.", False


def _box_distance(box, trajectory):
    """Smallest horizontal distance of a box from the trajectory's epochs. Units: m."""
    place = trajectory.position[:, :2]
    outside = np.maximum(np.maximum(box[0] - place, place - box[1]), 0.0)
    return float(np.hypot(*outside.T).min())


def distance_of(position: np.ndarray, trajectory: Trajectory) -> float:
    """Smallest horizontal distance of points from the trajectory's epochs. Units: m.

    Parameters
    ----------
    position : (n, 2) array
        Easting and northing. Units: m.
    trajectory : Trajectory
    """
    return nearest_epochs(position, trajectory)[0].min()


def nearest_epochs(position: np.ndarray, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Horizontal distance (n,) of points from the nearest epochs in m, and these epochs (n,).

    Parameters
    ----------
    position : (n, 2) array
        Easting and northing. Units: m.
    trajectory : Trajectory

    Returns
    -------
    distance : (n,) array
    epoch : (n,) int array
    """
    from scipy.spatial import cKDTree

    return cKDTree(trajectory.position[:, :2]).query(position)
