"""``plan``: expected results of a survey, before it is driven."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mlscorr.effects import Effect, known_effects, lowered, parameter_title, titles
from mlscorr.estimate import COMPONENTS, PlannedAccuracy, predict_accuracy
from mlscorr.gap import left_out_sentences, map_document, separability_document
from mlscorr.gap.evidence import Observations, Separability, compare_signatures
from mlscorr.gap.plan import NextData, event_sizes, next_data, planned_rows
from mlscorr.gap.residuals import Rows, background
from mlscorr.gap.signatures import signatures
from mlscorr.pipeline._result import KnownResult, ResultFiles
from mlscorr.survey import Matched, Statement, Survey, TargetObservations, check_survey, rows_frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

LARGE = 10.0  # times its usual size: an effect that is visible only above it counts as invisible


def plan(survey: Survey, library: Iterable[type[Effect]] | None = None) -> PlannedSurvey:
    """Find the effects that a survey can show and separate, from its geometry only.

    Parameters
    ----------
    survey : Survey
        With mounting, trajectory, control, and a reference surface if there is one; its cloud is
        not read.
    library : iterable of Effect classes, optional
        Effects to consider; all known ones by default.

    Raises
    ------
    ValueError
        If there is no mounting, or nothing will be observed.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> planned = mlscorr.plan(mlscorr.read_survey(folder))
    >>> "time_offset" in [row["effect"] for row in planned.to_frame().to_dict("records")]
    True
    """
    check_survey(survey)
    survey.check_one_scanner("a plan")
    rows = planned_rows(survey)
    library = known_effects() if library is None else library
    signs, left_out = signatures(rows, survey, library)
    observed = Observations.of(rows, background(rows, survey))
    compared = compare_signatures(observed, signs)
    data = []
    for members in compared.classes:
        data += next_data(rows, survey, library, members, compared)
    noise = {sign.name: Statement("noise") for sign in signs if sign.is_noise}
    best = {addition.survey: addition for addition in sorted(data, key=lambda a: -(a.after or 0.0))}
    return PlannedSurvey(
        survey,
        tuple(library),
        rows,
        compared,
        event_sizes(observed, signs),
        tuple(best.values()),
        left_out | noise,
        _accuracy(survey, rows),
    )


def _accuracy(survey, rows):
    """PlannedAccuracy from the expected control; None without any."""
    first = _control_rows(survey, rows)
    if len(first) == 0:
        return None
    points = survey.surveyed[rows.survey_item[first]]
    observed = TargetObservations(
        points.name,
        rows.covariates["pass"][first].astype(int),
        rows.gps_time[first],
        points.position,
        rows.noise[first, None, None] * np.eye(3),
        points.normal,
        points.kind,
        points.size,
        rows.points[first],
    )
    return predict_accuracy(survey.trajectory, Matched(observed, points), survey.pos)


def _control_rows(survey, rows):
    """First row of each view of a control point."""
    first = np.unique(rows.item[rows.channel == "target"], return_index=True)[1]
    first = np.flatnonzero(rows.channel == "target")[first]
    return first[rows.survey_item[first] < len(survey.control)]  # control comes before check


@dataclass(frozen=True, repr=False)
class PlannedSurvey(KnownResult):
    """Planned survey: the document of plan.json, and ``write``."""

    _name = "plan"
    survey: Survey
    kinds: tuple[type[Effect], ...]
    rows: Rows
    separability: Separability
    events: dict
    next_data: tuple[NextData, ...]
    left_out: dict[str, Statement]
    accuracy: PlannedAccuracy | None = None

    def _content(self):
        content = separability_document(self.separability)
        for name, (parameters, units, sizes) in self.events.items():
            content["detectable"][name] = [
                {
                    "name": f"{name} {p}" if len(parameters) > 1 else name,
                    "unit": u,
                    "detectable": float(s),
                }
                for p, u, s in zip(parameters, units, sizes, strict=True)
            ]
        for kind in self.kinds:
            for part in content["detectable"].get(kind.name, ()):
                part["typical"] = kind.quantities()["magnitude"].typical
        places = []
        if self.accuracy is not None:
            places = [place.document() for place in self.accuracy.next_control]
        return {
            "name": self.survey.name,
            "looks": len(np.unique(self.rows.item)),
            **content,
            "next_data": [vars(addition) for addition in self.next_data],
            "map": map_document(self.survey)
            | {"next_control": [[p["easting"], p["northing"]] for p in places]},
            "accuracy": self._accuracy_document(),
            "next_control": places,
            "advice": self._advice(content["detectable"]),
            "left_out": left_out_sentences(self.left_out),
            "notes": list(self.survey.notes),
            "warnings": [],
        }

    def _accuracy_document(self):
        """Sigma of the corrected position along the drive: 3D, m."""
        if self.accuracy is None:
            return None
        sigma = self.accuracy.sigma
        rows = _control_rows(self.survey, self.rows)
        return {
            "gps_time": self.accuracy.gps_time.round(3).tolist(),
            "sigma": sigma.round(5).tolist(),
            "rms": float(np.sqrt(np.mean(sigma**2))),
            "largest": float(sigma.max()),
            "control_times": self.rows.gps_time[rows].round(3).tolist(),
        }

    def _advice(self, detectable):
        hidden = [
            name
            for name, parts in detectable.items()
            if parts[0]["typical"]
            and min(part["detectable"] for part in parts) > LARGE * parts[0]["typical"]
        ]
        advice = [f"Add {addition.survey}: {addition.why}" for addition in self.next_data[:3]]
        if self.accuracy is not None and self.accuracy.next_control:
            place = self.accuracy.next_control[0]
            advice.append(
                f"Add a control point near {place.easting:.0f} E, {place.northing:.0f} N. "
                f"{place.why}"
            )
        if hidden:
            advice.append(
                f"Not detectable: {lowered(titles(hidden))}. Only more than {LARGE:.0f} times "
                "the usual size would show."
            )
        if not self.separability.classes:
            advice.append("All detectable effects are separable.")
        return advice

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame of the smallest detectable sizes, a row per parameter; requires
        pandas.
        """
        detectable = self.document["detectable"]
        return rows_frame(
            {"effect": name, **row} for name, rows in detectable.items() for row in rows
        )

    def plot(self, name: str = "detectable") -> Figure:
        """Draw a figure of the page.

        Parameters
        ----------
        name : str
            ``accuracy``, ``detectable``, ``map`` or ``separability``.

        Raises
        ------
        ValueError
            If there is no such figure, or it would be empty.
        """
        from mlscorr.report import draw
        from mlscorr.report.gap import plan_figures

        return draw(plan_figures(self.document), name)

    def _overview(self):
        """Return the rows that a notebook shows."""
        return [(sentence,) for sentence in (self.survey.name, *self.document["advice"])]

    def _files(self):
        """Files plan.json and plan.html."""
        from mlscorr.report.gap import plan_page

        name = self.survey.name
        return ResultFiles.of(
            self._name,
            self.survey.inputs,
            self.document,
            tables={},
            pages={"plan.html": lambda path, content: plan_page(content, name).write(path)},
        )


