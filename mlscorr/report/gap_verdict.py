"""What the first screen of a diagnosis says: what is wrong, how sure, how far the gap shrinks."""

from mlscorr.report.effect_sentences import parameters_of, sentence
from mlscorr.report.effect_words import joined, kind, lowered, meaning, title
from mlscorr.report.sizes import known, percent, signed, size

LEVELS = (  # probability from which on one says so
    (0.99, "practically certain"),
    (0.9, "very likely"),
    (0.66, "likely"),
    (0.5, "more likely than not"),
    (0.0, "only the likeliest of several"),
)
ENOUGH = 0.95
NUMBERS = {2: "two", 3: "three", 4: "four"}
SCATTER = "This is scatter: no correction takes it off, but accuracies must be stated larger."
NOT_TOLD = "It can't be told yet"
NEGATIVE = "It is what the two differ by beyond chance; below zero: less than by chance."
PARTS = {  # by the kind of gap that a closure measures
    "systematic": "Systematic part of the gap (a mean over all rows)",
    "scatter": "Scatter beyond the stated one",
    "returns": "Returns beyond the expected ones",
}
SHORT = 1.0  # s: a shorter window is a moment


def verdict(document):
    """The verdict box: dict of tone (good, bad or open), kicker, sentences, and how many of them
    are the verdict itself (told)."""
    told, label = document["verdict"], document["verdict"]["label"]
    if not is_told(document):
        said = told["sentence"] or "Too little of this survey could be compared with the simulator."
        return {"tone": "open", "kicker": NOT_TOLD, "sentences": [said], "told": 1}
    what = kind(label)
    made = {"none": _nothing, "unknown": _unknown}.get(what, _cause)
    tone = {"none": "good", "unknown": "open"}.get(what, "bad")
    kicker, sentences = made(document)
    number = len(_sizes_told(document)) if tone == "bad" else 1
    others = not_ruled_out(document)
    if others:
        sentences.append(f"Not ruled out: {others}.")
    return {"tone": tone, "kicker": kicker, "sentences": sentences, "told": number}


def is_told(document):
    """Whether anything could be compared at all."""
    told = document["verdict"]
    return bool(told["label"]) and known(told["probability"]) and bool(document["evidence"])


def _nothing(document):
    if document["verdict"]["probability"] >= ENOUGH:
        kicker = "Nothing is wrong that this survey could show"
    else:
        kicker = "Nothing is shown to be wrong, but not all is ruled out"
    return kicker, [
        "The survey and its simulation differ by no more than chance makes them differ. An error "
        "smaller than the sizes below might not have shown."
    ]


def _unknown(document):
    lead = document["verdict"]["lead"]
    said = "It can't be said what it looks like."
    if lead:
        said = f"It looks like: {lead.rstrip('.')}."
    return "Something is wrong that no known effect explains", [
        said,
        "This is a lead to follow, not a cause: whatever behaves like that may have made it.",
    ]


def _cause(document):
    told, label = document["verdict"], document["verdict"]["label"]
    sentences, parts = _sizes_told(document), len(label.split("+"))
    if alike(document):
        number = NUMBERS.get(len(sentences), len(sentences))
        return f"One of {number} is wrong; this survey can't tell which", sentences
    if parts > 1:
        return f"{NUMBERS.get(parts, 'several').capitalize()} things are wrong", sentences
    if kind(label) == "noise":
        return "Noisier than stated", [*sentences, SCATTER]
    return "One thing is wrong" if told["probability"] >= 0.5 else "Possibly wrong", sentences


def _sizes_told(document):
    """Sentences with numbers: of the label's parts, or of all that can't be told from it."""
    label, others = document["verdict"]["label"], alike(document)
    if not others:
        return sentences_of(document, label)
    told = [lowered(" ".join(sentences_of(document, name))) for name in (label, *others)]
    return [f"Either {told[0]}", *(f"Or {one}" for one in told[1:])]


def alike(document):
    """Labels that this survey can't tell from the verdict's at its size."""
    told = document["verdict"]
    return [name for name in told["same"] if name != told["label"]]


def sentences_of(document, label):
    """A sentence with its numbers for each effect of a label; what it is, where it has none."""
    cause = next((one for one in document["causes"] if one["effect"] == label), None)
    if cause is None:
        return [meaning(label)]
    found = parameters_of(label, cause["parameters"])
    return [sentence(name, told, _where(document, cause, name)) for name, told in found.items()]


def _where(document, cause, effect):
    """When an effect acts, or on which target, in words."""
    if effect == "target_outlier":
        name = cause.get("target")
        return f"target {name}" if name else "one target"
    window = next((one for one in document["windows"] if one["effect"] == effect), None)
    if window is None or not known(window["start"]) or not known(window["end"]):
        return ""
    if window["end"] - window["start"] < SHORT:
        return f" at gps_time {window['start']:.1f} s"
    return f" between gps_time {window['start']:.0f} s and {window['end']:.0f} s"


def not_ruled_out(document):
    """Labels of the 95 % set besides the verdict's own, with their probabilities, in words."""
    told = document["verdict"]
    share = probabilities(document)
    names = [name for name in told["set"] if name not in {told["label"], *told["same"]}]
    return joined([f"{lowered(title(n))} ({in_hundred(share.get(n))})" for n in names], "or")


