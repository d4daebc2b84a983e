"""Writing points as LAS or LAZ 1.4, format 6, with GPS week seconds."""

import os
from datetime import date
from pathlib import Path

import numpy as np

SCAN_ANGLE_UNIT = 0.006  # deg, LAS 1.4 specification, formats 6 to 10
INTEGER_LIMIT = 2**31 - 1


def write_cloud(path, cloud, scan_angle=None, crs=None, scale=0.001, created=None, chunk=500_000):
    """Write a cloud as one LAS or LAZ file, whole or not at all.

    Parameters
    ----------
    path : path ending in ``.las`` or ``.laz``
    cloud : PointCloud
        xyz (n, 3) in m, gps_time (n,) in s of the GPS week, intensity (n,) from 0 to 65535.
    scan_angle : (n,) array, optional
        From -180 to 180. Units: deg.
    crs : str, optional
        What pyproj understands, such as ``EPSG:32650``; written as WKT.
    scale : float
        Resolution of the stored coordinates. Units: m.
    created : date, optional
        Date in the header, today if not given.
    chunk : int
        Points held as records at a time.

    Raises ValueError where a coordinate is not a number or does not fit the scale.
    """
    path = Path(path)
    header = _header(cloud.xyz, crs, scale, created)
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "wb") as stream:
            _write_chunks(stream, path.suffix.lower() == ".laz", header, cloud, scan_angle, chunk)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _header(xyz, crs, scale, created):
    """LAS header whose offset is the cloud's lower corner in whole metres."""
    import laspy

    bad = int((~np.isfinite(xyz)).any(axis=1).sum())
    if bad or not len(xyz):
        raise ValueError(f"{bad} of {len(xyz)} points have a coordinate that is not a number.")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, scale)
    header.offsets = np.floor(xyz.min(axis=0))
    extent = float((xyz.max(axis=0) - header.offsets).max())
    if extent / scale > INTEGER_LIMIT:
        raise ValueError(
            f"The cloud extends {extent:.0f} m; at a scale of {scale} m a LAS file holds "
            f"{INTEGER_LIMIT * scale:.0f} m. Choose a coarser scale."
        )
    header.generating_software = "mlscorr"
    header.creation_date = created or date.today()
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.WEEK_TIME
    if crs is not None:
        import pyproj

        wkt = pyproj.CRS.from_user_input(crs).to_wkt("WKT1_GDAL")  # LAS 1.4 asks for WKT 1
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
        header.global_encoding.wkt = True
    return header


def _write_chunks(stream, compress, header, cloud, scan_angle, chunk):
    """Stream the points to an open file, one return to a pulse, and wait for the disk."""
    import laspy

    with laspy.open(stream, mode="w", header=header, do_compress=compress, closefd=False) as writer:
        for start in range(0, len(cloud), chunk):
            rows = slice(start, start + chunk)
            xyz = cloud.xyz[rows]
            record = laspy.ScaleAwarePointRecord.zeros(len(xyz), header=header)
            record.x, record.y, record.z = xyz.T
            record.gps_time = cloud.gps_time[rows]
            record.intensity = cloud.intensity[rows]
            record.return_number[:] = 1
            record.number_of_returns[:] = 1
            if scan_angle is not None:
                record.scan_angle = np.rint(scan_angle[rows] / SCAN_ANGLE_UNIT).astype(np.int16)
            writer.write_points(record)
    stream.flush()
    os.fsync(stream.fileno())
