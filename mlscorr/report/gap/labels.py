"""The labels of a diagnosis in plain words: effects, pairs, nothing, something unknown."""

from collections.abc import Callable, Iterable

from mlscorr.effects import Effect, SizeEstimate, known_effects
from mlscorr.effects.wording import joined

OTHERS = {
    "none": ("Nothing", "The simulator describes this survey as it is."),
    "unknown": ("Something unknown", "An error that none of the known effects explains."),
}


def title(label: str) -> str:
    """A label in words: of an effect, of a pair joined by +, of none or unknown.

    Parameters
    ----------
    label : str

    >>> title("time_offset+range_noise"), title("none")
    ('Scanner clock offset and noisy ranges', 'Nothing')
    """
    return titles(label.split("+"))


def titles(names: Iterable[str]) -> str:
    """Effects in words, in a row.

    Parameters
    ----------
    names : iterable of str

    >>> titles(["range_bias", "range_walk", "position_step"])
    'Range bias, range walk and GNSS jump'
    """
    first, *rest = [_words(name)[0] for name in names] or [""]
    return joined([first, *map(lowered, rest)])


def lowered(text: str) -> str:
    """A title or sentence as it goes on within a sentence.

    Parameters
    ----------
    text : str

    >>> lowered("Scanner clock offset"), lowered("GNSS jump")
    ('scanner clock offset', 'GNSS jump')
    """
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]


def meaning(label: str) -> str:
    """What a label is, in a sentence for each of its parts.

    Parameters
    ----------
    label : str
    """
    return " ".join(filter(None, (_words(name)[1] for name in label.split("+"))))


def family(label: str) -> str:
    """Where a label belongs: none, unknown, noise or effect.

    Parameters
    ----------
    label : str

    >>> family("range_noise"), family("range_noise+time_offset")
    ('noise', 'effect')
    """
    if label in OTHERS:
        return label
    kinds = [_effects().get(name) for name in label.split("+")]
    return "noise" if all(kind and kind.is_scatter() for kind in kinds) else "effect"


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
    kinds, sentences = _effects(), []
    for name, estimates in parameters_of(label, parameters).items():
        kind = kinds.get(name)
        sentence = kind.describe(estimates, where(kind)) if kind else meaning(name)
        sentences.append(sentence or f"{title(name)}.")
    return sentences


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
    kinds, owned = _effects(), {name: {} for name in label.split("+")}
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


def _words(name):
    """Title and meaning of an effect, none or unknown; of others the name itself."""
    kind = _effects().get(name)
    if kind:
        return kind.title, kind.meaning
    return OTHERS.get(name, (name.replace("_", " ").capitalize(), ""))


def _effects():
    """Classes of effects by their names."""
    return {kind.name: kind for kind in known_effects()}
