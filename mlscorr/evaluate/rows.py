"""Rows on residuals at surveyed points, made once for files, screen and pictures."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mlscorr.evaluate.wording import reason_in_words
from mlscorr.survey import Statement

NAMES = ("rmse", "mean", "std", "min", "max")  # of statistics, as in documents
VECTORS = ("surveyed", "observed", "sigma", "before", "after", "left_out")  # of a TargetRow
SINGLE = ("name", "gps_time", "role", "used")
CHECK_POINT = Statement("check point")  # reason for exclusion from the estimate
SEEN_BY_OTHERS = Statement("seen by others")  # for targets of another scanner
Reason = tuple[str, Statement | None]  # name of a point, and reason for its exclusion


@dataclass(frozen=True)
class Statistics:
    """Statistics of residuals in E, N, H, and of their lengths in plan and in space.

    Parameters
    ----------
    n : int
        Number of residuals.
    rmse, mean, std, minimum, maximum : (5,) array
        E, N, H, horizontal and 3D; NaN if there are too few residuals. std is the sample standard
        deviation. Units: m.
    """

    n: int
    rmse: np.ndarray
    mean: np.ndarray
    std: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray

    @classmethod
    def of(cls, residuals: np.ndarray) -> Statistics:
        """Make the statistics of residuals (n, 3) in m.

        >>> statistics = Statistics.of(np.array([[0.3, 0.0, -0.1], [-0.4, 0.0, 0.1]]))
        >>> statistics.rmse[:3].round(4).tolist(), float(statistics.maximum[3])
        ([0.3536, 0.0, 0.1], 0.4)
        """
        n = len(residuals)
        unknown = np.full(5, np.nan)
        if n == 0:
            return cls(n, *[unknown] * len(NAMES))
        lengths = [np.linalg.norm(residuals[:, :axes], axis=1) for axes in (2, 3)]
        values = np.column_stack([residuals, *lengths])
        rmse = np.sqrt(np.mean(values**2, axis=0))
        mean = values.mean(axis=0)
        std = values.std(axis=0, ddof=1) if n > 1 else unknown
        return cls(n, rmse, mean, std, values.min(axis=0), values.max(axis=0))

    @property
    def table(self) -> np.ndarray:
        """Statistics (5, 5), with a row each for E, N, H, horizontal and 3D."""
        return np.stack([self.rmse, self.mean, self.std, self.minimum, self.maximum], axis=1)

    def document(self) -> dict:
        """Return the statistics as in documents, None if undetermined."""
        east, north, height, horizontal, spatial = (
            _numbers(values) or [None] * len(NAMES) for values in self.table
        )
        document = {
            name: None if e is None else [e, n, h]
            for name, e, n, h in zip(NAMES, east, north, height, strict=True)
        }
        for end, values in (("horizontal", horizontal), ("3d", spatial)):
            document |= {f"{name}_{end}": v for name, v in zip(NAMES, values, strict=True)}
        return document


@dataclass(frozen=True)
class Score:
    """Misclosures and residuals at control or check points, before and after a correction.

    Parameters
    ----------
    before, after : Statistics
    left_out : Statistics or None
        Leave-one-out residuals of control points.
    sigma : (3,) array or None
        RMS of one sigma of residuals of check points, or of leave-one-out residuals of control
        points: from targets, their survey and the correction. Units: m.
    """

    before: Statistics
    after: Statistics
    left_out: Statistics | None = None
    sigma: np.ndarray | None = None

    @property
    def n(self) -> int:
        """Number of observations."""
        return self.after.n

    def document(self) -> dict:
        """Return the section ``control`` or ``check`` of report.json."""
        document = {"n": self.n, "before": self.before.document(), "after": self.after.document()}
        if self.left_out is not None:
            document["leave_one_out"] = {"n": self.left_out.n, **self.left_out.document()}
        return document


@dataclass(frozen=True)
class TargetRow:
    """One observation of a surveyed point, or a surveyed point without any.

    Parameters
    ----------
    name : str
    pass_number : int or None
        Passes are numbered from 1 in order of time.
    gps_time : float or None
        Time of the observation, or of one that was refused for the point. Units: s.
    role : str
        ``control`` or ``check``.
    surveyed, observed, sigma, before, after, left_out : (3,) array
        Positions, one sigma of the misclosure, and misclosures (surveyed - observed) as recorded,
        corrected, and leave-one-out; NaN if unknown. Units: m.
    used : bool
        True if it was used in the estimate.
    why : Statement or None
        Reason why it was not used; ``reason`` has its sentence.
    scanned : bool
        True if there are points of the cloud around it, so that it should have been observed.
    """

    name: str
    pass_number: int | None
    gps_time: float | None
    role: str
    surveyed: np.ndarray
    observed: np.ndarray
    sigma: np.ndarray
    before: np.ndarray
    after: np.ndarray
    left_out: np.ndarray
    used: bool
    why: Statement | None
    scanned: bool = True

    @classmethod
    def unobserved(
        cls,
        name: str,
        pass_number: int | None,
        role: str,
        surveyed: np.ndarray,
        why: Statement,
        scanned: bool = True,
        gps_time: float | None = None,
    ) -> TargetRow:
        """Make the row of a surveyed point without an observation, or with a refused one."""
        nan = np.full(3, np.nan)
        unknown: dict[str, Any] = dict.fromkeys(VECTORS[1:], nan)
        start = name, pass_number, gps_time, role, surveyed
        return cls(*start, **unknown, used=False, why=why, scanned=scanned)

    @classmethod
    def read(cls, row: dict) -> TargetRow:
        """Read a row of ``targets[]`` in report.json."""
        fields: dict[str, Any] = {name: row[name] for name in SINGLE}
        for name in VECTORS:
            fields[name] = np.array(row.get(name) or [np.nan] * 3, dtype=float)
        why = None
        if row["reason"] is not None:
            why = Statement("not matched", values={"why": row["reason"]})
        return cls(pass_number=row["pass"], **fields, why=why, scanned=row.get("scanned", True))

    @property
    def reason(self) -> str | None:
        """Reason for exclusion from the estimate, in words; None if it was used."""
        if self.why is None:
            return None
        return reason_in_words(self.why)

    @property
    def is_observed(self) -> bool:
        """True if the target was observed."""
        return bool(np.isfinite(self.observed).all())

    @property
    def group(self) -> str:
        """Group of the row: ``control``, ``check`` or ``unused``.

        Check points are never used in the estimate, so they count as unused only if they were not
        observed.
        """
        if self.used or (self.role == "check" and self.is_observed):
            return self.role
        return "unused"

    def document(self) -> dict:
        """Return the row of ``targets[]`` in report.json."""
        return {
            "name": self.name,
            "pass": self.pass_number,
            "gps_time": self.gps_time,
            "role": self.role,
            **{name: _numbers(getattr(self, name)) for name in VECTORS},
            "used": self.used,
            "reason": self.reason,
            "scanned": self.scanned,
        }


@dataclass(frozen=True)
class PointCounts:
    """Numbers of surveyed points of a role, each counted once regardless of its passes.

    Parameters
    ----------
    surveyed, observed, scored : int
        In the control file; observed with their names; used as control or check points.
    missing : tuple of (str, Statement or None)
        Name and reason of each with surrounding points of the cloud but no observation.
    refused, outside : tuple of (str, Statement or None)
        Name and reason of each that was observed but not used, and of each whose surroundings were
        not scanned, or only by another scanner.
    misplaced : tuple of (str, Statement or None)
        Missing points with a nearby object that differs in position, kind or size.
    """

    surveyed: int
    observed: int
    scored: int
    missing: tuple[Reason, ...] = ()
    refused: tuple[Reason, ...] = ()
    outside: tuple[Reason, ...] = ()
    misplaced: tuple[Reason, ...] = ()

    @property
    def hidden(self) -> tuple[Reason, ...]:
        """Missing points without any nearby object."""
        return tuple(point for point in self.missing if point not in self.misplaced)

    @classmethod
    def of(cls, rows: Iterable[TargetRow], role: str) -> PointCounts:
        """Make the counts of the points of a role.

        Parameters
        ----------
        rows : iterable of TargetRow
        role : str
            ``control`` or ``check``.
        """
        rows = [row for row in rows if row.role == role]
        observed = {row.name for row in rows if row.is_observed}
        scored = {row.name for row in rows if row.is_observed and row.group == role}

        def reasons(names):
            first = {row.name: row.why for row in reversed(rows) if row.name in names}
            return tuple((name, first[name]) for name in sorted(first))

        missing = {row.name for row in rows if row.scanned} - observed
        everything = {row.name for row in rows}
        counts = len(everything), len(observed), len(scored)
        outside = everything - observed - missing
        misplaced = missing & {row.name for row in rows if row.gps_time is not None}
        return cls(*counts, *map(reasons, (missing, observed - scored, outside, misplaced)))

    def document(self) -> dict[str, object]:
        """Return the counts of sections ``control`` and ``check`` of report.json."""
        return {
            "n_surveyed": self.surveyed,
            "n_seen": self.observed,
            "n_scored": self.scored,
            "n_unseen": len(self.missing),
            "unseen": [
                {"name": name, "reason": reason_in_words(why)} for name, why in self.missing
            ],
        }


def _numbers(values):
    """List of floats, with None for unknown ones; None if all are unknown."""
    numbers = [value if np.isfinite(value) else None for value in values.tolist()]
    if all(value is None for value in numbers):
        return None
    return numbers
