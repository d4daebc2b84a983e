"""A made-up correction of a drive and its report, and what a page's text is."""

import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.correction import Correction
from mlscorr.estimate import REASONS, Support, WeakInterval
from mlscorr.evaluate import Score, Statistics, TargetRow
from mlscorr.frames import attitude_from_angles
from mlscorr.report import CorrectionReport, Coverage, FileRow, write_report
from mlscorr.report.correction_report import array
from mlscorr.survey import CloudFile, ControlPoints, Statement, Survey, Trajectory

START = 357881.0  # s, GPS week seconds
SPEED = 6.0  # m/s


def drive(seconds=60.0, rate=50.0, gap=None):
    "A drive on a wide curve at UTM size; gap = (start, end) in s after the start"
    since = np.arange(0.0, seconds, 1 / rate)
    if gap is not None:
        since = since[(since <= gap[0]) | (since >= gap[1])]
    turn = 2 * np.pi * since / 400.0
    radius = SPEED * 400.0 / (2 * np.pi)
    position = np.column_stack(
        [
            532000.0 + radius * np.sin(turn),
            3374000.0 + radius * (1 - np.cos(turn)),
            42.0 + 0.5 * np.sin(turn * 5),
        ]
    )
    attitude = attitude_from_angles(0.01 * np.sin(since), 0.0 * since, np.pi / 2 - turn)
    return Trajectory(START + since, position, attitude)


def corrected(trajectory):
    "A drift of decimetres removed, with its sigma after the estimate"
    since = (trajectory.gps_time - START)[:, None]
    shift = [0.7, 0.2, 0.25] * np.sin(since / [25.0, 40.0, 60.0])
    small = Rotation.from_rotvec(np.radians([0.004, 0.003, 0.012] * np.sin(since / 50.0)))
    ones = np.ones((len(trajectory), 3))
    return Trajectory(
        trajectory.gps_time,
        trajectory.position + shift,
        small * trajectory.attitude,
        0.02 * ones * (1 + np.abs(np.sin(since / 10.0))),
        np.radians(0.004) * ones,
    )


def fabricate(trajectory, count=8, checks=True, rng=None, names=None):
    "A survey, its correction and a report.json, with made-up residuals"
    rng = rng or np.random.default_rng(1)
    new = corrected(trajectory)
    correction = Correction(trajectory, new)
    epochs = np.linspace(0.06, 0.94, count) * len(trajectory)
    rows = []
    for i, epoch in enumerate(epochs.astype(int)):
        role = "check" if checks and i % 3 == 2 else "control"
        after = rng.normal(0, 0.03 if role == "check" else 0.004, 3)
        before = new.position[epoch] - trajectory.position[epoch] + after
        right = trajectory.attitude[epoch].apply([12.0, 0.0, 1.5])
        surveyed = trajectory.position[epoch] + right + before
        rows.append(
            TargetRow(
                name=names[i] if names else f"T{i + 1:02d}",
                pass_number=1 + int(trajectory.segment(trajectory.gps_time[epoch])),
                gps_time=float(trajectory.gps_time[epoch]),
                role=role,
                surveyed=surveyed,
                observed=surveyed - before,
                sigma=np.array([0.004, 0.004, 0.005]),
                before=before,
                after=after,
                left_out=np.array([0.06, 0.04, 0.038]) * (1.0 if role == "control" else np.nan),
                used=role == "control",
                why=None if role == "control" else Statement("check point"),
            )
        )
    return survey_of(trajectory), correction, report_of(trajectory, rows)


def because(text):
    "A reason in words that no room has a key for, as that of a report which was read"
    return Statement("not matched", values={"why": text})


def survey_of(trajectory):
    "A survey of a drive whose points stand nowhere"
    empty = ControlPoints((), np.empty((0, 3)), np.empty((0, 3)), (), np.empty(0), np.empty((0, 3)))
    return Survey(
        name="street",
        path=Path("survey.toml"),
        crs="EPSG:32650",
        clouds=(CloudFile(Path("pass-1.laz"), 1_234_567, 0.0, "GPS week seconds"),),
        trajectory=trajectory,
        mounting=None,
        control=empty,
        check=empty,
        notes=("Meridian convergence -0.42 deg was applied.",),
    )


def score_of(rows, left_out=None):
    "Score of rows of one group"
    before, after = (Statistics.of(array(rows, name)) for name in ("before", "after"))
    return Score(before, after, left_out, np.full(3, 0.004))


def report_of(trajectory, rows):
    "The report on made-up rows of targets"
    control, check = ([row for row in rows if row.group == role] for role in ("control", "check"))
    several = len(control) > 1
    left_out = np.array([[0.061, 0.044, 0.038], [-0.061, -0.044, 0.038]])
    times = [row.gps_time for row in control] or [trajectory.gps_time[0]]
    model = {
        "method": "lsc",
        "order": 1,
        "covariance": {"family": "matern32", "correlation_time": 28.4, "scale": 1.3},
        "estimated_by": "marginal likelihood of the control points",
        "sigma0": 1.08 if several else None,
        "outliers": [{"name": "T99", "statistic": 9.31, "critical": 3.29}] if several else [],
        "alternatives": [
            {"family": "matern32", "correlation_time": 28.4, "log_likelihood": 81.25},
            {"family": "exponential", "correlation_time": 61.0, "log_likelihood": 74.5},
        ],
        "warnings": [],
    }
    first = min(times)
    last = max(times)
    size = 0.09
    ends = trajectory.gps_time[[0, -1]]
    weak = (
        WeakInterval(ends[0], first, SPEED * (first - ends[0]), size, REASONS[2]),
        WeakInterval(last, ends[1], SPEED * (ends[1] - last), size, REASONS[3]),
    )
    if len(trajectory.gaps):
        longest = float(np.ptp(trajectory.gaps))
    else:
        longest = 0.0
    return CorrectionReport(
        name="street",
        crs="EPSG:32650",
        notes=(),
        targets=rows,
        control=score_of(control, Statistics.of(left_out if several else left_out[:0])),
        check=score_of(check),
        accuracy=None,
        model=model,
        coverage=Coverage((first, last), longest, 0, 40_000, 40_000, 1_234_567),
        files=(FileRow("pass-1.laz", "ab12" * 16, points=1_234_567),),
        support=Support(weak),
    )


def page(folder, survey, correction, report):
    "The text of the page of a correction"
    write_report(folder / "report.html", survey, correction, report)
    return (folder / "report.html").read_text(encoding="utf-8")


def words(html):
    "The page's text without its style and scripts, one space between words"
    html = re.sub(r"<(style|script)\b.*?</\1>", "", html, flags=re.S)
    return " ".join(re.sub(r"<[^>]*>", " ", html).split())


class Links(HTMLParser):
    "Tags and addresses of a page"

    def __init__(self, html):
        super().__init__()
        self.tags = set()
        self.links = []
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.links += [v for k, v in attributes if k in ("src", "href", "srcset", "data", "action")]
