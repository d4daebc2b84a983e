"""What a verdict says of an effect in numbers: one sentence with its size and direction."""

from mlscorr.report.effect_words import WORDS, joined, meaning, title
from mlscorr.report.sizes import DASH, known, size

FACTOR = "factor on sigma"  # of a POS that drifts more than it says
WINDOW = ("start", "length", "largest sigma over the stated")  # of one that does so at times
TOLD = 2  # such windows that are told with their times
SURE = 2.0  # sigmas from zero, from which on a part of a vector is told


def parameters_of(label, parameters):
    """Parameters by the effects of a label: dict of dicts by their names.

    One of a pair has the effect's name before its own; without it, it belongs to the first effect
    that has such a parameter and lacks it still.
    """
    found = {name: {} for name in label.split("+")}
    for one in parameters:
        effect, _, rest = one["name"].partition(" ")
        if effect in found and rest:
            found[effect][rest] = one
            continue
        name = one["name"]
        kind = name.rstrip(" 0123456789")  # windows are numbered
        owner = next((e for e in found if kind in _expected(e) and name not in found[e]), None)
        found[owner or next(iter(found))][name] = one
    return found


def _expected(effect):
    own = {"position_noise": ("magnitude", FACTOR, *WINDOW)}
    events = {"position_step": ("time",), "position_bump": ("time", "width")}
    words = WORDS.get(effect)
    parts = (words.parts if words else ()) or own.get(effect, ("magnitude",))
    return (*parts, *events.get(effect, ()))


def sentence(effect, parameters, where=""):
    """The sentence of one effect with its numbers.

    Parameters
    ----------
    effect : str
    parameters : dict of dict
        By name, each with estimate, sigma and unit; see parameters_of.
    where : str
        Where or when it acts, in words.

    >>> told = {"magnitude": {"estimate": -0.0045, "sigma": 0.0005, "unit": "s"}}
    >>> sentence("time_offset", told)
    'The clock of the scanner is 4.5 ms ± 0.5 ms behind the clock of the POS.'
    """
    words = WORDS.get(effect)
    if words is None or not parameters:
        return meaning(effect) or f"{title(effect)}."
    if effect == "position_noise":
        return words.said.format(size=_noise(parameters))
    if effect == "angle_eccentricity":
        return words.said.format(size=_amplitude([*parameters.values()]))
    if words.parts:
        return words.said.format(size=_vector(words, parameters), where=where or "")
    one = parameters.get("magnitude")
    if one is None or not known(one["estimate"]):
        return meaning(effect)
    value, unit = one["estimate"], words.unit or one["unit"]
    told = size(abs(value), one["sigma"], unit)
    return words.said.format(size=told, side=words.sides[value < 0], where=where)


def _noise(parameters):
    """By how much a POS is worse than it says: at all times, or in windows.

    >>> told = {"start": 413205.0, "length": 20.0, "largest sigma over the stated": 12.0}
    >>> _noise({name: {"estimate": value} for name, value in told.items()})
    'up to 12 times as large between gps_time 413205 s and 413225 s'
    """
    if FACTOR in parameters:
        one = parameters[FACTOR]
        return f"{size(one['estimate'], one['sigma'], '')} times as large"
    if "magnitude" in parameters:
        one = parameters["magnitude"]
        value = abs(one["estimate"]) if known(one["estimate"]) else None
        return f"{size(value, one['sigma'], one['unit'])} of scatter come on top"
    start, length, factor = (
        [one["estimate"] for name, one in parameters.items() if name.startswith(kind)]
        for kind in WINDOW
    )
    if not start or not all(map(known, [*start, *length, *factor])):
        return DASH
    ends = list(zip(start, length, strict=True))
    when = [f"between gps_time {a:.0f} s and {a + b:.0f} s" for a, b in ends[:TOLD]]
    left = len(ends) - TOLD
    more = ["once more"] if left == 1 else [f"{left} times more"] if left > 1 else []
    return f"up to {max(factor):.0f} times as large {joined([*when, *more])}"


def _vector(words, parameters):
    """The parts of a vector that differ from zero; all, when none does."""
    told, sure = [], []
    for name, (above, below) in zip(words.parts, words.sides, strict=True):
        one = parameters.get(name)
        if one is None or not known(one["estimate"]):
            continue
        value, sigma = one["estimate"], one["sigma"]
        text = f"{size(abs(value), sigma, one['unit'])} {below if value < 0 else above}"
        told.append(text)
        sure.append(known(sigma) and abs(value) > SURE * sigma)
    shown = [text for text, is_sure in zip(told, sure, strict=True) if is_sure] or told
    return joined(shown) or DASH


def _amplitude(parameters):
    """Length of the two waves of an eccentricity, and its sigma."""
    values = [one["estimate"] for one in parameters]
    if not all(map(known, values)):
        return DASH
    length = sum(value**2 for value in values) ** 0.5
    sigmas = [one["sigma"] for one in parameters]
    sigma = None
    if all(map(known, sigmas)) and length > 0:
        sigma = sum((v * s) ** 2 for v, s in zip(values, sigmas, strict=True)) ** 0.5 / length
    return size(length, sigma, parameters[0]["unit"])
