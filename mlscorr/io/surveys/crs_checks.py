"""Checks of a CRS against a trajectory: its area, its scale and its datum."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from pyproj import CRS, Transformer

from mlscorr.io.trajectories import check_crs, crs_name, map_of
from mlscorr.survey import Trajectory


def check_area(crs: CRS, trajectory: Trajectory) -> None:
    """Warn if a trajectory is outside the area of use of a CRS; refuse it off the map.

    Parameters
    ----------
    crs : pyproj.CRS
    trajectory : Trajectory

    Warns
    -----
    UserWarning
    """
    east, north = np.median(trajectory.position[:, :2], axis=0)
    longitude, latitude = map_of(crs)(east, north, inverse=True)
    if not np.isfinite([longitude, latitude]).all():
        raise ValueError(
            f"The trajectory (E {east:.0f}, N {north:.0f} m) is outside the map of "
            f"{crs_name(crs)}. If its eastings have a zone prefix, remove it from clouds, "
            "trajectory and control, or set the crs with that prefix: EPSG:4647."
        )
    # deg, by which zones are used beyond their edges
    area = crs.area_of_use
    margin = 1.0
    if area is None or (
        area.west - margin <= longitude <= area.east + margin
        and area.south - margin <= latitude <= area.north + margin
    ):
        return
    warnings.warn(
        f"By {crs_name(crs)}, the trajectory (E {east:.0f}, N {north:.0f} m) is at longitude "
        f"{longitude:.2f}, latitude {latitude:.2f} deg, outside its area of {area.west:g} to "
        f"{area.east:g} and {area.south:g} to {area.north:g} deg. Possibly crs in survey.toml is "
        "of another zone, or easting and northing are swapped.",
        stacklevel=3,
    )


def check_scale(crs: CRS, trajectory: Trajectory) -> None:
    """Warn if the map of a CRS is far from true to scale at a trajectory.

    Parameters
    ----------
    crs : pyproj.CRS
    trajectory : Trajectory

    Warns
    -----
    UserWarning
    """
    east, north = np.median(trajectory.position[:, :2], axis=0)
    longitude, latitude = map_of(crs)(east, north, inverse=True)
    scale = map_of(crs).get_factors(longitude, latitude).meridional_scale
    if 0.005 < abs(scale - 1) < np.inf:  # 5 mm of a lever arm of 1 m; the limit of zones near UTM's
        warnings.warn(
            f"The scale of {crs_name(crs)} at the trajectory is {scale:.3f}, but lever arm, "
            "ranges and target sizes are in meters on the ground. Transform trajectory, cloud "
            "and control to the UTM zone or a national grid.",
            stacklevel=3,
        )


def describe_projection(crs: str) -> tuple[str, str, str]:
    """Sentences on the assumptions in projecting a geographic trajectory to a CRS.

    Parameters
    ----------
    crs : str

    Returns
    -------
    tuple of str
    """
    projected: Any = check_crs(crs)
    if projected.is_compound:
        vertical = projected.sub_crs_list[1].name
        heights = f"The trajectory's ellipsoidal heights were transformed to {vertical}."
    else:
        heights = "The trajectory's ellipsoidal heights were kept."
    return (
        "The trajectory's latitudes and longitudes are assumed to be in "
        f"{projected.geodetic_crs.name}, the datum of {projected.name}; an SBET does not state "
        "its datum.",
        heights,
        "Headings were converted from platform heading to grid heading: minus wander angle, "
        "minus meridian convergence.",
    )


def crs_notes(crs: str | None, trajectory: Trajectory, is_sbet: bool) -> list[str]:
    """Sentences on the CRS; warns if the trajectory is outside its area of use.

    Parameters
    ----------
    crs : str or None
    trajectory : Trajectory
    is_sbet : bool
        True if its file is an SBET, with latitudes and longitudes.
    """
    if crs is None:
        return ["No CRS was given."]
    projected = check_crs(crs)
    check_area(projected, trajectory)
    check_scale(projected, trajectory)
    notes = [f"Coordinates are in {crs} ({projected.name})."]
    if not is_sbet:
        return notes
    _check_datum(projected, trajectory)
    return notes + list(describe_projection(crs))


def _check_datum(crs, trajectory):
    """Warn if GNSS latitudes differ from those of the CRS's own datum."""
    place = np.median(trajectory.position[:, :2], axis=0)
    to_map = Transformer.from_crs("EPSG:4326", crs.to_2d(), always_xy=True)
    east, north = to_map.transform(*map_of(crs)(*place, inverse=True)) - place
    if 5 < np.hypot(east, north) < np.inf:  # m; plates and realizations cause less
        warnings.warn(
            "The trajectory's latitudes and longitudes are assumed to be in "
            f"{crs.geodetic_crs.name}, the datum of {crs.name}. If they are GNSS coordinates "
            f"(WGS 84, ETRS89), they would be shifted by {east:+.0f} m E and {north:+.0f} m N. "
            f"In that case, export the trajectory in {crs.name}, as a table of eastings and "
            "northings.",
            stacklevel=3,
        )
