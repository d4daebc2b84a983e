"""The report of a correction: what report.json holds, and pages and figures show."""

from dataclasses import asdict, dataclass, field, replace

import numpy as np

from mlscorr.estimate import DRIFT, REASONS, Jump, NextControl, Support
from mlscorr.evaluate import CheckSigmas, DatumDifference, PointCounts, Score, Statistics, TargetRow
from mlscorr.survey import Assumption, PointCloud, ProjectNames

GROUPS = ("control", "check", "unused")


@dataclass(frozen=True)
class FileRow:
    """A file that was read or written.

    Parameters
    ----------
    name : str
    sha256 : str
    what : str or None
        None for a corrected cloud.
    points, bytes : int or None
        A cloud's size is told in points, that of other files in bytes.
    """

    name: str
    sha256: str
    what: str | None = None
    points: int | None = None
    bytes: int | None = None

    def document(self) -> dict:
        """The row of ``files[]``, ``inputs[]`` or ``outputs[]`` in report.json."""
        row = {"what": self.what, "name": self.name, "points": self.points, "bytes": self.bytes}
        known = {key: value for key, value in row.items() if value is not None}
        return {**known, "sha256": self.sha256}


@dataclass(frozen=True)
class Coverage:
    """What the control points and the trajectory cover.

    Parameters
    ----------
    control_span : (float, float)
        First and last control epoch. Units: s.
    longest_gap_s : float
        Longest time without control inside a pass, its ends included. Units: s.
    points_outside_trajectory, points_outside_control : int
        Points that were left as they were, and points before the first or past the last control
        point of the survey.
    points_extrapolated, points_corrected : int
        Points in the weak stretches, and all that were moved.
    points_noise : int
        Points flagged as noise, which took no part in the measurement.
    """

    control_span: tuple[float, float]
    longest_gap_s: float
    points_outside_trajectory: int = 0
    points_outside_control: int = 0
    points_extrapolated: int = 0
    points_corrected: int = 0
    points_noise: int = 0

    @property
    def share_extrapolated(self) -> float:
        """Of the corrected points, 0 to 1."""
        return self.points_extrapolated / max(self.points_corrected, 1)

    def document(self) -> dict:
        """The section ``coverage`` of report.json."""
        return asdict(self) | {
            "control_span": list(self.control_span),
            "points_untouched": self.points_outside_trajectory,
            "share_extrapolated": self.share_extrapolated,
        }


