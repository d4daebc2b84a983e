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
            f"The trajectory (E {east:.0f}, N {north:.0f} m) lies nowhere on the map of "
            f"{crs_name(crs)}. Does a zone's number stand in front of its eastings? "
            "Take it off clouds, trajectory and control, or give the crs that has it: EPSG:4647."
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
        f"The trajectory (E {east:.0f}, N {north:.0f} m) lies at longitude {longitude:.2f}, "
        f"latitude {latitude:.2f} deg by {crs_name(crs)}, which was made for "
        f"{area.west:g} to {area.east:g} and {area.south:g} to {area.north:g} deg: crs in "
        "survey.toml may be of another zone, or easting and northing exchanged.",
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
            f"A metre on the ground is {scale:.3f} m on the map of {crs_name(crs)} "
            "at the trajectory, and lever arm, ranges and target sizes are metres on the ground: "
            "bring trajectory, cloud and control into the UTM zone or a national grid.",
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
        f"The trajectory's latitude and longitude are taken as {projected.geodetic_crs.name}, "
        f"the datum of {projected.name}; nothing in an SBET says otherwise.",
        heights,
        "Headings were turned from the platform to grid north: minus wander angle, "
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
            f"The trajectory's latitudes and longitudes are taken as {crs.geodetic_crs.name}, the "
            f"datum of {crs.name}; as those of GNSS (WGS 84, ETRS89) they would lie {east:+.0f} m "
            f"east and {north:+.0f} m north of there. If they are these, export the trajectory in "
            f"{crs.name}, as a table of eastings and northings.",
            stacklevel=3,
        )
