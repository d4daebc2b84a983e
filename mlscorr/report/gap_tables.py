"""Rows of the tables of a diagnosis and of a plan, read from their documents."""

from itertools import pairwise

from mlscorr.report.effect_words import meaning, title
from mlscorr.report.gap_figures import is_chosen, split_title
from mlscorr.report.sizes import DASH, column, known, plain

NUMBERS = ("estimate", "sigma", "detectable")


def where_rows(document):
    """Rows of the table of the gap by each covariate."""
    rows = []
    for split in document["where"]:
        names = split.get("bins")
        if split.get("edges") is not None:
            names = [f"{plain(a)} to {plain(b)}" for a, b in pairwise(split["edges"])]
        columns = ("count", "before", "after", "share", "null_band")
        for name, *values in zip(names, *(split[key] for key in columns), strict=True):
            row = dict(zip(("count", "before", "after", "share", "band"), values, strict=True))
            rows.append({"by": split_title(split), "bin": name, **row})
    return rows


def cause_rows(document):
    """Rows of the table of causes, one for each parameter."""
    rows = []
    for cause in document["causes"]:
        for one in cause["parameters"] or [{"name": DASH, "unit": DASH}]:
            values, unit = column([one.get(key) for key in NUMBERS], one["unit"])
            rows.append(
                {
                    **dict(zip(NUMBERS, values, strict=True)),
                    "name": one["name"].replace("_", " "),
                    "unit": unit,
                    "title": title(cause["effect"]),
                    "probability": cause["probability"],
                    "rms_mm": cause["rms_mm"],
                    "chosen": is_chosen(cause, document),
                }
            )
    return rows


def meanings(document):
    """Pairs (title, what it is) of all effects that the causes name."""
    names = [name for cause in document["causes"] for name in cause["effect"].split("+")]
    return [(title(name), meaning(name)) for name in dict.fromkeys(names)]


def detectable_rows(detectable):
    """Rows of the table of the smallest sizes that show; typical is there when planning."""
    rows = []
    for effect, parts in detectable.items():
        for one in parts:
            ratio = _ratio(one)
            values, unit = column([one["detectable"], one.get("typical")], one["unit"])
            rows.append(
                {
                    "title": title(effect),
                    "meaning": meaning(effect),
                    "name": one["name"].removeprefix(effect).strip() or "magnitude",
                    "unit": unit,
                    "detectable": values[0],
                    "typical": values[1],
                    "ratio": ratio,
                    "seen": _seen(one, ratio),
                }
            )
    return rows


def _ratio(one):
    """Smallest size over the usual one, None where either is not known."""
    small, usual = one["detectable"], one.get("typical")
    return small / usual if known(small) and known(usual) and usual > 0 else None


def _seen(one, ratio):
    """Whether the survey can see an effect, in words.

    >>> _seen({"detectable": 0.02}, 0.4), _seen({"detectable": 0.02}, 2.5)
    ('yes', 'only if 2.5 times the usual')
    """
    if ratio is None:
        return "no" if not known(one["detectable"]) else "–"
    return "yes" if ratio <= 1 else f"only if {ratio:.{int(ratio < 10)}f} times the usual"


def worst_of(rows):
    """One row for each effect, that of its worst parameter; the plainest effect first."""
    worst = {}
    for row in rows:
        have = worst.get(row["title"])
        if have is None or (row["ratio"] or float("inf")) > (have["ratio"] or float("inf")):
            worst[row["title"]] = row
    return sorted(worst.values(), key=lambda row: row["ratio"] or float("inf"))
