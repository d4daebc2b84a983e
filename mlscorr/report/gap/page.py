"""Pages and figures of a diagnosis, and of a planned survey's diagnosis."""

from functools import partial

from mlscorr.effects import family, lowered, title, titles
from mlscorr.report.gap import _rows as rows
from mlscorr.report.gap._channels import (
    WORDS,
    channel_rows,
    channel_statements,
    channels_figure,
    distance_rows,
)
from mlscorr.report.gap._evidence import heat_figure, ladder, ladder_figure
from mlscorr.report.gap._innovations import channel_style, innovations_figure, site_map
from mlscorr.report.gap._plan import accuracy_figure, accuracy_sentence, detectable_figure
from mlscorr.report.gap._rows import detectable_rows, worst_rows
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.gap._splits import closure_figure, where_figure
from mlscorr.report.gap._verdict import (
    VerdictBox,
    advice,
    facts,
    is_closed,
    is_judged,
    is_named,
    shrunk,
    smallest,
    span,
    verdict,
)
from mlscorr.report.gap.first_screen import accuracy, unjudged
from mlscorr.report.pages import Page, drawn
from mlscorr.report.style import Figures
from mlscorr.wording import DASH, joined, known, percent, signed


def diagnosis_figures(document: dict) -> Figures:
    """Make functions that draw the figures of a diagnosis, by name.

    Parameters
    ----------
    document : dict
        Contents of gap.json, with None for undetermined values.
    """
    figures = {
        "where": (where_figure, document["where"]),
        "innovations": (innovations_figure, document["innovations"]["gps_time"]),
        "evidence": (ladder_figure, ladder(document)),
        "closure": (closure_figure, is_closed(document)),
        "map": (site_map, document["map"]["trajectory"]),
        "channels": (channels_figure, any(c["tables"] for c in document.get("contrasts", ()))),
    }
    drawn = {name: partial(draw, document) for name, (draw, content) in figures.items() if content}
    return drawn | _separability(document["separability"])


def plan_figures(document: dict) -> Figures:
    """Make functions that draw the figures of a plan, by name.

    Parameters
    ----------
    document : dict
        Contents of plan.json.
    """
    figures = {}
    worst = worst_rows(detectable_rows(document["detectable"]))
    if any(known(row.ratio) for row in worst):
        figures["detectable"] = partial(detectable_figure, worst)
    if document.get("accuracy"):
        figures["accuracy"] = partial(accuracy_figure, document)
    if document["map"]["trajectory"]:
        figures["map"] = partial(site_map, document)
    return figures | _separability(document)


def _separability(document):
    is_matrix = len(document["correlation"]["names"]) > 1
    if is_matrix:
        return {"separability": partial(heat_figure, document)}
    return {}


SECTIONS = {  # in order; empty ones are omitted
    "where": "Location",
    "innovations": "Innovations",
    "evidence": "Hypotheses",
    "causes": "Causes in numbers",
    "separability": "Separability",
    "closure": "Decrease of the gap",
    "rounds": "Rounds",
    "channels": "Other channels",
    "distances": "Other distances",
    "map": "Map",
    "next": "What to measure next",
    "used": "Residuals compared",
    "method": "Method",
}
PLANNED = {
    "accuracy": "Accuracy along the drive",
    "detectable": "Smallest detectable errors",
    "separability": SECTIONS["separability"],
    "map": SECTIONS["map"],
    "next": SECTIONS["next"],
    "left": "Errors not tested",
    "method": SECTIONS["method"],
}


def diagnosis_page(document: dict, name: str) -> Page:
    """Make the self-contained page of a diagnosis.

    Parameters
    ----------
    document : dict
        Contents of gap.json, with None for undetermined values.
    name : str
        Name of the survey.
    """
    separability = document["separability"]
    closure = document["closure"]
    answer = document["verdict"]
    detectable = separability["detectable"]
    is_clean = is_judged(document) and family(answer["label"]) == "none"
    probable, unlikely = _by_probability(rows.cause_rows(document))
    figures = drawn(diagnosis_figures(document))
    is_empty = {key: key not in figures for key in ("where", "innovations", "evidence", "map")}
    is_empty["separability"] = not separability["correlation"]["names"]
    is_empty |= {"closure": not is_judged(document), "causes": not document["causes"]}
    ablation = document.get("ablation") or {"rounds": [], "alone": []}
    is_empty |= {"rounds": not ablation["rounds"], "distances": not document.get("distances")}
    is_empty["channels"] = not document.get("contrasts")
    others = (*accuracy(document), *channel_statements(document), *unjudged(document))
    content = {
        "figures": figures,
        "verdict": verdict(document),
        "facts": facts(document),
        "others": [fact.document() for fact in others],
        "smallest": smallest(detectable) if is_clean else [],
        "splits_in_words": joined(lowered(rows.split_title(split)) for split in document["where"]),
        "bin_rows": rows.bin_rows(document),
        "shared": "the effect of the cause" if is_named(document) else "the squared gap",
        "open_causes": _open_causes(answer),
        "in_set": joined(lowered(title(label)) for label in answer["set"]),
        "cause_rows": probable,
        "unlikely_rows": unlikely,
        "meanings": rows.meanings(document),
        "smallest_rows": rows.detectable_rows(detectable),
        "closed": shrunk(closure) if is_closed(document) else "",
        "rounds": rows.round_rows(ablation["rounds"]),
        "alone": rows.lone_rows(ablation["alone"]),
        **_channels(document),
        "tested": lowered(title(closure["effect"] or "none")),
        "compared": bool(document["map"]["rows"]),
        "channels": [(channel_style(key).words, n) for key, n in document["channels"].items()],
        "already": titles(e["name"] for e in document["simulator"]["effects"]) or "none",
    }
    sections = {key: text for key, text in SECTIONS.items() if not is_empty.get(key)}
    headline = f"{name}: errors that its simulator does not include"
    return _page(document, name, headline, "gap-summary.html", sections, separability, content)


