"""A fact on the first screen of a report."""

from dataclasses import dataclass

RATINGS = ("green", "amber", "red")  # as it should be; mind it; not whole, or worse than before


@dataclass(frozen=True)
class StatementRow:
    """A fact on the first screen.

    Parameters
    ----------
    what : str
        What it is about.
    rating : str
        Of RATINGS.
    sentence : str
    items : tuple of (str, str)
        What it names one by one, and what is said of each.
    """

    what: str
    rating: str
    sentence: str
    items: tuple[tuple[str, str], ...] = ()

    def document(self) -> dict[str, object]:
        """The row of ``statements[]`` in report.json."""
        return {**vars(self), "items": [{"name": name, "text": text} for name, text in self.items]}