@dataclass(frozen=True)
class CorrectionReport:
    """All that is told of a correction.

    Parameters
    ----------
    name : str
        Of the survey.
    crs : str or None
    notes : tuple of str
        On what was done when the survey was read.
    targets : list of TargetRow
        One for each surveyed point and pass.
    control, check : Score
    accuracy : dict or None
        As mlscorr.evaluate._accuracy has it.
    model : dict
        As mlscorr.evaluate.model.model_section has it.
    coverage : Coverage
    files, inputs, outputs : tuple of FileRow
        The corrected clouds, what was read, and what else was written.
    support : Support
        What holds the correction along the drive.
    jumps : tuple of Jump
        Of the correction, in time.
    next_control : tuple of NextControl
        Where more control points would help most, the best first.
    ties : dict or None
        As mlscorr.evaluate.model.tie_section has it.
    position_sigma : dict or None
        3D sigma of the corrected position, in m: ``median``, ``largest``, and the ``time`` (s) of
        the latter.
    datum : tuple of DatumDifference
        By what the control that was used differs from the cloud as a whole.
    assumed : tuple of Assumption
        Accuracies of the POS that nobody stated.
    project : ProjectNames
        Names that survey.toml gives.
    recorded : dict or None
        As mlscorr.report.first_look.recorded_time has it.
    check_sigmas : CheckSigmas or None
        Test of the stated sigmas; None without check points.
    well_determined : float or None
        Share of the driven distance that lies in no poorly constrained interval, 0 to 1.
    """

    name: str
    crs: str | None
    notes: tuple[str, ...]
    targets: list[TargetRow]
    control: Score
    check: Score
    accuracy: dict | None
    model: dict
    coverage: Coverage
    files: tuple[FileRow, ...] = ()
    inputs: tuple[FileRow, ...] = ()
    outputs: tuple[FileRow, ...] = ()
    support: Support = field(default_factory=Support)
    jumps: tuple[Jump, ...] = ()
    next_control: tuple[NextControl, ...] = ()
    ties: dict | None = None
    position_sigma: dict[str, float] | None = None
    datum: tuple[DatumDifference, ...] = ()
    assumed: tuple[Assumption, ...] = ()
    project: ProjectNames = field(default_factory=ProjectNames)
    recorded: dict[str, str | None] | None = None
    check_sigmas: CheckSigmas | None = None
    well_determined: float | None = None

    def document(self) -> dict:
        """The content of report.json."""
        rows = ("targets", "files", "inputs", "outputs")
        return {
            "name": self.name,
            "crs": self.crs,
            "notes": list(self.notes),
            "targets": [row.document() for row in self.targets],
            "control": self.control.document() | self.points("control").document(),
            "check": self.check.document() | self.points("check").document(),
            "accuracy": self.accuracy,
            "model": self.model,
            "datum": [difference.document() for difference in self.datum],
            "coverage": self.coverage.document()
            | {"seconds_extrapolated": self.seconds_extrapolated}
            | {"metres_extrapolated": self.metres_extrapolated},
            "ties": self.ties,
            "weak": [stretch.document() for stretch in self.support.weak],
            "drift": {
                "outages": [list(outage) for outage in self.support.outages],
                "steps": list(self.support.steps),
            },
            "jumps": [jump.document() for jump in self.jumps],
            "position_sigma": self.position_sigma,
            "assumed": [vars(row) for row in self.assumed],
            "next_control": [place.document() for place in self.next_control],
            **{name: [row.document() for row in getattr(self, name)] for name in rows[1:]},
            "project": asdict(self.project),
            "recorded": self.recorded,
            "check_sigmas": None if self.check_sigmas is None else self.check_sigmas.document(),
            "well_determined": self.well_determined,
        }

    def points(self, role: str) -> PointCounts:
        """How many surveyed points of a role took part.

        Parameters
        ----------
        role : str
            ``control`` or ``check``.
        """
        return PointCounts.of(self.targets, role)

    @property
    def seconds_extrapolated(self) -> float:
        """How long the weak stretches take together. Units: s."""
        return sum(stretch.seconds for stretch in self.support.weak)

    @property
    def metres_extrapolated(self) -> float:
        """How long the weak stretches are together, along the path. Units: m."""
        return sum(stretch.length_m for stretch in self.support.weak)

    @property
    def holds_everywhere(self) -> bool:
        """Whether what the check points say is true of the whole cloud.

        Control points hold all of it, no point of it was left as it was, and no check point is
        missing where there should be one.
        """
        is_whole = not self.support.weak and self.coverage.points_outside_trajectory == 0
        return is_whole and not self.points("check").missing

    @property
    def is_held_by_others(self) -> bool:
        """Whether control of other drives holds it, without its own: no part lacks it all."""
        whys = {stretch.why for stretch in self.support.weak}
        return self.points("control").scored == 0 and whys <= {REASONS[DRIFT]}

    @property
    def cloud_points(self) -> int:
        """Number of points of the clouds."""
        return sum(file.points or 0 for file in self.files)

    @property
    def judgement(self) -> tuple[Statistics | None, Statistics | None, str]:
        """Statistics before and after that a verdict rests on, and what they are.

        ``check``, ``leave-one-out`` or ``fit``; (None, None, ``nothing``) without any residual.
        """
        kinds = (
            (self.check.before, self.check.after, "check"),
            (self.control.before, self.control.left_out, "leave-one-out"),
            (self.control.before, self.control.after, "fit"),
        )
        for before, after, kind in kinds:
            if before.n and after is not None and after.n:
                return before, after, kind
        return None, None, "nothing"

    def count(self, role: str) -> tuple[int, int]:
        """How many points of a role, and how many observations (one for each pass) of them.

        Parameters
        ----------
        role : str
            ``control`` or ``check``.
        """
        n = getattr(self, role).n
        points = len({row.name for row in self.targets if row.group == role})
        return (points if n else 0) or n, n


def ordered(rows: list[TargetRow], *groups: str) -> list[TargetRow]:
    """Rows by group, each group in time.

    Parameters
    ----------
    rows : list of TargetRow
    *groups : str
        Of GROUPS; all when none is named.
    """

    def key(row):
        time = np.inf if row.gps_time is None else row.gps_time
        return GROUPS.index(row.group), time, row.name or ""

    return sorted((row for row in rows if row.group in (groups or GROUPS)), key=key)


def array(rows: list[TargetRow], name: str) -> np.ndarray:
    """A vector of the rows as an (n, 3) array, NaN where it is not known.

    Parameters
    ----------
    rows : list of TargetRow
    name : str
        The vector's, such as ``before``.
    """
    return np.array([getattr(row, name) for row in rows], dtype=float).reshape(-1, 3)


def recomputed(rows: list[TargetRow], correction) -> list[TargetRow]:
    """Rows with their misclosures as recorded and by this correction, those observed first.

    Parameters
    ----------
    rows : list of TargetRow
    correction : anything with ``apply(cloud) -> cloud``
    """
    known = [row for row in rows if row.is_observed]
    observed = np.array([row.observed for row in known]).reshape(-1, 3)
    times = np.array([row.gps_time for row in known], float)
    moved = correction.apply(PointCloud(observed, times, np.zeros(len(known)))).xyz
    return [
        replace(row, before=row.surveyed - row.observed, after=row.surveyed - place)
        for row, place in zip(known, moved, strict=True)
    ] + [row for row in rows if not row.is_observed]
