"""The survey's projected CRS, and geographic positions brought into it."""

from __future__ import annotations

import warnings
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mlscorr.survey import Trajectory

if TYPE_CHECKING:
    from pyproj import CRS


def check_crs(crs: str) -> CRS:
    """The CRS that is meant, projected, in metres and with axes east and north.

    Parameters
    ----------
    crs : str
        Anything pyproj understands.

    Returns
    -------
    pyproj.CRS

    Raises
    ------
    ValueError
        For anything else.
    """
    crs = _parse_crs(crs)
    axes = crs.axis_info
    if not crs.is_projected:
        raise ValueError(
            f"crs {_short(crs)} ({crs.name}) is {crs.type_name}; a projected CRS is needed, "
            "such as the UTM zone of the survey."
        )
    if any(axis.unit_name != "metre" for axis in axes):
        raise ValueError(
            f"crs {_short(crs)} ({crs.name}) is in {axes[0].unit_name}, not in metres."
        )
    if {axis.direction for axis in axes[:2]} != {"east", "north"}:
        raise ValueError(
            f"crs {_short(crs)} ({crs.name}) counts {axes[0].direction} and {axes[1].direction}; "
            "axes must point east and north."
        )
    return crs


def check_area(crs: CRS, trajectory: Trajectory) -> None:
    """Warn where a trajectory lies outside the area that a CRS was made for.

    Parameters
    ----------
    crs : pyproj.CRS
    trajectory : Trajectory

    Warns
    -----
    UserWarning
    """
    from pyproj import Transformer

    to_degrees = Transformer.from_crs(crs.to_2d(), crs.geodetic_crs.to_2d(), always_xy=True)
    east, north = np.median(trajectory.position[:, :2], axis=0)
    longitude, latitude = to_degrees.transform(east, north)
    area, margin = crs.area_of_use, 1.0  # deg, by which zones are used beyond their edges
    if area is None or (
        area.west - margin <= longitude <= area.east + margin
        and area.south - margin <= latitude <= area.north + margin
    ):
        return
    warnings.warn(
        f"The trajectory (E {east:.0f}, N {north:.0f} m) lies at longitude {longitude:.2f}, "
        f"latitude {latitude:.2f} deg by {_short(crs)} ({crs.name}), which was made for "
        f"{area.west:g} to {area.east:g} and {area.south:g} to {area.north:g} deg: crs in "
        "survey.toml may be of another zone, or easting and northing exchanged.",
        stacklevel=3,
    )


def describe_projection(crs: str) -> tuple[str, str, str]:
    """Sentences on what a geographic trajectory's way into a CRS assumes.

    Parameters
    ----------
    crs : str

    Returns
    -------
    tuple of str
    """
    projected: Any = check_crs(crs)
    vertical = projected.sub_crs_list[1].name if projected.is_compound else None
    return (
        f"The trajectory's latitude and longitude are taken as {projected.geodetic_crs.name}, "
        f"the datum of {projected.name}; nothing in an SBET says otherwise.",
        f"The trajectory's ellipsoidal heights were transformed to {vertical}."
        if vertical
        else "The trajectory's ellipsoidal heights were kept.",
        "Headings were turned from the platform to grid north: minus wander angle, "
        "minus meridian convergence.",
    )


def crs_notes(crs: str | None, trajectory: Trajectory, is_sbet: bool) -> list[str]:
    """Sentences on the CRS; warns where the trajectory lies outside its area.

    Parameters
    ----------
    crs : str or None
    trajectory : Trajectory
    is_sbet : bool
        Whether its file is an SBET, with latitudes and longitudes.
    """
    if crs is None:
        return ["No CRS was given."]
    projected = check_crs(crs)
    check_area(projected, trajectory)
    notes = [f"Coordinates are in {crs} ({projected.name})."]
    return notes + list(describe_projection(crs) if is_sbet else ())


@lru_cache
def _parse_crs(crs):
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        return CRS.from_user_input(crs)
    except CRSError:
        raise ValueError(f"crs '{crs}' is unknown; give it like \"EPSG:32650\".") from None


def _short(crs):
    authority = crs.to_authority()
    return ":".join(authority) if authority else crs.to_string()


def project(crs: str, record: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Map coordinates and meridian convergence of geographic positions.

    Parameters
    ----------
    crs : str
        See check_crs.
    record : dict
        With latitude, longitude (rad) and height (m), each (n,).

    Returns
    -------
    position : (n, 3) array
        Units: m.
    convergence : (n,) array
        Units: rad.

    Raises
    ------
    ValueError
        Where a grid or the CRS does not reach.
    """
    from pyproj.exceptions import ProjError

    crs = check_crs(crs)
    longitude, latitude = np.degrees(record["longitude"]), np.degrees(record["latitude"])
    try:
        easting, northing, height = _exact(crs.geodetic_crs.to_3d(), crs).transform(
            longitude, latitude, record["height"], errcheck=True
        )
        factors = _map(crs).get_factors(longitude, latitude, errcheck=True)
    except ProjError as error:
        raise ValueError(
            f"the trajectory can't be brought into {_short(crs)} ({crs.name}): {error} "
            "A geoid grid may be missing (projsync --file NAME installs it), or give the "
            "horizontal CRS alone to keep ellipsoidal heights."
        ) from None
    position = np.column_stack([easting, northing, height])
    outside = ~np.isfinite(position).all(axis=1)
    if outside.any():
        raise ValueError(
            f"{outside.sum()} of {len(outside)} positions can't be expressed in {_short(crs)} "
            f"({crs.name}; first: {latitude[outside][0]:.4f}, {longitude[outside][0]:.4f} deg)."
        )
    return position, np.radians(factors.meridian_convergence)


def convergence_at(crs: str, easting: np.ndarray, northing: np.ndarray) -> np.ndarray:
    """Meridian convergence (n,) at places on the map. Units: rad.

    Parameters
    ----------
    crs : str
        See check_crs.
    easting, northing : (n,) array
        Units: m.
    """
    plane = _map(check_crs(crs))
    return np.radians(
        plane.get_factors(*plane(easting, northing, inverse=True)).meridian_convergence
    )


def to_geographic(crs: str, position: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Latitude, longitude and ellipsoidal height of places on the map, and their convergence.

    Parameters
    ----------
    crs : str
        See check_crs.
    position : (n, 3) array
        Units: m.

    Returns
    -------
    place : dict
        latitude, longitude (rad) and height (m), each (n,).
    convergence : (n,) array
        Units: rad.

    Raises
    ------
    ValueError
        Where a grid is missing, or the CRS does not reach.
    """
    from pyproj.exceptions import ProjError

    projected = check_crs(crs)
    try:
        transformer = _exact(projected, projected.geodetic_crs.to_3d())
        easting, northing, height = position.T
        longitude, latitude, height = transformer.transform(
            easting, northing, height, errcheck=True
        )
    except ProjError as error:
        raise ValueError(f"{crs} can't be left for latitude and longitude: {error}") from None
    place = {"latitude": np.radians(latitude), "longitude": np.radians(longitude)}
    return place | {"height": height}, convergence_at(crs, *position[:, :2].T)


def _exact(source, target):
    """The transformation between two CRS, by the grids that it needs or not at all."""
    from pyproj import Transformer

    return Transformer.from_crs(
        source, target, always_xy=True, only_best=True, allow_ballpark=False
    )


def _map(crs):
    """The horizontal part of a projected CRS."""
    from pyproj import Proj

    return Proj(crs.sub_crs_list[0] if crs.is_compound else crs)
