"""Writers of LAS or LAZ points, block by block.

New clouds are LAS 1.4, format 6 or 7; copies keep head and tail of another file.
"""

from __future__ import annotations

import io
import os
import shutil
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any, BinaryIO

import laspy
import lazrs
import numpy as np
from pyproj import CRS

from mlscorr.io.clouds.las_layout import COPC, LASZIP, LASZIP_RECORD, LasLayout
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import output_file
from mlscorr.survey import PointCloud

Blocks = Callable[[bool], Iterator[np.ndarray]]  # argument: True in the last pass
SCAN_ANGLE_UNIT = 0.006  # deg, LAS 1.4 specification, formats 6 to 10
INTEGER_LIMIT = np.iinfo(np.int32).max  # of coordinates


@contextmanager
def cloud_writer(
    path: str | Path,
    corner: np.ndarray,
    crs: str | None = None,
    scale: float = 0.001,
    created: date | None = None,
    is_standard: bool = False,
    has_colours: bool = False,
) -> Iterator[CloudWriter]:
    """Open a CloudWriter for one new LAS or LAZ file, which is written atomically.

    Parameters
    ----------
    path : path ending in ``.las`` or ``.laz``
    corner : (3,) array
        Position near the cloud, the reference of its integers. Units: m.
    crs : str, optional
        Any CRS that pyproj understands, such as ``EPSG:32650``; written as WKT.
    scale : float
        Resolution of the stored coordinates. Units: m.
    created : date, optional
        Date in the header, today if not given.
    is_standard : bool
        True if times are adjusted standard GPS time, not seconds of the GPS week.
    has_colours : bool
        True if points have colors (format 7).

    Yields
    ------
    CloudWriter

    Raises
    ------
    ValueError
        If no points were written.
    OSError
        If the disk refuses.
    """
    path = Path(path)
    header = _header(corner, crs, scale, created, 7 if has_colours else 6)
    if is_standard:
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    compress = path.suffix.lower() == ".laz"
    try:
        with output_file(path) as part, open(part, "wb") as stream:
            with laspy.open(
                stream, mode="w", header=header, do_compress=compress, closefd=False
            ) as las:
                writer = CloudWriter(las)
                yield writer
                if writer.points == 0:
                    raise ValueError(f"{path.name} would have no points.")
            stream.flush()
            os.fsync(stream.fileno())
    except lazrs.LazrsError as error:
        raise OSError(f"{path} can't be written: {error}") from error


class CloudWriter:
    """Writer that appends points to an open file; ``points`` counts them.

    Parameters
    ----------
    las : laspy.LasWriter

    Examples
    --------
    >>> import tempfile, numpy as np
    >>> from mlscorr.survey import PointCloud
    >>> xyz = np.array([[532_000.0, 3_374_000.0, 42.0]])
    >>> cloud = PointCloud(xyz, np.array([357_700.0]), np.array([1000]))
    >>> with cloud_writer(tempfile.mkdtemp() + "/one.laz", xyz[0]) as writer:
    ...     writer.write(cloud)
    """

    def __init__(self, las: laspy.LasWriter) -> None:
        self._las = las
        self.points = 0

    def write(
        self,
        cloud: PointCloud,
        scan_angle: np.ndarray | None = None,
        return_number: np.ndarray | int = 1,
        number_of_returns: np.ndarray | int = 1,
        colours: np.ndarray | None = None,
    ) -> None:
        """Append a PointCloud.

        Parameters
        ----------
        cloud : PointCloud
            xyz (n, 3) in m, gps_time (n,) in s, intensity (n,) from 0 to 65535.
        scan_angle : (n,) array, optional
            From -180 to 180. Units: deg.
        return_number, number_of_returns : (n,) int array
        colours : (n, 3) array, optional
            Red, green and blue from 0 to 65535.

        Raises
        ------
        ValueError
            If a coordinate is not a number or does not fit the scale.
        """
        if len(cloud) == 0:
            return
        header = self._las.header
        _check(cloud.xyz, header)
        record = laspy.ScaleAwarePointRecord.zeros(len(cloud), header=header)
        record.x, record.y, record.z = cloud.xyz.T
        record.gps_time = cloud.gps_time
        record.intensity = cloud.intensity
        record.return_number[:] = return_number
        record.number_of_returns[:] = number_of_returns
        if scan_angle is not None:
            record.scan_angle = np.rint(scan_angle / SCAN_ANGLE_UNIT).astype(np.int16)
        if colours is not None:
            record.red, record.green, record.blue = np.asarray(colours, np.uint16).T
        self._las.write_points(record)
        self.points += len(cloud)


