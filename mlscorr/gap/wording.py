"""The sentences of an advice: what to do about a verdict, by the key of its statement."""

from collections.abc import Iterable, Sequence

from mlscorr.effects import effect_class, lowered, title
from mlscorr.survey import Statement, Wording
from mlscorr.wording import percent, with_articles


def _nearest_effect(effect: str, share: float | None) -> str:
    closes = ""
    if share is not None:
        closes = f"closes {percent(share)} of the squared gap, but "
    return (
        f"The nearest known effect, {lowered(title(effect))}, {closes}does not explain it: don't "
        "use it."
    )


def _addition(labels: Sequence[str], survey: str, why: str) -> str:
    names = dict.fromkeys(lowered(title(label)) for label in labels)
    return f"To settle what is open ({', '.join(names)}), measure {survey}: {why}"


ADVICE: dict[str, Wording] = {
    "nothing to do": "Nothing needs to be done: what is left agrees with what the simulator says.",
    "drift of a default": "Run mlscorr correct: what is left looks like drift of the POS, whose "
    "sigma nobody stated.",
    "errors above stated": "Errors are larger than stated: run mlscorr correct, or state POS "
    "sigmas larger.",
    "gap above chance": "More control points, or a second pass, may show why the two differ.",
    "unmatched targets": "Find out why the targets of that stretch could not be matched before the "
    "survey is trusted there: the warnings give each one's reason.",
    "unstated mounting": "State [mounting] in survey.toml and diagnose again: {effects} kinds of "
    "error can't be judged without it, and one of them may be the cause.",
    "unknown error": "Look for what makes a {lead}: no effect that was judged does.",
    "nearest effect": _nearest_effect,
    "remedy": lambda effect: effect_class(effect).remedy,
    "grown gap": "But with that size in the simulator the gap grew (from {before:.1f} to "
    "{after:.1f} {unit}): trust what was found, not how large it is.",
    "addition": _addition,
    "channels": "See by what the clouds differ beside geometry: Channels.",
    "simulator as it was": "simulator.toml is as it was, since no simulator can take that: {why}",
    "next run": "Run mlscorr diagnose once more with --simulator simulator.toml of this folder: it "
    "has the cause in it, and the next run finds what is left, or nothing.",
    "next clouds": "Put the cause into your simulator, and give the clouds that it makes then as a "
    "second --simulated: they tell how far the gap shrinks, and by themselves what is left.",
    "second clouds": "Run mlscorr diagnose with your second clouds alone: they tell what is left.",
}


def advice_sentences(advice: Iterable[Statement]) -> list[str]:
    """The sentences of an advice, those that two effects share once.

    Parameters
    ----------
    advice : iterable of Statement
        Of the keys of ADVICE.
    """
    sentences = (with_articles(statement.sentence(ADVICE)) for statement in advice)
    return list(dict.fromkeys(sentences))
