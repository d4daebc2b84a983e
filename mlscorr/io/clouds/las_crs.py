"""CRS stated in the VLRs of a LAS or LAZ file, and its agreement with that of the survey."""

from __future__ import annotations

import struct
import warnings

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from mlscorr.io.clouds.las_checks import variable_records
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.settings import SETTINGS
from mlscorr.io.trajectories import crs_name

# LAS 1.4 R15, section 3
OWNER = b"LASF_Projection"
WKT = 2112
GEO_KEYS = 34735
# keys of GeoTIFF 1.1
PROJECTED = 3072
GEOGRAPHIC = 2048
VERTICAL = 4096
UNITS_OF_LENGTH = (3076, 4099)  # keys, horizontal and vertical
FEET = {9002: "feet", 9003: "US survey feet"}  # their values


def stated_crs(layout: LasLayout) -> CRS | None:
    """Return the CRS of a file's VLRs, given as WKT or as EPSG codes.

    Parameters
    ----------
    layout : LasLayout

    Returns
    -------
    pyproj.CRS or None
        None if no VLR states one, or PROJ does not know it.
    """
    words = [
        data.split(b"\0")[0].decode("utf-8", "replace")
        for data in variable_records(layout, OWNER, WKT)
    ]
    code = _code(_geo_keys(layout))
    for text in filter(None, [*words, code] if layout.states_wkt else [code, *words]):
        try:
            with warnings.catch_warnings(action="ignore"):  # codes that PROJ replaces
                return CRS.from_user_input(text)
        except CRSError:
            continue
    return None


def _geo_keys(layout):
    """Values of the GeoKeys that are codes, by key."""
    data = b"".join(layout.vlr_data(OWNER, GEO_KEYS))
    rows = struct.iter_unpack("<4H", data[8 : len(data) // 8 * 8])
    return {key: value for key, at, _, value in rows if at == 0}


def _code(keys):
    """EPSG code (with that of heights) of GeoKeys, or empty."""
    plan, heights = (
        next((keys[name] for name in names if 1024 <= keys.get(name, 0) < 32767), 0)
        for names in ((PROJECTED, GEOGRAPHIC), (VERTICAL,))
    )  # higher values are user-defined
    if plan == 0:
        return ""
    if heights:
        return f"EPSG:{plan}+{heights}"
    return f"EPSG:{plan}"


def crs_conflict(layout: LasLayout, crs: str, source: str = "crs of survey.toml") -> str:
    """Return a sentence if a file's own CRS differs from that of the survey, otherwise empty.

    The position of the file's middle counts, so two names of one CRS do not conflict.

    Parameters
    ----------
    layout : LasLayout
    crs : str
        CRS of the survey, which must be valid.
    source : str
        Its origin.
    """
    stated = stated_crs(layout)
    survey_crs = CRS.from_user_input(crs)
    if stated is None:
        return ""
    what = _other_units(layout, stated) or _other_place(layout, stated, survey_crs)
    what = what or _other_heights(stated, survey_crs)
    if not what:
        return ""
    return (
        f"The VLRs of {layout.cloud.name} state {crs_name(stated)}, {source} is "
        f"{crs_name(survey_crs)}: {what}. Set crs to that of the cloud, or transform the cloud."
    )


def _other_units(layout, stated):
    """Phrase on coordinates that are not in meters, whatever the unit of their CRS."""
    keys = {} if layout.states_wkt else _geo_keys(layout)
    units = [FEET[keys[key]] for key in UNITS_OF_LENGTH if keys.get(key) in FEET]
    units += [axis.unit_name for axis in stated.axis_info if axis.unit_name != "metre"]
    if units:
        return f"the cloud is in {units[0]}, and mlscorr needs meters"
    return ""


def _other_place(layout, stated, survey_crs):
    """Phrase on the distance between the middles of a cloud in two CRS."""
    if stated.to_2d().to_epsg() == survey_crs.to_2d().to_epsg() is not None:
        return ""
    middle = cloud_box(layout).mean(axis=0)[:2]
    try:
        transformer = Transformer.from_crs(stated.to_2d(), survey_crs.to_2d(), always_xy=True)
        distance = float(np.hypot(*np.subtract(transformer.transform(*middle), middle)))
    except ProjError:
        distance = np.inf
    if distance <= SETTINGS.same_place:
        return ""
    if distance >= 1e3:
        length = f"{distance / 1e3:.1f} km"
    else:
        length = f"{distance:.2f} m"
    if not np.isfinite(distance):
        return "the center of the cloud is outside one of them"
    return f"they place the center of the cloud {length} apart"


def _other_heights(stated, survey_crs):
    """Phrase on two systems of heights."""
    if not (stated.is_compound and survey_crs.is_compound):
        return ""
    first, second = (crs.sub_crs_list[1] for crs in (stated, survey_crs))
    if first.to_epsg():
        same = first.to_epsg() == second.to_epsg()
    else:
        same = first.name == second.name
    if same:
        return ""
    return "the height systems differ"


def cloud_box(layout: LasLayout) -> np.ndarray:
    """Corners (2, 3) of the box in a file's header, the lowest first. Units: m.

    Parameters
    ----------
    layout : LasLayout
    """
    return np.array(layout.field("6d", 179)).reshape(3, 2).T[::-1]
