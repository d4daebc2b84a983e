"""RIEGL's position and orientation files (.pof), and their accuracy companions (.poq).

The layout is that of the public crate ``pos`` (P. Gadomski), little-endian: a signature, a header,
and records of float64 from its data offset. The signature is not public, so the header is compared
with the records.
"""

import warnings
from datetime import date
from pathlib import Path

import numpy as np

from mlscorr.io.store import as_path, read_bytes
from mlscorr.io.tables import check_finite
from mlscorr.io.trajectories.time_systems import DAY, counting_on, leap_seconds
from mlscorr.survey import WEEK

POF_SUFFIX = ".pof"
POQ_SUFFIX = ".poq"
HEADER = np.dtype(
    [
        ("signature", "V27"),
        *((name, "<u2") for name in ("major", "minor")),
        ("offset", "<u4"),
        *((name, "<u2") for name in ("year", "month", "day")),
        ("entries", "<i8"),
        ("box", "<f8", (3, 2)),  # smallest and largest longitude, latitude (deg), altitude (m)
        ("interval", "<f8", 3),  # mean, largest, standard deviation; s
        *((name, "u1") for name in ("unit", "system")),
        ("names", "V192"),  # time zone, location, device, project, company; not read
    ]
)
FIELDS = ("gps_time", "longitude", "latitude", "height", "roll", "pitch", "heading")  # s, deg, m
UNITS = ("normalized time", "seconds of the day", "seconds of the week")
SYSTEMS = ("GPS", "UTC", "unknown")
QUALITY_HEADER = np.dtype(
    [("signature", "V35"), ("major", "<u2"), ("minor", "<u2"), ("interval", "<f8", 3)]
)
QUALITIES = ("gps_time", "north", "east", "down", "roll", "pitch", "heading", "pdop")  # s, m, deg
REMEDY = "Export it as SBET, or as text."


def read_pof(path: str | Path) -> tuple[dict[str, np.ndarray], float, str]:
    """Read the columns of a POF in the units of an SBET, with times as seconds of the GPS week.

    Parameters
    ----------
    path : path

    Returns
    -------
    record : dict
        Name of each of FIELDS to an (n,) array, the heading from true north. Units: s, rad, m.
    constant : float
        Constant that was added to its times. Units: s.
    layout : str
        Interpretation, without a full stop.

    Raises
    ------
    ValueError
        If the file is truncated, header and records disagree, or times are not seconds of day or
        week.

    Warns
    -----
    UserWarning
        If the header does not state whether times are GPS or UTC.
    """
    path = as_path(path)
    data = read_bytes(path)
    header, day = _header(path, data)
    names = (*FIELDS, "distance")[: 8 if header["minor"] >= 1 else 7]
    width = 8 * len(names)
    count = int(header["entries"])
    whole = int(header["offset"]) + count * width
    if len(data) != whole:
        if len(data) < whole:
            cause = "it is truncated"
        else:
            cause = "its version may have another layout"
        raise ValueError(
            f"{path} has {len(data)} bytes where its header states {count} records of {width} "
            f"bytes, {whole} in all: {cause}. {REMEDY}"
        )
    table = np.frombuffer(data, "<f8", count * len(names), header["offset"]).reshape(count, -1)
    check_finite(path, table, "POF record")
    for name, values, (low, high) in zip(FIELDS[1:4], table.T[1:4], header["box"], strict=True):
        ends = values.min(), values.max()
        if not (np.isclose(ends, (low, high)) | (ends[0] >= low, ends[1] <= high)).all():
            raise ValueError(
                f"{path} has {name}s of {ends[0]:.6f} to {ends[1]:.6f} where its header states "
                f"{low:.6f} to {high:.6f}: it is damaged, or not a POF of RIEGL. {REMEDY}"
            )
    constant, layout = _constant(path, header, day)
    record = dict(zip(FIELDS, table.T.astype(float), strict=False))
    record = counting_on(record, DAY if header["unit"] == 1 else WEEK)
    record["gps_time"] += constant
    angles = {
        name: np.radians(record[name]) for name in FIELDS if name not in ("gps_time", "height")
    }
    return record | angles, constant, layout


