"""PLY files: clouds of points with a time, in text or binary, and meshes."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from mlscorr.io.clouds._cloud_sources import CloudSource, SourceBlock, check_precision, lacking_time
from mlscorr.io.store import shown
from mlscorr.io.tables import plain

TYPES = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")  # of properties
OLDER = ("char", "uchar", "short", "ushort", "int", "uint", "float", "double")  # their names
KINDS = {np.dtype(kind).name: kind for kind in TYPES} | dict(zip(OLDER, TYPES, strict=True))
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
AXES = ("x", "y", "z")
TIMES = ("gpstime", "time", "timestamp", "t")  # plain names, the most specific first
INTENSITIES = ("intensity", "reflectance", "amplitude")
COLOURS = (("red", "green", "blue"), ("r", "g", "b"))
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


def open_ply(path: Path) -> CloudSource:
    """Open a cloud in a PLY file by its header.

    Parameters
    ----------
    path : Path

    Returns
    -------
    CloudSource

    Raises
    ------
    ValueError
        If the file is damaged, not a PLY, or without coordinates or times.
    """
    vertices = _header(path)
    names = vertices.kind.names
    time = vertices.first(TIMES)
    intensity = vertices.first(INTENSITIES)
    if time is None:
        raise lacking_time(path, names, "", "gps_time (double)")
    used = {*map(vertices.names.get, AXES), time, intensity, *vertices.colours}
    limit = 255.0
    if vertices.colours:
        colour = vertices.kind[vertices.colours[0]]
        limit = float(np.iinfo(colour).max) if colour.kind in "iu" else 1.0
    return CloudSource(
        path,
        vertices.points,
        f"with times by {shown(time)}",
        tuple(shown(name) for name in names if name not in used),
        limit,
        None,
        partial(_intensities, vertices, intensity),
        partial(_blocks, vertices, time, intensity),
    )


@dataclass(frozen=True)
class _Vertices:
    """Position and properties of the points of a PLY."""

    path: Path
    start: int  # bytes
    points: int
    is_text: bool
    kind: np.dtype

    @property
    def names(self):
        """Properties by their plain names; those of CloudCompare without the prefix scalar."""
        return {plain(name).removeprefix("scalar"): name for name in reversed(self.kind.names)}

    def first(self, names):
        """Property with the first of some plain names, None without one."""
        return next((self.names[name] for name in names if name in self.names), None)

    @property
    def colours(self):
        """Properties of red, green and blue; empty without them."""
        known = (names for names in COLOURS if set(names) <= set(self.names))
        return [self.names[name] for name in next(known, ())]

    def read(self, size):
        """Yield records in blocks."""
        if not self.is_text:
            whole = np.memmap(self.path, self.kind, "r", self.start, self.points)
            yield from (whole[start : start + size] for start in range(0, self.points, size))
            return
        with self.path.open("rb") as file:
            file.seek(self.start)
            for start in range(0, self.points, size):
                count = min(size, self.points - start)
                try:
                    rows = np.loadtxt(islice(file, count), self.kind, comments=None, ndmin=1)
                except ValueError as error:
                    raise ValueError(f"{self.path}, after point {start}: {error}") from None
                if len(rows) < count:
                    raise ValueError(_cut_off(self.path, start + len(rows), self.points))
                yield rows


def _header(path) -> _Vertices:
    """Read the header of a PLY's points. Raises ValueError if there are none."""
    with path.open("rb") as file:
        head = file.read(1 << 16).split(b"end_header", 1)
        if not head[0].startswith(b"ply") or len(head) < 2:
            raise ValueError(f"{path} is not a PLY file: it has no header from ply to end_header.")
        start = len(head[0]) + len(b"end_header\n")
        if head[1].startswith(b"\r\n"):
            start += 1
    lines = [line.split() for line in head[0].decode("latin-1").splitlines() if line.strip()]
    form = next((line[1] for line in lines if line[0] == "format" and len(line) > 1), "")
    elements = [line for line in lines if line[0] == "element"]
    count = ""
    if elements and len(elements[0]) == 3 and elements[0][1] == "vertex":
        count = elements[0][2]
    places = [place for place, line in enumerate(lines) if line[0] == "element"] + [len(lines)]
    rows = [line for line in lines[places[0] : places[1 % len(places)]] if line[0] == "property"]
    is_plain = all(len(line) == 3 and line[1] in KINDS for line in rows)
    if form not in ORDERS or not count.isdigit() or int(count) == 0 or not rows or not is_plain:
        raise ValueError(
            f"{path} is a PLY whose first element is not vertex with plain numbers. Export the "
            "cloud as a binary PLY with x, y, z and gps_time as double, or as LAS."
        )
    kind = np.dtype([(line[2], ORDERS[form] + KINDS[line[1]]) for line in rows])
    vertices = _Vertices(path, start, int(count), form == "ascii", kind)
    if lacking := [axis for axis in AXES if axis not in vertices.names]:
        raise ValueError(f"{path} has points without {', '.join(lacking)}.")
    there = (path.stat().st_size - start) // kind.itemsize
    if form != "ascii" and there < vertices.points:
        raise ValueError(_cut_off(path, there, vertices.points))
    return vertices


def _cut_off(path, there, announced):
    return (
        f"{path} is truncated: it has {there} of the {announced} points stated in its header. "
        "Copy it again."
    )


def _intensities(vertices, intensity, size) -> Iterator[np.ndarray]:
    """Yield intensities in blocks."""
    if intensity is not None:
        yield from (rows[intensity].astype(float) for rows in vertices.read(size))


def _blocks(vertices, time, intensity, size) -> Iterator[SourceBlock]:
    """Yield SourceBlocks of a PLY."""
    axes = [vertices.names[axis] for axis in AXES]
    named = {"coordinates": axes[0], "times": time}
    singles = [
        what
        for what, name in named.items()
        if vertices.kind[name].itemsize == 4 and vertices.kind[name].kind == "f"
    ]
    for whole in vertices.read(size):
        xyz = np.column_stack([whole[axis].astype(float) for axis in axes])
        times = whole[time].astype(float)
        is_valid = np.isfinite(xyz).all(axis=1)
        check_precision(vertices.path, singles, xyz[is_valid], times[np.isfinite(times)])
        rows = whole[is_valid]
        intensities = colours = None
        if intensity is not None:
            intensities = rows[intensity].astype(float)
        if vertices.colours:
            colours = np.column_stack([rows[name] for name in vertices.colours])
        invalid = int(np.count_nonzero(~is_valid))
        yield SourceBlock(xyz[is_valid], times[is_valid], intensities, colours, invalid)


def write_ply(path: str | Path, triangles: np.ndarray) -> None:
    """Write triangles as a binary PLY of doubles; identical corners are merged.

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
    """Number of faces that a PLY file announces in its header.

    Parameters
    ----------
    path : path

    Returns
    -------
    int
        Zero without such a header.
    """
    with open(path, "rb") as file:
        head = file.read(1 << 16).split(b"end_header")[0]
    faces = re.search(rb"^element face (\d{1,18})\s*$", head, re.MULTILINE)
    if faces:
        return int(faces[1])
    return 0
