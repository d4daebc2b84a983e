"""Sentences of a diagnosis: verdict, advice, reasons for unjudged effects, and headline.

The headline states the size of the gap and where most of it is. A cause moves some residuals more
than others, and thus by chance also those of an unrelated range or brightness. A cause is therefore
located only by the covariates on which it acts; without a cause, by bins that exceed their null
band.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from mlscorr.effects import effect_class, lowered, title
from mlscorr.gap.advice import distinct_parameters
from mlscorr.gap.evidence import CHANNELS, NAMES, SETTINGS, Inference, Split, Where
from mlscorr.survey import Statement, Wording
from mlscorr.wording import figures, percent, size, with_articles


def _nearest_effect(effect: str, share: float | None) -> str:
    closes = ""
    if share is not None:
        closes = f"closes {percent(share)} of the squared gap, but "
    return (
        f"The nearest known effect, {lowered(title(effect))}, {closes}does not explain it: do "
        "not use it."
    )


def _addition(labels: Sequence[str], survey: str, why: str) -> str:
    names = dict.fromkeys(lowered(title(label)) for label in labels)
    return f"To resolve the open hypotheses ({', '.join(names)}), measure {survey}: {why}"


ADVICE: dict[str, Wording] = {
    "nothing to do": "No action is needed: the remaining differences agree with the simulator.",
    "drift of a default": "Run mlscorr correct: the remaining differences look like POS drift, "
    "and no sigma of the POS was given.",
    "errors above stated": "The errors are larger than stated: run mlscorr correct, or increase "
    "the stated sigmas of the POS.",
    "gap above chance": "More control points or a second pass may show why survey and "
    "simulation differ.",
    "unmatched targets": "Find out why the targets of that interval could not be matched before "
    "using the survey there. The warnings give the reason for each target.",
    "unstated mounting": "Add [mounting] to survey.toml and diagnose again: {effects} error "
    "types can't be tested without it, and one of them may be the cause.",
    "unknown error": "Look for the cause of a {lead}: no tested effect explains it.",
    "nearest effect": _nearest_effect,
    "remedy": lambda effect: effect_class(effect).remedy,
    "grown gap": "However, the gap increased with that size in the simulator (from {before:.1f} "
    "to {after:.1f} {unit}). The cause is reliable, its size is not.",
    "addition": _addition,
    "channels": 'See "Channels" for differences other than geometry.',
    "simulator as it was": "simulator.toml is unchanged, because no simulator can include this: "
    "{why}",
    "next run": "Run mlscorr diagnose again with --simulator simulator.toml from this folder. "
    "It contains the cause, and the next run finds what remains.",
    "next clouds": "Add the cause to your simulator, and give its new clouds as a second "
    "--simulated. They show how far the gap decreases; on their own, they show "
    "what remains.",
    "second clouds": "Run mlscorr diagnose with the second clouds alone: they show what remains.",
}

LEFT_OUT: dict[str, Wording] = {  # reasons why an effect is not judged
    "no mounting": "It acts on the {stage}, and the survey has no [mounting].",
    "unstated size": "survey.toml does not give its size: [scanner] {name}.",
    "no row": "No residual of this survey depends on it.",
    "noise": "Noise shows in surface roughness and in the scatter of residuals, not in a shift.",
    "not usable": "{why}",
}


def no_cause(labels: Sequence[str], excess: str) -> str:
    """Phrase if no cause is named, without a full stop.

    Parameters
    ----------
    labels : sequence of str
        Labels with 95 % probability.
    excess : str
        From ``excess_of``.
    """
    if excess:
        return f"No cause is identified, but survey and simulation differ by more than {excess}"
    if list(labels) != ["none"]:
        return "No error was detected, but not all errors are ruled out"
    return "No error was detected that this survey could show"


def sentence_of(inference: Inference, excess: str) -> str:
    """Return the verdict in a sentence.

    Parameters
    ----------
    inference : Inference
    excess : str
        From ``excess_of``.
    """
    verdict = inference.verdict
    cause = inference.cause
    chance = f"probability {verdict.probability:.2f}"
    if verdict.label == "none":
        return f"{no_cause(verdict.set, excess)} ({chance} of no error)."
    if verdict.is_hidden:
        return (
            f"The comparison shows no error, but an error is possible: there is a {verdict.hint} "
            f"(probability of an unknown error {verdict.probability:.2f})."
        )
    if verdict.label == "unknown":
        return f"No tested effect explains the differences ({chance}). Hint: {verdict.hint}."
    parameters = distinct_parameters(cause)
    sizes = [f"{p.name} {size(p.estimate, p.sigma, p.unit)}" for p in parameters]
    do = "explain" if "+" in verdict.label else "explains"
    return (
        f"{title(verdict.label)} {do} the differences ({chance}): {', '.join(sizes)} (± 1 sigma)."
    )


def advice_sentences(advice: Iterable[Statement]) -> list[str]:
    """Return the sentences of an advice, without repetitions for two effects.

    Parameters
    ----------
    advice : iterable of Statement
        Of the keys of ADVICE.
    """
    sentences = (with_articles(statement.sentence(ADVICE)) for statement in advice)
    return list(dict.fromkeys(sentences))


def left_out_sentences(left_out: Mapping[str, Statement]) -> dict[str, str]:
    """Return the sentences on effects that are not judged.

    Parameters
    ----------
    left_out : mapping of str to Statement
        By name of the effect, with keys of LEFT_OUT.
    """
    return {name: why.sentence(LEFT_OUT) for name, why in left_out.items()}


ACTS_ON = {  # covariates by which the size of an effect varies, by name of the effect
    "time_offset": ("speed", "turn_rate"),
    "clock_drift": ("time", "speed", "turn_rate"),
    "time_jitter": ("speed", "turn_rate"),
    "boresight": ("range", "scan_angle"),
    "lever_arm": ("pass", "axis"),
    "range_bias": ("scan_angle", "axis"),
    "range_scale": ("range",),
    "range_walk": ("intensity",),
    "incidence_bias": ("incidence",),
    "range_noise": ("incidence",),
    "angle_scale": ("scan_angle", "range"),
    "angle_eccentricity": ("scan_angle", "range"),
    "angle_noise": ("range", "incidence"),
    "heading_drift": ("time", "location", "pass", "range"),
    "position_step": ("time",),
    "position_bump": ("time",),
    "position_noise": ("time", "location"),
    "vertical_datum": ("axis",),
    "horizontal_datum": ("axis",),
    "map_rotation": ("location",),
    "map_scale": ("location",),
    "target_outlier": ("time", "location"),
    "beam_divergence": ("range", "incidence"),
    "dropout": ("range", "incidence"),
}
WORDS = {  # of a range of values of a covariate
    "time": "between gps_time {} s and {} s",
    "location": "at chainage {} m to {} m of the first pass",
    "range": "at ranges of {} m to {} m",
    "incidence": "at incidence angles of {}° to {}°",
    "scan_angle": "at scan angles of {}° to {}°",
    "intensity": "at intensities of {} to {} (16 bits)",
    "speed": "at speeds of {} m/s to {} m/s",
    "turn_rate": "at turn rates of {} °/s to {} °/s",
}
AXIS_WORDS = {"E": "in easting", "N": "in northing", "H": "in height"}


class _GapPlace(NamedTuple):
    """Range of a covariate: its share of the cause's shift or of the gap, and of rows."""

    share: float
    rows: float
    words: str


