"""Statement on a survey as a value: code compares its key, and readers get its sentence."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Severity = Literal["note", "warning", "fault"]
Wording = str | Callable[..., str]  # with the names of values in braces, or a function of them


@dataclass(frozen=True)
class Statement:
    """A fact, a doubt, a fault or an advice, before anyone words it.

    Parameters
    ----------
    key : str
        What it is, in a few words; each room lists its own.
    severity : str
        ``note``, ``warning`` (something may be wrong) or ``fault`` (something is).
    values : mapping
        Numbers in SI units, names and whatever else its sentence needs.
    """

    key: str
    severity: Severity = "note"
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def sentence(self, wordings: Mapping[str, Wording]) -> str:
        """The sentence by the wordings of a room.

        Parameters
        ----------
        wordings : mapping of str or function
            By key.

        Raises
        ------
        KeyError
            Where the room has none for the key.

        >>> Statement("no target", values={"name": "T07"}).sentence(
        ...     {"no target": "{name} was not found."}
        ... )
        'T07 was not found.'
        """
        wording = wordings[self.key]
        if isinstance(wording, str):
            return wording.format_map(self.values)
        return wording(**self.values)
