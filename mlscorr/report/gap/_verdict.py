"""First screen of a diagnosis: cause, certainty, and reduction of the gap."""

from typing import NamedTuple

from mlscorr.effects import family, lowered, meaning, title
from mlscorr.gap import no_cause
from mlscorr.report.gap._labels import place_of, sentences_of
from mlscorr.report.headline import has_assumed_sigma
from mlscorr.wording import DASH, joined, known, percent, signed, size, thousands

GAPS = {  # by kind of gap in a closure
    "systematic": "Systematic part of the gap (mean over all residuals)",
    "scatter": "Scatter beyond the stated one",
    "returns": "Returns beyond those expected",
}
NOTHING_TO_CLOSE = "The gap was already within chance before, so it can't decrease."
AXES = {"E": "easting", "N": "northing", "H": "height"}


class Fact(NamedTuple):
    """Number next to the verdict: name, value, remark in words, and end of its sentence."""

    title: str
    number: str
    more: str = ""
    stop: str = "."


def is_closed(document: dict) -> bool:
    """True if anything was added to the simulator.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    closure = document["closure"]
    return closure["effect"] not in (None, "", "none") and known(closure["before"])


def is_within(
    value: float | None, band: list[float | None], kind: str | None = None, is_left: bool = False
) -> bool:
    """True if a gap is within its range by chance; False if either is unknown.

    Parameters
    ----------
    value : float or None
    band : list of 2 floats or None
    kind : str, optional
        Kind of the gap: below the band more returns are lost than by chance; for others it is
        smaller.
    is_left : bool
        True for the gap after a cause was added: below the band, too much was added.
    """
    is_known = all(map(known, [value, *band]))
    is_low = is_known and value < band[0]
    return is_known and value <= band[1] and not (is_low and (is_left or kind == "returns"))


def shrinking(document: dict) -> Fact:
    """Reduction of the gap with the cause in the simulator.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    closure = document["closure"]
    gap = document["gap"]
    if not is_closed(document):
        before = signed(gap["before"], gap["unit"])
        more = f"Without any error: {span(gap)}."
        return Fact("The gap between survey and simulation", before, more)
    pair = " → ".join(signed(closure[when], closure["unit"]) for when in ("before", "after"))
    if document["verdict"]["label"] == "unknown":
        nearest = f"With the nearest known effect, {lowered(title(closure['effect']))},"
        return Fact(f"{nearest} in the simulator", pair, shrunk(closure))
    more = ""
    left = (closure["after"], closure["null_band"], closure.get("kind"))
    if not known(closure["shrink"]):
        more = ""
    elif is_within(*left, is_left=True):
        chance = " The remaining gap is within chance."
        more = "" if _not_closed(closure) else chance
    elif is_within(*left):
        more = " The remaining gap is smaller than by chance: the correction was too large."
    if closure["is_held_out"]:
        data = "held-out data"
    else:
        data = "the data from which it was estimated"
    part = f"{GAPS.get(closure.get('kind'), 'Gap')} on {data}"
    return Fact(
        f"{part}, before → after adding the cause to the simulator", pair, shrunk(closure) + more
    )


def shrunk(closure: dict) -> str:
    """Reduction of the squared gap, with its interval, in words.

    Errors far above the sigma of the simulator with the cause are mentioned first, because their
    square may be a small part of the gap's.

    Parameters
    ----------
    closure : dict
        Section of gap.json.
    """
    (low, high), share, between = closure["interval"], closure["shrink"], ""
    if not known(share):
        return _not_closed(closure) + NOTHING_TO_CLOSE
    if known(low) and known(high):
        between = f" (95 %: {percent(low)} to {percent(high)})"
    text = f"The squared gap decreased by {percent(share)}{between}."
    if share >= 1:
        text = f"The squared gap was removed completely{between}."
    elif share < 0:
        text = f"The squared gap increased{between}."
    return _not_closed(closure) + text


def _not_closed(closure: dict) -> str:
    """Axes with errors far above their simulated sigma with the cause; otherwise empty.

    Parameters
    ----------
    closure : dict
        Section of gap.json.
    """
    errors = closure.get("over_sigma") or {"beyond": []}
    if not errors["beyond"]:
        return ""
    ratio = dict(zip(errors["axes"], errors["after"], strict=True))
    sizes = [f"{ratio[axis]:.1f} times in {AXES[axis]}" for axis in errors["beyond"]]
    return f"Not closed: errors are still {joined(sizes)} the simulated sigma. Squares in mm: "


