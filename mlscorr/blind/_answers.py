"""A case of a blind check: what was made, what the diagnosis said, and whether that is right."""

from dataclasses import dataclass

from mlscorr.blind._mix import causes
from mlscorr.gap.evidence import SETTINGS


@dataclass(frozen=True)
class AnsweredCase:
    """One case: its label and what the diagnosis said.

    Parameters
    ----------
    name : str
    label : dict
        As make_case gives it.
    answer : dict
        {"document": gap.json} or {"error": text}.
    """

    name: str
    label: dict
    answer: dict

    @property
    def document(self) -> dict | None:
        """That of gap.json; None of a diagnosis that failed."""
        return self.answer.get("document")

    @property
    def verdict(self) -> dict:
        """The verdict; of a diagnosis that failed a label that is never right."""
        failed = {"label": "failed", "probability": 1.0, "set": [], "p_value": None, "lead": ""}
        if self.document:
            return self.document["verdict"]
        return failed

    @property
    def named(self) -> str:
        """The label that was named."""
        return self.verdict["label"]

    @property
    def kind(self) -> str:
        """That of the case."""
        return self.label["kind"]

    @property
    def mdb(self) -> float:
        """Size of the smallest cause, in minimal detectable biases."""
        return min(self.label["mdb"], default=0.0)

    @property
    def goal_size(self) -> float:
        """The size to the nearest half, at which goals are set."""
        return round(2 * self.mdb) / 2

    @property
    def is_clear(self) -> bool:
        """Whether its size is three or more."""
        return round(self.mdb, 2) >= 3

    @property
    def truth(self) -> str:
        """The label that is right."""
        mechanism = self.label["mechanism"]
        if mechanism:
            return mechanism["name"]
        return "+".join(self.label["names"]) or "none"

    @property
    def is_noise(self) -> bool:
        """Whether none, or nothing but noise, was said to be there."""
        return set(self.named.split("+")) <= {"none", *causes(is_random=True)}

    @property
    def is_only_noise(self) -> bool:
        """Whether noise and nothing else was named."""
        return self.is_noise and self.named != "none"

    @property
    def resemblance(self) -> float:
        """Largest squared correlation of the truth with what was named."""
        like = next(iter(self.label["likeness"].values()), {})
        return max(like.get(name, 0.0) for name in self.named.split("+"))

    @property
    def is_right(self) -> bool:
        """Whether the answer is what an honest diagnosis should say."""
        if self.kind == "outside":
            return self.named == "unknown"
        if self.kind == "withheld":
            is_random = set(self.named.split("+")) <= set(causes(is_random=True))
            return self.named == "unknown" or is_random or self.resemblance > SETTINGS.same
        return self.names(self.named, by_class=True)

    @property
    def leads(self) -> bool:
        """Whether the lead has one of the words of each entry."""
        lead = self.verdict["lead"]
        entries = self.label["mechanism"]["lead"]
        return all(any(word in lead for word in entry.split("|")) for entry in entries)

    def names(self, label: str, by_class: bool = False) -> bool:
        """Whether a label is the truth.

        Parameters
        ----------
        label : str
        by_class : bool
            Also what the geometry can't tell from it.
        """
        parts = label.split("+")
        truth = self.label["names"] or ["none"]
        if len(parts) != len(truth):
            return False
        if not by_class:
            return sorted(parts) == sorted(truth)
        return any(all(map(self._is_of_class, truth, order)) for order in (parts, parts[::-1]))

    def _is_of_class(self, truth, name):
        likeness = self.label["likeness"].get(truth, {})
        return name == truth or likeness.get(name, 0.0) > SETTINGS.same
