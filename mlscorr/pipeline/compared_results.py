"""``compare`` of two results: two runs, settings or releases, value by value.

Both folders come from ``correct``. Every difference is second - first.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mlscorr.io.store import as_path, input_file, is_there, read_bytes
from mlscorr.io.trajectories import check_crs, read_trajectory
from mlscorr.pipeline._result import KnownResult, ResultFiles
from mlscorr.survey import AXES, SAME_EPOCH, InputFile, Trajectory, rows_frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

SAME_TIME = 2e-6  # s; trajectory.csv rounds times to 1e-6 s
SCHEMA = "mlscorr.report/1"
SIDES = ("first", "second")
VECTORS = ("surveyed", "observed", "before", "after")  # compared fields of a target's row
SCORES = {  # parts of report.json with statistics, by their names here
    "check": ("check", "after"),
    "control": ("control", "after"),
    "leave_one_out": ("control", "leave_one_out"),
}
COVERAGE = (
    "points_corrected",
    "points_untouched",
    "points_outside_control",
    "points_extrapolated",
    "share_extrapolated",
    "seconds_extrapolated",
    "metres_extrapolated",
    "longest_gap_s",
)
FILE_LISTS = ("inputs", "files")  # of report.json


@dataclass(frozen=True)
class ResultFolder:
    """Folder written by ``correct``, with the data to compare.

    Parameters
    ----------
    path : Path
    report : dict
        Document of report.json.
    trajectory : Trajectory
        Corrected trajectory.
    """

    path: Path
    report: dict[str, Any]
    trajectory: Trajectory

    @property
    def inputs(self) -> list[InputFile]:
        """Files read from it."""
        names = ("report.json", "trajectory.csv")
        return [input_file("result", self.path / name) for name in names]


def is_result(path: str | Path) -> bool:
    """True if a folder contains a report.json.

    Parameters
    ----------
    path : path
    """
    return is_there(as_path(path) / "report.json")


def read_result(path: str | Path) -> ResultFolder:
    """Read report and trajectory of a folder written by ``correct``.

    Parameters
    ----------
    path : path

    Raises
    ------
    ValueError
        If the folder is not a result of ``correct``, or is damaged.
    """
    path = as_path(path)
    for name in ("report.json", "trajectory.csv"):
        if not is_there(path / name):
            raise ValueError(_no_result(path, name))
    try:
        report = json.loads(read_bytes(path / "report.json"))
    except ValueError as error:
        raise ValueError(
            f"{path / 'report.json'} is not a JSON document: {error}. Copying may have been "
            "interrupted; copy the folder again, or run mlscorr correct."
        ) from None
    schema = report.get("schema") if isinstance(report, dict) else None
    if schema != SCHEMA:
        raise ValueError(
            f"{path / 'report.json'} has the schema {schema!r}, not {SCHEMA!r}. Only results of "
            "mlscorr correct can be compared; another release may have written this one."
        )
    needed = {"name", "targets", "control", "check", "model", "coverage", *FILE_LISTS}
    if missing := sorted(needed - report.keys()):
        raise ValueError(
            f"{path / 'report.json'} has no {', '.join(missing)}: it was edited or truncated. "
            "Run mlscorr correct again."
        )
    return ResultFolder(path, report, read_trajectory(path / "trajectory.csv"))


def _no_result(path, name):
    """Error on a folder that cannot be compared, with the remedy."""
    if is_there(path / "project.json"):
        return (
            f"{path} holds the results of a project. Compare the folders of its drives one by one, "
            f"such as {path}/NAME."
        )
    return (
        f"{path} is not a result of mlscorr correct: it has no {name}. Give two folders written "
        "by mlscorr correct -o."
    )


@dataclass(frozen=True)
class TrajectoryDifference:
    """Second - first corrected trajectory, at the epochs of the first that both cover.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    position : (n, 3) array
        E, N, H. Units: m.
    sigmas : pair of (n, 3) array or None
        One sigma of E, N, H in both. Units: m.
    gaps : (k, 2) array
        Gaps of either trajectory. Units: s.
    interpolated : int
        Number of epochs without a partner in the second, which was interpolated there.
    only : pair of int
        Numbers of epochs of each outside the other one.
    """

    gps_time: np.ndarray
    position: np.ndarray
    sigmas: tuple[np.ndarray | None, np.ndarray | None]
    gaps: np.ndarray
    interpolated: int
    only: tuple[int, int]

    @classmethod
    def of(cls, first: Trajectory, second: Trajectory) -> TrajectoryDifference:
        """Compute the difference of two trajectories; empty without common times.

        Parameters
        ----------
        first, second : Trajectory
        """
        inside = _covered(first.gps_time, second)
        time = first.gps_time[inside]
        nearest = _nearest(second.gps_time, time)
        is_equal = np.abs(second.gps_time[nearest] - time) <= SAME_TIME
        other = second.position[nearest]
        sigma = None if second.position_sigma is None else second.position_sigma[nearest]
        if not is_equal.all():
            start, end = second.gps_time[[0, -1]]
            between = second.at(np.clip(time[~is_equal], start, end))
            other[~is_equal] = between.position
            if sigma is not None:
                sigma[~is_equal] = between.position_sigma
        own = None if first.position_sigma is None else first.position_sigma[inside]
        lost = ~inside, ~_covered(second.gps_time, first)
        gaps = np.vstack([first.gaps, second.gaps])
        gaps = gaps[(gaps[:, 1] > time[0]) & (gaps[:, 0] < time[-1])] if len(time) else gaps[:0]
        difference = other - first.position[inside]
        interpolated = int(np.count_nonzero(~is_equal))
        only = int(lost[0].sum()), int(lost[1].sum())
        return cls(time, difference, (own, sigma), _disjoint(gaps), interpolated, only)

    def document(self) -> dict[str, Any]:
        """Return the section ``trajectory`` of compare_results.json."""
        size = np.linalg.norm(self.position, axis=1)
        columns = [*self.position.T, size]
        return {
            "from": float(self.gps_time[0]),
            "to": float(self.gps_time[-1]),
            "epochs": len(self.gps_time),
            "interpolated": self.interpolated,
            "epochs_only_in": dict(zip(SIDES, map(int, self.only), strict=True)),
            "difference": {
                name: self._statistics(values)
                for name, values in zip((*AXES, "3d"), columns, strict=True)
            },
            "sigma_3d": {
                side: _sigma_statistics(sigma)
                for side, sigma in zip(SIDES, self.sigmas, strict=True)
            },
        }

    def _statistics(self, values):
        """Median, RMS, and largest value with its sign and time."""
        worst = int(np.abs(values).argmax())
        return {
            "median": float(np.median(values)),
            "rms": float(np.sqrt(np.mean(values**2))),
            "largest": float(values[worst]),
            "time": float(self.gps_time[worst]),
        }


def _covered(gps_time, trajectory):
    """Flag (n,) of times within a trajectory, to the rounding of its ends, and outside its gaps."""
    start, end = trajectory.gps_time[[0, -1]]
    is_near = (gps_time >= start - SAME_TIME) & (gps_time <= end + SAME_TIME)
    inside = trajectory.segment(np.clip(gps_time, start, end)) >= 0
    nearest = _nearest(trajectory.gps_time, gps_time)
    is_epoch = np.abs(trajectory.gps_time[nearest] - gps_time) <= SAME_TIME
    return is_near & (inside | is_epoch)


def _nearest(epochs, gps_time):
    """Index of the sorted epoch nearest to each time."""
    right = np.clip(np.searchsorted(epochs, gps_time), 1, len(epochs) - 1)
    return right - (gps_time - epochs[right - 1] < epochs[right] - gps_time)


def _disjoint(spans):
    """Sorted intervals (k, 2), with overlapping ones merged."""
    joined: list[list[float]] = []
    for start, end in sorted(map(tuple, spans)):
        if joined and start <= joined[-1][1]:
            joined[-1][1] = max(joined[-1][1], end)
        else:
            joined.append([start, end])
    return np.array(joined).reshape(-1, 2)


def _sigma_statistics(sigma):
    """Median and largest 3D sigma; None without sigmas."""
    if sigma is None:
        return None
    size = np.linalg.norm(sigma, axis=1)
    return {"median": float(np.median(size)), "largest": float(size.max())}


@dataclass(frozen=True, repr=False)
class ComparedResults(KnownResult):
    """Two results of ``correct`` on one survey, and their differences second - first.

    Parameters
    ----------
    first, second : ResultFolder
    """

    first: ResultFolder
    second: ResultFolder
    _name: ClassVar[str] = "compare_results"

    @cached_property
    def difference(self) -> TrajectoryDifference:
        """Difference of the corrected trajectories over time."""
        return TrajectoryDifference.of(self.first.trajectory, self.second.trajectory)

    def _content(self):
        """Return the document without its schema."""
        from mlscorr.report import results_screen

        reports = self.first.report, self.second.report
        content = {
            "name": reports[0]["name"],
            "crs": reports[0].get("crs"),
            "difference": "second - first; misclosure = surveyed - observed; m",
            "first": _about(self.first),
            "second": _about(self.second),
            "trajectory": self.difference.document(),
            "targets": _target_rows(*(report["targets"] for report in reports)),
            "scores": _scores(*reports),
            "model": _model(*reports),
            "coverage": _rows(COVERAGE, *(report["coverage"] for report in reports)),
            "warnings": _warnings(*reports),
            "files": _file_rows(*reports),
        }
        return results_screen(content) | content

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row for each target and pass, worst first; requires pandas."""
        rows = []
        for row in self.document["targets"]:
            cells = {key: row[key] for key in ("name", "pass", "role", "gps_time", "change_3d")}
            cells |= {f"used_{side}": row["used"][side] for side in SIDES}
            for vector in VECTORS:
                for part in (*SIDES, "difference"):
                    values = row[vector][part] or (None,) * len(AXES)
                    names = (f"{vector}_{part}_{axis}" for axis in AXES)
                    cells |= dict(zip(names, values, strict=True))
            rows.append(cells)
        return rows_frame(rows)

    def plot(self) -> Figure:
        """Plot the difference of the corrected trajectories over time, E, N and H."""
        from mlscorr.report import results_figure

        curves = self.difference
        return results_figure(curves.gps_time, curves.position, curves.sigmas, curves.gaps)

    def _overview(self):
        """Return the rows that terminal and notebook show."""
        rows = [(self.document["name"],)]
        rows += [(f"{side}: {self.document[side]['folder']}",) for side in SIDES]
        rows.append(("difference (mm)", "median", "RMS", "largest", "at (s)"))
        for name, part in self.document["trajectory"]["difference"].items():
            numbers = [f"{1e3 * part[key]:.1f}" for key in ("median", "rms", "largest")]
            rows.append((name, *numbers, f"{part['time']:.2f}"))
        rows.append(("3D RMSE (mm)", *SIDES))
        for name, row in self.document["scores"].items():
            values = [row[side]["rmse_3d"] for side in SIDES]
            words = ["none" if value is None else f"{1e3 * value:.1f}" for value in values]
            rows.append((name.replace("_", "-"), *words))
        return rows

    def _files(self):
        """Return compare_results.json and its page."""
        from mlscorr.report import write_results

        inputs = [*self.first.inputs, *self.second.inputs]
        curves = self.difference

        def page(path, document):
            write_results(
                path,
                document,
                (curves.gps_time, curves.position, curves.sigmas, curves.gaps),
            )

        return ResultFiles.of(self._name, inputs, self.document, {}, {"compare_results.html": page})


