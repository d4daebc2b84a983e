"""Corrected copies of LAS and LAZ files that change only what a correction requires."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from laspy.vlrs.known import ExtraBytesStruct, ExtraBytesVlr

from mlscorr.correction import PointSigma, require_fit
from mlscorr.io.clouds._copc_writer import CopcWriter
from mlscorr.io.clouds.las import read_records, records_at, timed_points
from mlscorr.io.clouds.las_checks import read_layout, variable_records
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.clouds.las_writer import INTEGER_LIMIT, LasOutput, PlainWriter, cloud_writer
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import PART, is_remote, open_file, output_file
from mlscorr.io.trajectories import PLACEHOLDERS
from mlscorr.survey import AXES, CloudFile, CloudInMemory, Correcting, PointCloud

SIGMAS = tuple(f"sigma_{axis}" for axis in AXES)
DISPLACEMENTS = tuple(f"displacement_{axis}" for axis in AXES)
UINT16, INT32 = 3, 6  # numbers of the types, ASPRS LAS 1.4 R15, table 24
PROVENANCE = (b"mlscorr", 1)  # user and record of the VLR that names the correcting program
SOFTWARE = slice(58, 90)  # bytes of the header: generating software
UNKNOWN = np.iinfo(np.uint16).max  # of a point without a pose


@dataclass(frozen=True)
class Additions:
    """Optional additions to a corrected file, none by default.

    By default everything except the coordinates is copied byte for byte, so that files can be
    compared and a zero correction reproduces the file. Each addition breaks this rule, so each must
    be requested.

    Parameters
    ----------
    sigma : bool
        Fields sigma_easting, sigma_northing, sigma_height of each point: uint16, 0.1 mm.
    displacement : bool
        Fields displacement_easting, displacement_northing, displacement_height of each point,
        corrected - recorded: int32 of the file's own scale, so that the recorded integers can be
        restored exactly. Zero for unchanged points.
    provenance : str, optional
        Text of a VLR (user ID mlscorr, record ID 1); mlscorr also becomes the generating software.
    version : str
        Version of mlscorr for the header; used only with provenance.
    """

    sigma: bool = False
    displacement: bool = False
    provenance: str | None = None
    version: str = ""

    @property
    def has_fields(self) -> bool:
        """True if points get longer."""
        return self.sigma or self.displacement


NOTHING_ADDED = Additions()


@dataclass(frozen=True)
class CorrectedPart:
    """Points of a file, and their correction.

    Parameters
    ----------
    file : CloudFile
        The whole file, or the points of one of several scanners or drives.
    correction : Correction, or anything else with ``apply(cloud) -> cloud``
    sigma : PointSigma, optional
        Adds the fields sigma_easting, sigma_northing and sigma_height to each point.
    watch : function, optional
        Called for each finished chunk with the gps_time (n,) in the trajectory's system, and the
        noise flags (n,).
    additions : Additions
        Displacement and provenance; for sigmas see ``sigma``. The same for all parts of a file.
    sample : function, optional
        Called for each chunk, before it is corrected, with its points as from ``read_chunks``.
    """

    file: CloudFile
    correction: Correcting
    sigma: PointSigma | None = None
    watch: Callable[[np.ndarray, np.ndarray], object] | None = None
    additions: Additions = NOTHING_ADDED
    sample: Callable[[PointCloud], object] | None = None

    @property
    def added(self) -> Additions:
        """Additions, including the fields of sigmas if the part has them."""
        return replace(self.additions, sigma=self.sigma is not None)

    def move(self, layout: LasLayout, records: np.ndarray, sigmas: np.ndarray | None) -> int:
        """Correct its points among records in place; return those outside the trajectory.

        Parameters
        ----------
        layout : LasLayout
        records : (n,) structured array
        sigmas : (n, 3) array, optional
            Output for its points. Units: m.
        """
        rows = self.file.rows(records["point_source_id"])
        some = records[rows]
        if self.sample is not None and len(some):
            is_noise = layout.is_noise(some, self.file.noise_classes)
            measured = some[~is_noise] if is_noise.any() else some
            self.sample(timed_points(self.file, layout, measured))
        xyz = [some[name] for name in "XYZ"]
        times = self.file.counted(some["gps_time"])
        scaled = layout.scale, layout.offset, times, self.file.time_constant
        shift = getattr(self.correction, "shift_integers", None)
        try:
            outside = (shift or partial(_shift_integers, self.correction))(xyz, *scaled)
        except ValueError as error:
            raise ValueError(f"{layout.path}: {error}") from None
        if sigmas is not None and self.sigma is not None:
            sigmas[rows] = self.sigma.of_integers(xyz, *scaled)
        if not isinstance(rows, slice):  # which is a view
            records[rows] = some
        if self.watch is not None and len(some):
            is_noise = layout.is_noise(some, self.file.noise_classes)
            self.watch(times + self.file.time_constant, is_noise)
        return outside


def _write_points(part, file, target):
    """Write corrected points from memory as a new file; return the number of those outside."""
    if part.sigma is not None:
        raise ValueError(
            f"{file.name} represents points in memory, which can't be written with sigma fields. "
            "Use point_sigma() of the result instead."
        )
    if part.added.displacement or part.added.provenance is not None:
        raise ValueError(
            f"{file.name} represents points in memory, which can't be written with displacement "
            "or provenance. Write the points as LAS first, and read the survey from files."
        )
    outside = 0
    with cloud_writer(target, file.cloud.xyz[0], file.crs) as writer:
        for chunk in file.chunks(SETTINGS.chunk_points):
            if part.sample is not None:
                part.sample(chunk)
            if hasattr(part.correction, "increments"):
                added, inside = part.correction.increments(chunk.xyz, chunk.gps_time)
                places = chunk.xyz + added
                outside += int(np.count_nonzero(~inside))
            else:
                places = part.correction.apply(chunk).xyz
            levels = np.clip(np.rint(chunk.intensity), 0, UNKNOWN).astype(np.uint16)
            writer.write(replace(chunk, xyz=places, intensity=levels, attributes={}))
            if part.watch is not None:
                part.watch(chunk.gps_time, np.zeros(len(chunk), bool))
    return outside


def write_parts(parts: Sequence[CorrectedPart], target: str | Path) -> list[int]:
    """Copy a file with corrected coordinates; all else is copied byte for byte.

    Changes are limited to X, Y, Z of each point, the bounds in the header, the position of data
    after the points where necessary, and the parts' additions. The target's suffix determines
    compression. The file is written atomically, as ``.part`` in the same folder, and checked by
    reading before it gets its name. An existing file is replaced.

    Parameters
    ----------
    parts : sequence of CorrectedPart
        Parts of one file, possibly of several scanners; all with sigmas, or none.
    target : path
        ``.las`` or ``.laz``, not the input.

    Returns
    -------
    list of int
        Number of unchanged points of each part, which are outside the trajectory.

    Raises
    ------
    ValueError
        For invalid input, a target equal to the input, overflowing coordinates, and LAZ files with
        waveforms (formats 9 and 10) of several scanner channels, which lazrs would damage.
    OSError
        If the target cannot be written.
    """
    if isinstance(parts[0].file, CloudInMemory):
        return [_write_points(part, part.file, target) for part in parts]
    layout = read_layout(parts[0].file.path)
    target = Path(target)
    _check_target(layout.path, target)
    corrected = _Corrected(layout, target, parts)
    with output_file(target) as copy:
        with LasOutput(copy) as output, open_file(layout.path) as file:
            if layout.is_copc and corrected.is_laz:
                writer = CopcWriter(corrected.written, output, copy.parent)
            else:
                writer = PlainWriter(corrected.written, output, corrected.is_laz)
            writer.write(corrected.blocks, file)
            output.complete(writer.head, corrected.bounds * layout.scale + layout.offset)
        _check_copy(layout, copy)
    for value, count in corrected.untimed.items():
        is_number = np.isfinite(value)
        if not count or (is_number and count > corrected.outside.sum()):  # a time of the drive
            continue
        if is_number:
            what = f"of {value:.15g} s"
        else:
            what = "that is not a number"
        warnings.warn(
            f"{count} of {layout.points} points of {layout.path} have a gps_time {what}. They "
            "can't be located on the trajectory and are not corrected.",
            stacklevel=3,
        )
    return corrected.outside.tolist()


class _Corrected:
    """Records of a file after their correction, and counts collected meanwhile.

    Attributes
    ----------
    written : LasLayout
        Layout of the corrected records.
    outside : (k,) int array
        Number of points of each part outside the trajectory.
    untimed : dict
        Number of points without a valid time, by the stored value (s), or NaN for none.
    bounds : (2, 3) array
        Largest and smallest integers of the coordinates.
    """

    def __init__(self, layout, target, parts):
        self._layout = layout
        self._target = target
        self._parts = parts
        self.is_laz = target.suffix.lower() == ".laz"
        self._added = parts[0].added
        self.written = with_additions(layout, self._added)

    def blocks(self, is_final):
        """Yield all records, (n,) at a time, as bytes of each; watchers are called in the final
        pass.
        """
        layout = self._layout
        added = self._added
        if is_final:
            parts = self._parts
        else:
            parts = [replace(part, watch=None, sample=None) for part in self._parts]
        self.outside = np.zeros(len(parts), int)
        self.untimed = dict.fromkeys((np.nan, *PLACEHOLDERS), 0)
        self.bounds = np.array([np.full(3, -np.inf), np.full(3, np.inf)])
        for records in read_records(layout, SETTINGS.chunk_points):
            _check_channels(layout, self._target, records)
            sigmas = None
            if added.sigma:
                sigmas = np.full((len(records), 3), np.nan)
            if added.displacement:
                recorded = _integers(records)
            self.outside += [part.move(layout, records, sigmas) for part in parts]
            times = records["gps_time"]
            self.untimed[np.nan] += np.count_nonzero(~np.isfinite(times))
            for time in PLACEHOLDERS:
                self.untimed[time] += np.count_nonzero(times == time)
            xyz = [records[name] for name in "XYZ"]
            self.bounds[0] = np.maximum(self.bounds[0], [values.max() for values in xyz])
            self.bounds[1] = np.minimum(self.bounds[1], [values.min() for values in xyz])
            columns = []
            if sigmas is not None:
                columns.append(_sigma_steps(sigmas))
            if added.displacement:
                columns.append((_integers(records) - recorded).astype("<i4"))
            raw = _lengthened(records, columns)
            yield raw.view(f"V{self.written.record_length}")


def _integers(records):
    """Coordinates (n, 3) of point records, as stored."""
    return np.column_stack([records[name] for name in "XYZ"]).astype(np.int64)


def _shift_integers(correction, xyz, scale, offset, gps_time, time_constant):
    """Correction.shift_integers for corrections with only ``apply``, where no point is outside."""
    old = np.column_stack(xyz)
    places = old * scale + offset
    cloud = PointCloud(places, gps_time + time_constant, np.zeros(len(gps_time)))
    new = old + np.rint((correction.apply(cloud).xyz - places) / scale)
    overflow = int((np.abs(new) > INTEGER_LIMIT).any(axis=1).sum())
    require_fit(overflow, scale, offset)
    for values, corrected in zip(xyz, new.T, strict=True):
        values[:] = corrected
    return 0


def _check_channels(layout, target, records):
    """Check that lazrs preserves the waveforms, which it mixes up if scanner channels alternate."""
    is_laz = layout.is_compressed or target.suffix.lower() == ".laz"
    if not is_laz or layout.point_format not in (9, 10):
        return
    channel = records.view(np.uint8).reshape(len(records), -1)[:, 15] >> 4 & 3
    if np.ptp(channel):
        raise ValueError(
            f"{layout.path} has waveforms (point format {layout.point_format}) of "
            f"{len(np.unique(channel))} scanner channels, which lazrs can't compress without "
            "loss. Use LAS for input and output, or one file for each channel."
        )


def _check_target(source, target):
    if target.suffix.lower() not in (".las", ".laz"):
        raise ValueError(f"The corrected file {target} must end in .las or .laz.")
    for path in (target, target.with_name(target.name + PART)):
        if path.exists() and not is_remote(source) and path.samefile(source):
            raise ValueError(
                f"The corrected file {path} would replace the input. Choose another output folder."
            )


def _check_copy(layout, part):
    """Check that the file just written can be opened and contains all points."""
    copy = read_layout(part)
    records_at(copy, [copy.points - 1])
    if copy.points != layout.points:
        raise OSError(f"{part} was written with {copy.points} of {layout.points} points.")


def with_additions(layout: LasLayout, additions: Additions) -> LasLayout:
    """Return the LasLayout of a copy with additional point fields, or a VLR on its provenance.

    Undescribed extra bytes get a descriptor, because the new ones follow them. All VLRs are kept.

    Parameters
    ----------
    layout : LasLayout
    additions : Additions

    Returns
    -------
    LasLayout

    Raises
    ------
    ValueError
        If the points already have these fields, or have fewer bytes than described.
    """
    if additions.has_fields:
        layout = _with_fields(layout, additions)
    if additions.provenance is None:
        return layout
    text = additions.provenance.encode()
    head = bytearray(layout.head_with(*PROVENANCE, text, b"correction by mlscorr"))
    software = f"mlscorr {additions.version}".encode()[: SOFTWARE.stop - SOFTWARE.start]
    head[SOFTWARE] = software.ljust(SOFTWARE.stop - SOFTWARE.start, b"\0")
    return replace(layout, head=bytes(head))


def _with_fields(layout, additions):
    """LasLayout with sigmas and displacements appended to each point."""
    owner = (ExtraBytesVlr.official_user_id().encode(), ExtraBytesVlr.official_record_ids()[0])
    described = b"".join(variable_records(layout, *owner))
    size = ExtraBytesStruct.size()
    described = described[: len(described) // size * size]
    fields = [
        ExtraBytesStruct.from_buffer_copy(described, start)
        for start in range(0, len(described), size)
    ]
    new = SIGMAS * additions.sigma + DISPLACEMENTS * additions.displacement
    if twice := sorted({field.name.decode(errors="replace") for field in fields} & set(new)):
        kinds = "sigmas" if twice[0] in SIGMAS else "displacements"
        raise ValueError(
            f"The points of {layout.path} already have the field {twice[0]}. Correct the file as "
            f"recorded, or omit {kinds}."
        )
    nameless = layout.extra_bytes - sum(field.dtype().itemsize for field in fields)
    if nameless < 0:
        raise ValueError(
            f"{layout.path} is damaged: it describes {layout.extra_bytes - nameless} extra bytes "
            f"per point, and its points have {layout.extra_bytes}."
        )
    longest = np.iinfo(np.uint8).max  # bytes that a descriptor of raw bytes can cover
    for number, start in enumerate(range(0, nameless, longest)):
        size = min(longest, nameless - start)
        described += _descriptor(b"undescribed_%d" % number, data_type=0, options=size)
    length = layout.record_length
    if additions.sigma:
        for name in SIGMAS:
            scaled = {"scale": [SETTINGS.sigma_step], "no_data": [UNKNOWN]}
            described += _descriptor(name.encode(), b"one sigma, m", data_type=UINT16, **scaled)
            length += np.dtype(np.uint16).itemsize
    if additions.displacement:
        for name, scale in zip(DISPLACEMENTS, layout.scale, strict=True):
            words = b"corrected - recorded, m"
            described += _descriptor(name.encode(), words, data_type=INT32, scale=[scale])
            length += np.dtype(np.int32).itemsize
    head = layout.head_with(*owner, described)
    return replace(layout, head=head).with_record_length(length)


def _sigma_steps(sigma):
    """Sigmas (n, 3) in m as stored: NaN is unknown; values above 6.5534 m are stored as that."""
    steps = np.minimum(np.rint(sigma / SETTINGS.sigma_step), UNKNOWN - 1)
    return np.where(np.isnan(steps), UNKNOWN, steps).astype("<u2")


def _lengthened(records, columns):
    """Bytes (k,) of point records with further columns (n, 3) appended to each."""
    if not columns:
        return records.view(np.uint8)
    raw = [records.view(np.uint8).reshape(len(records), -1)]
    raw += [np.ascontiguousarray(values).view(np.uint8) for values in columns]
    return np.hstack(raw).ravel()


def _descriptor(name, description=b"", scale=None, no_data=None, **fields):
    """Bytes that describe one field; laspy's own would state a range that was never measured."""
    field = ExtraBytesStruct.from_buffer_copy(bytes(ExtraBytesStruct.size()))
    for key, value in {"name": name, "description": description, **fields}.items():
        setattr(field, key, value)
    if scale is not None:
        field.scale = scale
    if no_data is not None:
        field.no_data = no_data
    return bytes(field)