def read_poq(path: str | Path) -> dict[str, np.ndarray]:
    """Read the columns of a POQ: sigmas at times in the system of its POF.

    Parameters
    ----------
    path : path

    Returns
    -------
    dict
        Name of each of QUALITIES to an (n,) array. Units: s, m, rad.

    Raises
    ------
    ValueError
        If the file is truncated.
    """
    data = read_bytes(path)
    start = QUALITY_HEADER.itemsize
    header = np.frombuffer(data[:start].ljust(start, b"\0"), QUALITY_HEADER)[0]
    satellites = 2 if header["minor"] >= 1 else 1  # counts, of GPS and of GLONASS
    kind = np.dtype([("values", "<f8", len(QUALITIES)), ("satellites", "<u2", satellites)])
    count, rest = divmod(len(data) - start, kind.itemsize)
    if header["major"] != 1 or count < 1 or rest:
        raise ValueError(
            f"{path} has {len(data)} bytes, which are no header of {start} bytes and whole POQ "
            f"records of {kind.itemsize} bytes (version {header['major']}.{header['minor']}): it "
            f"is truncated, or not a POQ of RIEGL. {REMEDY}"
        )
    table = np.frombuffer(data, kind, count, start)["values"]
    check_finite(path, table, "POQ record")
    record = dict(zip(QUALITIES, table.T.astype(float), strict=True))
    return record | {name: np.radians(record[name]) for name in ("roll", "pitch", "heading")}


def _header(path, data):
    """Read header and date of a POF. Raises ValueError if it is not one."""
    whole = HEADER.itemsize
    header = np.frombuffer(data[:whole].ljust(whole, b"\0"), HEADER)[0]
    try:
        day = date(*(int(header[name]) for name in ("year", "month", "day")))
    except ValueError:
        day = None
    is_timed = header["unit"] < len(UNITS) and header["system"] < len(SYSTEMS)
    is_placed = header["offset"] >= whole and header["entries"] > 0
    if len(data) < whole or header["major"] != 1 or day is None or not is_timed or not is_placed:
        raise ValueError(
            f"{path} is not a POF of RIEGL of version 1 ({len(data)} bytes, version "
            f"{header['major']}.{header['minor']}, date "
            f"{header['year']}-{header['month']:02}-{header['day']:02}, {header['entries']} "
            f"records, from byte {header['offset']} on): it is truncated, or of another format. "
            f"{REMEDY}"
        )
    return header, day


def _constant(path, header, day):
    """Constant that converts a POF's times to seconds of the GPS week (s), and a sentence on it."""
    unit = UNITS[header["unit"]]
    system = SYSTEMS[header["system"]]
    version = f"{path.name} was read as RIEGL's POF {header['major']}.{header['minor']} of {day}"
    if header["unit"] == 0:
        raise ValueError(
            f"{path} has normalized time with an unknown start. Export it with seconds of the "
            "GPS week."
        )
    if system == "unknown":
        warnings.warn(
            f"{path} does not state whether its times are GPS or UTC. GPS time is assumed, 18 s "
            "ahead of UTC since 2017; if this is wrong, export it with seconds of the GPS week.",
            stacklevel=4,
        )
    # GPS weeks start on Sunday
    if header["unit"] == 1:
        days = day.isoweekday() % 7 * DAY
    else:
        days = 0.0
    leaps = float(leap_seconds(day)) if system == "UTC" else 0.0
    parts = [f"{unit} ({system})"]
    parts += [f"{days:+.0f} s to {day:%A} in the GPS week"] * bool(header["unit"] == 1)
    parts += [f"{leaps:+.0f} leap seconds"] * bool(leaps)
    return days + leaps, f"{version}, times of {', '.join(parts)}"
