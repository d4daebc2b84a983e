"""Defaults that stand in for accuracies that nobody stated, on the first screen."""

from collections.abc import Iterable, Iterator, Mapping

from mlscorr.report._statement import StatementRow
from mlscorr.wording import counted, joined, known, length_in_words

NAMES = {  # of a key of survey.toml
    "pos.position_sigma": "Position of the POS",
    "pos.attitude_sigma": "Attitude of the POS",
    "pos.correlation_time": "Correlation time of the POS",
    "scanner.range_noise": "Range noise",
    "scanner.angle_noise": "Angle noise",
}
SIGMAS = ("pos.position_sigma", "pos.attitude_sigma")


def has_assumed_sigma(rows: Iterable[dict]) -> bool:
    """Return True if a sigma of the POS is a default.

    Parameters
    ----------
    rows : iterable of dict
        ``assumed`` of a document.
    """
    return any(row["key"] in SIGMAS for row in rows)


def assumed_statement(
    rows: list[dict], purpose: str, rating: str, uses: Mapping[str, str] | None = None
) -> Iterator[StatementRow]:
    """The accuracies that nobody stated, with the defaults that stand in; nothing without any.

    Parameters
    ----------
    rows : list of dict
        ``assumed`` of a document: key, value, unit and, where there is one, the estimate.
    purpose : str
        What becomes of them: the end of the sentence.
    rating : str
        Of RATINGS, where a sigma is among them; else it is green.
    uses : mapping of str to str, optional
        What a default without an estimate is used for, by its key.
    """
    if not rows:
        return
    sections = dict.fromkeys(f"[{row['key'].partition('.')[0]}]" for row in rows)
    verb = "is" if len(rows) == 1 else "are"
    is_sigma = has_assumed_sigma(rows)
    if is_sigma:
        columns = ", or give the trajectory sigma columns"
    else:
        columns = ""
    sentence = (
        f"{counted(len(rows), 'accuracy')} that nobody stated {verb} assumed{purpose}. State "
        f"what you know under {joined(sections)} in survey.toml{columns}."
    )
    items = tuple(_item(row, uses or {}) for row in rows)
    yield StatementRow("Assumed", rating if is_sigma else "green", sentence, items)


def _item(row, uses):
    """Sentence on an assumed sigma, with its size by this survey."""
    text = f"{_size(row['value'], row['unit'])} assumed"
    if row.get("estimate") is not None:
        text += f"; about {_size(row['estimate'], row['unit'])} by this survey"
    elif row["key"] in uses:
        text += f"; {uses[row['key']]}"
    return NAMES.get(row["key"], row["key"]), text


def _size(value, unit):
    """A size, or several, in words."""
    values = value if isinstance(value, list | tuple) else [value]
    if not all(map(known, values)):
        return "–"
    if unit == "m":
        return length_in_words(values[0])
    sign = "°" if unit == "deg" else f" {unit}"
    return ", ".join(f"{number:.2g}{sign}" for number in values)
