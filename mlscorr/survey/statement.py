"""Statement on a survey as a value: code compares its key, readers get its sentence."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Severity = Literal["note", "warning", "fault"]
Wording = str | Callable[..., str]  # with the names of values in braces, or a function of them


@dataclass(frozen=True)
class Statement:
    """Fact, doubt, fault or advice, before it is worded.

    Parameters
    ----------
    key : str
        Identifier in a few words; each package lists its own.
    severity : str
        ``note``, ``warning`` (something may be wrong) or ``fault`` (something is).
    values : mapping
        Numbers in SI units, names and whatever else its sentence needs.
    """

    key: str
    severity: Severity = "note"
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def sentence(self, wordings: Mapping[str, Wording]) -> str:
        """Return the sentence, by the wordings of a package.

        Parameters
        ----------
        wordings : mapping of str or function
            By key.

        Raises
        ------
        KeyError
            If there is no wording for the key.

        >>> Statement("no target", values={"name": "T07"}).sentence(
        ...     {"no target": "{name} was not found."}
        ... )
        'T07 was not found.'
        """
        wording = wordings[self.key]
        if isinstance(wording, str):
            return wording.format_map(self.values)
        return wording(**self.values)
