"""TerraScan binary trajectories (.trj); see TerraScan User Guide, Trajectory file formats.

A header of HdrSize bytes, then PosCnt records of PosSize bytes, little-endian: time, X, Y, Z,
heading, roll and pitch (deg), then qualities, which are not read. TerraScan converts positions and
headings to the map on import.
"""

import struct
from pathlib import Path

import numpy as np

from mlscorr.io.store import read_bytes

MARK = b"TSCANTRJ"
VERSION = 20010715  # the only documented version
FIELDS = ("gps_time", "easting", "northing", "height", "heading", "roll", "pitch")


def read_trj(path: str | Path) -> dict[str, np.ndarray]:
    """Read the columns of a TerraScan trajectory.

    Parameters
    ----------
    path : path

    Returns
    -------
    dict
        Name of each of FIELDS to an (n,) array. Units: s, m, deg.

    Raises
    ------
    ValueError
        If the version is unknown, or the file size does not match its header.
    """
    data = read_bytes(path)
    start = struct.calcsize("<8s4i")
    mark, version, header, count, width = struct.unpack("<8s4i", data[:start].ljust(start, b"\0"))
    if mark != MARK or version != VERSION or width < 8 * len(FIELDS) or header < start or count < 1:
        raise ValueError(
            f"{path} is not a TerraScan trajectory of version {VERSION} (version {version}, "
            f"{count} records of {width} bytes). Export it as text from TerraScan."
        )
    if len(data) != header + count * width:
        raise ValueError(
            f"{path} is truncated: it has {len(data)} bytes where its header states "
            f"{header + count * width}."
        )
    record = np.dtype({"names": FIELDS, "formats": ["<f8"] * len(FIELDS), "itemsize": width})
    table = np.frombuffer(data, record, count, header)
    return {name: table[name].astype(float) for name in FIELDS}