def compare_results(first: str | Path, second: str | Path) -> ComparedResults:
    """Compare two results of ``correct`` on one survey: two runs, settings or releases.

    Parameters
    ----------
    first, second : path
        Folders written by ``correct``, with report.json and trajectory.csv.

    Returns
    -------
    ComparedResults
        Every difference is second - first. ``write`` makes compare_results.json and
        compare_results.html.

    Raises
    ------
    ValueError
        If a folder is not a result, or results belong to different surveys: in different CRS,
        without a common time, or without a common target.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = mlscorr.read_survey(folder)
    >>> for order in (0, 1):
    ...     written = mlscorr.correct(survey, order).write(f"{folder}/order-{order}", page=False)
    >>> compared = mlscorr.compare_results(f"{folder}/order-0", f"{folder}/order-1")
    >>> [(row["what"], row["first"], row["second"]) for row in compared.document["model"][:1]]
    [('order', 0, 1)]
    >>> compared.document["trajectory"]["difference"]["3d"]["largest"] < 0.05  # m
    True
    """
    results = read_result(first), read_result(second)
    if results[0].path.resolve() == results[1].path.resolve():
        raise ValueError(f"Both results are {results[0].path}. Give two different folders.")
    _check_crs(*results)
    _check_targets(*results)
    compared = ComparedResults(*results)
    if not len(compared.difference.gps_time):
        spans = [
            "[{:.3f}, {:.3f}] s".format(*result.trajectory.gps_time[[0, -1]]) for result in results
        ]
        raise ValueError(
            f"The trajectories do not overlap in time: {spans[0]} in {results[0].path}, "
            f"{spans[1]} in {results[1].path}. Compare two results of one survey; if their time "
            "systems differ, correct both with the same one."
        )
    return compared


