"""What a comparison of methods says first: in the terminal, in compare.json and on its page."""

from collections.abc import Iterator
from typing import Any

from mlscorr.evaluate import PointCounts, TargetRow
from mlscorr.report import headline
from mlscorr.report.settings import SETTINGS
from mlscorr.wording import counted, joined, number

OWN = "correct"  # the method that the command of this name uses
UNTIED = "lsc"  # the same by control points alone
OTHERS = {
    "one move": "Best of those that move the whole cloud as one",
    "over time": "Best of polynomials and interpolation over time",
}


def comparison_screen(document: dict[str, Any], rows: list[TargetRow]) -> dict[str, object]:
    """``rating`` and ``statements`` of compare.json.

    Parameters
    ----------
    document : dict
        Its other content.
    rows : list of TargetRow
        One for each surveyed point and pass.
    """
    facts = [
        _best(document),
        _scored(document),
        headline.check_statement(PointCounts.of(rows, "check")),
        headline.control_statement(PointCounts.of(rows, "control")),
        *_ties(document),
        *_undetermined(document),
        *headline.warning_statements(method_warnings(document["methods"])),
    ]
    return headline.statements_section(facts)


def _best(document):
    """Which method corrects best; the whole of the verdict."""
    first, *more = verdict(document)
    is_tested = document["scored_by"] != "control" and ranking(document)[0]["name"] != "raw"
    items = tuple(("", sentence) for sentence in more)
    return headline.StatementRow("Result", "green" if is_tested else "amber", first, items)


def _scored(document):
    """What the scores rest on."""
    if document["scored_by"] == "control":
        rating = "amber"
    else:
        rating = "green"
    return headline.StatementRow("Scores", rating, basis(document))


def _ties(document) -> Iterator[headline.StatementRow]:
    """Which methods use ties between passes, where there are any."""
    own = next((row for row in document["methods"] if row["name"] == OWN), None)
    if own is None or own["status"] != "determined":
        return
    if count := own["details"]["ties"]:
        sentence = (
            f"{OWN} also uses {counted(count, 'tie')}: planes, poles and paint that two passes "
            "both saw. All other methods use the control points alone."
        )
    else:
        sentence = f"{OWN} equals {UNTIED} here, for no ties were used."
        if own["details"]["untied"]:
            sentence += f" {own['details']['untied']}"
    yield headline.StatementRow("Ties", "green", sentence)


def method_warnings(rows: list[dict]) -> list[str]:
    """Warnings of all methods, each once, after the names of the methods that gave it.

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


def _undetermined(document) -> Iterator[headline.StatementRow]:
    """Methods without a score."""
    absent = undetermined(document)
    if absent:
        count = f"{len(absent)} of {len(document['methods'])} methods have no score."
        yield headline.StatementRow("Not determined", "amber", count, tuple(absent))


def undetermined(document: dict) -> list[tuple[str, str]]:
    """Name and reason of each method without a score.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    ranked = ranking(document)
    by = document["scored_by"]
    return [
        (row["name"], row["why"] or row[by].get("why") or "no point to score it by")
        for row in document["methods"]
        if row not in ranked
    ]


def ranking(document: dict) -> list[dict]:
    """Rows of the methods that have a score, by their 3D RMSE, the best first.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    by = document["scored_by"]
    scored = [row for row in document["methods"] if row[by]["rmse_3d"] is not None]
    return sorted(scored, key=lambda row: row[by]["rmse_3d"])


def basis(document: dict) -> str:
    """What the scores rest on, in one sentence.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    control = document["control_points"]
    check = document["check_points"]
    made = f"Every method was fitted to the same {counted(control, 'control point')}"
    if document["scored_by"] == "check":
        return f"{made} and scored by {counted(check, 'check point')} that took no part."
    if document["scored_by"] == "control":
        return f"{made}. Nothing independent is left to score them by: this is the mere fit."
    if check:
        too_few = f"only {counted(check, 'check point')}"
    else:
        too_few = "no check points"
    groups = document["cross_validation_groups"]
    if groups == control:
        left = "each left out in turn"
    else:
        left = f"left out in {groups} groups in turn"
    if check:
        others = "; each check point from all control points"
    else:
        others = ""
    return (
        f"{made}. There {'is' if check == 1 else 'are'} {too_few}, so the scores are "
        f"cross-validated over all points: control points, {left}, are predicted from the "
        f"others{others}."
    )


def verdict(document: dict) -> list[str]:
    """The result in sentences.

    Parameters
    ----------
    document : dict
        The content of compare.json.
    """
    ranked = ranking(document)
    by = document["scored_by"]
    value = {row["name"]: row[by]["rmse_3d"] for row in ranked}
    best = ranked[0]["name"]
    tied = [name for name in value if value[name] - value[best] < SETTINGS.difference]
    raw = f"{number(value['raw'])} m without any correction"
    if "raw" in tied:
        text = f"The cloud as recorded, with {number(value['raw'])} m, is as good as any"
        return [
            f"No method improves this cloud by {1000 * SETTINGS.difference:.0f} mm or more. {text}."
        ]
    sentences = [_winner(ranked[0], tied, number(value[best]), raw)]
    for kind, words in OTHERS.items():
        rest = [row["name"] for row in ranked if row["kind"] == kind]
        if rest and rest[0] not in tied:
            sentences.append(f"{words}: {rest[0]}, with {number(value[rest[0]])} m.")
    if OWN in value and OWN not in tied:
        own = value[OWN]
        behind = own - value[best]
        sentences.append(f"{OWN}, with {number(own)} m, is {number(behind)} m behind.")
    return sentences


def _winner(row, tied, value, raw):
    """The sentence on the best method, or on those that are too close to tell apart."""
    if len(tied) == 1:
        return f"Best is {row['name']}: 3D RMSE {value} m, against {raw}. {row['about']}"
    return (
        f"Best are {joined(tied)}: 3D RMSE {value} m, against {raw}. They differ by less than "
        f"{1000 * SETTINGS.difference:.0f} mm, which can't be told apart."
    )