def plan_page(document: dict, name: str) -> Page:
    """Make the self-contained page of a planned survey's diagnosis.

    Parameters
    ----------
    document : dict
        Contents of plan.json.
    name : str
        Name of the survey.
    """
    detectable = rows.detectable_rows(document["detectable"])
    worst = rows.worst_rows(detectable)
    figures = drawn(plan_figures(document))
    is_empty = {key: key not in figures for key in ("map", "accuracy")}
    is_empty["left"] = not document.get("left_out")
    content = {
        "figures": figures,
        "verdict": _plan_verdict(worst, document),
        "detectable_rows": detectable,
        "smallest_rows": [],
        "open_causes": [lowered(titles(members)) for members in document["classes"]],
        "compared": False,
        "accuracy_words": "",
    }
    if document.get("accuracy"):
        content["accuracy_words"] = accuracy_sentence(document["accuracy"])
    if document["advice"]:
        content["advice_title"] = "What to add"
    sections = {key: text for key, text in PLANNED.items() if not is_empty.get(key)}
    headline = f"{name}: errors that this survey can detect"
    return _page(document, name, headline, "gap-plan-summary.html", sections, document, content)


def _page(document, name, headline, summary, sections, separability, content):
    """Page with the parts common to both."""
    advice_title, sentences = advice(document)
    common = {
        "document": document,
        "name": name,
        "percent": percent,
        "advice_title": advice_title,
        "advice": sentences,
        "classes": [titles(members) for members in separability["classes"]],
        "parameter_count": len(separability["correlation"]["names"]),
        "left_out": [(title(k), why) for k, why in (document.get("left_out") or {}).items()],
    }
    return Page(headline, summary, sections, common | content, "gap-", ("gap.css",))


def _channels(document):
    """Content on non-geometric channels, and on distances."""
    contrasts = document.get("contrasts", ())
    gap = document["gap"]
    sides = (signed(gap[when], gap["unit"]) for when in ("before", "after"))
    silent = [(WORDS[c["channel"]][0], c["silent"]) for c in contrasts if c["silent"]]
    return {
        "channel_sentences": [text for each in contrasts for text in each["sentences"]],
        "channels_silent": silent,
        "channel_rows": channel_rows(document),
        "distance_rows": distance_rows(document),
        "gap_words": f"{' before, '.join(sides)} after ({span(gap)} without any error)",
    }


def _open_causes(answer):
    """Open causes of a verdict in words, as one class; empty for a single cause."""
    labels = dict.fromkeys([*answer["set"], *answer["same"]])
    causes = [lowered(title(label)) for label in labels if label not in ("none", "unknown")]
    if len(causes) > 1:
        return [joined(causes)]
    return []


def _by_probability(rows):
    """Rows of likely or chosen causes, and the others."""
    least = SETTINGS.likely_probability
    probable = [row for row in rows if row.chosen or (row.probability or 0.0) >= least]
    probable = probable or rows[:1]
    return probable, [row for row in rows if row not in probable]


def _plan_verdict(worst, document):
    """Verdict on a plan: visible, invisible and inseparable effects."""
    visible = [row.title for row in worst if row.visible == "yes"]
    hidden = [row.title for row in worst if row.visible not in ("yes", DASH)]
    if len(visible) == 1:
        errors = "type of error"
    else:
        errors = "types of error"
    sentences = [
        f"{len(visible)} {errors} would be detectable at the usual size, {len(hidden)} would not."
    ]
    if hidden:
        sentences.append(f"Only detectable if larger: {joined(map(lowered, hidden))}.")
    classes = [titles(members) for members in document["classes"]]
    sentences += [f"Not separable: {lowered(members)}." for members in classes]
    tone = "open" if hidden or classes else "good"
    return VerdictBox(tone, "Errors that this survey can detect", sentences)
