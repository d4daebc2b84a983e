"""One trajectory from several files: sessions of the POS, joined in order of time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.io.settings import SETTINGS
from mlscorr.io.trajectories.conventions import TrajectorySection
from mlscorr.io.trajectories.time_systems import NAMES, usual_systems
from mlscorr.io.trajectories.trajectory import read_trajectory_file
from mlscorr.survey import WEEK, Pos, Trajectory

KINDS = ("position", "attitude")


@dataclass(frozen=True)
class SessionFile:
    """File of [trajectory] or of one [[trajectory]].

    Parameters
    ----------
    path : Path
    accuracy : Path or None
        Accuracy file of an SBET.
    section : TrajectorySection
        Its section of survey.toml.
    """

    path: Path
    accuracy: Path | None
    section: TrajectorySection


@dataclass(frozen=True)
class Sessions:
    """Trajectory of a survey, and its sources.

    Parameters
    ----------
    trajectory : Trajectory
        Trajectory of all sessions.
    parts : tuple of Trajectory
        Trajectory of each file.
    is_sbet : bool
        True if one of the files is an SBET.
    layouts : tuple of str
        Notes on how foreign tables were interpreted.
    notes : tuple of str
        Notes on how the files were joined, and on constants added to times.
    """

    trajectory: Trajectory
    parts: tuple[Trajectory, ...]
    is_sbet: bool
    layouts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def read_sessions(
    files: Sequence[SessionFile], crs: str | None = None, pos: Pos | None = None
) -> Sessions:
    """Read the trajectory of a survey from one file, or join several.

    Parameters
    ----------
    files : sequence of SessionFile
    crs : str, optional
        See read_trajectory.
    pos : Pos, optional
        Accuracy from survey.toml for a trajectory without sigmas.

    Returns
    -------
    Sessions

    Raises
    ------
    ValueError
        See read_trajectory_file; also if the files cannot belong to one drive.
    """
    read = [read_trajectory_file(f.path, crs, f.accuracy, f.section) for f in files]
    names = [file.path.name for file in files]
    parts = [
        replace(part.trajectory, gps_time=part.trajectory.gps_time + file.section.time_constant)
        for part, file in zip(read, files, strict=True)
    ]
    joined = parts[0]
    notes = []
    if len(parts) > 1:
        check_systems(names, parts)
        parts = across_week_end(parts)
        parts, notes = with_sigmas(names, parts, pos)
        joined, joints = join_sessions(names, parts, pos or Pos())
        notes = [_summary(names, parts, joined), *joints, *notes]
    notes += _week_ends(names, parts)
    notes += [
        f"{file.section.time_constant:+g} s (trajectory.time_constant) were added to the times "
        f"of {name}; written trajectories include this."
        for name, file in zip(names, files, strict=True)
        if file.section.time_constant
    ]
    layouts = tuple(filter(None, (file.layout for file in read)))
    return Sessions(joined, tuple(parts), any(f.is_sbet for f in read), layouts, tuple(notes))


def _summary(names, parts, joined):
    """Sentence on several files."""
    order = np.argsort([part.gps_time[0] for part in parts])
    listed = ", ".join(f"{names[i]} {_span(parts[i])}" for i in order)
    return (
        f"The trajectory was joined from {len(parts)} files in time order ({listed}): "
        f"{len(joined)} epochs, gaps {len(joined.gaps)}."
    )


def _span(part):
    return f"[{part.gps_time[0]:.3f}, {part.gps_time[-1]:.3f}] s"


def check_systems(names: Sequence[str], parts: Sequence[Trajectory]) -> None:
    """Refuse trajectories in different time systems, judged by the size of their times.

    Parameters
    ----------
    names : sequence of str
        Names of the files, for messages.
    parts : sequence of Trajectory

    Raises
    ------
    ValueError
    """
    systems = [usual_systems(part.gps_time) for part in parts]
    for name, part, system in zip(names, parts, systems, strict=True):
        if not set(system) & set(systems[0]):
            raise ValueError(
                f"The times of {names[0]} {_span(parts[0])} seem to be {NAMES[systems[0][0]]}, "
                f"those of {name} {_span(part)} {NAMES[system[0]]}. Export all trajectories of a "
                "survey in one time system."
            )


def across_week_end(parts: Sequence[Trajectory]) -> list[Trajectory]:
    """Continue seconds of week of trajectories across the end of a week.

    A week is added to times at the start of a week if the total duration then becomes shorter and
    is less than half a week: a drive from Saturday to Sunday, not from Sunday to Saturday.

    Parameters
    ----------
    parts : sequence of Trajectory
        In one time system.
    """
    starts, ends = np.array([part.gps_time[[0, -1]] for part in parts]).T
    if starts.min() < 0 or usual_systems(ends) != ("week",):
        return list(parts)
    lengths = {}
    for first in np.unique(starts):
        shift = WEEK * (starts < first)
        lengths[first] = (ends + shift).max() - (starts + shift).min()
    first = min(lengths, key=lambda start: lengths[start])
    if lengths[first] >= min(WEEK / 2, lengths[starts.min()]):
        return list(parts)
    counted = list(parts)
    for i in np.flatnonzero(starts < first).tolist():
        part = parts[i]
        counted[i] = replace(part, gps_time=part.gps_time + WEEK, weeks=_weeks(part) + 1)
    return counted


def _weeks(part):
    """Number (n,) of weeks that were added to the times of a trajectory."""
    if part.weeks is None:
        return np.zeros(len(part), int)
    return part.weeks


def _week_ends(names, parts):
    """Sentence on each trajectory to whose times weeks were added."""
    for name, part in zip(names, parts, strict=True):
        if part.weeks is None:
            continue
        first = part.file_time[np.argmax(part.weeks > 0)]
        yield (
            f"The GPS week ends before epoch {np.argmax(part.weeks > 0) + 1} of {name} "
            f"({first:.3f} s): {WEEK:.0f} s are added from there on, so that times increase. "
            "Trajectories are written with the seconds of week of the input."
        )


def with_sigmas(
    names: Sequence[str], parts: Sequence[Trajectory], pos: Pos | None
) -> tuple[list[Trajectory], list[str]]:
    """Add the sigmas stated by one trajectory to all, with sentences on those of [pos].

    Parameters
    ----------
    names : sequence of str
        Names of the files, for messages.
    parts : sequence of Trajectory
    pos : Pos or None
        Assumed accuracy of those without sigmas.

    Raises
    ------
    ValueError
        If there is none.
    """
    parts = list(parts)
    notes = []
    for kind in KINDS:
        key = f"{kind}_sigma"
        lacking = [i for i, part in enumerate(parts) if getattr(part, key) is None]
        if len(lacking) in (0, len(parts)):
            continue
        without = ", ".join(names[i] for i in lacking)
        if pos is None:
            raise ValueError(
                f"{len(lacking)} of the {len(parts)} trajectories have no sigma of {kind} "
                f"({without}), the others do. Export them with sigmas, give the accuracy file of "
                f"an SBET under its [[trajectory]], or set {key} under [pos] in survey.toml."
            )
        for i in lacking:
            stated = np.tile(np.broadcast_to(getattr(pos, key), 3), (len(parts[i]), 1))
            parts[i] = replace(parts[i], **{key: stated})
        notes.append(f"{without} has no sigma of {kind}: that of [pos] is used.")
    return parts, notes


def join_sessions(
    names: Sequence[str], parts: Sequence[Trajectory], pos: Pos
) -> tuple[Trajectory, list[str]]:
    """Join several trajectories in order of time, with gaps between them.

    The overlap of two of them is used once, from the one that starts first. It joins them without a
    gap if both agree to a millimeter, as parts of one export.

    Parameters
    ----------
    names : sequence of str
        Names of the files, for messages.
    parts : sequence of Trajectory
        Either all with sigmas, or none.
    pos : Pos
        Its sigmas are assumed if they have none.

    Returns
    -------
    trajectory : Trajectory
        Without sessions if its time steps separate them.
    notes : list of str
        Sentences on overlaps.

    Raises
    ------
    ValueError
        If two are at different positions at the same time.
    """
    if any(part.weeks is not None for part in parts):
        parts = [replace(part, weeks=_weeks(part)) for part in parts]
    order = sorted(range(len(parts)), key=lambda i: (parts[i].gps_time[0], -len(parts[i])))
    sessions = [_numbers(part) for part in parts]
    kept = []
    notes = []
    largest = 1 + max(session.max() for session in sessions)
    bases = {}
    for number, i in enumerate(order):
        bases[i] = 1 + number * largest
        is_new = np.ones(len(parts[i]), bool)
        for j in order[:number]:
            is_common = parts[j].segment(parts[i].gps_time) >= 0
            if not is_common.any():
                continue
            if _are_one([names[j], names[i]], parts[j], parts[i], is_common, pos):
                bases[i] = bases[j]
                how = "and are identical: the two are joined"
            else:
                how = "and are equal within their sigmas: the two stay separate"
            notes.append(
                f"{is_common.sum()} epochs of {names[i]} overlap {names[j]} {how}. Those of "
                f"{names[j]} are used."
            )
            is_new &= ~is_common
        if is_new.any():
            kept.append(replace(parts[i], session=bases[i] + sessions[i]).select(is_new))
    parted = Trajectory.concatenate(kept)
    whole = replace(parted, session=None)
    if np.array_equal(whole.gaps, parted.gaps):
        return whole, notes
    return parted, notes


def _numbers(part):
    """Sessions (n,) of a single trajectory, from 0."""
    if part.session is None:
        return np.zeros(len(part), int)
    return part.session - part.session.min()


def _are_one(names, first, second, is_common, pos):
    """True if two trajectories are the same; raises ValueError if their positions differ."""
    there = Trajectory.at(first, second.gps_time[is_common])
    distance = np.linalg.norm(there.position - second.position[is_common], axis=1)
    turned = (there.attitude * second.attitude[is_common].inv()).magnitude()
    limits = []
    for kind in KINDS:
        key = f"{kind}_sigma"
        stated = getattr(second, key)
        if stated is None:
            limits.append(np.linalg.norm(np.broadcast_to(getattr(pos, key), 3)) * np.sqrt(2))
        else:
            both = np.hstack([getattr(there, key), stated[is_common]])
            limits.append(_rms(np.linalg.norm(both, axis=1)))
    difference = _rms(distance)
    turn = _rms(turned)
    if difference > limits[0] or turn > limits[1]:
        common = second.gps_time[is_common]
        raise ValueError(
            f"{names[0]} and {names[1]} overlap by {np.ptp(common):.1f} s (from {common[0]:.3f} "
            f"s) and differ by {difference:.3f} m and {np.degrees(turn):.4f} deg (RMS); their "
            f"sigmas are {limits[0]:.3f} m and {np.degrees(limits[1]):.4f} deg. For two vehicles, "
            "make two surveys. For one vehicle, give only the final trajectory, and times of "
            "different weeks as continuous GPS seconds."
        )
    return bool(distance.max() <= SETTINGS.same_export)


def _rms(values):
    return float(np.sqrt(np.mean(np.square(values))))
