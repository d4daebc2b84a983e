"""Sentences of a diagnosis on the effects of a label, with their numbers."""

from collections.abc import Callable

from mlscorr.effects import Effect, SizeEstimate, effects_by_name, meaning, title
from mlscorr.wording import known


def sentences_of(
    label: str, parameters: list[dict], where: Callable[[type[Effect]], str]
) -> list[str]:
    """Sentences with numbers for each effect of a label, or its meaning without numbers.

    Parameters
    ----------
    label : str
    parameters : list of dict
        Parameters of the label's cause in gap.json.
    where : function
        Returns place or time of an effect class's action, in words.
    """
    kinds = effects_by_name()
    sentences = []
    for name, estimates in parameters_of(label, parameters).items():
        kind = kinds.get(name)
        if kind:
            sentence = kind.describe(estimates, where(kind))
        else:
            sentence = meaning(name)
        sentences.append(sentence or f"{title(name)}.")
    return sentences


def place_of(kind: type[Effect], target: str | None, windows: list[dict]) -> str:
    """Time of an effect, or its target, in words.

    Parameters
    ----------
    kind : class of an Effect
    target : str or None
        Target of the cause.
    windows : list of dict
        Intervals of gap.json, with start and end. Units: s.
    """
    if kind.is_on_target():
        if target:
            return f"target {target}"
        return "one target"
    for window in windows:
        start = window["start"]
        end = window["end"]
        if window["effect"] == kind.name and known(start) and known(end):
            if end - start < 1.0:  # times are written in whole seconds
                return f" at gps_time {start:.1f} s"
            if kind.name == "position_step":  # until the end of its pass
                return f" about gps_time {start:.0f} s"
            return f" between gps_time {start:.0f} s and {end:.0f} s"
    return ""


def parameters_of(label: str, parameters: list[dict]) -> dict[str, dict[str, SizeEstimate]]:
    """Parameters of each effect of a label, by their names.

    For a pair, names are prefixed by the effect; without a prefix, a parameter belongs to the first
    effect that has such a parameter and no value yet.

    Parameters
    ----------
    label : str
    parameters : list of dict
        Each with name, estimate, sigma and unit.
    """
    kinds = effects_by_name()
    owned = {name: {} for name in label.split("+")}
    expected = {n: kinds[n].parameter_names() if n in kinds else ("magnitude",) for n in owned}
    for row in parameters:
        effect, _, name = row["name"].partition(" ")
        if effect not in owned or not name:
            name = row["name"]
            plain = name.rstrip(" 0123456789")  # intervals are numbered
            owners = (e for e in owned if plain in expected[e] and name not in owned[e])
            effect = next(owners, next(iter(owned)))
        owned[effect][name] = SizeEstimate(row["estimate"], row["sigma"], row["unit"])
    return owned