def headline(where: Where, label: str, hint: str, start: float) -> str:
    """Return the sentence on the size of the gap and on its largest part.

    Parameters
    ----------
    where : Where
    label : str
        Of the verdict.
    hint : str
        Hint of an unknown error; otherwise empty.
    start : float
        The gps_time at which the covariate time is zero. Units: s.
    """
    low, high = where.null_band
    is_measurable = where.before > high
    chance = f"{low:.1f} to {high:.1f} mm without any error"
    size = f"The residuals together differ from the simulation by {where.before:.1f} mm ({chance})"
    if not is_measurable:
        size = f"The residuals together agree with the simulation within chance ({chance})"
    is_moved = label != "none"
    if not is_measurable and not is_moved:
        return f"There is no significant difference. {size}."
    whole = "the effect of the cause" if is_moved else "the gap"
    best = _largest(_places(where.splits, _acts_on(label, hint), start))
    if best is None:
        return f"No part of the survey is conspicuous. {size}."
    return (
        f"{percent(min(best.share, 1.0))} of {whole} is {best.words}, with {percent(best.rows)} "
        f"of the residuals. {size}."
    )


def _acts_on(label: str, hint: str) -> Callable[[str], bool] | None:
    """Function that is True for covariates on which a cause acts; None if unknown."""
    if label == "unknown" and hint:
        return lambda by: NAMES.get(by, (by,))[0] in hint
    effects = label.split("+")
    if not set(effects) <= set(ACTS_ON):
        return None
    named = {by for effect in effects for by in ACTS_ON[effect]}
    return lambda by: by in named


def _largest(places: Iterable[_GapPlace]) -> _GapPlace | None:
    """Bin whose share exceeds that of its residuals most; None if none does clearly."""
    plain = [place for place in places if place.share > SETTINGS.plain * place.rows]
    return max(plain, key=lambda place: place.share - place.rows, default=None)


def _places(splits, acts_on, start):
    """Bins of the splits on which a cause acts, or that exceed their null band."""
    for split in splits:
        if acts_on is not None and not acts_on(split.by):
            continue
        if acts_on is not None and split.extent is not None:
            extent = split.extent
            words = _range_words(split.by, extent.low, extent.high, start)
            yield _GapPlace(extent.share, extent.rows, words)
            continue
        for number, words in enumerate(_bin_words(split, start)):
            is_beyond = split.before[number] > split.band[number, 1]
            if acts_on is not None or is_beyond:
                rows = split.count[number] / split.count.sum()
                yield _GapPlace(float(split.share[number]), float(rows), words)


def _bin_words(split: Split, start: float) -> list[str]:
    """Each bin of a split in words."""
    if split.edges is not None:
        ends = zip(split.edges[:-1], split.edges[1:], strict=True)
        return [_range_words(split.by, low, high, start) for low, high in ends]
    if split.by == "pass":
        return [f"in pass {name}" for name in split.bins]
    if split.by == "axis":
        return [AXIS_WORDS.get(name, "along no axis") for name in split.bins]
    return [CHANNELS.get(name, name) for name in split.bins]


def _range_words(by, low, high, start):
    """Range of a covariate in the unit used by surveyors."""
    if by == "time":
        return WORDS[by].format(f"{start + low:.1f}", f"{start + high:.1f}")
    if by == "intensity":
        low = 10.0**low
        high = 10.0**high
    if by in ("intensity", "location"):
        return WORDS[by].format(f"{low:.0f}", f"{high:.0f}")
    return WORDS[by].format(figures(low, 2), figures(high, 2))
