"""Projected CRS of the survey, and conversion of geographic positions to it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import lru_cache

import numpy as np
from pyproj import CRS, Proj, Transformer
from pyproj.exceptions import CRSError, ProjError


def check_crs(crs: str) -> CRS:
    """Return the given CRS, which must be projected, in meters and with axes east and north.

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
            f"crs {crs_name(crs)} is a {crs.type_name}, but a projected CRS is needed, such as "
            "the UTM zone of the survey."
        )
    for axis in axes:
        if axis.unit_name != "metre":
            raise ValueError(
                f"crs {crs_name(crs)} has its {axis.name} in {axis.unit_name}, not in meters. "
                "Transform clouds, trajectory and control to a CRS in meters."
            )
    if {axis.direction for axis in axes} - {"up"} != {"east", "north"}:
        raise ValueError(
            f"crs {crs_name(crs)} has the axes {', '.join(axis.direction for axis in axes)}; "
            "axes must point east and north, and up if there is a height."
        )
    return crs


@dataclass(frozen=True)
class MapFactors:
    """Difference between map and ground at a position.

    Parameters
    ----------
    projection : float
        Scale of the map relative to the ellipsoid.
    height : float
        Scale of the ellipsoid relative to the ground, R / (R + h); one if the CRS has no heights.
    convergence : float
        Direction of grid north, clockwise from true north. Units: rad.
    """

    projection: float
    height: float
    convergence: float

    @property
    def combined(self) -> float:
        """Scale of the map relative to the ground."""
        return self.projection * self.height

    def document(self) -> dict[str, float]:
        """Return ``projection``, ``height``, ``combined`` and ``convergence`` (deg)."""
        angle = {"convergence": float(np.degrees(self.convergence))}
        return asdict(self) | {"combined": self.combined} | angle

    def __str__(self) -> str:
        """Factors in words."""
        words = f"scale factor of the projection {self.projection:.6f}"
        if self.height != 1:
            words += f", height factor {self.height:.6f}"
        return words


def map_factors(crs: str, place: np.ndarray) -> MapFactors:
    """Compute the factors between ground and map at a position.

    R is the mean radius of the ellipsoid there, sqrt(M N) = a sqrt(1 - e^2) / (1 - e^2 sin^2 phi)
    (Gauss). The height is used as given; a height above the geoid instead of the ellipsoid changes
    the factor by at most 1.6e-5. The scale is the root of the areal scale, which is valid for any
    direction if the projection is conformal.

    Parameters
    ----------
    crs : str
        See check_crs.
    place : (3,) array
        E, N, H. Units: m.

    >>> str(map_factors("EPSG:32650", np.array([500000.0, 3374000.0, 42.0])))
    'scale factor of the projection 0.999600'
    """
    projected = check_crs(crs)
    plane = map_of(projected)
    east, north, height = place
    longitude, latitude = plane(east, north, inverse=True)
    factors = plane.get_factors(longitude, latitude)
    projection = float(np.sqrt(factors.areal_scale))
    convergence = float(np.radians(factors.meridian_convergence))
    if len(projected.axis_info) < 3:
        return MapFactors(projection, 1.0, convergence)
    ellipsoid = projected.ellipsoid
    ratio = (ellipsoid.semi_minor_metre / ellipsoid.semi_major_metre) ** 2  # 1 - e^2
    flattened = 1 - (1 - ratio) * np.sin(np.radians(latitude)) ** 2
    radius = ellipsoid.semi_major_metre * np.sqrt(ratio) / flattened
    return MapFactors(projection, float(radius / (radius + height)), convergence)


@lru_cache
def _parse_crs(crs):
    try:
        return CRS.from_user_input(crs)
    except CRSError:
        raise ValueError(f"crs '{crs}' is unknown; give it as \"EPSG:32650\".") from None


def crs_name(crs: CRS) -> str:
    """Name of a CRS in words, with its code if it has one.

    Parameters
    ----------
    crs : pyproj.CRS
    """
    code = crs_code(crs)
    if code:
        return f"{code} ({crs.name})"
    return crs.name


def crs_code(crs: CRS) -> str | None:
    """Code of a CRS as in survey.toml, None without one.

    Parameters
    ----------
    crs : pyproj.CRS
    """
    parts = crs.sub_crs_list if crs.is_compound else [crs]
    codes = [part.to_authority(min_confidence=70) for part in parts]
    if codes[0] is None or None in codes:
        return None
    return f"{codes[0][0]}:" + "+".join(code for _, code in codes)


def _by_greenwich(crs):
    """The given CRS with longitudes from Greenwich, as in trajectories."""
    crs = check_crs(crs)
    if crs.prime_meridian.longitude != 0:
        raise ValueError(
            f"{crs_name(crs)} counts longitudes from {crs.prime_meridian.name}. Give latitudes, "
            "longitudes and true headings with a CRS that counts from Greenwich."
        )
    return crs


def project(crs: str, record: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Project geographic positions to map coordinates and meridian convergence.

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
        If a position is outside a grid or the CRS.
    """
    crs = _by_greenwich(crs)
    longitude = np.degrees(record["longitude"])
    latitude = np.degrees(record["latitude"])
    try:
        easting, northing, height = _exact(crs.geodetic_crs.to_3d(), crs).transform(
            longitude, latitude, record["height"], errcheck=True
        )
        factors = map_of(crs).get_factors(longitude, latitude, errcheck=True)
    except ProjError as error:
        raise ValueError(
            f"the trajectory can't be transformed to {crs_name(crs)}: {error} A geoid grid may "
            "be missing (projsync --file NAME installs it); a horizontal CRS alone keeps "
            "ellipsoidal heights."
        ) from None
    position = np.column_stack([easting, northing, height])
    outside = ~np.isfinite(position).all(axis=1)
    if outside.any():
        raise ValueError(
            f"{outside.sum()} of {len(outside)} positions are outside {crs_name(crs)} (first: "
            f"{latitude[outside][0]:.4f}, {longitude[outside][0]:.4f} deg)."
        )
    return position, np.radians(factors.meridian_convergence)


def convergence_at(crs: str, easting: np.ndarray, northing: np.ndarray) -> np.ndarray:
    """Meridian convergence (n,) at map positions. Units: rad.

    Parameters
    ----------
    crs : str
        See check_crs.
    easting, northing : (n,) array
        Units: m.
    """
    plane = map_of(_by_greenwich(crs))
    return np.radians(
        plane.get_factors(*plane(easting, northing, inverse=True)).meridian_convergence
    )


def to_geographic(crs: str, position: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Convert map positions to latitude, longitude, ellipsoidal height, and convergence.

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
        If a grid is missing, or a position is outside the CRS.
    """
    projected = _by_greenwich(crs)
    try:
        transformer = _exact(projected, projected.geodetic_crs.to_3d())
        easting, northing, height = position.T
        longitude, latitude, height = transformer.transform(
            easting, northing, height, errcheck=True
        )
    except ProjError as error:
        raise ValueError(f"{crs} can't be transformed to latitude and longitude: {error}") from None
    place = {"latitude": np.radians(latitude), "longitude": np.radians(longitude)}
    return place | {"height": height}, convergence_at(crs, *position[:, :2].T)


def _exact(source, target):
    """Transformation between two CRS with the required grids, or none."""
    return Transformer.from_crs(
        source, target, always_xy=True, only_best=True, allow_ballpark=False
    )


def map_of(crs: CRS) -> Proj:
    """Horizontal part of a projected CRS.

    Parameters
    ----------
    crs : pyproj.CRS
    """
    if crs.is_compound:
        return Proj(crs.sub_crs_list[0])
    return Proj(crs)
