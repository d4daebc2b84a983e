"""Applanix SBET trajectories with accuracy file (smrmsg), and RIEGL's POF, in map coordinates.

Both are bare little-endian records of float64 without a header. Applanix' body axes are forward,
right, down, and its attitude is C = Rz(heading) Ry(pitch) Rx(roll) into north, east, down, with
roll right side down and pitch nose up. In axes right, forward, up and east, north, up this is
Rz(-heading) Rx(pitch) Ry(roll): roll and pitch keep their signs, and only the heading must be
converted to grid north:

    true heading = platform heading - wander angle
    grid heading = true heading - meridian convergence

Checked on a real airborne SBET (EPSG:32611) and its own LAS, beams of 5 km: they are in one plane
of the body to 0.0041 deg, and with the sign of roll or pitch reversed to more than three times
that. Flatness over trial headings is best 0.13 deg (sigma 0.22 deg) from the heading read here;
without the wander angle the heading is 1.02 deg off (4 sigma), without the convergence 1.24 deg (6
sigma).
"""

from pathlib import Path

import numpy as np

from mlscorr.frames import attitude_from_angles
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import PLACE_OF_CRS, OpenQuestion, as_path, file_state, read_doubles
from mlscorr.io.tables import check_finite
from mlscorr.io.trajectories.pof import POQ_SUFFIX, read_pof, read_poq
from mlscorr.io.trajectories.projection import project
from mlscorr.io.trajectories.time_systems import DAY, count_on, counting_on
from mlscorr.survey import WEEK, Trajectory

SBET_FIELDS = (
    "gps_time",
    *("latitude", "longitude", "height"),  # rad, rad, m above the ellipsoid
    *("velocity_x", "velocity_y", "velocity_z"),  # m/s, in the wander frame; written only
    *("roll", "pitch", "heading", "wander"),  # rad
    *("acceleration_x", "acceleration_y", "acceleration_z"),  # m/s^2; written only
    *("rate_x", "rate_y", "rate_z"),  # rad/s; written only
)
SMRMSG_FIELDS = (
    "gps_time",
    *("north", "east", "down"),  # m, one sigma
    *("velocity_north", "velocity_east", "velocity_down"),  # m/s; not used
    *("roll", "pitch", "heading"),  # arc-minutes, one sigma
)
LIMITS = {  # largest possible magnitude of a value in radians
    "latitude": np.pi / 2,
    "longitude": 2 * np.pi,
    "roll": np.pi,
    "pitch": np.pi / 2,
    "heading": 2 * np.pi,
    "wander": 2 * np.pi,
}


def read_sbet(path: str | Path, crs: str | None, accuracy: str | Path | None = None) -> Trajectory:
    """Read a trajectory in a projected CRS from an SBET file.

    Positions are projected from the CRS's own geodetic datum. The ellipsoidal height does not
    change, unless the CRS has a vertical part.

    Parameters
    ----------
    path : path
    crs : str
        Any projected CRS in meters that pyproj understands; compound for physical heights.
    accuracy : path, optional
        The smrmsg file; its 1 Hz sigmas are interpolated.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError
        For a missing or unsuitable CRS, an incomplete record, values that are not radians, or a
        missing geoid grid.
    """
    _check_known(path, crs, "an SBET")
    record = _read_records(path, SBET_FIELDS, "SBET")
    _check_radians(path, record)
    return _in_map(path, crs, counting_on(record), accuracy, 0.0)


def read_riegl(
    path: str | Path, crs: str | None, accuracy: str | Path | None = None
) -> tuple[Trajectory, str]:
    """Read a trajectory in a projected CRS from a RIEGL POF, with the angles of an SBET.

    Parameters
    ----------
    path, crs
        See read_sbet.
    accuracy : path, optional
        Its POQ, or a smrmsg file.

    Returns
    -------
    trajectory : Trajectory
    layout : str
        A sentence.

    Raises
    ------
    ValueError
        See read_sbet and read_pof.
    """
    record, constant, layout = read_pof(path)
    _check_known(path, crs, "a POF")
    trajectory = _in_map(path, crs, record | {"wander": 0.0}, accuracy, constant)
    return trajectory, (
        f"{layout}; latitude and longitude in the datum of {crs}, altitudes as heights above the "
        "ellipsoid; heading clockwise from true north, pitch nose up, roll right side down."
    )


def _check_known(path, crs, kind):
    """Refuse geographic positions without a CRS."""
    if crs is None:
        raise OpenQuestion(
            f"{path} is {kind} with latitude and longitude: set crs in survey.toml "
            'to the projected CRS of cloud and control, e.g. crs = "EPSG:32650".',
            [PLACE_OF_CRS],
        )