def _check(xyz, header):
    """Check that coordinates are numbers and fit 32-bit integers."""
    bad = int((~np.isfinite(xyz)).any(axis=1).sum())
    if bad:
        raise ValueError(f"{bad} of {len(xyz)} points have a coordinate that is not a number.")
    scale = header.scales[0]
    distance = float(np.abs(xyz - header.offsets).max())
    if distance / scale > INTEGER_LIMIT:
        raise ValueError(
            f"A point is {distance:.0f} m from the corner of the cloud; at a scale of {scale} m "
            f"a LAS file can store {INTEGER_LIMIT * scale:.0f} m. Choose a coarser scale."
        )


def _header(corner, crs, scale, created, point_format):
    """LAS header whose offset is the corner in whole meters."""
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales = np.full(3, scale)
    header.offsets = np.floor(corner)
    header.generating_software = "mlscorr"
    header.creation_date = created or date.today()
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.WEEK_TIME
    if crs is not None:
        wkt = CRS.from_user_input(crs).to_wkt("WKT1_GDAL")  # LAS 1.4 requires WKT 1
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
        header.global_encoding.wkt = True
    return header


class LasOutput(io.BufferedWriter):
    """New file that remembers what interrupts its writing, which lazrs replaces by its own error.

    Parameters
    ----------
    path : path
    """

    def __init__(self, path: Path):
        super().__init__(io.FileIO(path, "wb"), SETTINGS.copied_bytes)
        self.interruption: BaseException | None = None

    def write(self, data: Any) -> int:
        """Append bytes, like any file.

        Parameters
        ----------
        data : buffer
        """
        try:
            return super().write(data)
        except BaseException as error:
            self.interruption = error
            raise

    def encode(self, function: Callable, *arguments: object) -> None:
        """Let lazrs write here; raise the original error of the system.

        Parameters
        ----------
        function : function
        *arguments
            Arguments of the function.
        """
        try:
            function(*arguments)
        except lazrs.LazrsError as error:
            raise self.interruption or OSError(f"{self.name}: {error}") from error

    def complete(self, head: bytearray, bounds: np.ndarray) -> None:
        """Write the head again, and flush everything to disk.

        Parameters
        ----------
        head : bytearray
            Header and VLRs.
        bounds : (2, 3) array
            Largest and smallest coordinates. Units: m.
        """
        struct.pack_into("<6d", head, 179, *bounds.T.ravel())  # max x, min x, max y, ...
        self.seek(0)
        self.write(head)
        self.flush()
        os.fsync(self.fileno())


class PlainWriter:
    """Writer of points in the given order, followed by the tail.

    Parameters
    ----------
    layout : LasLayout
        Layout of the other file, with the records and VLRs of the new one.
    output : LasOutput
        Empty.
    is_laz : bool
        True if points are compressed.
    """

    def __init__(self, layout: LasLayout, output: LasOutput, is_laz: bool):
        self._layout = layout
        self._output = output
        self._is_laz = is_laz
        self._vlr = lazrs.LazVlr.new_for_compression(layout.point_format, layout.extra_bytes)
        data = bytes(self._vlr.record_data()) if is_laz else None
        if layout.is_copc:  # the new one is not a COPC
            layout = replace(layout, head=layout.head_with(*COPC, None))
        self.head = bytearray(layout.head_with(LASZIP, LASZIP_RECORD, data, b"http://laszip.org"))
        self.head[104] = layout.point_format | (0x80 if is_laz else 0)

    def write(self, blocks: Blocks, file: BinaryIO) -> None:
        """Write the current head, the points and the tail.

        Parameters
        ----------
        blocks : function
            Yields all records, (n,) at a time, as bytes of each.
        file : binary file
            The other file, open for reading.

        Raises
        ------
        OSError
            If the disk refuses.
        """
        self._output.write(self.head)
        if self._is_laz:
            encoder = lazrs.ParLasZipCompressor(self._output, self._vlr)
            for records in blocks(True):
                self._output.encode(encoder.compress_many, records.view(np.uint8))
            self._output.encode(encoder.done)
        else:
            for records in blocks(True):
                self._output.write(records.view(np.uint8))
        self._append_tail(file)

    def _append_tail(self, file):
        """Copy the tail of the other file, and update its positions in the head."""
        layout = self._layout
        self._output.seek(0, io.SEEK_END)
        moved = self._output.tell() - layout.tail
        file.seek(layout.tail)
        shutil.copyfileobj(file, self._output, SETTINGS.copied_bytes)
        # of waveforms, since 1.3, and EVLRs
        for position in (227, 235)[: max(0, layout.version[1] - 2)]:
            value = layout.field("Q", position)[0]
            if value >= layout.tail:
                struct.pack_into("<Q", self.head, position, value + moved)
