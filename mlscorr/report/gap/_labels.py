"""Sentences of a diagnosis on the effects of a label, with their numbers."""

from collections.abc import Callable

from mlscorr.effects import Effect, SizeEstimate, effects_by_name, meaning, title
from mlscorr.wording import known


def sentences_of(
    label: str, parameters: list[dict], where: Callable[[type[Effect]], str]
) -> list[str]:
    """A sentence with its numbers for each effect of a label; what it is, where it has none.

    Parameters
    ----------
    label : str
    parameters : list of dict
        Of the label's cause in gap.json.
    where : function
        Of the class of an effect: where or when it acts, in words.
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
    """When an effect acts, or on which target, in words.

    Parameters
    ----------
    kind : class of an Effect
    target : str or None
        Of the cause.
    windows : list of dict
        Of gap.json, with start and end. Units: s.
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
            if kind.name == "position_step":  # from then on to the end of its pass
                return f" about gps_time {start:.0f} s"
            return f" between gps_time {start:.0f} s and {end:.0f} s"
    return ""


def parameters_of(label: str, parameters: list[dict]) -> dict[str, dict[str, SizeEstimate]]:
    """Parameters by the effects of a label, and by their names.

    That of a pair has the effect's name before its own; without it, it belongs to the first effect
    that has such a parameter and lacks it still.

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
            plain = name.rstrip(" 0123456789")  # windows are numbered
            owners = (e for e in owned if plain in expected[e] and name not in owned[e])
            effect = next(owners, next(iter(owned)))
        owned[effect][name] = SizeEstimate(row["estimate"], row["sigma"], row["unit"])
    return owned
