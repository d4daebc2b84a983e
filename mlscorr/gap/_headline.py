"""Sentence on the size of the gap and on where most of it lies.

A cause moves some residuals more than others, and so by chance also those of some range or
brightness that it has nothing to do with. So a cause is located by the covariates on which it acts
alone; without a cause, by what exceeds its null band.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from mlscorr.gap.evidence import CHANNELS, NAMES, SETTINGS, Split, Where
from mlscorr.wording import figures, percent

ACTS_ON = {  # covariates by which the size of an effect differs, by the effect's name
    "time_offset": ("speed", "turn_rate"),
    "clock_drift": ("time", "speed", "turn_rate"),
    "time_jitter": ("speed", "turn_rate"),
    "boresight": ("range", "scan_angle"),
    "lever_arm": ("pass", "axis"),
    "range_bias": ("scan_angle", "axis"),
    "range_scale": ("range",),
    "range_walk": ("intensity",),
    "incidence_bias": ("incidence",),
    "range_noise": ("incidence",),
    "angle_scale": ("scan_angle", "range"),
    "angle_eccentricity": ("scan_angle", "range"),
    "angle_noise": ("range", "incidence"),
    "heading_drift": ("time", "location", "pass", "range"),
    "position_step": ("time",),
    "position_bump": ("time",),
    "position_noise": ("time", "location"),
    "vertical_datum": ("axis",),
    "horizontal_datum": ("axis",),
    "map_rotation": ("location",),
    "map_scale": ("location",),
    "target_outlier": ("time", "location"),
    "beam_divergence": ("range", "incidence"),
    "dropout": ("range", "incidence"),
}
WORDS = {  # of a range of values of a covariate
    "time": "between gps_time {} s and {} s",
    "location": "at chainage {} m to {} m of the first pass",
    "range": "at ranges of {} m to {} m",
    "incidence": "at incidence angles of {}° to {}°",
    "scan_angle": "at scan angles of {}° to {}°",
    "intensity": "at intensities of {} to {} (16 bits)",
    "speed": "at speeds of {} m/s to {} m/s",
    "turn_rate": "at turn rates of {} °/s to {} °/s",
}
AXIS_WORDS = {"E": "in easting", "N": "in northing", "H": "in height"}


class _GapPlace(NamedTuple):
    """A range of a covariate.

    Parameters
    ----------
    share : float
        Of what the cause moves, or of the gap.
    rows : float
        Share of the residuals that lie in it.
    words : str
    """

    share: float
    rows: float
    words: str


def headline(where: Where, label: str, lead: str, start: float) -> str:
    """Return the sentence on the size of the gap and on where most of it lies.

    Parameters
    ----------
    where : Where
    label : str
        Of the verdict.
    lead : str
        What an unknown error looks like; else empty.
    start : float
        The gps_time from which the covariate time counts. Units: s.
    """
    low, high = where.null_band
    is_measurable = where.before > high
    chance = f"{low:.1f} to {high:.1f} mm when nothing is wrong"
    size = f"All residuals together differ by {where.before:.1f} mm more than simulated ({chance})"
    if not is_measurable:
        size = f"All residuals together differ by no more than chance makes them ({chance})"
    is_moved = label != "none"
    if not is_measurable and not is_moved:
        return f"Nothing stands out. {size}."
    whole = "what the cause moves" if is_moved else "the gap"
    best = _largest(_places(where.splits, _acts_on(label, lead), start))
    if best is None:
        return f"No part of the survey stands out. {size}."
    return (
        f"{percent(min(best.share, 1.0))} of {whole} lies {best.words}, where "
        f"{percent(best.rows)} of the residuals are. {size}."
    )


def _acts_on(label: str, lead: str) -> Callable[[str], bool] | None:
    """Return True if a cause acts on a covariate; None if that is not known."""
    if label == "unknown" and lead:
        return lambda by: NAMES.get(by, (by,))[0] in lead
    effects = label.split("+")
    if not set(effects) <= set(ACTS_ON):
        return None
    named = {by for effect in effects for by in ACTS_ON[effect]}
    return lambda by: by in named


def _largest(places: Iterable[_GapPlace]) -> _GapPlace | None:
    """The place whose share exceeds that of its residuals most; None where none does plainly."""
    plain = [place for place in places if place.share > SETTINGS.plain * place.rows]
    return max(plain, key=lambda place: place.share - place.rows, default=None)


def _places(splits, acts_on, start):
    """Places of the splits on which a cause acts, or of bins that exceed their null band."""
    for split in splits:
        if acts_on is not None and not acts_on(split.by):
            continue
        if acts_on is not None and split.extent is not None:
            extent = split.extent
            words = _range_words(split.by, extent.low, extent.high, start)
            yield _GapPlace(extent.share, extent.rows, words)
            continue
        for number, words in enumerate(_bin_words(split, start)):
            is_beyond = split.before[number] > split.band[number, 1]
            if acts_on is not None or is_beyond:
                rows = split.count[number] / split.count.sum()
                yield _GapPlace(float(split.share[number]), float(rows), words)


def _bin_words(split: Split, start: float) -> list[str]:
    """Each bin of a split in words."""
    if split.edges is not None:
        ends = zip(split.edges[:-1], split.edges[1:], strict=True)
        return [_range_words(split.by, low, high, start) for low, high in ends]
    if split.by == "pass":
        return [f"in pass {name}" for name in split.bins]
    if split.by == "axis":
        return [AXIS_WORDS.get(name, "along no axis") for name in split.bins]
    return [CHANNELS.get(name, name) for name in split.bins]


def _range_words(by, low, high, start):
    """A range of a covariate in the unit that a surveyor reads."""
    if by == "time":
        return WORDS[by].format(f"{start + low:.1f}", f"{start + high:.1f}")
    if by == "intensity":
        low = 10.0**low
        high = 10.0**high
    if by in ("intensity", "location"):
        return WORDS[by].format(f"{low:.0f}", f"{high:.0f}")
    return WORDS[by].format(figures(low, 2), figures(high, 2))
