"""A CRS in the header of a LAS file."""

import laspy
import pyproj


def add_crs(header, crs):
    "State a CRS, if any, as WKT"
    if crs:
        wkt = pyproj.CRS.from_user_input(crs).to_wkt("WKT1_GDAL")
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
        header.global_encoding.wkt = True
