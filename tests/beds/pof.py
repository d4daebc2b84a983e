"""RIEGL's POF and POQ, written from their public layout."""

from datetime import date

import numpy as np
from pyproj import Proj

from mlscorr.frames import angles_from_attitude


def geographic(trajectory, crs):
    "Longitude, latitude (deg), height (m), roll, pitch, heading from true north (deg)"
    plane = Proj(crs)
    longitude, latitude = plane(*trajectory.position[:, :2].T, inverse=True)
    roll, pitch, heading = np.degrees(angles_from_attitude(trajectory.attitude))
    heading = heading + plane.get_factors(longitude, latitude).meridian_convergence
    height = trajectory.position[:, 2]
    return np.column_stack([longitude, latitude, height, roll, pitch, heading % 360.0])


def pof_bytes(trajectory, crs, minor=1, day=date(2026, 5, 7), unit=2, system=0, seconds=0.0):
    "The bytes of a POF; seconds are taken off the times"
    table = np.column_stack([trajectory.gps_time - seconds, geographic(trajectory, crs)])
    box = np.column_stack([table[:, 1:4].min(axis=0), table[:, 1:4].max(axis=0)])
    step = np.diff(table[:, 0])
    if minor >= 1:
        table = np.column_stack([table, np.zeros(len(table))])
    numbers = [
        np.array([1, minor], "<u2"),
        np.array([400], "<u4"),
        np.array([day.year, day.month, day.day], "<u2"),
        np.array([len(table)], "<i8"),
        box.astype("<f8"),
        np.array([step.mean(), step.max(), step.std()], "<f8"),
        np.array([unit, system], "u1"),
    ]
    header = b"RIEGL POF".ljust(27, b"\0") + b"".join(part.tobytes() for part in numbers)
    return header.ljust(400, b"\0") + table.astype("<f8").tobytes()


def poq_bytes(trajectory, minor=1, seconds=0.0):
    "The bytes of a POQ with the trajectory's own sigmas"
    north_east_down = trajectory.position_sigma[:, [1, 0, 2]]
    columns = [trajectory.gps_time - seconds, north_east_down]
    columns += [np.degrees(trajectory.attitude_sigma), np.full(len(trajectory), 1.2)]
    satellites = 2 if minor >= 1 else 1
    records = np.zeros(len(trajectory), [("values", "<f8", 8), ("count", "<u2", satellites)])
    records["values"] = np.column_stack(columns)
    header = b"RIEGL POQ".ljust(35, b"\0") + np.array([1, minor], "<u2").tobytes()
    return header + np.zeros(3).tobytes() + records.tobytes()