def check_enough(
    survey: Survey, rows: Rows, library: Iterable[type[Effect]], notes: tuple[str, ...]
) -> None:
    """Refuse a survey with too few observations: missing data, and the plan.

    Parameters
    ----------
    survey : Survey
    rows : Rows
    library : iterable of Effect classes
    notes : tuple of str
        Sentences to put first.

    Raises
    ------
    ValueError
        If fewer items have a residual in m than the pose has components.
    """
    items = len(np.unique(rows.item[rows.metric]))
    if items >= len(COMPONENTS):  # of the pose: fewer do not allow any conclusion
        return
    sentence = (
        f"{survey.path} has {items} residuals in m, too few to identify a cause: the error of "
        "the POS alone has 6 unknowns. Survey at least 12 targets along the road, preferably on "
        "two passes, or set scene.reference."
    )
    sentence = " ".join([*notes, sentence])
    if survey.mounting is None or items == 0:
        raise ValueError(sentence)
    signs, _ = signatures(rows, survey, library)
    compared = compare_signatures(Observations.of(rows, background(rows, survey)), signs)
    sizes = [
        f"{lowered(parameter_title(name))} {size:.2g} {unit}"
        for name, unit, size in zip(
            compared.names, compared.units, compared.detectable, strict=True
        )
    ]
    raise ValueError(
        f"{sentence} The smallest errors detectable with the present data, if they were the only "
        f"ones: {', '.join(sizes[:6])}. mlscorr plan predicts this before a survey is driven."
    )