def probabilities(document):
    """Probability of each label that is known."""
    share = {one["effect"]: one["probability"] for one in document["causes"]}
    return share | {one["label"]: one["probability"] for one in document["evidence"]}


def facts(document):
    """Triples (what it is, number, more in words) beside the verdict."""
    if not is_told(document):
        return []
    return [_how_sure(document), *_gap(document)]


def _how_sure(document):
    told = document["verdict"]
    of = probabilities(document)
    share = told["probability"] + sum(of.get(name) or 0.0 for name in alike(document))
    share = min(1.0, share)
    word = next(word for least, word in LEVELS if share >= least)
    more = [chance(told["p_value"]), "± is one sigma." if is_named(document) else ""]
    return "How sure", f"{in_hundred(share)}: {word}", " ".join(filter(None, more))


def in_hundred(share):
    """A probability in words.

    >>> in_hundred(0.9817), in_hundred(0.999), in_hundred(0.002), in_hundred(None)
    ('98 in 100', 'more than 99 in 100', 'less than 1 in 100', '–')
    """
    if not known(share):
        return "–"
    if share >= 0.995:
        return "more than 99 in 100"
    return f"{100 * share:.0f} in 100" if share >= 0.005 else "less than 1 in 100"


def chance(p_value):
    """How often a survey in which nothing is wrong would look as odd.

    >>> chance(0.04976), chance(1e-19)
    ('Of 100 surveys in which nothing is wrong, 5 would look as odd.', 'Of 10 000 surveys in which
    nothing is wrong, not one would look as odd.')
    """
    if not known(p_value):
        return ""
    if p_value < 1e-4:
        return "Of 10 000 surveys in which nothing is wrong, not one would look as odd."
    of, words = next((n, w) for n, w in ((100, "100"), (1000, "1000"), (10000, "10 000"))
                     if round(n * p_value) > 0)  # fmt: skip
    return f"Of {words} surveys in which nothing is wrong, {of * p_value:.0f} would look as odd."


def _gap(document):
    """The headline with what it means when the pattern alone betrays a cause, and the shrinking."""
    if not is_named(document) and not is_closed(document):
        return [("The gap between survey and simulation", document["headline"], NEGATIVE)]
    more, gap = "", document["gap"]
    if inside(gap["before"], gap["null_band"]):
        more = "What gives it away is its pattern, not its size."
    return [("Where it shows most", document["headline"], more), _shrinking(document)]


def is_named(document):
    """Whether the verdict names a cause."""
    return is_told(document) and kind(document["verdict"]["label"]) in ("effect", "noise")


def inside(value, band):
    """Whether a gap is what it may be when nothing is wrong; not, when one is not known."""
    return all(map(known, [value, *band])) and value <= band[1]


def is_closed(document):
    """Whether anything was put into the simulator."""
    closure = document["closure"]
    return closure["effect"] not in (None, "", "none") and known(closure["shrink"])


def _shrinking(document):
    """How far the gap shrinks once the simulator has the cause."""
    closure = document["closure"]
    if not is_closed(document):
        gap = document["gap"]
        return (
            "The gap between survey and simulation",
            signed(gap["before"], gap["unit"]),
            f"When nothing is wrong: {span(gap)}.",
        )
    pair = " → ".join(signed(closure[when], closure["unit"]) for when in ("before", "after"))
    if document["verdict"]["label"] == "unknown":
        nearest = lowered(title(closure["effect"]))
        return f"With the nearest known effect, {nearest}, in the simulator", pair, shrunk(closure)
    said = shrunk(closure)
    if inside(closure["after"], closure["null_band"]):
        said += " What is left is what chance leaves when nothing is wrong."
    what = PARTS.get(closure.get("kind"), "Gap")
    return f"{what} on held-out data, before → after the simulator has it", pair, said


def shrunk(closure):
    """By how much the squared gap shrinks, with its interval, in words."""
    (low, high), share, between = closure["interval"], closure["shrink"], ""
    if known(low) and known(high):
        between = f" (95 %: {percent(low)} to {percent(min(high, 1.0))})"
    if share < 0:
        said = f"The squared gap grew by {percent(-share)}{between}."
    elif share > 1:
        said = f"All of the squared gap is gone{between}."
    else:
        said = f"{percent(share)} of the squared gap is gone{between}."
    if inside(closure["before"], closure["null_band"]):
        said += " Before, it was within chance already: the share says little."
    return said


def span(gap):
    """What a gap is when nothing is wrong, in words."""
    low, high = gap["null_band"]
    if not known(low) or not known(high):
        return "–"
    return f"{signed(low, gap['unit'])} to {signed(high, gap['unit'])}"


def advice(document):
    """What to do now: a title and sentences."""
    if document["advice"]:
        return "What to do now", document["advice"]
    found = [f"Measure {one['survey']}." for one in document["next_data"]]
    return "What to measure next", found


def smallest(detectable):
    """Pairs (effect in words, smallest size that shows), by its worst part; dashes last."""
    rows = []
    for effect, parts in detectable.items():
        sizes = [one["detectable"] for one in parts]
        worst = max(sizes) if sizes and all(map(known, sizes)) else None
        unit = parts[0]["unit"] if parts else ""
        rows.append((title(effect), size(worst, None, unit)))
    return rows