def span(gap: dict) -> str:
    """Range of a gap if nothing is wrong, in words.

    Parameters
    ----------
    gap : dict
        Section of gap.json.
    """
    if not all(map(known, gap["null_band"])):
        return DASH
    return " to ".join(signed(end, gap["unit"]) for end in gap["null_band"])


CERTAINTY = (  # smallest probability for each phrase
    (0.99, "practically certain"),
    (0.9, "very likely"),
    (0.66, "likely"),
    (0.5, "more likely than not"),
    (0.0, "the most probable of several"),
)
DIFFERENCE = {  # by the threshold that residuals exceed, without a named cause
    "": "Survey and simulation agree within chance.",
    "stated": "The errors are larger than stated, but no known error explains them well enough.",
    "chance": "Survey and simulation differ more than in 39 of 40 surveys without any error, "
    "but no known error explains this better than chance.",
}
NUMBER_WORDS = ("none", "one", "two", "three", "four")
SCATTER = "This is noise: no correction removes it, but larger sigmas must be stated."
NEGATIVE = "Difference beyond chance; below zero: less than by chance."


class VerdictBox(NamedTuple):
    """Box with the verdict.

    Parameters
    ----------
    tone : str
        good, bad or open.
    kicker : str
        Line above the sentences.
    sentences : list of str
    large : int
        Number of leading sentences that are the verdict itself.
    """

    tone: str
    kicker: str
    sentences: list[str]
    large: int = 1


def verdict(document: dict) -> VerdictBox:
    """Make the box with the verdict of a diagnosis.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    answer = document["verdict"]
    kind = family(document["verdict"]["label"])
    if not is_judged(document):
        short = "Too little of this survey could be compared with the simulator."
        return VerdictBox("open", "No verdict yet", [answer["sentence"] or short])
    box = {"none": _nothing, "unknown": _unknown}.get(kind, _cause)(document)
    others = _not_ruled_out(document)
    more = [f"Not ruled out: {others}."] if others else []
    return box._replace(sentences=[*box.sentences, *more])


def is_judged(document: dict) -> bool:
    """True if anything could be compared at all.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    answer = document["verdict"]
    return bool(answer["label"]) and known(answer["probability"]) and bool(document["evidence"])


def is_named(document: dict) -> bool:
    """True if the verdict names a cause.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    return is_judged(document) and family(document["verdict"]["label"]) in ("effect", "noise")


def _nothing(document):
    excess = document["verdict"]["excess"]
    small = "Errors below the smallest detectable sizes remain possible."
    kicker = no_cause(document["verdict"]["set"], excess)
    tone = "open" if excess else "good"
    return VerdictBox(tone, kicker, [f"{DIFFERENCE[excess]} {small}"])


def _unknown(document):
    answer = document["verdict"]
    if answer.get("hidden"):
        return VerdictBox(
            "open",
            "No error was detected, but not everything could be compared",
            [answer["sentence"]],
        )
    if answer["lead"]:
        text = f"Hint: {answer['lead']}."
    else:
        text = "Its pattern gives no hint."
    more = "This is a hint, not a cause: any error with this pattern may have produced it."
    return VerdictBox("open", "An error that no tested effect explains", [text, more])


def _cause(document):
    answer = document["verdict"]
    label = document["verdict"]["label"]
    sentences = _sentences(document, label)
    others = _same(document)
    parts = label.count("+") + 1
    large = len(sentences)
    if others:
        either, *more = [lowered(" ".join(_sentences(document, name))) for name in (label, *others)]
        sentences = [f"Either {either}", *(f"Or {text}" for text in more)]
        large = len(sentences)
        kicker = f"One of {_number_word(large)} errors, not separable in this survey"
    elif parts > 1:
        kicker = f"{_number_word(parts).capitalize()} errors"
    elif family(label) == "noise":
        is_assumed = label == "position_noise" and has_assumed_sigma(document["assumed"])
        if is_assumed:
            kicker = "Noisier than assumed"
        else:
            kicker = "Noisier than stated"
        sentences = [*sentences, SCATTER]
    elif answer["probability"] >= 0.5:
        kicker = "One error"
    else:
        kicker = "Possible error"
    return VerdictBox("bad", kicker, sentences, large)


def _number_word(number):
    if number < len(NUMBER_WORDS):
        return NUMBER_WORDS[number]
    return str(number)


def _same(document):
    """Labels that this survey cannot separate from the verdict's at its size."""
    answer = document["verdict"]
    return [name for name in answer["same"] if name != answer["label"]]


