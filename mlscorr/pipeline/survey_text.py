"""Text of a survey.toml: known values with reasons, unknown ones as comments."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import tomlkit

from mlscorr.io.store import MARK, OpenPlace

COLUMN = 40  # characters, after which comments start
HEAD = "# Made by mlscorr init. Lines starting with # are unknown or optional: docs/survey.md."
OPEN = f'# Replace each "{MARK}" with its value; check and correct refuse the file until then.'
TABLES = ("control.words",)  # keys whose value is a table, not a section
OPTIONAL = {
    "trajectory": ['# accuracy = "smrmsg.out"       # of an SBET, or a POQ of a POF'],
    "control": [
        '# file = "control.csv"          # surveyed targets; without them passes are only aligned'
    ],
    "mounting": [
        "# Mounting of the scanner on the POS, from drawings or calibration. calibrate and plan",
        "# need it, diagnose tests fewer effects without it, and correct works without it.",
        "# lever_arm = [0.0, 0.0, 0.0]   # m: right, forward, up; from the POS to the scanner",
        "# boresight = [0.0, 0.0, 0.0]   # deg, [a, b, c]: Rz(c) Ry(b) Rx(a), scanner to body",
    ],
    "scanner": [
        "# range_noise = 0.005           # m, 1 sigma, from the data sheet",
        "# angle_noise = 0.002           # deg, 1 sigma, from the data sheet",
        "# lines_per_second = 100        # of the mirror",
    ],
    "pos": [
        "# Assumed if the trajectory has no sigmas: 1 sigma, from the data sheet.",
        "# position_sigma = 0.02         # m",
        "# attitude_sigma = [0.0063, 0.0063, 0.014]  # deg: roll, pitch, heading",
        "# correlation_time = 30.0       # s",
    ],
    "matching": [
        "# search_radius = 10.0          # m, largest distance of a target from its point"
    ],
    "scene": ['# reference = "reference.ply"   # a surface in the same coordinates, for diagnose'],
}


@dataclass(frozen=True)
class _Line:
    """Key with its value, the reason, and the open values in it."""

    key: str
    value: Any
    reason: str
    places: tuple[OpenPlace, ...] = ()

    def text(self, is_marked):
        """Line as in survey.toml, with open values marked or as examples."""
        value = self.value
        reason = self.reason
        if is_marked and self.places:
            reason = "; ".join(dict.fromkeys(map(str, self.places)))
            value = MARK
            if isinstance(self.value, Mapping):
                marks = {place.keys[-1]: MARK for place in self.places}
                value = dict(self.value) | marks
        item = tomlkit.item(value)
        if isinstance(value, Mapping):
            item = tomlkit.inline_table()
            item.update(value)
        line = f"{self.key} = {item.as_string()}"
        return f"{line:<{COLUMN - 1}} # {_shown(reason)}"


class SurveyText:
    """Lines of a survey.toml by section, in the order of docs/survey.md.

    Parameters
    ----------
    given : mapping
        User's values, with priority over all others, and always written.
    places : sequence of OpenPlace
        Open values of given, which contains an example of each.
    """

    def __init__(self, given: Mapping[str, Any], places: Sequence[OpenPlace] = ()):
        self.given = _flat(given)
        self.places = tuple(places)
        names = ("", "cloud", *OPTIONAL)
        self.lines: dict[str, list[str | _Line]] = {name: [] for name in names}
        self.keys: dict[str, set[str]] = {name: set() for name in names}
        self.entries: dict[str, int] = {}

    def listed(self, section: str, number: int) -> str:
        """Name for put of an entry in a list of sections; given values apply to each.

        Parameters
        ----------
        section : str
        number : int
            From 0.
        """
        self.entries[section] = number + 1
        name = f"{section} {number}"
        self.lines[name], self.keys[name] = [], set()
        for dotted in [key for key in self.given if key.startswith(f"{section}.")]:
            self.given[f"{name}{dotted.removeprefix(section)}"] = self.given[dotted]
        return name

    def put(self, section: str, key: str, value: object, reason: str) -> None:
        """Write a key with its value and the reason, unless the user gave it.

        Parameters
        ----------
        section : str
            Empty for the top level.
        key : str
        value : object
            Any TOML value.
        reason : str
        """
        dotted = f"{section}.{key}" if section else key
        if dotted in self.given:
            value = self.given.pop(dotted)
            reason = "as given"
        self.keys.setdefault(section, set()).add(key)
        if section:
            keys = (*section.split(" ")[:1], *key.split("."))
        else:
            keys = tuple(key.split("."))
        places = tuple(place for place in self.places if place.keys[: len(keys)] == keys)
        self.lines.setdefault(section, []).append(_Line(key, value, reason, places))

    def note(self, section: str, sentence: str) -> None:
        """Write a comment.

        Parameters
        ----------
        section, sentence : str
        """
        self.lines[section].append(f"# {_shown(sentence)}")

    def __str__(self) -> str:
        return self.render(is_marked=True)

    def render(self, is_marked: bool) -> str:
        """Return the whole text.

        Parameters
        ----------
        is_marked : bool
            True to mark open values; otherwise they contain their examples, so that the text is
            readable.
        """
        for section in self.entries:  # applies to each entry
            self.given = {k: v for k, v in self.given.items() if not k.startswith(f"{section}.")}
        for dotted in list(self.given):
            section, _, key = dotted.partition(".") if "." in dotted else ("", "", dotted)
            self.put(section, key, self.given[dotted], "")
        texts = {
            section: [line if isinstance(line, str) else line.text(is_marked) for line in lines]
            for section, lines in self.lines.items()
        }
        parts = [HEAD, *[OPEN] * bool(is_marked and self.places), *texts.pop("")]
        for section, lines in texts.items():
            keys = self.keys.get(section, set())
            count = self.entries.get(section, 0)
            for number in range(count):
                parts += ["", f"[[{section}]]", *texts[f"{section} {number}"]]
            if count or section.partition(" ")[0] in self.entries:
                continue
            unknown = [
                line for line in OPTIONAL.get(section, ()) if line[2:].split(" =")[0] not in keys
            ]
            parts += ["", f"[{section}]" if keys else f"# [{section}]", *lines, *unknown]
        return "\n".join(parts) + "\n"


def _flat(given, prefix=""):
    """Dotted keys of nested tables."""
    flat = {}
    for key, value in given.items():
        dotted = f"{prefix}{key}"
        is_section = isinstance(value, Mapping) and dotted not in TABLES
        flat |= _flat(value, f"{dotted}.") if is_section else {dotted: value}
    return flat


def _shown(sentence):
    """Sentence as a comment of one line."""
    return "".join(c if c.isprintable() else " " for c in sentence)
