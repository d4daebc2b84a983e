"""Each effect in plain words: what it is, and how one says how large it is."""

from dataclasses import dataclass

from mlscorr.effects import EFFECTS

EAST = (("to the east", "to the west"), ("to the north", "to the south"), ("upward", "downward"))
MAP = ("easting", "northing", "height")
BODY = ("right", "forward", "up")
NOISE = frozenset(kind.name for kind in EFFECTS if kind.random) | {"beam_divergence"}


@dataclass(frozen=True)
class Words:
    """An effect in words.

    Parameters
    ----------
    title : str
        For tables.
    meaning : str
        What it is, in one sentence.
    said : str
        The sentence of a verdict: {size} stands for the number, {side} for its direction, {where}
        for the place or the time.
    sides : tuple
        Of a number: words for above and below zero. Of a vector: such a pair for each part.
    parts : tuple of str
        Names of the parts of a vector.
    unit : str
        Where the effect's own unit would be misread.
    """

    title: str
    meaning: str
    said: str
    sides: tuple = ("", "")
    parts: tuple[str, ...] = ()
    unit: str = ""


WORDS = {
    "time_offset": Words(
        "Scanner clock offset",
        "The clocks of scanner and POS differ by a constant.",
        "The clock of the scanner is {size} {side} the clock of the POS.",
        ("ahead of", "behind"),
    ),
    "clock_drift": Words(
        "Scanner clock drift",
        "The clock of the scanner runs faster or slower than the clock of the POS.",
        "The clock of the scanner runs {side} by {size}.",
        ("fast", "slow"),
    ),
    "time_jitter": Words(
        "Noisy time stamps",
        "Each laser pulse's time stamp has an error of its own.",
        "The scanner's time stamps scatter by {size}, which the simulator does not know.",
    ),
    "boresight": Words(
        "Boresight",
        "The scanner is turned otherwise than the recorded mounting says.",
        "The recorded boresight is wrong: the scanner is really turned {size}.",
        (
            ("nose up", "nose down"),
            ("right side down", "left side down"),
            ("to the left", "to the right"),
        ),
        BODY,
    ),
    "lever_arm": Words(
        "Lever arm",
        "The scanner sits elsewhere on the vehicle than the recorded mounting says.",
        "The recorded lever arm is wrong: the scanner really sits {size}.",
        (
            ("farther right", "farther left"),
            ("farther forward", "farther back"),
            ("higher", "lower"),
        ),
        BODY,
    ),
    "range_bias": Words(
        "Range bias",
        "All distances that the scanner measures are wrong by a constant.",
        "Every distance of the scanner is {size} too {side}.",
        ("long", "short"),
    ),
    "range_scale": Words(
        "Range scale",
        "Distances are wrong in proportion to their length.",
        "The scanner's distances are too {side} by {size} of their length.",
        ("long", "short"),
    ),
    "range_walk": Words(
        "Range walk",
        "Distances depend on how bright the return is.",
        "Bright surfaces are measured {side} than dark ones: {size} for ten times the intensity.",
        ("farther", "nearer"),
        unit="m",
    ),
    "incidence_bias": Words(
        "Incidence bias",
        "Distances depend on the angle at which the beam meets the surface.",
        "Where the beam meets a surface at a slant, distances are too {side}: by {size} at 60°.",
        ("long", "short"),
    ),
    "range_noise": Words(
        "Noisy ranges",
        "Distances are noisier than stated.",
        "The scanner's distances are noisier than stated: {size} of scatter come on top.",
    ),
    "angle_scale": Words(
        "Encoder scale",
        "Scan angles are wrong in proportion to the angle from the zero beam.",
        "The scanner's encoder gives scan angles too {side} by {size}.",
        ("large", "small"),
    ),
    "angle_eccentricity": Words(
        "Encoder off its axis",
        "Scan angles are wrong by a wave that comes once a turn.",
        "The scanner's encoder sits off its axis: scan angles are wrong by up to {size}, once a "
        "turn.",
        parts=("magnitude cos(phase)", "magnitude sin(phase)"),
    ),
    "angle_noise": Words(
        "Noisy scan angles",
        "Scan angles are noisier than stated.",
        "The scan angles are noisier than stated: {size} of scatter come on top.",
    ),
    "heading_drift": Words(
        "Heading drift",
        "The heading of the POS drifts away in the course of each pass.",
        "The heading of the POS drifts {side} by {size} from start to end of each pass.",
        ("to the right", "to the left"),
    ),
    "position_step": Words(
        "GNSS jump",
        "The recorded position jumps at one moment and stays off to the end of the pass.",
        "The recorded position jumps {size}{where}, and stays off to the end of the pass.",
        EAST,
        MAP,
    ),
    "position_bump": Words(
        "Passing GNSS error",
        "The recorded position is off for a while, as by multipath or a short outage.",
        "The recorded position goes astray for a while{where}: {size} at the worst.",
        EAST,
        MAP,
    ),
    "position_noise": Words(
        "Noisy positions",
        "The recorded position is noisier, or drifts more, than its stated sigmas say.",
        "The positions of the POS are worse than their sigmas say: {size}.",
    ),
    "vertical_datum": Words(
        "Vertical datum",
        "Heights of the surveyed targets and of the cloud are in different systems.",
        "The surveyed heights of the targets lie {size} {side} those of the cloud: two height "
        "systems.",
        ("above", "below"),
    ),
    "horizontal_datum": Words(
        "Horizontal datum",
        "Surveyed targets and cloud are in different frames, moved against each other.",
        "The surveyed targets and the cloud are in different frames: the targets lie too far "
        "{size}.",
        EAST[:2],
        MAP[:2],
    ),
    "map_rotation": Words(
        "Turned frame",
        "The frame of the surveyed targets is turned against that of the cloud.",
        "The frame of the surveyed targets is turned {side} by {size} against that of the cloud.",
        ("counter-clockwise", "clockwise"),
    ),
    "map_scale": Words(
        "Scale of the map",
        "The surveyed targets have another map scale than the cloud.",
        "The map of the surveyed targets is too {side} by {size}, compared with the cloud.",
        ("large", "small"),
    ),
    "target_outlier": Words(
        "One wrong target",
        "The surveyed coordinates of one target are wrong.",
        "The surveyed coordinates of {where} are wrong: too far {size}.",
        EAST,
        MAP,
    ),
    "beam_divergence": Words(
        "Wide beam",
        "The laser's footprint is wider than stated.",
        "The laser beam is {size} wider than stated.",
    ),
    "dropout": Words(
        "Lost returns",
        "Pulses that should return are lost.",
        "{size} of the pulses that should come back are lost.",
    ),
}
OTHERS = {
    "none": ("Nothing", "The simulator describes this survey as it is."),
    "unknown": ("Something unknown", "An error that none of the known effects explains."),
}