def _check_crs(first, second):
    """Refuse results with unrelated coordinates."""
    codes = first.report.get("crs"), second.report.get("crs")
    if None in codes or codes[0] == codes[1] or check_crs(codes[0]) == check_crs(codes[1]):
        return
    raise ValueError(
        f"The results are in different CRS: {codes[0]} in {first.path}, {codes[1]} in "
        f"{second.path}. Correct both with the same crs in survey.toml."
    )


def _check_targets(first, second):
    """Refuse results that both have targets, but none in common."""
    names = [{row["name"] for row in result.report["targets"]} for result in (first, second)]
    if all(names) and not names[0] & names[1]:
        raise ValueError(
            f"The results have no common target: {len(names[0])} in {first.path}, "
            f"{len(names[1])} in {second.path}, all with different names. Compare two results of "
            "one survey with the same control list."
        )


def _about(result):
    """Identification of a result."""
    model = result.report["model"]
    return {
        "folder": str(result.path),
        "name": result.report["name"],
        "method": model.get("method"),
        "rating": result.report.get("rating"),
        "headline": result.report.get("headline"),
    }


def _target_rows(first, second):
    """Make a row for each target and pass of either result, sorted by the change of ``after``."""
    rows = [_target_row(*pair) for pair in _pairs(first, second)]
    return sorted(rows, key=lambda row: (-(row["change_3d"] or 0.0), row["name"] or ""))


