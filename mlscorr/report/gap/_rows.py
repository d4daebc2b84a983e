"""Rows and numbers from the documents of a diagnosis and of a plan, for tables and figures."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from mlscorr.effects import meaning, title
from mlscorr.report.gap._labels import place_of, sentences_of
from mlscorr.wording import DASH, column, known, percent, plain, signed


def numbers(values: Iterable[float | None]) -> np.ndarray:
    """Numbers of a document as an array, NaN if missing.

    Parameters
    ----------
    values : iterable of float or None
    """
    return np.array([v if known(v) else np.nan for v in values], dtype=float)


COVARIATES = {
    "time": "Time since the start",
    "location": "Chainage",
    "range": "Distance from the scanner",
    "incidence": "Angle of incidence",
    "scan_angle": "Scan angle",
    "intensity": "Intensity, log10",
    "speed": "Speed",
    "turn_rate": "Turn rate, to the right",
    "pass": "Pass",
    "axis": "Axis",
    "channel": "Residuals compared",
}


@dataclass(frozen=True)
class BinRow:
    """Gap of a bin of a covariate (mm), its share of the whole, and its null band."""

    by: str
    bin: str
    count: int
    before: float | None
    after: float | None
    share: float | None
    band: list[float | None]


@dataclass(frozen=True)
class CauseRow:
    """Parameter of a cause; its numbers are texts in the unit."""

    title: str
    probability: float | None
    rms_mm: float | None
    chosen: bool
    name: str
    unit: str
    estimate: str
    sigma: str
    detectable: str


@dataclass(frozen=True)
class DetectableRow:
    """Smallest detectable size of a parameter, and its usual one, as texts in the unit.

    Parameters
    ----------
    ratio : float or None
        Smallest over usual size.
    visible : str
        Visibility in the survey, in words.
    """

    title: str
    meaning: str
    name: str
    unit: str
    detectable: str
    typical: str
    ratio: float | None
    visible: str


@dataclass(frozen=True)
class RoundRow:
    """Additions to the simulator, their size in a sentence, and the gap, as texts."""

    title: str
    size: str
    before: str
    after: str
    gone: str


def round_rows(rounds: list[dict]) -> list[RoundRow]:
    """Make rows of the table of rounds.

    Parameters
    ----------
    rounds : list of dict
        ``ablation`` of gap.json.
    """
    rows = []
    for each in rounds:
        label = each["label"]
        gap = [signed(each[k], each["unit"]) for k in ("before", "after")]
        place = partial(place_of, target=each.get("target"), windows=each["windows"])
        sizes = " ".join(sentences_of(label, each["parameters"], place))
        gone = DASH if label == "none" else percent(each["shrink"])
        rows.append(RoundRow(f"{each['round']}. {title(label)}", sizes, *gap, gone))
    return rows


def lone_rows(effects: list[dict]) -> list[RoundRow]:
    """Make rows of the table of single effects, in the first round.

    Parameters
    ----------
    effects : list of dict
        ``alone`` of ``ablation`` in gap.json.
    """
    rows = []
    for r in effects:
        before, after = (signed(r[key], r["unit"]) for key in ("before", "after"))
        rows.append(RoundRow(title(r["effect"]), "", before, after, ""))
    return rows


def split_title(split: dict) -> str:
    """Covariate of a split of the gap, in words with its unit.

    Parameters
    ----------
    split : dict
        Row of where[] in gap.json.
    """
    logarithm = split["by"] == "intensity"  # its unit would not help a reader
    if split["unit"] and not logarithm:
        unit = f" ({split['unit']})"
    else:
        unit = ""
    return COVARIATES.get(split["by"], split["name"] or split["by"]) + unit


def bin_rows(document: dict) -> list[BinRow]:
    """Make rows of the table of the gap by each covariate.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    rows = []
    for split in document["where"]:
        columns = (split[key] for key in ("count", "before", "after", "share", "null_band"))
        bins = zip(bin_names(split), *columns, strict=True)
        rows += [BinRow(split_title(split), *values) for values in bins]
    return rows


def bin_names(split: dict) -> list[str]:
    """Names of the bins of a split: their own, or from edge to edge.

    Parameters
    ----------
    split : dict
        With bins, or edges.
    """
    if split.get("edges") is None:
        return split["bins"]
    return [f"{plain(a)} to {plain(b)}" for a, b in pairwise(split["edges"])]


def cause_rows(document: dict) -> list[CauseRow]:
    """Make rows of the table of causes, one for each parameter.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    rows = []
    for cause in document["causes"]:
        chosen = cause["effect"] == document["verdict"]["label"]
        fixed = (title(cause["effect"]), cause["probability"], cause["rms_mm"], chosen)
        for parameter in cause["parameters"] or [{"name": DASH, "unit": DASH}]:
            sizes = [parameter.get(key) for key in ("estimate", "sigma", "detectable")]
            values, unit = column(sizes, parameter["unit"])
            rows.append(CauseRow(*fixed, parameter["name"].replace("_", " "), unit, *values))
    return rows


def meanings(document: dict) -> list[tuple[str, str]]:
    """Titles of all effects in the causes, and their meanings.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    names = [name for cause in document["causes"] for name in cause["effect"].split("+")]
    return [(title(name), meaning(name)) for name in dict.fromkeys(names)]


def detectable_rows(detectable: dict[str, list[dict]]) -> list[DetectableRow]:
    """Make rows of the table of the smallest detectable sizes.

    Parameters
    ----------
    detectable : dict
        By effect, of gap.json, or of plan.json with typical.
    """
    rows = []
    for effect, parts in detectable.items():
        for part in parts:
            small = part["detectable"]
            usual = part.get("typical")
            if known(small) and known(usual) and usual > 0:
                ratio = small / usual
            else:
                ratio = None
            values, unit = column([small, usual], part["unit"])
            name = part["name"].removeprefix(effect).strip() or "magnitude"
            texts = (title(effect), meaning(effect), name, unit, values[0], values[1])
            rows.append(DetectableRow(*texts, ratio, _visibility(small, ratio)))
    return rows


def _visibility(small, ratio):
    """Visibility of an effect in the survey, in words.

    >>> _visibility(0.02, 0.4), _visibility(0.02, 2.5)
    ('yes', 'only from 2.5 times the usual size')
    """
    if ratio is None:
        if known(small):
            return DASH
        return "no"
    if ratio <= 1:
        return "yes"
    return f"only from {ratio:.{int(ratio < 10)}f} times the usual size"


def worst_rows(rows: list[DetectableRow]) -> list[DetectableRow]:
    """Row of each effect's worst parameter, sorted by visibility.

    Parameters
    ----------
    rows : list of DetectableRow
    """
    worst = {}
    for row in rows:
        if row.title not in worst or _ratio(row) > _ratio(worst[row.title]):
            worst[row.title] = row
    return sorted(worst.values(), key=_ratio)


def _ratio(row):
    return row.ratio or float("inf")
