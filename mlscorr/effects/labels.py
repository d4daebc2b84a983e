"""Labels of a diagnosis in plain words: effects, pairs, none, unknown."""

from collections.abc import Iterable

from mlscorr.effects.catalogue import effects_by_name
from mlscorr.wording import joined

OTHERS = {
    "none": ("Nothing", "The simulator describes this survey correctly."),
    "unknown": ("Something unknown", "An error that no known effect explains."),
}


def title(label: str) -> str:
    """Title of a label: an effect, a pair joined by +, none or unknown.

    Parameters
    ----------
    label : str

    >>> title("time_offset+range_noise"), title("none")
    ('Scanner clock offset and noisy ranges', 'Nothing')
    """
    return titles(label.split("+"))


def titles(names: Iterable[str]) -> str:
    """Join titles of effects in words.

    Parameters
    ----------
    names : iterable of str

    >>> titles(["range_bias", "range_walk", "position_step"])
    'Range bias, range walk and GNSS jump'
    """
    first, *rest = [_words(name)[0] for name in names] or [""]
    return joined([first, *map(lowered, rest)])


def lowered(text: str) -> str:
    """Convert a title or sentence for use within a sentence.

    Parameters
    ----------
    text : str

    >>> lowered("Scanner clock offset"), lowered("GNSS jump")
    ('scanner clock offset', 'GNSS jump')
    """
    if text[1:2].isupper():
        return text
    return text[:1].lower() + text[1:]


def meaning(label: str) -> str:
    """Meaning of a label, with a sentence for each of its parts.

    Parameters
    ----------
    label : str
    """
    return " ".join(filter(None, (_words(name)[1] for name in label.split("+"))))


def family(label: str) -> str:
    """Class of a label: none, unknown, noise or effect.

    Parameters
    ----------
    label : str

    >>> family("range_noise"), family("range_noise+time_offset")
    ('noise', 'effect')
    """
    if label in OTHERS:
        return label
    kinds = [effects_by_name().get(name) for name in label.split("+")]
    if all(kind and kind.is_scatter() for kind in kinds):
        return "noise"
    return "effect"


def parameter_title(name: str) -> str:
    """Name of a parameter in words: that of the effect, and of its component.

    Parameters
    ----------
    name : str

    >>> parameter_title("lever_arm up"), parameter_title("time_offset")
    ('Lever arm, up', 'Scanner clock offset')
    """
    effect, _, part = name.partition(" ")
    part = part.replace("magnitude ", "").replace("(phase)", "")
    return ", ".join(filter(None, [title(effect), part]))


def _words(name):
    """Title and meaning of an effect, none or unknown; otherwise the name itself."""
    kind = effects_by_name().get(name)
    if kind:
        return kind.title, kind.meaning
    return OTHERS.get(name, (name.replace("_", " ").capitalize(), ""))