def _pairs(
    first: Sequence[Mapping], second: Sequence[Mapping]
) -> Iterator[tuple[Mapping | None, Mapping | None]]:
    """Yield rows of one target at one time in both results; None if missing in one."""
    others = defaultdict(list)
    for row in second:
        others[row["name"]].append(row)
    singles = []
    for row in first:
        times = [_lag(row, other) for other in others[row["name"]]]
        if times and min(times) <= SAME_EPOCH:
            yield row, others[row["name"]].pop(int(np.argmin(times)))
        else:
            singles.append(row)
    for row in singles:  # observed in one result only, listed as unobserved in the other
        rest = others[row["name"]]
        places = [i for i, other in enumerate(rest) if None in (row["gps_time"], other["gps_time"])]
        yield row, rest.pop(places[0]) if places else None
    for rest in others.values():
        yield from ((None, row) for row in rest)


def _lag(row, other):
    """Time between two rows of a target; zero if both were not observed. Units: s."""
    times = row["gps_time"], other["gps_time"]
    if times == (None, None):
        return 0.0
    if None in times:
        return np.inf
    return abs(times[0] - times[1])


def _target_row(first, second):
    """Make one row of ``targets`` in compare_results.json."""
    known = first or second
    sides = first or {}, second or {}
    row = {key: known.get(key) for key in ("name", "pass", "role", "gps_time")}
    row["in"] = "both" if first and second else SIDES[first is None]
    for vector in VECTORS:
        values = [side.get(vector) for side in sides]
        row[vector] = {**dict(zip(SIDES, values, strict=True)), "difference": _minus(*values)}
    change = row["after"]["difference"]
    row["change_3d"] = None if change is None else float(np.linalg.norm(change))
    for key in ("used", "reason"):
        row[key] = {side: part.get(key) for side, part in zip(SIDES, sides, strict=True)}
    return row