def title(label):
    """A label in words: of an effect, of several joined by +, of none or unknown.

    >>> title("time_offset+range_noise"), title("none")
    ('Scanner clock offset and noisy ranges', 'Nothing')
    """
    return titles(label.split("+"))


def titles(names, last="and"):
    """Several effects in words, in one row.

    >>> titles(["range_bias", "range_walk", "position_step"])
    'Range bias, range walk and GNSS jump'
    """
    first, *rest = [_title(name) for name in names] or [""]
    return joined([first, *map(lowered, rest)], last)


def lowered(text):
    """A title or sentence as it goes on within a sentence.

    >>> lowered("Scanner clock offset"), lowered("GNSS jump")
    ('scanner clock offset', 'GNSS jump')
    """
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]


def _title(name):
    if name in OTHERS:
        return OTHERS[name][0]
    return WORDS[name].title if name in WORDS else name.replace("_", " ").capitalize()


def meaning(label):
    """What a label is, in a sentence for each of its parts."""
    told = {name: words.meaning for name, words in WORDS.items()}
    told |= {name: words[1] for name, words in OTHERS.items()}
    return " ".join(told[name] for name in label.split("+") if name in told)


def kind(label):
    """Where a label belongs: none, unknown, noise or effect.

    >>> kind("range_noise"), kind("range_noise+time_offset")
    ('noise', 'effect')
    """
    if label in OTHERS:
        return label
    return "noise" if all(name in NOISE for name in label.split("+")) else "effect"


def joined(words, last="and"):
    """Words in a row.

    >>> joined(["a", "b", "c"]), joined(["a", "b"], "or"), joined([])
    ('a, b and c', 'a or b', '')
    """
    *first, final = list(words) or [""]
    return f"{', '.join(first)} {last} {final}" if first else final
