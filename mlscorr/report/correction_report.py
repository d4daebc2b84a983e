"""Report of a correction: contents of report.json, pages and figures."""

from dataclasses import asdict, dataclass, field, replace

import numpy as np

from mlscorr.estimate import DRIFT, REASONS, Jump, NextControl, Support
from mlscorr.evaluate import CheckSigmas, DatumDifference, PointCounts, Score, Statistics, TargetRow
from mlscorr.survey import Assumption, PointCloud, ProjectNames

GROUPS = ("control", "check", "unused")


@dataclass(frozen=True)
class FileRow:
    """File that was read or written.

    Parameters
    ----------
    name : str
    sha256 : str
    what : str or None
        None for a corrected cloud.
    points, bytes : int or None
        A cloud's size is given in points, that of other files in bytes.
    """

    name: str
    sha256: str
    what: str | None = None
    points: int | None = None
    bytes: int | None = None

    def document(self) -> dict:
        """Return the row of ``files[]``, ``inputs[]`` or ``outputs[]`` in report.json."""
        row = {"what": self.what, "name": self.name, "points": self.points, "bytes": self.bytes}
        known = {key: value for key, value in row.items() if value is not None}
        return {**known, "sha256": self.sha256}


@dataclass(frozen=True)
class Coverage:
    """Coverage by control points and trajectory.

    Parameters
    ----------
    control_span : (float, float)
        First and last control epoch. Units: s.
    longest_gap_s : float
        Longest time without control within a pass, including its ends. Units: s.
    points_outside_trajectory, points_outside_control : int
        Unchanged points, and points before the first or past the last control point of the survey.
    points_extrapolated, points_corrected : int
        Points in poorly constrained intervals, and all moved points.
    points_noise : int
        Points flagged as noise, which were not used in the measurement.
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
        """Extrapolated share of the corrected points, 0 to 1."""
        return self.points_extrapolated / max(self.points_corrected, 1)

    def document(self) -> dict:
        """Return the section ``coverage`` of report.json."""
        return asdict(self) | {
            "control_span": list(self.control_span),
            "points_untouched": self.points_outside_trajectory,
            "share_extrapolated": self.share_extrapolated,
        }


@dataclass(frozen=True)
class CorrectionReport:
    """Complete report of a correction.

    Parameters
    ----------
    name : str
        Name of the survey.
    crs : str or None
    notes : tuple of str
        Notes on the reading of the survey.
    targets : list of TargetRow
        One for each surveyed point and pass.
    control, check : Score
    accuracy : dict or None
        See mlscorr.evaluate._accuracy.
    model : dict
        See mlscorr.evaluate.model.model_section.
    coverage : Coverage
    files, inputs, outputs : tuple of FileRow
        Corrected clouds, inputs, and other outputs.
    support : Support
        Constraints of the correction along the drive.
    jumps : tuple of Jump
        Jumps of the correction, sorted by time.
    next_control : tuple of NextControl
        Best positions for further control points, sorted by benefit.
    ties : dict or None
        See mlscorr.evaluate.model.tie_section.
    position_sigma : dict or None
        3D sigma of the corrected position, in m: ``median``, ``largest``, and the ``time`` (s) of
        the latter.
    datum : tuple of DatumDifference
        Overall differences of the used control from the cloud.
    assumed : tuple of Assumption
        Accuracies of the POS that nobody stated.
    project : ProjectNames
        Names from survey.toml.
    recorded : dict or None
        See mlscorr.report.first_look.recorded_time.
    check_sigmas : CheckSigmas or None
        Test of the stated sigmas; None without check points.
    well_determined : float or None
        Share of the driven distance outside poorly constrained intervals, 0 to 1.
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
        """Return the contents of report.json."""
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
            "weak": [interval.document() for interval in self.support.weak],
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
        """Count the surveyed points of a role.

        Parameters
        ----------
        role : str
            ``control`` or ``check``.
        """
        return PointCounts.of(self.targets, role)

    @property
    def seconds_extrapolated(self) -> float:
        """Total duration of the poorly constrained intervals. Units: s."""
        return sum(interval.seconds for interval in self.support.weak)

    @property
    def metres_extrapolated(self) -> float:
        """Total length of the poorly constrained intervals along the path. Units: m."""
        return sum(interval.length_m for interval in self.support.weak)

    @property
    def holds_everywhere(self) -> bool:
        """True if the result at the check points applies to the whole cloud.

        Control constrains all of it, no point is unchanged, and no expected check point is missing.
        """
        is_whole = not self.support.weak and self.coverage.points_outside_trajectory == 0
        return is_whole and not self.points("check").missing

    @property
    def is_constrained_by_others(self) -> bool:
        """True if only control of other drives constrains it, without any unconstrained part."""
        whys = {interval.why for interval in self.support.weak}
        return self.points("control").scored == 0 and whys <= {REASONS[DRIFT]}

    @property
    def cloud_points(self) -> int:
        """Number of points of the clouds."""
        return sum(file.points or 0 for file in self.files)

    @property
    def judgement(self) -> tuple[Statistics | None, Statistics | None, str]:
        """Statistics before and after that a verdict uses, and their kind.

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
        """Number of points of a role, and of their observations (one for each pass).

        Parameters
        ----------
        role : str
            ``control`` or ``check``.
        """
        n = getattr(self, role).n
        points = len({row.name for row in self.targets if row.group == role})
        return (points if n else 0) or n, n


def ordered(rows: list[TargetRow], *groups: str) -> list[TargetRow]:
    """Sort rows by group, and each group by time.

    Parameters
    ----------
    rows : list of TargetRow
    *groups : str
        Of GROUPS; all by default.
    """

    def key(row):
        time = np.inf if row.gps_time is None else row.gps_time
        return GROUPS.index(row.group), time, row.name or ""

    return sorted((row for row in rows if row.group in (groups or GROUPS)), key=key)


def array(rows: list[TargetRow], name: str) -> np.ndarray:
    """Vector of the rows as an (n, 3) array, NaN if unknown.

    Parameters
    ----------
    rows : list of TargetRow
    name : str
        Name of the vector, such as ``before``.
    """
    return np.array([getattr(row, name) for row in rows], dtype=float).reshape(-1, 3)


def recomputed(rows: list[TargetRow], correction) -> list[TargetRow]:
    """Recompute misclosures of rows as recorded and after this correction, observed ones first.

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