def _sentences(document, label):
    """Sentences with numbers for each effect of a label, or its meaning without numbers."""
    cause = next((cause for cause in document["causes"] if cause["effect"] == label), None)
    if cause is None:
        return [meaning(label)]
    target = cause.get("target")
    windows = document["windows"]
    return sentences_of(label, cause["parameters"], lambda kind: place_of(kind, target, windows))


def _not_ruled_out(document: dict) -> str:
    """Labels of the 95 % set besides the verdict's own, with their probabilities, in words.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    answer = document["verdict"]
    share = _probabilities(document)
    names = [name for name in answer["set"] if name not in {answer["label"], *answer["same"]}]
    return joined([f"{lowered(title(n))} ({_in_hundred(share.get(n))})" for n in names], "or")


def _probabilities(document):
    """Probability of each known label."""
    share = {cause["effect"]: cause["probability"] for cause in document["causes"]}
    return share | {rung["label"]: rung["probability"] for rung in document["evidence"]}


def facts(document: dict) -> list[Fact]:
    """Numbers next to the verdict: certainty, location, and reduction of the gap.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    if not is_judged(document):
        return []
    gap = document["gap"]
    headline = document["headline"]
    if not is_named(document) and not is_closed(document):
        whole = Fact("The gap between survey and simulation", headline, NEGATIVE, stop="")
        return [_certainty(document), whole]
    is_pattern = is_within(gap["before"], gap["null_band"])
    if is_pattern:
        more = "It was detected by its pattern, not by its size."
    else:
        more = ""
    where = Fact("Where it is largest", headline, more, stop="")
    return [_certainty(document), where, shrinking(document)]


def _certainty(document):
    answer = document["verdict"]
    share = _probabilities(document)
    share = answer["probability"] + sum(share.get(name) or 0.0 for name in _same(document))
    share = min(1.0, share)
    words = next(words for least, words in CERTAINTY if share >= least)
    if (
        max(
            (p or 0.0 for name, p in _probabilities(document).items() if name != answer["label"]),
            default=0.0,
        )
        > share
    ):
        words = "another is more probable, but a wrong verdict would cost more"
    more = [chance(answer["p_value"]), "± is 1 sigma." if is_named(document) else ""]
    return Fact("Confidence", f"{_in_hundred(share)}: {words}", " ".join(filter(None, more)))


def _in_hundred(share: float | None) -> str:
    """A probability in words.

    Parameters
    ----------
    share : float or None

    >>> _in_hundred(0.9817), _in_hundred(0.999), _in_hundred(0.002), _in_hundred(None)
    ('98 in 100', 'more than 99 in 100', 'less than 1 in 100', '–')
    """
    if not known(share):
        return DASH
    if share >= 0.995:
        return "more than 99 in 100"
    if share >= 0.005:
        return f"{100 * share:.0f} in 100"
    return "less than 1 in 100"


def chance(p_value: float | None) -> str:
    """Frequency of equally odd surveys with only POS errors of this one's size, in words.

    Parameters
    ----------
    p_value : float or None

    >>> chance(0.04976)
    'Of 100 surveys without any error and with an equally inaccurate POS, 5 would deviate as
    much.'
    """
    if not known(p_value):
        return ""
    number = next((n for n in (100, 1000) if round(n * p_value) > 0), 10_000)
    if p_value >= 1e-4:
        count = f"{number * p_value:.0f}"
    else:
        count = "not one"
    if number > 1000:
        words = thousands(number)
    else:
        words = number
    return (
        f"Of {words} surveys without any error and with an equally inaccurate POS, {count} would "
        "deviate as much."
    )


def advice(document: dict) -> tuple[str, list[str]]:
    """Recommended actions: a title and sentences.

    Parameters
    ----------
    document : dict
        Contents of gap.json or plan.json.
    """
    if document["advice"]:
        return "What to do now", document["advice"]
    return "What to measure next", [f"Measure {r['survey']}." for r in document["next_data"]]


def smallest(detectable: dict[str, list[dict]]) -> list[tuple[str, str]]:
    """Each effect in words and its smallest detectable size, by its worst component.

    Parameters
    ----------
    detectable : dict
        By effect, from gap.json.
    """
    rows = []
    for effect, parts in detectable.items():
        sizes = [part["detectable"] for part in parts]
        worst = max(sizes) if sizes and all(map(known, sizes)) else None
        rows.append((title(effect), size(worst, None, parts[0]["unit"] if parts else "")))
    return rows