def _minus(first, second):
    """Difference second - first (3,), None if either is unknown."""
    if not first or not second or None in (*first, *second):
        return None
    return (np.array(second) - np.array(first)).tolist()


def _scores(first, second):
    """RMSE of check and control points after the correction, and leave-one-out."""
    scores = {}
    for name, (role, state) in SCORES.items():
        sides = {}
        for side, report in zip(SIDES, (first, second), strict=True):
            group = report[role].get(state) or {}
            count = report[role].get("n") if state == "after" else group.get("n")
            sides[side] = {
                "n": count or 0,
                "rmse": group.get("rmse"),
                "rmse_3d": group.get("rmse_3d"),
            }
        values = [sides[side]["rmse_3d"] for side in SIDES]
        difference = None if None in values else values[1] - values[0]
        scores[name] = {**sides, "difference_3d": difference}
    return scores


def _model(first, second):
    """Rows of order, covariance and use of ties of both."""
    flat = []
    for report in (first, second):
        model = report["model"]
        ties = report.get("ties") or {}
        values = {"order": model.get("order"), "method": model.get("method")}
        values |= {"sigma0": model.get("sigma0"), "ties used": ties.get("used", 0)}
        covariance = model.get("covariance") or {}
        flat.append(values | {f"covariance {key}": value for key, value in covariance.items()})
    return _rows(dict.fromkeys([*flat[0], *flat[1]]), *flat)


def _rows(names, first, second):
    """Make a row for each value of both, with a flag of differences."""
    rows = []
    for name in names:
        values = first.get(name), second.get(name)
        row = {"what": name, **dict(zip(SIDES, values, strict=True))}
        rows.append(row | {"differs": not _is_same(*values)})
    return rows


def _is_same(first, second):
    """True if two values are equal, numbers up to their last digits."""
    if isinstance(first, float) and isinstance(second, float):
        return bool(np.isclose(first, second, rtol=1e-9, atol=0.0))
    return first == second


def _warnings(first, second):
    """Warnings of only one result."""
    lists = [report["model"].get("warnings") or [] for report in (first, second)]
    return {
        side: [text for text in own if text not in other]
        for side, own, other in zip(SIDES, lists, lists[::-1], strict=True)
    }


def _file_rows(first, second):
    """Inputs and corrected clouds of both by name, with their contents (SHA-256)."""
    rows = []
    for kind in FILE_LISTS:
        sides = [
            {(row.get("what", "corrected cloud"), row["name"]): row["sha256"] for row in part[kind]}
            for part in (first, second)
        ]
        for what, name in dict.fromkeys([*sides[0], *sides[1]]):
            contents = [side.get((what, name)) for side in sides]
            row = {"what": what, "name": name, "is_input": kind == "inputs"}
            row |= dict(zip(SIDES, contents, strict=True))
            rows.append(row | {"differs": contents[0] != contents[1]})
    return rows
