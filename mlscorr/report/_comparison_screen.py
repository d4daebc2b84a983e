"""First screen of a comparison of methods: in the terminal, in compare.json and on its page."""

from collections.abc import Iterator
from typing import Any

from mlscorr.evaluate import PointCounts, TargetRow
from mlscorr.report.headline import (
    StatementRow,
    check_statement,
    control_statement,
    statements_section,
    warning_statements,
)
from mlscorr.report.settings import SETTINGS
from mlscorr.report.wording import in_words
from mlscorr.survey import Severity, Statement
from mlscorr.wording import joined

OWN = "correct"  # method used by the command of this name
UNTIED = "lsc"  # the same from control points only
KINDS = ("one move", "over time")  # of methods whose best are named besides the best of all


def comparison_screen(document: dict[str, Any], rows: list[TargetRow]) -> dict[str, object]:
    """``rating`` and ``statements`` of compare.json.

    Parameters
    ----------
    document : dict
        Rest of the document.
    rows : list of TargetRow
        One for each surveyed point and pass.
    """
    return statements_section(comparison_statements(document, rows))


def comparison_statements(document: dict[str, Any], rows: list[TargetRow]) -> list[StatementRow]:
    """Rows of the first screen of a comparison, in order.

    Parameters
    ----------
    document : dict
        Rest of compare.json.
    rows : list of TargetRow
        One for each surveyed point and pass.
    """
    first, *more = verdict(document)
    return [
        StatementRow.of("Result", first, items=[("", text) for text in in_words(more)]),
        StatementRow.of("Scores", _basis(document)),
        check_statement(PointCounts.of(rows, "check")),
        control_statement(PointCounts.of(rows, "control")),
        *_ties(document),
        *_undetermined(document),
        *warning_statements(method_warnings(document["methods"])),
    ]


def verdict(document: dict[str, Any]) -> list[Statement]:
    """Statements on the best method, and on the best of each kind and our own.

    Parameters
    ----------
    document : dict
        Contents of compare.json.
    """
    ranked = ranking(document)
    by = document["scored_by"]
    value = {row["name"]: row[by]["rmse_3d"] for row in ranked}
    best = ranked[0]["name"]
    severity: Severity = "warning"
    if by != "control" and best != "raw":
        severity = "note"
    tied = [name for name in value if value[name] - value[best] < SETTINGS.difference]
    raw = value["raw"]
    if "raw" in tied:
        values = {"least": SETTINGS.difference, "raw": raw}
        return [Statement("no method improves", severity, values)]
    values = {"rmse": value[best], "raw": raw}
    if len(tied) == 1:
        values |= {"name": best, "about": ranked[0]["about"]}
        facts = [Statement("best method", severity, values)]
    else:
        values |= {"names": tied, "least": SETTINGS.difference}
        facts = [Statement("best methods", severity, values)]
    for kind in KINDS:
        rest = [row["name"] for row in ranked if row["kind"] == kind]
        if rest and rest[0] not in tied:
            values = {"kind": kind, "name": rest[0], "rmse": value[rest[0]]}
            facts.append(Statement("best of a kind", values=values))
    if OWN in value and OWN not in tied:
        own = value[OWN]
        values = {"name": OWN, "rmse": own, "behind": own - value[best]}
        facts.append(Statement("behind the best", values=values))
    return facts


def _basis(document):
    """Basis of the scores."""
    control = document["control_points"]
    check = document["check_points"]
    if document["scored_by"] == "check":
        return Statement("scored by check points", values={"control": control, "check": check})
    if document["scored_by"] == "control":
        return Statement("scored by the fit", "warning", {"control": control})
    groups = document["cross_validation_groups"]
    values = {"control": control, "check": check, "groups": groups}
    return Statement("cross-validated", values=values)


def _ties(document) -> Iterator[StatementRow]:
    """Yield statements on methods that use ties between passes, if there are any."""
    own = next((row for row in document["methods"] if row["name"] == OWN), None)
    if own is None or own["status"] != "determined":
        return
    count = own["details"]["ties"]
    if count:
        fact = Statement("method with ties", values={"name": OWN, "count": count})
    else:
        values = {"name": OWN, "other": UNTIED, "why": own["details"]["untied"]}
        fact = Statement("method without ties", values=values)
    yield StatementRow.of("Ties", fact)


def method_warnings(rows: list[dict]) -> list[str]:
    """Warnings of all methods, each once, after the names of the methods with it.

    Parameters
    ----------
    rows : list of dict
        ``methods`` of compare.json.
    """
    names: dict[str, list[str]] = {}
    for row in rows:
        for sentence in row["warnings"]:
            names.setdefault(sentence, []).append(row["name"])
    return [f"{joined(of_one)}: {sentence}" for sentence, of_one in names.items()]


def _undetermined(document) -> Iterator[StatementRow]:
    """Yield statements on methods without a score."""
    absent = undetermined(document)
    if absent:
        values = {"count": len(absent), "methods": len(document["methods"])}
        fact = Statement("methods without a score", "warning", values)
        yield StatementRow.of("Not determined", fact, items=absent)


def undetermined(document: dict) -> list[tuple[str, str]]:
    """Name and reason of each method without a score.

    Parameters
    ----------
    document : dict
        Contents of compare.json.
    """
    ranked = ranking(document)
    by = document["scored_by"]
    return [
        (row["name"], row["why"] or row[by].get("why") or "no point to score it by")
        for row in document["methods"]
        if row not in ranked
    ]


def ranking(document: dict) -> list[dict]:
    """Rows of the methods with a score, sorted by 3D RMSE.

    Parameters
    ----------
    document : dict
        Contents of compare.json.
    """
    by = document["scored_by"]
    scored = [row for row in document["methods"] if row[by]["rmse_3d"] is not None]
    return sorted(scored, key=lambda row: row[by]["rmse_3d"])
