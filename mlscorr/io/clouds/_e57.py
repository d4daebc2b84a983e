"""Clouds in E57 files (ASTM E2807), by libE57Format in pye57.

By the standard, times of points count from the acquisitionStart of their scan, but many programs
write seconds of the GPS week. Times count from the start if they fit between it and the
acquisitionEnd, or into a day if none is given.
"""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import from_polar
from mlscorr.io.clouds._cloud_sources import CloudSource, SourceBlock, check_precision, lacking_time
from mlscorr.io.settings import SETTINGS
from mlscorr.io.trajectories import DAY

CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")  # m, rad
COLOURS = ("colorRed", "colorGreen", "colorBlue")
TIME = "timeStamp"
INTENSITY = "intensity"
INVALID = ("cartesianInvalidState", "sphericalInvalidState", "isTimeStampInvalid")
FIELDS = {*CARTESIAN, *SPHERICAL, *COLOURS, *INVALID, TIME, INTENSITY}


def open_e57(path: Path) -> CloudSource:
    """Open an E57 file by its header.

    Parameters
    ----------
    path : Path

    Returns
    -------
    CloudSource

    Raises
    ------
    ValueError
        If the file is damaged or not an E57, or a scan has no coordinates or times.
    """
    with _opened(path) as root:
        scans = _scans(path, root)
        if root.isDefined("coordinateMetadata"):
            metadata = root["coordinateMetadata"].value()
        else:
            metadata = ""
        if not scans:
            raise ValueError(f"{path} has no points.")
        dropped = sorted({name for scan in scans for name in scan.fields} - FIELDS)
        limits = [scan.colour_limit for scan in scans]
        starts = {scan.starts for scan in scans}
    times = "and their acquisitionStart" if True in starts else ""
    return CloudSource(
        path,
        sum(scan.points for scan in scans),
        f"of {len(scans)} scan{'s' * (len(scans) > 1)}, times by timeStamp {times}".strip(),
        tuple(dropped),
        max(limits),
        metadata or None,
        partial(_intensities, path),
        partial(_blocks, path),
    )


@contextmanager
def _opened(path) -> Iterator[Any]:
    """Yield the root of a file; errors of libE57Format become a message."""
    try:
        from pye57 import libe57
    except ImportError:
        raise ValueError(
            f"{path} is an E57 file, and pye57, which reads it, is not installed: pip install "
            "'mlscorr[e57]', or export the cloud as LAZ."
        ) from None

    try:
        file = libe57.ImageFile(str(path), "r")
        try:
            yield file.root()
        finally:
            file.close()
    except libe57.E57Exception as error:
        cause = str(error).strip().splitlines()[0].split(" (")[0]
        raise ValueError(
            f"{path} can't be read as E57 ({cause}): it is truncated, damaged or of another "
            "format. Copy or export it again."
        ) from None


