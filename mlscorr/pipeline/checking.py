"""``check``: all faults of a survey before its correction, and the resources it needs."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.estimate import SETTINGS, checked_inputs, few_targets, sentences_of
from mlscorr.evaluate import DatumDifference, datum_differences, outside_warnings
from mlscorr.io.clouds import (
    cloud_box,
    counted_noise,
    crs_conflict,
    read_in_part,
    read_layout,
    stated_crs,
    timed_records,
)
from mlscorr.io.store import glance
from mlscorr.io.surveys import read_survey
from mlscorr.io.tables import far_cloud
from mlscorr.io.trajectories import crs_code, crs_name
from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.pipeline import needs
from mlscorr.pipeline.control_checks import check_control, reuse_warnings
from mlscorr.pipeline.faults import Fault, Faults, find_faults
from mlscorr.pipeline.finding import find_control
from mlscorr.pipeline.quick_look import QuickLook, check_near_control
from mlscorr.survey import ControlPoints, Matched, Survey


@dataclass(frozen=True)
class CheckedSurvey:
    """Result of a check of a survey.

    Parameters
    ----------
    faults : tuple of Fault
        Faults that stop a correction, or make it wrong.
    warnings : tuple of str
        Possible faults.
    notes : tuple of str
        Findings, and checked items.
    unchecked : tuple of str
        Unchecked items, with reasons.
    is_searched : bool
        True if a control point was found and matched, as a correction requires.
    read, written, needed : tuple of Amount
        Amounts for a correction; empty if a fault prevents reading.
    datum : tuple of DatumDifference
        Overall differences of the checked control from the cloud; the warnings include its
        sentences.
    """

    faults: tuple[Fault, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...] = ()
    unchecked: tuple[str, ...] = ()
    is_searched: bool = False
    read: tuple[needs.Amount, ...] = ()
    written: tuple[needs.Amount, ...] = ()
    needed: tuple[needs.Amount, ...] = ()
    datum: tuple[DatumDifference, ...] = ()


def check(path: str | Path) -> CheckedSurvey:
    """Check a survey in seconds: all faults at once, without correcting it.

    Headers, sampled times and points near some surveyed points are read. If no control point is
    found there, the clouds are read as in a correction.

    Parameters
    ----------
    path : path
        survey.toml, or its folder.

    Returns
    -------
    CheckedSurvey

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 4.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> checked = mlscorr.check(folder)
    >>> checked.faults, len(checked.warnings)
    ((), 0)
    """
    first = Faults()
    with glance():
        survey = first.of("data", read_survey, path)
        if survey is not None:
            return checked_survey(survey, first)
        faults = Faults()
        find_faults(path, faults)
    for fault in first.faults:
        faults.add(fault.where, fault.sentence, fault.number)
    reason = "Targets in the cloud, time and memory: not checked until the faults are corrected."
    return CheckedSurvey(tuple(faults.faults), tuple(faults.warnings), unchecked=(reason,))


def checked_survey(survey: Survey, faults: Faults, needs_control: bool = True) -> CheckedSurvey:
    """Check a survey that can be read.

    Parameters
    ----------
    survey : Survey
    faults : Faults
        Known faults; more are added.
    needs_control : bool
        True if nothing is corrected without a target.
    """
    for sentence in _crs_conflicts(survey):
        faults.warnings = [warning for warning in faults.warnings if warning != sentence]
        faults.add("data", sentence)
    layouts = [read_layout(path) for path in survey.cloud_paths]
    passes, outside = _placed_times(survey)
    if not passes:
        faults.add("data", "No point of any cloud was measured during the trajectory.")
    uncovered, is_uncovered = _uncovered(survey, layouts)
    faults.warn(*outside, *_crs_hints(survey, layouts), *uncovered)
    for layout in layouts:
        sentence, is_explained = far_cloud(
            layout.cloud.name, cloud_box(layout)[:, :2], survey.trajectory
        )
        if is_explained:
            faults.add("data", sentence)
        elif sentence:  # from a header, which may be wrong
            faults.warn(sentence)
    with counted_noise() as noise:
        sample = faults.of("data", needs.sample_clouds, survey)
        faults.warn(*(sample.warnings if sample else ()))
        probe, matched, is_searched, notes, unchecked = _looked(
            survey, faults, needs_control, is_uncovered
        )
    notes += filter(None, [noise.sentence])
    datum: tuple[DatumDifference, ...] = ()
    if matched is not None:
        datum = datum_differences(matched, survey.trajectory, survey.pos, survey.crs)
    faults.warn(*(difference.sentence for difference in datum))
    return CheckedSurvey(
        faults=tuple(faults.faults),
        warnings=tuple(faults.warnings),
        notes=(*survey.notes, *notes),
        unchecked=unchecked,
        is_searched=is_searched,
        read=needs.amounts_read(survey, passes),
        written=needs.amounts_written(survey),
        needed=needs.amounts_needed(survey, sample, probe) if sample else (),
        datum=datum,
    )


def _crs_conflicts(survey) -> Iterator[str]:
    """Yield a sentence on each file with another CRS."""
    if survey.crs is not None:
        sentences = (crs_conflict(read_layout(path), survey.crs) for path in survey.cloud_paths)
        yield from filter(None, sentences)


def _crs_hints(survey, layouts) -> Iterator[str]:
    """Yield a sentence if the files state a CRS and survey.toml does not."""
    stated = stated_crs(layouts[0]) if survey.crs is None else None
    if stated is not None:
        code = crs_code(stated)
        hint = f': set crs = "{code}".' if code else "."
        yield (
            f"survey.toml has no crs, but the VLRs of {layouts[0].path.name} state "
            f"{crs_name(stated)}{hint}"
        )


def _placed_times(survey) -> tuple[int, list[str]]:
    """Number of passes that contain sampled times of the files; sentences on times outside."""
    placed = []
    outside = []
    for file in survey.clouds:
        records = timed_records(read_layout(file.path))
        times = file.trajectory_time(records["gps_time"][file.rows(records["point_source_id"])])
        if not len(times):
            continue
        placed.append(times)
        outside += outside_warnings(survey, file, times)
    return survey.trajectory.count_passes(placed, MATCHING.visit_gap), outside


def _uncovered(survey, layouts) -> tuple[list[str], bool]:
    """Sentences on surveyed points outside the boxes of all files, and flag if all control is."""
    place = survey.surveyed.position[:, :2]
    covered = np.full(len(place), any(read_in_part(file.path) for file in survey.clouds))
    for layout in layouts:
        low, high = cloud_box(layout)[:, :2]
        margin = survey.search_radius
        covered |= ((place >= low - margin) & (place <= high + margin)).all(axis=1)
    names = [survey.surveyed.name[i] for i in np.flatnonzero(~covered)]
    sentence = (
        f"{len(names)} of the {len(place)} surveyed points are more than "
        f"{survey.search_radius:g} m outside the clouds, by their headers (first: "
        f"{next(iter(names), None)})."
    )
    return [sentence] * bool(names), not covered[: len(survey.control)].any()


def _looked(
    survey: Survey, faults: Faults, needs_control: bool, is_uncovered: bool
) -> tuple[QuickLook | None, Matched | None, bool, list[str], tuple[str, ...]]:
    """Search for some targets.

    Returns the quick look, whether a control point was found, and sentences on found and on
    unchecked items.
    """
    if needs_control:
        faults.of("data", check_control, survey)
        faults.warn(*sentences_of(few_targets(len(survey.control))))
    faults.warn(*reuse_warnings(survey))
    if not len(survey.surveyed):
        return None, None, False, [], ("Targets in the cloud: the survey has no control.",)
    if parts := [file.path.name for file in survey.clouds if read_in_part(file.path)]:
        reason = f"Targets in the cloud: only the first points of {', '.join(parts)} were read."
        return None, None, False, [], (reason,)
    problems = Faults()
    probe = problems.of("data", check_near_control, survey)
    if probe is None:
        reasons = tuple(f"Targets in the cloud: {fault.sentence}" for fault in problems.faults)
        return None, None, False, [], reasons
    faults.warn(*problems.warnings)
    points = probe.points
    matched = probe.matched
    if probe.fault:
        faults.add("data", probe.fault)
    elif needs_control and len(survey.control) and probe.refusal:
        if is_uncovered:
            faults.add("data", probe.refusal)
        else:
            finding = faults.of("data", find_control, survey)
            if finding is not None:
                points = survey.surveyed
                control, check_points = finding.matches.by_role(survey)
                matched = Matched.concatenate([control, check_points])
    elif probe.doubt:
        faults.warn(probe.doubt)
    control = matched[np.isin(matched.name, survey.control.name)]
    if len(control):
        faults.of("data", checked_inputs, survey.trajectory, control, survey.pos, SETTINGS.order)
    notes, unchecked = _found_notes(survey, points, matched)
    return probe, matched, len(control) > 0, notes, unchecked


def _found_notes(
    survey: Survey, points: ControlPoints, matched: Matched
) -> tuple[list[str], tuple[str, ...]]:
    """Sentences on found surveyed points, and on unchecked ones."""
    names = set(matched.name)
    lost = [name for name in points.name if name not in names]
    missing = f", not {', '.join(lost)}" if lost else ""
    notes = [f"{len(names)} of {len(points)} tested targets were found{missing}."]
    if len(matched):
        middle = ", ".join(
            f"{axis} {value:+.3f}"
            for axis, value in zip("ENH", np.median(matched.misclosure, axis=0), strict=True)
        )
        notes.append(f"Median misclosure at the {len(names)} targets found: {middle} m.")
    if len(points) == len(survey.surveyed):
        return notes, ()
    return notes, (f"Targets: only {len(points)} of {len(survey.surveyed)} were tested.",)
