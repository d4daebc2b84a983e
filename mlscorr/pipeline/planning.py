"""``plan``: what a survey will be able to show, before anyone drives."""

from dataclasses import dataclass

import numpy as np

from mlscorr.effects import EFFECTS
from mlscorr.gap.background import epochs
from mlscorr.gap.document import map_document, separability_document
from mlscorr.gap.plan import NextData, next_data
from mlscorr.gap.planned import event_sizes, planned_rows
from mlscorr.gap.rows import Rows, background
from mlscorr.gap.separability import Separability, separability
from mlscorr.gap.signatures import signatures
from mlscorr.io.output import check_output, document, output_folder, write_json
from mlscorr.io.survey_file import input_files
from mlscorr.survey import Survey

KINDS = {kind.name: kind for kind in EFFECTS}
LARGE = 10.0  # times its usual size: an effect that must be larger to be seen is not seen


def plan(survey, library=EFFECTS):
    """What effects a survey can show and tell apart, from its geometry alone: a PlannedSurvey.

    Parameters
    ----------
    survey : Survey
        With mounting, trajectory, control, and a reference surface where there is one; its cloud
        is not read.
    library : iterable of Effect classes

    Raises ValueError without a mounting, or when nothing will be seen.
    """
    rows = planned_rows(survey)
    signs, left_out = signatures(rows, survey, library)
    observed = epochs(rows, background(rows, survey))
    compared, more = separability(observed, signs), []
    for members in compared.classes:
        more += next_data(rows, survey, library, members, compared)
    noise = {one.name: _NOISE for one in signs if one.is_noise}
    best = {one.survey: one for one in sorted(more, key=lambda one: -one.after)}
    return PlannedSurvey(
        survey, rows, compared, event_sizes(observed, signs), tuple(best.values()), left_out | noise
    )


_NOISE = "Noise shows in the roughness of surfaces and the spread of residuals, not in a shift."


@dataclass(frozen=True)
class PlannedSurvey:
    """A survey before it is driven: the document of plan.json, and ``write``."""

    survey: Survey
    rows: Rows
    separability: Separability
    events: dict
    next_data: tuple[NextData, ...]
    left_out: dict[str, str]

    @property
    def document(self):
        """The document of plan.json."""
        content = separability_document(self.separability)
        for name, (parameters, units, sizes) in self.events.items():
            content["detectable"][name] = [
                {"name": f"{name} {p}" if len(parameters) > 1 else name, "unit": u,
                 "detectable": float(s)}
                for p, u, s in zip(parameters, units, sizes, strict=True)
            ]  # fmt: skip
        for name, parts in content["detectable"].items():
            usual = KINDS[name].quantities()["magnitude"].typical
            for part in parts:
                part["typical"] = usual
        looks = len(np.unique(self.rows.item))
        return document(
            "plan",
            {
                "name": self.survey.name,
                "looks": looks,
                **content,
                "next_data": [vars(one) for one in self.next_data],
                "map": map_document(self.survey),
                "advice": self._advice(content["detectable"]),
                "left_out": self.left_out,
                "warnings": list(self.survey.notes),
            },
        )

    def _advice(self, detectable):
        hidden = [
            name
            for name, parts in detectable.items()
            if parts[0]["typical"]
            and min(part["detectable"] for part in parts) > LARGE * parts[0]["typical"]
        ]
        told = []
        for one in self.next_data[:3]:
            told.append(f"Add {one.survey}: {one.why}")
        if hidden:
            told.append(
                f"Don't expect to see {', '.join(hidden)}: only more than {LARGE:.0f} times the "
                "usual size would show."
            )
        if not self.separability.classes:
            told.append("All effects that show can be told apart.")
        return told

    def write(self, out, overwrite=False):
        """Write plan.json and plan.html into a folder, whole or not at all: the document.

        Raises as ``CorrectedSurvey.write`` does.
        """
        from mlscorr.report.gap_page import plan_page

        check_output(out, input_files(self.survey.path, planned=True), overwrite)
        content = self.document
        page = plan_page(content, self.survey.name)
        with output_folder(out) as folder:
            write_json(folder / "plan.json", content)
            (folder / "plan.html").write_text(page, encoding="utf-8")
        return content


def too_little(survey, rows, looks, library, notes=()):
    """The sentence for a survey that shows too little: what is missing, and the plan."""
    told = (
        f"{survey.path} shows {looks} things with a residual in m, and the POS's error alone has 6 "
        "unknowns: no cause can be told from it. Survey at least 12 targets along the way, better "
        "on two passes, or give a [scene] reference."
    )
    told = " ".join([*notes, told])
    if survey.mounting is None or looks == 0:
        return told
    signs, _ = signatures(rows, survey, library)
    compared = separability(epochs(rows, background(rows, survey)), signs)
    sizes = [
        f"{name} {size:.2g} {unit}"
        for name, unit, size in zip(
            compared.names, compared.units, compared.detectable, strict=True
        )
    ]
    return (
        f"{told} As it is, the smallest effects that could be seen, were nothing else wrong, are: "
        f"{', '.join(sizes[:6])}. mlscorr plan tells the same of any survey before it is driven."
    )