class _Scan:
    """One scan of a file: its fields, pose, and reference of times."""

    def __init__(self, path, node, number):
        from pye57 import libe57

        self.path = path
        self.node = node
        self.vector = node["points"]
        self.points = self.vector.childCount()
        self._prototype = libe57.StructureNode(self.vector.prototype())
        count = self._prototype.childCount()
        self.fields = [self._prototype.get(k).elementName() for k in range(count)]
        if self.points and TIME not in self.fields:
            raise lacking_time(path, self.fields, f" in scan {number}", f"the field {TIME}")
        self.axes = next(
            (axes for axes in (CARTESIAN, SPHERICAL) if set(axes) <= {*self.fields}), ()
        )
        if self.points and not self.axes:
            raise ValueError(
                f"Scan {number} of {path} has no coordinates: its fields are "
                f"{', '.join(self.fields)}. Export it with {', '.join(CARTESIAN)}."
            )
        self.colours = COLOURS if set(COLOURS) <= {*self.fields} else ()
        self.start = self._value("acquisitionStart", "dateTimeValue")
        self.end = self._value("acquisitionEnd", "dateTimeValue")

    def _value(self, *names):
        """Number from the scan's header, zero without one."""
        node = self.node
        for name in names:
            if not node.isDefined(name):
                return 0.0
            node = node[name]
        return float(node.value())

    @property
    def colour_limit(self):
        """Largest value of a color: from the limits, or from the field if it has one."""
        largest = max(self._value("colorLimits", f"{name}Maximum") for name in COLOURS)
        field = max((float(self._prototype[name].maximum()) for name in self.colours), default=0.0)
        if largest:
            return largest
        if 0.0 < field <= np.iinfo(np.uint16).max:
            return field
        return 255.0

    @cached_property
    def singles(self):
        """Names of what is stored in single precision."""
        from pye57 import libe57

        groups = {"coordinates": self.axes[0], "times": TIME}
        nodes = {what: self._prototype[name] for what, name in groups.items()}
        return [
            what
            for what, node in nodes.items()
            if isinstance(node, libe57.FloatNode) and node.precision() == libe57.E57_SINGLE
        ]

    @cached_property
    def starts(self):
        """True if times count from the scan's start, judged by the first ones."""
        with closing(self.read([TIME], SETTINGS.sampled_points)) as blocks:
            first = next(blocks)[TIME]
        span = self.end - self.start if self.end > self.start else DAY
        return bool(self.start > 0 and first.min() >= -1.0 and first.max() <= span + 1.0)

    def read(self, names, size):
        """Yield blocks as dicts of name to (n,) array; each reuses the memory of the previous
        one.
        """
        from pye57 import libe57

        size = min(size, self.points)
        arrays = {name: np.empty(size) for name in names}
        buffers = libe57.VectorSourceDestBuffer()
        for name, array in arrays.items():
            buffers.append(
                libe57.SourceDestBuffer(self.node.destImageFile(), name, array, size, True, True)
            )
        reader = self.vector.reader(buffers)
        try:
            while count := reader.read():
                yield {name: array[:count] for name, array in arrays.items()}
        finally:
            reader.close()

    @cached_property
    def pose(self):
        """Rotation and translation (3,) into the file's coordinates."""
        names = ("x", "y", "z", "w")
        quaternion = [self._value("pose", "rotation", name) for name in names]
        shift = np.array([self._value("pose", "translation", name) for name in names[:3]])
        if any(quaternion):
            return Rotation.from_quat(quaternion), shift
        return Rotation.identity(), shift


def _scans(path, root):
    """Scans that contain points."""
    count = len(root["data3D"])
    scans = [_Scan(path, scan, f"{k + 1} of {count}") for k, scan in enumerate(root["data3D"])]
    return [scan for scan in scans if scan.points]


def _intensities(path, size):
    """Yield intensities of a file in blocks."""
    with _opened(path) as root:
        for scan in _scans(path, root):
            if INTENSITY in scan.fields:
                with closing(scan.read([INTENSITY], size)) as blocks:
                    yield from (block[INTENSITY] for block in blocks)


def _blocks(path, size):
    """Yield SourceBlocks of a file."""
    with _opened(path) as root:
        for scan in _scans(path, root):
            marks = [name for name in INVALID if name in scan.fields]
            names = [*scan.axes, TIME, *scan.colours, *marks]
            names += [INTENSITY] * (INTENSITY in scan.fields)
            start = scan.start if scan.starts else 0.0  # by its first times: one reader at a time
            with closing(scan.read(names, size)) as blocks:  # before the file is
                yield from (_source_block(scan, block, marks, start) for block in blocks)


def _source_block(scan, block, marks, start):
    """Make a SourceBlock of a block of a scan, without points marked as invalid."""
    places = np.column_stack([block[name] for name in scan.axes])
    is_valid = np.isfinite(places).all(axis=1)
    for name in marks:
        is_valid &= block[name] == 0
    block = {name: values[is_valid] for name, values in block.items()}
    xyz = places[is_valid]
    if scan.axes != CARTESIAN:  # but range, azimuth, elevation
        xyz = from_polar(*xyz.T)
    check_precision(scan.path, scan.singles, xyz, block[TIME])
    rotation, shift = scan.pose
    if len(xyz):
        xyz = rotation.apply(xyz) + shift
    colours = None
    if scan.colours:
        colours = np.column_stack([block[name] for name in COLOURS])
    invalid = int(np.count_nonzero(~is_valid))
    return SourceBlock(xyz, block[TIME] + start, block.get(INTENSITY), colours, invalid)
