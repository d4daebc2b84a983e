"""Meshes in PLY files."""

import re
from pathlib import Path

import numpy as np

HEADER = """\
ply
format binary_little_endian 1.0
element vertex {}
property double x
property double y
property double z
element face {}
property list uchar int vertex_indices
end_header
"""


def write_ply(path: str | Path, triangles: np.ndarray) -> None:
    """Write triangles as a binary PLY of doubles; corners at exactly the same place are merged.

    Parameters
    ----------
    path : path
    triangles : (n, 3, 3) array
        Corners in map coordinates. Units: m.
    """
    vertices, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, corners.reshape(-1, 3)
    with open(path, "wb") as file:
        file.write(HEADER.format(len(vertices), len(faces)).encode("ascii"))
        file.write(vertices.astype("<f8").tobytes())
        file.write(faces.tobytes())


def announced_faces(path: str | Path) -> int:
    """How many faces a PLY file announces in its header.

    Parameters
    ----------
    path : path

    Returns
    -------
    int
        Zero where there is no such header.
    """
    with open(path, "rb") as file:
        head = file.read(1 << 16).split(b"end_header")[0]
    faces = re.search(rb"^element face (\d{1,18})\s*$", head, re.MULTILINE)
    if faces:
        return int(faces[1])
    return 0
