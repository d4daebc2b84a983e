"""What is said of a verdict in a sentence, and what to do about it."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace

from mlscorr.effects import effect_class, lowered, title
from mlscorr.gap._agreement import Agreement
from mlscorr.gap.closure import Closure
from mlscorr.gap.evidence import SETTINGS, Cause, CauseParameter, Inference
from mlscorr.gap.plan import NextData
from mlscorr.wording import percent, size, with_articles

NOTHING_TO_DO = "Nothing needs to be done: what is left agrees with what the simulator says."
ONLY_DRIFT = (
    "Run mlscorr correct: what is left looks like drift of the POS, whose sigma nobody stated."
)
ADVICE = {  # where no cause is named, by what is left is more than
    "": NOTHING_TO_DO,
    "stated": "Errors are larger than stated: run mlscorr correct, or state POS sigmas larger.",
    "chance": "More control points, or a second pass, may show why the two differ.",
}


def excess_of(
    inference: Inference, closure: Closure, agreement: Iterable[Agreement], is_stated: bool = True
) -> str:
    """What it is more than that is left where no cause is named: stated, chance, or nothing.

    Parameters
    ----------
    inference : Inference
    closure : Closure
        Of its verdict.
    agreement : iterable of Agreement
    is_stated : bool
        Whether somebody stated the sigmas of the POS: nothing is more than a default.
    """
    if inference.verdict.label != "none":
        return ""
    worse = [part for part in agreement if part.rms_mm > SETTINGS.quantile * part.stated_mm]
    if is_stated and (worse or closure.over_sigma.beyond):
        return "stated"
    gaps = closure.gap, inference.where
    if any(gap.before > gap.null_band[1] for gap in gaps):
        return "chance"
    return ""


def no_cause(labels: Sequence[str], excess: str) -> str:
    """What is said where no cause is named, without a full stop.

    Parameters
    ----------
    labels : sequence of str
        That hold 95 %.
    excess : str
        As ``excess_of`` gives it.
    """
    if excess:
        return f"No cause is shown, but the two differ by more than {excess}"
    if list(labels) != ["none"]:
        return "Nothing is shown to be wrong, but not all is ruled out"
    return "Nothing is wrong that this survey could show"


def distinct_parameters(cause: Cause) -> tuple[CauseParameter, ...]:
    """Parameters of a cause; those of one name have the name of their effect before it.

    Parameters
    ----------
    cause : Cause
        Its parts are in the order of its parameters.
    """
    often = Counter(parameter.name for parameter in cause.parameters)
    owners = {
        name: iter([part.name for part, _ in cause.parts if name in part.parameters])
        for name, count in often.items()
        if count > 1
    }
    return tuple(
        replace(p, name=f"{next(owners[p.name])} {p.name}") if p.name in owners else p
        for p in cause.parameters
    )


def sentence_of(inference: Inference, excess: str) -> str:
    """The verdict in a sentence.

    Parameters
    ----------
    inference : Inference
    excess : str
        As ``excess_of`` gives it.
    """
    verdict = inference.verdict
    cause = inference.cause
    chance = f"probability {verdict.probability:.2f}"
    if verdict.label == "none":
        return f"{no_cause(verdict.set, excess)} ({chance} that nothing is wrong)."
    if verdict.is_hidden:
        return (
            f"What was compared shows nothing wrong, but it can't be said that nothing is: there "
            f"is a {verdict.lead} (probability of something unknown {verdict.probability:.2f})."
        )
    if verdict.label == "unknown":
        return f"No known effect explains it ({chance}): it looks like a {verdict.lead}."
    parameters = distinct_parameters(cause)
    sizes = [f"{p.name} {size(p.estimate, p.sigma, p.unit)}" for p in parameters]
    do = "explain" if "+" in verdict.label else "explains"
    return f"{title(verdict.label)} {do} it ({chance}): {', '.join(sizes)} (± one sigma)."


def advice_of(
    inference: Inference,
    closure: Closure,
    next_data: Sequence[NextData],
    excess: str,
    is_stated: bool = True,
) -> list[str]:
    """What to do about a verdict, in sentences.

    Parameters
    ----------
    inference : Inference
    closure : Closure
        Of its verdict.
    next_data : sequence of NextData
    excess : str
        As ``excess_of`` gives it.
    is_stated : bool
        Whether somebody stated the sigmas of the POS.
    """
    verdict = inference.verdict
    sentences = []
    if verdict.label == "none":
        sentences.append(ADVICE[excess] if is_stated or excess else ONLY_DRIFT)
    elif verdict.is_hidden:
        sentences.append(
            "Find out why the targets of that stretch could not be matched before the survey is "
            "trusted there: the warnings give each one's reason."
        )
    elif verdict.label == "unknown":
        sentences.append(f"Look for what makes a {verdict.lead}: no effect of the library does.")
        if closure.effect != "none":  # it impersonates the cause
            share = f"closes {percent(max(0.0, closure.shrink))} of the squared gap, but "
            if closure.is_within_noise:
                share = ""
            sentences.append(
                f"The nearest known effect, {lowered(title(closure.effect))}, {share}does not "
                "explain it: don't use it."
            )
    else:
        sentences += [effect_class(part).remedy for part in verdict.label.split("+")]
        (low, high), before, after = closure.null_band, closure.before, closure.after
        if closure.shrink < 0 and not low <= after <= high:
            sentences.append(
                f"But with that size in the simulator the gap grew (from {before:.1f} to "
                f"{after:.1f} {closure.unit}): trust what was found, not how large it is."
            )
    labels = (*verdict.set, *inference.same)
    open_question = [lowered(title(n)) for n in labels if n not in ("none", verdict.label)]
    if open_question and next_data:
        sentences = [sentence for sentence in sentences if sentence != NOTHING_TO_DO]
        sentences.append(
            f"To settle what is open ({', '.join(dict.fromkeys(open_question))}), measure "
            f"{next_data[0].survey}: {next_data[0].why}"
        )
    return list(dict.fromkeys(map(with_articles, sentences)))
