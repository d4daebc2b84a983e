"""First screen of a diagnosis in terminal, gap.json and page: two answers, and open questions."""

from collections.abc import Iterator
from itertools import groupby

from mlscorr.effects import lowered, title
from mlscorr.gap.evidence import SETTINGS
from mlscorr.pos import SETTINGS as POS
from mlscorr.report.gap._channels import channel_statements
from mlscorr.report.gap._verdict import facts, is_named, verdict
from mlscorr.report.headline import (
    StatementRow,
    assumed_statement,
    has_assumed_sigma,
    statements_section,
    warning_statements,
)
from mlscorr.wording import joined, length_in_words

RATINGS = {"good": "green", "open": "amber", "bad": "red"}  # by tone of the verdict
TIMES = [time for _, time, _ in POS.process_shapes]
USES = {  # of defaults that are not estimated
    "pos.attitude_sigma": "its scale is estimated",
    "pos.correlation_time": f"{min(TIMES):g} to {max(TIMES):g} times as long is also possible",
    "scanner.range_noise": "not compared with surface roughness",
    "scanner.angle_noise": "not compared with surface roughness",
}
THINGS = {  # observed items of residuals, in words
    "target": "Surveyed targets",
    "surface": "Reference surface",
    "shared": "Planes scanned in two passes",
}


def gap_screen(document: dict) -> dict[str, object]:
    """``rating`` and ``statements`` of gap.json.

    Parameters
    ----------
    document : dict
        Rest of the document.
    """
    box = verdict(document)
    first, *more = box.sentences
    items = [("", sentence) for sentence in more]
    items += [
        (fact.title, f"{fact.number}{fact.stop} {fact.more}".strip()) for fact in facts(document)
    ]
    answer = StatementRow("Unmodeled", RATINGS[box.tone], f"{box.kicker}. {first}", tuple(items))
    warnings = warning_statements(document["warnings"])
    further = (*channel_statements(document), *unjudged(document))
    judged = ", and the accuracy is not tested against it"
    assumed = assumed_statement(document["assumed"], judged, "amber", USES)
    return statements_section([*accuracy(document), answer, *assumed, *further, *warnings])


def accuracy(document: dict) -> Iterator[StatementRow]:
    """Yield statements on the accuracy of the recorded cloud relative to POS, scanner and survey.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    parts = document["agreement"]
    if document["simulator"]["effects"]:
        less = ", after removing the errors in the simulator,"
    else:
        less = ""
    if not parts:
        return
    if has_assumed_sigma(document["assumed"]):
        yield _unstated_accuracy(document, less)
        return
    is_worse = [part["rms_mm"] > SETTINGS.quantile * part["stated_mm"] for part in parts]
    if any(is_worse):
        answer = "less accurate than"
    else:
        answer = "as accurate as"
    sizes = []
    for part in parts:
        lengths = part["rms_mm"], part["stated_mm"], SETTINGS.quantile * part["stated_mm"]
        residual, stated, limit = (length_in_words(length / 1e3) for length in lengths)
        states = f"{stated} from the stated accuracy of POS, survey and extraction (limit {limit})"
        sizes.append((THINGS[part["channel"]], f"RMS {residual} per axis, {states}"))
    rating = "amber" if any(is_worse) else "green"
    items = (*sizes, *_moved(document))
    yield StatementRow("Accuracy", rating, f"The recorded cloud{less} is {answer} stated.", items)


def _unstated_accuracy(document, less):
    """Statement on errors of the recorded cloud without a stated POS accuracy."""
    sizes = [
        (THINGS[part["channel"]], f"RMS {length_in_words(part['rms_mm'] / 1e3)} per axis")
        for part in document["agreement"]
    ]
    sentence = (
        f"The recorded cloud{less} can't be compared with a stated accuracy, because no sigma of "
        "the POS is given."
    )
    return StatementRow("Accuracy", "amber", sentence, (*sizes, *_moved(document)))


def _moved(document):
    """Statement on the shift of points by the cause itself."""
    causes = [c for c in document["causes"] if c["effect"] == document["verdict"]["label"]]
    if not is_named(document) or not causes or not causes[0]["rms_mm"]:
        return ()
    size = length_in_words(causes[0]["rms_mm"] / 1e3)
    return ((title(causes[0]["effect"]), f"effect on the residuals: {size} (RMS)"),)


def unjudged(document: dict) -> Iterator[StatementRow]:
    """Yield statements on effects that this survey cannot judge, by reason.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    left = sorted(document["left_out"].items(), key=lambda item: item[1])
    if left:
        items = tuple(
            (joined(lowered(title(name)) for name, _ in group), why)
            for why, group in groupby(left, key=lambda item: item[1])
        )
        judged = [rung["label"] for rung in document["evidence"] if "+" not in rung["label"]]
        total = len(left) + len({*judged} - {"none", "unknown"})
        sentence = f"{len(left)} of {total} types of error can't be tested here."
        rating = "amber" if document["mendable"] else "green"
        yield StatementRow("Not tested", rating, sentence, items)
