"""What a correction was made of: files, coordinate and time systems, beliefs, coverage."""

import numpy as np

from mlscorr.report.tables import number, thousands

FRAMES = (
    ("Map", "easting, northing, height in m, as the files have them"),
    ("Body", "X right, Y forward, Z up, at the trajectory's navigation centre"),
    (
        "Attitude",
        "heading clockwise from grid north, pitch nose up, roll right side down; "
        "R = Rz(−heading) Rx(pitch) Ry(roll)",
    ),
)

TIMES = {"week": "GPS seconds of week", "standard": "adjusted standard GPS time"}


def used(survey):
    """Pairs (what, value) on systems, frames, and what was believed of the instruments."""
    trajectory, time = survey.trajectory, survey.trajectory.gps_time
    crs = survey.crs or "not stated in survey.toml; coordinates are taken as E, N, H in m"
    pairs = [("Coordinate reference system", crs)]
    pairs += [(f"Frame: {name[:1].lower()}{name[1:]}", text) for name, text in FRAMES]
    pairs.append(("Time of the trajectory", f"gps_time {time[0]:.3f} to {time[-1]:.3f} s"))
    pairs += [(f"Time of {cloud.path.name}", _time(cloud)) for cloud in survey.clouds]
    rate = 1 / np.median(np.diff(time))
    pairs.append(("Epochs of the trajectory", f"{thousands(len(time))} at {rate:.4g} Hz"))
    if trajectory.position_sigma is None:
        sigma = f"{survey.pos.position_sigma:g} m at all times, as survey.toml or the default says"
    else:
        sigma = "its own at each epoch"
    pairs.append(("Stated sigma of the trajectory's position", sigma))
    arm = survey.mounting
    text = "not given (not needed: it cancels where only the trajectory is corrected)"
    if arm is not None:
        text = f"right, forward, up {', '.join(f'{v:g}' for v in arm.lever_arm)} m"
    return [*pairs, ("Lever arm of the scanner", text)]


def _time(cloud):
    system = TIMES.get(cloud.time_system, cloud.time_system)
    if not cloud.time_constant:
        return f"{system}, as the trajectory's"
    return f"{system}; {cloud.time_constant:+.3f} s gives the trajectory's"


def files(document):
    """Rows (what, name, size in words, SHA-256) of what went in and what came out."""
    rows = {"Read": document.get("inputs") or [], "Written": []}
    clouds = [{"what": "corrected cloud", **file} for file in document["files"]]
    rows["Written"] = clouds + (document.get("outputs") or [])
    return {
        title: [(row["what"], row["name"], _size(row), row["sha256"]) for row in part]
        for title, part in rows.items()
        if part
    }


def _size(row):
    if row.get("points") is not None:
        return f"{thousands(row['points'])} points"
    return f"{thousands(row['bytes'])} bytes" if "bytes" in row else "–"


def coverage(correction, document):
    """Pairs (what, value) on what the control points and the trajectory cover."""
    given, time = document["coverage"], correction.recorded.gps_time
    span = given.get("control_span")
    pairs = [("Trajectory", f"{time[0]:.3f} to {time[-1]:.3f} s ({time[-1] - time[0]:.1f} s)")]
    if span:
        text = f"{span[0]:.3f} to {span[1]:.3f} s ({span[1] - span[0]:.1f} s)"
        pairs.append(("Control span (first to last control epoch)", text))
    else:
        pairs.append(("Control span (first to last control epoch)", "not determined"))
    longest = given.get("longest_gap_s")
    pairs.append(
        (
            "Longest time without control",
            "not determined" if longest is None else f"{number(longest)} s",
        )
    )
    total = sum(file["points"] or 0 for file in document["files"])
    for key, words in (
        ("points_outside_trajectory", "Points outside the trajectory (left as they were)"),
        ("points_outside_control", "Points outside the control span (correction extrapolated)"),
    ):
        n = given.get(key)
        share = f" ({100 * n / total:.2f} %)" if n and total else ""
        text = "not determined" if n is None else thousands(n) + share
        pairs.append((words, text))
    gaps = len(correction.recorded.gaps)
    return [*pairs, ("Gaps of the trajectory (nothing is interpolated across them)", gaps)]
