"""Contents of gap.json: all results of a diagnosis, as plain numbers and words."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict

import numpy as np

from mlscorr.effects import Effect
from mlscorr.gap.advice import (
    advice_of,
    agreements,
    distinct_parameters,
    excess_of,
    without_nothing_to_do,
)
from mlscorr.gap.closure import Closure
from mlscorr.gap.evidence import NAMES, Cause, Inference, Separability
from mlscorr.gap.open_scale import open_sigmas
from mlscorr.gap.plan import NextData
from mlscorr.gap.residuals import Absence, Rows, background
from mlscorr.gap.wording import advice_sentences, headline, left_out_sentences, sentence_of
from mlscorr.survey import Statement, Survey
from mlscorr.wording import with_articles

MAP_POINTS = 1500  # of trajectory and rows on the map: more are not visible on a page
LISTED = 1e-4  # probability above which a pair is listed in the evidence


def gap_document(
    survey: Survey,
    rows: Rows,
    inference: Inference,
    closure: Closure,
    next_data: Sequence[NextData],
    effects: Iterable[Effect],
    left_out: Mapping[str, Statement],
    warnings: Iterable[str],
    absence: Absence,
    further_advice: Sequence[Statement] = (),
) -> dict:
    """Make the contents of gap.json.

    Parameters
    ----------
    survey : Survey
        With the simulator's assumptions on scanner and POS.
    rows : Rows
    inference : Inference
    closure : Closure
    next_data : sequence of NextData
    effects : iterable of Effect
        Effects already in the simulator.
    left_out : mapping of str to Statement
        Reasons why effects were not considered.
    warnings : iterable of str
    absence : Absence
        Absence of surveyed targets without a row.
    further_advice : sequence of Statement
        Advice beyond the verdict.
    """
    verdict = inference.verdict
    where = inference.where
    agreement = agreements(rows, background(rows, survey))
    is_stated = not open_sigmas(survey)
    excess = excess_of(inference, closure, agreement, is_stated)
    advice = advice_of(inference, closure, next_data, excess, is_stated, left_out)
    if further_advice:
        advice = [*without_nothing_to_do(advice), *further_advice]
    return {
        "name": survey.name,
        "verdict": {
            "label": verdict.label,
            "probability": float(verdict.probability),
            "set": list(verdict.set),
            "p_value": float(verdict.p_value),
            "same": [name for name in inference.same if name != verdict.label],
            "lead": verdict.hint,
            "hidden": verdict.is_hidden,
            "excess": excess,
            "sentence": with_articles(sentence_of(inference, excess)),
        },
        "gap": vars(closure.gap) | {"unit": closure.unit, "kind": closure.kind},
        "headline": headline(where, verdict.label, verdict.hint, rows.reference.start),
        "agreement": [vars(part) for part in agreement],
        "advice": advice_sentences(advice),
        "where": [_split(split) for split in where.splits],
        "causes": [cause_document(rows, cause) for cause in inference.causes],
        "separability": separability_document(inference.separability),
        "closure": _closure(closure),
        "next_data": [asdict(data) for data in next_data],
        "evidence": _evidence(inference),
        "innovations": _innovations(rows, where),
        "windows": windows_document(inference.cause, survey),
        "map": map_document(survey) | {"rows": _on_map(rows, where)},
        "channels": {str(k): int((rows.channel == k).sum()) for k in np.unique(rows.channel)},
        "simulator": {"effects": [effect.document() for effect in effects]},
        "left_out": left_out_sentences(left_out),
        "mendable": [name for name, why in left_out.items() if why.severity == "warning"],
        "absent": [run.document() for run in absence.runs],
        "warnings": [*absence.warnings, *warnings],
        "notes": list(survey.notes),
    }


def assumed_document(survey: Survey, inference: Inference, scale: float) -> list[dict]:
    """List unstated values: the default, and the POS error according to the survey itself.

    Parameters
    ----------
    survey : Survey
        Diagnosed survey.
    inference : Inference
    scale : float
        Scale on the default sigmas of the POS.
    """
    model = inference.evidence.likely_model(inference.verdict.label)
    scaled = [f"pos.{name}" for name in open_sigmas(survey)]
    rows = []
    for row in (*survey.assumed_pos, *survey.assumed_scanner):
        value = row.value
        estimate = None
        if row.key in scaled:
            value = (np.array(value) / scale).round(9).tolist()
        if row.key == "pos.position_sigma":
            estimate = float(survey.pos.position_sigma * model.scale)
        rows.append({"key": row.key, "value": value, "unit": row.unit, "estimate": estimate})
    return rows


def _split(split):
    name, unit = NAMES.get(split.by, (split.by, ""))
    if split.edges is None:
        place = {"bins": list(split.bins)}
    else:
        place = {"edges": split.edges.tolist()}
    columns = {key: getattr(split, key).tolist() for key in ("count", "before", "after", "share")}
    named = {"by": split.by, "name": name, "unit": unit}
    extent = None if split.extent is None else asdict(split.extent)
    return named | place | columns | {"null_band": split.band.tolist(), "extent": extent}


def cause_document(rows: Rows, cause: Cause) -> dict:
    """Make the document of a cause with its parameters, and its target if it concerns one.

    Parameters
    ----------
    rows : Rows
    cause : Cause
        Found in these.
    """
    moved = cause.shift[rows.metric]
    content = {
        "effect": cause.effect,
        "probability": float(cause.probability),
        "rms_mm": float(1e3 * np.sqrt(np.mean(moved**2))),
        "parameters": [asdict(parameter) for parameter in distinct_parameters(cause)],
    }
    for part, _ in cause.parts:
        if "target" in part.fixed:
            content.setdefault("target", part.fixed["target"])
    return content


def separability_document(compared: Separability) -> dict:
    """Make the document of classes, correlations and minimal detectable biases.

    Parameters
    ----------
    compared : Separability
    """
    detectable = defaultdict(list)
    names = compared.names
    columns = zip(names, compared.effects, compared.units, compared.detectable, strict=True)
    for name, effect, unit, limit in columns:
        detectable[effect].append({"name": name, "unit": unit, "detectable": float(limit)})
    return {
        "classes": [list(members) for members in compared.classes],
        "correlation": {"names": list(names), "matrix": compared.correlation.tolist()},
        "detectable": dict(detectable),
    }


def _closure(closure):
    names = ("effect", "probability", "kind", "before", "after", "unit")
    names += ("held_out", "is_held_out")
    is_within = closure.is_within_noise
    return {name: getattr(closure, name) for name in names} | {
        "shrink": None if is_within else closure.shrink,
        "interval": [None, None] if is_within else list(closure.interval),
        "null_band": list(closure.null_band),
        "folds": [
            {"label": closure.effect, "before": float(before), "after": float(after)}
            for before, after in closure.folds
        ],
        "over_sigma": asdict(closure.over_sigma) | {"beyond": list(closure.over_sigma.beyond)},
    }


def _evidence(inference):
    """Document of the evidence ladder."""
    chance = inference.probability
    score = inference.joint.score
    return [
        {
            "label": name,
            "log_evidence_ratio": score[name] - score["none"],
            "probability": chance[name],
        }
        for name in chance
        if name in inference.joint.single or chance[name] > LISTED
    ]


def _innovations(rows, where):
    return {
        "gps_time": where.gps_time.tolist(),
        "channel": rows.channel[where.row].tolist(),
        "before": where.innovation[:, 0].round(3).tolist(),
        "after": where.innovation[:, 1].round(3).tolist(),
        "sigma_mm": (1e3 * where.sigma).round(3).tolist(),
    }


def windows_document(cause: Cause, survey: Survey) -> list[dict]:
    """List the intervals in which the events of a cause act.

    Parameters
    ----------
    cause : Cause
    survey : Survey
    """
    intervals = cause.intervals(survey.trajectory)
    return [{"effect": name, "start": start, "end": end} for name, start, end in intervals]


def map_document(survey: Survey) -> dict:
    """Make the document of a survey's path and targets on the map.

    Parameters
    ----------
    survey : Survey
    """
    position = survey.trajectory.position
    thin = position[:: max(1, len(position) // MAP_POINTS), :2]
    targets = [
        {"name": name, "role": role, "position": place[:2].tolist()}
        for role, points in (("control", survey.control), ("check", survey.check))
        for name, place in zip(points.name, points.position, strict=True)
    ]
    return {"trajectory": thin.round(2).tolist(), "targets": targets}


def _on_map(rows, where):
    number = len(where.row)
    thin = np.unique(np.linspace(0, number - 1, min(MAP_POINTS, number)).astype(int))
    return [
        {
            "position": rows.position[row, :2].round(2).tolist(),
            "channel": str(rows.channel[row]),
            "before": round(float(u[0]), 2),
            "after": round(float(u[1]), 2),
        }
        for row, u in zip(where.row[thin], where.innovation[thin], strict=True)
    ]
