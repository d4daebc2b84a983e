"""Summary of two results compared: in the terminal, in compare_results.json and on its page."""

from collections.abc import Iterator
from typing import Any

from mlscorr.report.headline import StatementRow, capped, statements_section
from mlscorr.report.settings import SETTINGS
from mlscorr.survey import Severity, Statement
from mlscorr.wording import length_in_words

SIDES = ("first", "second")
SCORES = {
    "check": "check points",
    "leave_one_out": "control points (leave-one-out)",
    "control": "control points (fit)",
}


def results_screen(document: dict[str, Any]) -> dict[str, object]:
    """``rating`` and ``statements`` of compare_results.json.

    Parameters
    ----------
    document : dict
        Rest of the document.
    """
    return statements_section(results_statements(document))


def results_statements(document: dict[str, Any]) -> list[StatementRow]:
    """First screen of a comparison of two results, in order.

    Parameters
    ----------
    document : dict
        Rest of compare_results.json.
    """
    return [
        StatementRow.of("Trajectory", _trajectory(document["trajectory"])),
        *_epochs(document["trajectory"]),
        *_scores(document["scores"]),
        *_targets(document["targets"]),
        _use(document["targets"]),
        _settings(document),
        _inputs(document["files"]),
        *_warnings(document["warnings"]),
    ]


def _severity(is_small: bool) -> Severity:
    """Severity of a difference: a warning unless it is below the smallest relevant one."""
    if is_small:
        return "note"
    return "warning"


def _trajectory(section):
    """Statement on the difference of the corrected positions."""
    space = section["difference"]["3d"]
    largest = space["largest"]
    values = {
        "largest": largest,
        "time": space["time"],
        "rms": space["rms"],
        "axes": {name: row["rms"] for name, row in section["difference"].items() if name != "3d"},
    }
    if largest == 0.0:
        return Statement("equal trajectories", values={"epochs": section["epochs"]})
    return Statement("trajectories differ", _severity(largest <= SETTINGS.difference), values)


def _epochs(section) -> Iterator[StatementRow]:
    """Yield statements on epochs that do not agree."""
    only = section["epochs_only_in"]
    if not section["interpolated"] and not any(only.values()):
        return
    values = {"interpolated": section["interpolated"], **only}
    statement = Statement("epochs differ", _severity(not any(only.values())), values)
    yield StatementRow.of("Epochs", statement)


def _scores(scores) -> Iterator[StatementRow]:
    """Yield statements on the 3D RMSE of both results, at the most independent points."""
    for key, name in SCORES.items():
        row = scores[key]
        if row["difference_3d"] is None:
            continue
        values = {
            "name": name,
            "difference": row["difference_3d"],
            **{side: row[side]["rmse_3d"] for side in SIDES},
            "counts": [row[side]["n"] for side in SIDES],
        }
        statement = Statement("scores of results", _severity(_is_no_worse(row)), values)
        yield StatementRow.of("RMSE", statement)
        return


def _is_no_worse(row):
    """True unless the second RMSE is larger by a relevant amount."""
    return row["difference_3d"] <= SETTINGS.difference


def _targets(rows) -> Iterator[StatementRow]:
    """Yield statements on targets with the largest differences, and on changed surveyed points."""
    changed = [row for row in rows if row["change_3d"] is not None]
    if changed:
        above = [row for row in changed if row["change_3d"] > SETTINGS.difference]
        values = {
            "name": changed[0]["name"],
            "change": changed[0]["change_3d"],
            "count": len(above),
            "all": len(changed),
            "least": SETTINGS.difference,
        }
        statement = Statement("residuals differ", _severity(not above), values)
        items = capped((_name(row), _change_in_words(row)) for row in above)
        yield StatementRow.of("Targets", statement, items=items)
    moved = [row for row in rows if any(row["surveyed"]["difference"] or ())]
    if moved:
        statement = Statement("surveyed differently", "warning", {"count": _points(moved)})
        by_name = {row["name"]: _axes(row["surveyed"]["difference"]) for row in moved}
        yield StatementRow.of("Coordinates", statement, items=capped(by_name.items()))


def _name(row):
    """Name of a target, and the pass of its observation."""
    if row["pass"] is None:
        return str(row["name"])
    return f"{row['name']} (pass {row['pass']})"


def _axes(vector):
    """Format a vector of E, N, H in words, to a tenth of a millimeter."""
    parts = [round(value, 4) + 0.0 for value in vector]  # no negative zero
    return "E {:+.4f}, N {:+.4f}, H {:+.4f} m".format(*parts)


def _change_in_words(row):
    """Change of a residual, in space and by axis, in words."""
    return f"{length_in_words(row['change_3d'])}: {_axes(row['after']['difference'])}"


def _points(rows):
    """Number of surveyed points in rows of targets."""
    return len({row["name"] for row in rows})


def _use(rows):
    """Statement on targets used in only one result, with the reason."""
    differing = [row for row in rows if bool(row["used"]["first"]) != bool(row["used"]["second"])]
    if not differing:
        used = [row for row in rows if row["used"]["first"]]
        return StatementRow.of("Use", Statement("same targets used", values={"n": len(used)}))
    items = []
    for row in differing:
        side = SIDES[not row["used"]["first"]]
        other = SIDES[bool(row["used"]["first"])]
        why = row["reason"][other] or "not among its targets"
        items.append((_name(row), f"used in the {side} only; {other}: {why}"))
    statement = Statement("targets used in one", "warning", {"count": len(differing)})
    return StatementRow.of("Use", statement, items=capped(items))


def _settings(document):
    """Statement on different order, covariance and coverage."""
    rows = [row for part in ("model", "coverage") for row in document[part] if row["differs"]]
    count = len(document["model"]) + len(document["coverage"])
    values = {"count": len(rows), "all": count}
    items = [(row["what"].replace("_", " "), _both(row)) for row in rows]
    return StatementRow.of("Model", Statement("values differ", values=values), items=capped(items))


def _both(row):
    """Format two values side by side."""
    words = []
    for side in SIDES:
        value = row[side]
        if isinstance(value, float):
            words.append(f"{value:.4g}")
        else:
            words.append("none" if value is None else str(value))
    return " → ".join(words)


def _inputs(files):
    """Statement on inputs with different contents."""
    inputs = [row for row in files if row["is_input"]]
    other = [row for row in inputs if row["differs"]]
    values = {"count": len(other), "all": len(inputs)}
    items = []
    for row in other:
        there = [side for side in SIDES if row[side] is not None]
        words = "other contents" if len(there) == 2 else f"in the {there[0]} only"
        items.append((row["name"], f"{row['what']}, {words}"))
    statement = Statement("inputs differ", values=values)
    return StatementRow.of("Inputs", statement, items=capped(items))


def _warnings(warnings) -> Iterator[StatementRow]:
    """Yield statements on warnings of only one result."""
    items = [(f"{side} only", text) for side in SIDES for text in warnings[side]]
    if items:
        statement = Statement("warnings of one", "warning", {"count": len(items)})
        yield StatementRow.of("Warnings", statement, items=capped(items))
