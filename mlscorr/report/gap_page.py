"""The pages of a diagnosis, and of what a survey could diagnose before it is driven."""

from mlscorr.report.effect_words import joined, kind, lowered, title, titles
from mlscorr.report.gap_evidence import detectable_figure, heat_figure, ladder, ladder_figure
from mlscorr.report.gap_figures import closure_figure, split_title, where_figure
from mlscorr.report.gap_map import gap_map
from mlscorr.report.gap_tables import (
    cause_rows,
    detectable_rows,
    meanings,
    where_rows,
    worst_of,
)
from mlscorr.report.gap_timeline import innovations_figure, look_of
from mlscorr.report.gap_verdict import (
    advice,
    facts,
    is_closed,
    is_named,
    is_told,
    shrunk,
    smallest,
    verdict,
)
from mlscorr.report.look import svg
from mlscorr.report.sizes import known, percent
from mlscorr.report.skeleton import data_uri, environment, now, versions

SECTIONS = {  # in their order; one without anything to show is left out
    "where": "Where it shows",
    "innovations": "Over time",
    "evidence": "Candidates",
    "causes": "Causes in numbers",
    "separability": "What can be told apart",
    "closure": "How far it shrinks",
    "map": "Map",
    "next": "What to measure next",
    "used": "What was compared",
    "method": "Method",
}
PLANNED = {
    "detectable": "How small an error would show",
    "separability": SECTIONS["separability"],
    "map": SECTIONS["map"],
    "next": SECTIONS["next"],
    "left": "What can't be judged",
    "method": SECTIONS["method"],
}
LIKELY = 0.01  # probability from which on a cause is not folded away


def gap_page(document, name):
    """The self-contained page of a diagnosis, as a str of HTML.

    Parameters
    ----------
    document : dict
        The content of gap.json; what was not determined is None.
    name : str
        Of the survey.
    """
    return _render("gap.html", _diagnosis(document) | {"name": name})


def plan_page(document, name):
    """The self-contained page of what a planned survey could show, as a str of HTML.

    Parameters
    ----------
    document : dict
        detectable (by effect: name, unit, detectable, typical), classes, correlation, next_data,
        map, advice and warnings.
    name : str
        Of the survey.
    """
    return _render("gap-plan.html", _plan(document) | {"name": name})


def _render(template, content):
    templates = environment()
    templates.filters["percent"] = percent
    content |= {"versions": versions(), "written": content["document"].get("created") or now()}
    return templates.get_template(template).render(content)


def _diagnosis(document):
    """All that the page of a diagnosis shows."""
    first, (advice_title, sentences) = verdict(document), advice(document)
    label = document["verdict"]["label"]
    nothing = is_told(document) and kind(label) == "none"
    detectable = document["separability"]["detectable"]
    closure = document["closure"]
    likely, unlikely = cut(cause_rows(document))
    shown = {
        "where": bool(document["where"]),
        "separability": bool(document["separability"]["correlation"]["names"]),
        "closure": is_told(document),
        "innovations": bool(document["innovations"]["gps_time"]),
        "evidence": bool(ladder(document)),
        "causes": bool(document["causes"]),
        "map": bool(document["map"]["trajectory"]),
    }
    return _common(document, document["separability"]) | {
        "sections": {key: text for key, text in SECTIONS.items() if shown.get(key, True)},
        "verdict": first,
        "facts": facts(document),
        "advice_title": advice_title,
        "advice": sentences,
        "smallest": smallest(detectable) if nothing else [],
        "figures": _figures(document),
        "splits_in_words": joined(lowered(split_title(one)) for one in document["where"]),
        "where_rows": where_rows(document),
        "shared": "what the cause explains" if is_named(document) else "the squared gap",
        "in_set": joined(lowered(title(one)) for one in document["verdict"]["set"]),
        "cause_rows": likely,
        "unlikely_rows": unlikely,
        "meanings": meanings(document),
        "smallest_rows": detectable_rows(detectable),
        "closed": shrunk(closure) if is_closed(document) else "",
        "tested": lowered(title(closure["effect"] or "none")),
        "compared": bool(document["map"]["rows"]),
        "channels": [(look_of(one)[2], count) for one, count in document["channels"].items()],
        "already": _already(document["simulator"]),
    }


def _common(document, separability):
    """What both pages show."""
    return {
        "document": document,
        "classes": [titles(members) for members in separability["classes"]],
        "parameter_count": len(separability["correlation"]["names"]),
        "left_out": [(title(one), why) for one, why in (document.get("left_out") or {}).items()],
    }


def _figures(document):
    """The figures of a diagnosis that have something to show, as addresses of images."""
    draw = {
        "where": (where_figure, document["where"]),
        "innovations": (innovations_figure, document["innovations"]["gps_time"]),
        "evidence": (ladder_figure, ladder(document)),
        "closure": (closure_figure, is_closed(document)),
        "map": (gap_map, document["map"]["trajectory"]),
    }
    found = {
        name: _drawn(figure(document)) if some else None for name, (figure, some) in draw.items()
    }
    return found | {"heat": _heat(document["separability"])}


def _heat(separability):
    several = len(separability["correlation"]["names"]) > 1
    return _drawn(heat_figure(separability)) if several else None


def _drawn(figure):
    return data_uri(svg(figure))


def cut(rows):
    """Rows of causes that are likely, or chosen, and the others."""
    likely = [row for row in rows if row["chosen"] or (row["probability"] or 0.0) >= LIKELY]
    likely = likely or rows[:1]
    return likely, [row for row in rows if row not in likely]


def _already(simulator):
    """Effects that the simulator had already, in words."""
    names = [one if isinstance(one, str) else one.get("name", "") for one in simulator["effects"]]
    return titles(names) or "none"


def _plan(document):
    """All that the page of a plan shows."""
    rows = detectable_rows(document["detectable"])
    worst = worst_of(rows)
    separability = {key: document[key] for key in ("classes", "correlation")}
    figures = {
        "detectable": _drawn(detectable_figure(worst))
        if any(known(r["ratio"]) for r in worst)
        else None,
        "heat": _heat(separability),
        "map": _drawn(gap_map(document)) if document["map"]["trajectory"] else None,
    }
    advice_title, sentences = advice(document)
    some = {"map": figures["map"] is not None, "left": bool(document.get("left_out"))}
    rows_on_map = document["map"].get("rows") or []
    return _common(document, separability) | {
        "sections": {key: text for key, text in PLANNED.items() if some.get(key, True)},
        "verdict": _planned(worst, document),
        "advice_title": "What to add" if document["advice"] else advice_title,
        "advice": sentences,
        "figures": figures,
        "detectable_rows": rows,
        "smallest_rows": [],
        "compared": bool(rows_on_map) and "before" in rows_on_map[0],
    }


def _planned(worst, document):
    """The verdict on a plan: what it can see, what not, and what it can't tell apart."""
    seen = [row["title"] for row in worst if row["seen"] == "yes"]
    unseen = [row["title"] for row in worst if row["seen"] not in ("yes", "–")]
    errors = "kind of error" if len(seen) == 1 else "kinds of error"
    sentences = [f"{len(seen)} {errors} would show at the usual size, {len(unseen)} would not."]
    if unseen:
        sentences.append(f"Must be larger to show: {joined(map(lowered, unseen))}.")
    alike = [titles(members) for members in document["classes"]]
    sentences += [f"Not told apart: {lowered(one)}." for one in alike]
    tone = "good" if not unseen and not alike else "open"
    return {"tone": tone, "kicker": "What this survey could show", "sentences": sentences}
