"""The content of gap.json: everything that a diagnosis says, as plain numbers and words."""

from dataclasses import asdict

import numpy as np

from mlscorr.gap.where import NAMES
from mlscorr.survey import Survey

EPOCHS, ON_MAP = 1500, 1500  # of trajectory and rows on the map: more can't be seen on a page
QUANTILE = 1.96
LEAST = 1e-4  # probability from which on a pair is listed


def gap_document(survey, rows, inference, closure, next_data, advice, effects, left_out, warnings):
    """Content of gap.json, from what its arguments are named after; see DiagnosedSurvey."""
    verdict, where = inference.verdict, inference.where
    return {
        "name": survey.name,
        "verdict": {
            "label": verdict.label,
            "probability": float(verdict.probability),
            "set": list(verdict.set),
            "p_value": float(verdict.p_value),
            "same": [one for one in inference.same if one != verdict.label],
            "lead": verdict.lead,
            "sentence": _sentence(inference),
        },
        "gap": {
            "before": closure.gap.before,
            "after": closure.gap.after,
            "unit": closure.unit,
            "null_band": list(closure.gap.null_band),
            "kind": closure.kind,
        },
        "headline": where.headline,
        "advice": advice,
        "where": [_split(split) for split in where.splits],
        "causes": [_cause(rows, cause) for cause in inference.causes],
        "separability": separability_document(inference.separability),
        "closure": _closure(closure),
        "next_data": [asdict(one) for one in next_data],
        "evidence": _evidence(inference),
        "innovations": _innovations(rows, where),
        "windows": _windows(inference.cause, rows),
        "map": map_document(survey) | {"rows": _on_map(rows, where)},
        "channels": {str(k): int((rows.channel == k).sum()) for k in np.unique(rows.channel)},
        "simulator": {"effects": [effect_document(one) for one in effects]},
        "left_out": dict(left_out),
        "warnings": list(warnings),
        "notes": list(survey.notes),
    }


def _sentence(inference):
    verdict, cause = inference.verdict, inference.cause
    sure = f"probability {verdict.probability:.2f}"
    if verdict.label == "none":
        return f"Nothing is wrong that this survey could show ({sure})."
    if verdict.label == "unknown":
        return f"No known effect explains it ({sure}): it looks like a {verdict.lead}."
    said = [
        f"{one.name} {one.estimate:.4g} {one.unit}"
        + (f" +- {QUANTILE * one.sigma:.2g}" if np.isfinite(one.sigma) else "")
        for one in cause.parameters
    ]
    names = verdict.label.replace("+", " and ")
    do = "explain" if "+" in verdict.label else "explains"
    return f"{names} {do} it ({sure}): {', '.join(said)} (95 %)."


def _split(split):
    name, unit = NAMES.get(split.by, (split.by, ""))
    found = {"by": split.by, "name": name, "unit": unit}
    if split.edges is not None:
        found["edges"] = split.edges.tolist()
    else:
        found["bins"] = list(split.bins)
    return found | {
        "count": split.count.tolist(),
        "before": split.before.tolist(),
        "after": split.after.tolist(),
        "share": split.share.tolist(),
        "null_band": split.band.tolist(),
    }


def _cause(rows, cause):
    moved = cause.shift[rows.metric]
    target = [part.fixed["target"] for part, _ in cause.parts if "target" in part.fixed]
    return {
        "effect": cause.effect,
        "probability": float(cause.probability),
        "rms_mm": float(1e3 * np.sqrt(np.mean(moved**2))),
        "parameters": [asdict(one) for one in cause.parameters],
    } | ({"target": target[0]} if target else {})


def separability_document(compared):
    """Classes, correlations and minimal detectable biases of a Separability."""
    detectable = {}
    for name, effect, unit, size in zip(
        compared.names, compared.effects, compared.units, compared.detectable, strict=True
    ):
        one = {"name": name, "unit": unit, "detectable": float(size)}
        detectable.setdefault(effect, []).append(one)
    return {
        "classes": [list(members) for members in compared.classes],
        "correlation": {
            "names": list(compared.names),
            "matrix": compared.correlation.tolist(),
        },
        "detectable": detectable,
    }


def _closure(closure):
    labels = closure.labels or (closure.effect,) * len(closure.folds)
    return {
        "effect": closure.effect,
        "kind": closure.kind,
        "before": closure.before,
        "after": closure.after,
        "unit": closure.unit,
        "shrink": closure.shrink,
        "interval": list(closure.interval),
        "null_band": list(closure.null_band),
        "held_out": closure.held_out,
        "folds": [
            {"label": label, "before": float(before), "after": float(after)}
            for label, (before, after) in zip(labels, closure.folds, strict=False)
        ],
    }


def _evidence(inference):
    """The ladder; of labels that were weighed last, the ratio follows from the probability."""
    score = {name: float(values[0]) for name, values in inference.found.score.items()}
    chance, none = inference.probability, score["none"]
    known = max(score, key=lambda name: chance.get(name, 0.0))

    def ratio(name):
        if name in score:
            return score[name] - none
        if chance[name] == 0.0:  # it underflows
            return float("nan")
        return score[known] - none + float(np.log(chance[name] / chance[known]))

    return [
        {"label": name, "log_evidence_ratio": ratio(name), "probability": chance[name]}
        for name in chance
        if name in score or chance[name] > LEAST
    ]


def _innovations(rows, where):
    return {
        "gps_time": where.gps_time.tolist(),
        "channel": rows.channel[where.row].tolist(),
        "before": where.innovation[:, 0].round(3).tolist(),
        "after": where.innovation[:, 1].round(3).tolist(),
        "sigma_mm": (1e3 * where.sigma).round(3).tolist(),
    }


def _windows(cause, rows):
    """When the events of a cause act."""
    found = []
    for part, _ in cause.parts:
        if "time" in part.fixed:
            start = rows.reference.start + part.fixed["time"]
            half = part.fixed.get("width", 0.0) / 2
            end = rows.gps_time.max() if "width" not in part.fixed else start + half
            found.append({"effect": part.name, "start": start - half, "end": float(end)})
    for start, length, *_ in cause.setting.bursts:
        found.append({"effect": "position_noise", "start": start, "end": start + length})
    return found


def map_document(survey: Survey):
    """Way and targets of a survey on the map."""
    way = survey.trajectory.position
    thin = way[:: max(1, len(way) // EPOCHS), :2]
    targets = [
        {"name": name, "role": role, "position": place[:2].tolist()}
        for role, points in (("control", survey.control), ("check", survey.check))
        for name, place in zip(points.name, points.position, strict=True)
    ]
    return {"trajectory": thin.round(2).tolist(), "targets": targets}


def _on_map(rows, where):
    taken = np.unique(np.linspace(0, len(where.row) - 1, min(ON_MAP, len(where.row))).astype(int))
    return [
        {
            "position": rows.position[row, :2].round(2).tolist(),
            "channel": str(rows.channel[row]),
            "before": round(float(u[0]), 2),
            "after": round(float(u[1]), 2),
        }
        for row, u in zip(where.row[taken], where.innovation[taken], strict=True)
    ]


def effect_document(effect):
    """An Effect as scenario.toml names it."""
    return {"name": effect.name, **asdict(effect)}
