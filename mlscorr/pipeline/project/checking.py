"""``check`` of a project: all faults of its drives before their correction."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from mlscorr.estimate import few_targets, sentences_of
from mlscorr.io.store import glance
from mlscorr.io.surveys import ProjectParts, read_project, stated_project
from mlscorr.pipeline.checking import CheckedSurvey, checked_survey
from mlscorr.pipeline.faults import Faults
from mlscorr.pipeline.needs import Amount
from mlscorr.pipeline.project import stages
from mlscorr.pipeline.project.file_tasks import read_tile
from mlscorr.survey import Survey

NO_CONTROL = (
    "Drive {} has no surveyed point near its clouds. It can only be corrected by overlap with "
    "other drives."
)


def check_project(path: str | Path) -> CheckedSurvey:
    """Check all drives of a project, like ``check`` for one survey, without correcting them.

    Parameters
    ----------
    path : path
        project.toml, or its folder.

    Returns
    -------
    CheckedSurvey
        Result for all drives: faults with names, and total resources.
    """
    faults = Faults()
    with glance():
        stated = faults.of("survey.toml", stated_project, path)
        project = stated and faults.of("data", read_project, stated)
        if project is None:
            reason = "Clouds and targets: not checked until the faults are corrected."
            return CheckedSurvey(tuple(faults.faults), tuple(faults.warnings), unchecked=(reason,))
        checked = [_checked(survey) for survey in _surveys(project, faults)]
    _check_control(project, checked, faults)
    return CheckedSurvey(
        faults=(*faults.faults, *(fault for _, each in checked for fault in each.faults)),
        warnings=(*faults.warnings, *_all("warnings", checked)),
        notes=_notes(checked),
        unchecked=(
            *_all("unchecked", checked),
            "Drives joined by ties: known only after reading their clouds.",
        ),
        is_searched=any(each.is_searched for _, each in checked),
        read=_with_control(_sums([each.read for _, each in checked]), project),
        written=_sums([each.written for _, each in checked]),
        needed=_sums([each.needed for _, each in checked]),
        datum=tuple(difference for _, each in checked for difference in each.datum),
    )


def _surveys(project: ProjectParts, faults: Faults) -> list[Survey]:
    """Surveys of the drives, with the readable clouds."""
    tasks = [task.arguments for task in stages.tile_tasks(project)]
    read = [(owners, faults.of("data", read_tile, path, owners)) for path, owners in tasks]
    surveys = []
    for drive in project.drives:
        own = [tiles[drive.name] for _, tiles in read if tiles and drive.name in tiles]
        if own:
            planned = faults.of("data", stages.planned_drive, project, drive, own)
        else:
            planned = None
        if planned is not None:
            surveys.append(planned.survey)
    for task in stages.refusals(project, read):
        faults.of("data", task.function, *task.arguments)
    return surveys


def _checked(survey: Survey) -> tuple[Survey, CheckedSurvey]:
    """Check of a drive, with its name."""
    checked = checked_survey(survey, Faults(), needs_control=False)
    name = survey.name
    return survey, replace(
        checked,
        faults=tuple(replace(f, sentence=f"{name}: {f.sentence}") for f in checked.faults),
        warnings=tuple(f"{name}: {sentence}" for sentence in checked.warnings),
        unchecked=tuple(f"{name}: {sentence}" for sentence in checked.unchecked),
    )


def _check_control(project, checked, faults):
    """Report drives without surveyed points nearby, and points without a drive."""
    for survey, _ in checked:
        if not len(survey.surveyed):
            faults.warn(NO_CONTROL.format(survey.name))
    near = {name for survey, _ in checked for name in survey.surveyed.name}
    names = [*project.control.name, *project.check.name, *project.excluded.name]
    control_near = near.intersection(project.control.name)
    faults.warn(*sentences_of(few_targets(len(control_near))))
    faults.of("data", stages.check_control_near, project, [survey for survey, _ in checked])
    if control_near and (far := [name for name in names if name not in near]):
        faults.warn(
            f"{len(far)} of the {len(names)} surveyed points of {project.path} are not near any "
            f"cloud, by the headers (first: {far[0]})."
        )


def _all(what: str, checked: Sequence[tuple[Survey, CheckedSurvey]]) -> Iterable[str]:
    """Sentences on all drives."""
    return [sentence for _, each in checked for sentence in getattr(each, what)]


def _notes(checked):
    """Notes on the drives, with names unless they apply to all."""
    count = Counter(_all("notes", checked))
    return tuple(
        dict.fromkeys(
            sentence if count[sentence] == len(checked) else f"{survey.name}: {sentence}"
            for survey, each in checked
            for sentence in each.notes
        )
    )


def _with_control(amounts: Sequence[Amount], project: ProjectParts) -> tuple[Amount, ...]:
    """Amounts with the surveyed points of the project, because some are near two drives."""
    numbers = {"control points": len(project.control), "check points": len(project.check)}
    source = project.layout or "of all drives"
    return tuple(
        replace(each, number=numbers[each.what], source=source) if each.what in numbers else each
        for each in amounts
    )


def _sums(parts: Sequence[Sequence[Amount]]) -> tuple[Amount, ...]:
    """Total amounts of all drives; for memory the largest, because a worker processes one file."""
    total: dict[tuple[str, str], Amount] = {}
    for amount in (amount for own in parts for amount in own):
        key = amount.what, amount.unit
        before = total[key].number if key in total else 0.0
        if amount.what == "memory":
            number = max(before, amount.number)
        else:
            number = before + amount.number
        if len(parts) > 1:
            source = f"{len(parts)} drives"
        else:
            source = amount.source
        total[key] = replace(amount, number=number, source=source)
    return tuple(total.values())