def _in_map(path, crs, record, accuracy, constant):
    """Trajectory of geographic columns; the constant (s) was added to a POF's times."""
    try:
        position, convergence = project(crs, record)
        heading = record["heading"] - record["wander"] - convergence
        attitude = attitude_from_angles(record["roll"], record["pitch"], heading)
        sigmas = (None, None)
        if accuracy:
            sigmas = _sigmas(accuracy, record["gps_time"], constant)
        weeks = record.get("weeks")
        return Trajectory(record["gps_time"], position, attitude, *sigmas, weeks=weeks)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def is_sbet(path: str | Path) -> bool:
    """True if a file with any name can only be an SBET: whole records, angles, increasing times.

    Parameters
    ----------
    path : path
    """
    size = file_state(path)[0]
    width = 8 * len(SBET_FIELDS)
    if size % width or size < 2 * width:
        return False
    places = [0, size // width // 2, size // width - 1]
    fields = len(SBET_FIELDS)
    table = np.stack([read_doubles(path, place * fields, fields) for place in places])
    with np.errstate(invalid="ignore"):
        angles = np.abs(table[:, [SBET_FIELDS.index(name) for name in LIMITS]])
        is_within = (angles <= list(LIMITS.values())).all()
        time = table[:, 0]  # text interpreted as numbers is far below 1 s, or infinite
        is_timed = 1.0 < time[0] < time[-1] or count_on(time)[1] is not None
    return bool(
        is_within and np.isfinite(table).all() and is_timed and time[-1] < SETTINGS.microseconds
    )


def _read_records(path, fields, what):
    """Read records of a headerless file as a dict of (n,) float64 arrays."""
    size = file_state(path)[0]
    width = 8 * len(fields)
    if size == 0:
        raise ValueError(f"{path} is empty.")
    if size % width:
        raise ValueError(
            f"{path} has {size} bytes, {size % width} more than {size // width} whole {what} "
            f"records of {width} bytes: it is truncated, or it is not {what}."
        )
    table = read_doubles(path).reshape(-1, len(fields))
    check_finite(path, table, f"{what} record")
    return dict(zip(fields, table.T.astype(float), strict=True))


def _check_radians(path, record):
    """Refuse an SBET whose angles cannot be radians."""
    for name, limit in LIMITS.items():
        worst = np.abs(record[name]).max()
        if worst > limit * (1 + 1e-9):
            cause = "it may be in degrees" if worst <= 360 else "the file may not be an SBET"
            raise ValueError(
                f"{path} has a {name} of {worst:.6g}; radians up to {limit:.4f} are expected: "
                f"{cause}."
            )


def _cause(accuracy, gps_time):
    """Likely cause of different times in an accuracy file and its trajectory."""
    difference = float(np.mean(gps_time[[0, -1]]) - np.mean(accuracy[[0, -1]]))
    if weeks := round(difference / WEEK):
        return f"they are {weeks:+d} weeks apart, so one of the two has the wrong GPS week"
    if 10 <= abs(difference) <= 40:
        return (
            f"they are {difference:+.1f} s apart, so one may be in UTC, which differs by leap "
            "seconds"
        )
    return "it belongs to another trajectory"


def _counted_on(accuracy, gps_time):
    """Times of an accuracy file, continued across weeks like those of its trajectory. Units: s."""
    for period in (WEEK, DAY):  # seconds of day only if a POF has them
        times, periods = count_on(accuracy, period)
        if periods is not None:
            difference = np.mean(times[[0, -1]]) - np.mean(gps_time[[0, -1]])
            return times - period * np.round(difference / period)
    return accuracy


def _sigmas(path, gps_time, constant):
    """Sigmas (n, 3) of E, N, H (m) and roll, pitch, heading (rad) at the trajectory's times."""
    is_poq = as_path(path).suffix.lower() == POQ_SUFFIX
    if is_poq:
        record = read_poq(path)
    else:
        record = _read_records(path, SMRMSG_FIELDS, "smrmsg")
    times = _counted_on(record["gps_time"], gps_time - constant) + constant
    step = np.median(np.diff(times)) if len(times) > 1 else 0.0
    if (np.diff(times) <= 0).any():
        raise ValueError(f"the times of the accuracy file {path} do not increase.")
    if times[0] - gps_time[0] > 2 * step or gps_time[-1] - times[-1] > 2 * step:
        raise ValueError(
            f"the accuracy file {path} covers [{times[0]:.1f}, {times[-1]:.1f}] s, not the "
            f"trajectory's [{gps_time[0]:.1f}, {gps_time[-1]:.1f}] s: {_cause(times, gps_time)}."
        )
    at_epochs = {name: np.interp(gps_time, times, values) for name, values in record.items()}
    position = np.column_stack([at_epochs[name] for name in ("east", "north", "down")])
    attitude = np.column_stack([at_epochs[name] for name in ("roll", "pitch", "heading")])
    if min(position.min(), attitude.min()) < 0:
        kind = "a POQ" if is_poq else "smrmsg"
        raise ValueError(f"the accuracy file {path} has negative sigmas: it may not be {kind}.")
    if not is_poq:  # arc minutes
        attitude = np.radians(attitude / 60)
    return position, attitude
