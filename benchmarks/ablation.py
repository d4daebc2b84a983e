"""Which numbers of a room its benchmark feels: each setting is halved and doubled in turn.

    python benchmarks/ablation.py [room or room.field ... [tolerance]]

A number that no figure feels should go, or follow from another one. A figure is felt where it
moves by more than the tolerance (a hundredth by default) of its value, or where the benchmark
refuses the number. Each room of ``ROOMS`` names its frozen ``SETTINGS`` and a function without
arguments that returns figures by name, the same ones each time (small: it runs twice for every
field). A field's unit is the first word of the comment on its line. Values that a module copies
when it is imported aren't reached: it reads ``SETTINGS.field`` where it uses it.
"""

import argparse
import inspect
import math
import re
from contextlib import contextmanager
from dataclasses import dataclass, fields
from time import perf_counter

import matching_study
import target_study

import mlscorr.matching
import mlscorr.targets

TOLERANCE = 0.01  # of a figure: what moves less is the luck of a small benchmark
ROOMS = (  # name, SETTINGS, function that returns a dict of figures
    ("matching", mlscorr.matching.SETTINGS, matching_study.figures),
    ("targets", mlscorr.targets.SETTINGS, target_study.figures),
)


@dataclass(frozen=True)
class Ablation:
    """One setting, and the figures with it halved and doubled.

    Parameters
    ----------
    field, unit : str
    value : number or tuple of numbers
    half, double : dict of str to float, or str
        Figures; the sentence of the error where the benchmark refuses the value.
    """

    field: str
    unit: str
    value: object
    half: dict[str, float] | str
    double: dict[str, float] | str

    def changes(self, figures, tolerance=TOLERANCE):
        """Sentences of what moved at half and at double of the value: two lists.

        Parameters
        ----------
        figures : dict of str to float
            With the value as it is.
        tolerance : float
            Of a figure, below which it did not move.
        """
        return [_changes(figures, other, tolerance) for other in (self.half, self.double)]


def scaled(value, factor):
    """A number, or each one of a tuple, times a factor; whole numbers stay whole, one at least."""
    if isinstance(value, tuple):
        return tuple(scaled(part, factor) for part in value)
    if isinstance(value, int):
        if value > 0:
            return max(1, int(value * factor))
        return int(value * factor)
    return value * factor


@contextmanager
def setting(settings, field, value):
    """Give a field of a frozen instance another value for a while."""
    before = getattr(settings, field)
    object.__setattr__(settings, field, value)
    try:
        yield
    finally:
        object.__setattr__(settings, field, before)


def ablate(settings, benchmark, names=()):
    """Halve and double each numeric field of a frozen instance while a benchmark runs.

    Parameters
    ----------
    settings : dataclass instance
        As its modules import it; every field is left as it was.
    benchmark : function
        Without arguments; returns a dict of figures, the same ones each time.
    names : collection of str
        Fields to look at; all by default.

    Yields an Ablation for each field that holds a number or a tuple of numbers.
    """
    units = units_of(type(settings))
    for name in (field.name for field in fields(settings)):
        value = getattr(settings, name)
        if _is_numeric(value) and (not names or name in names):
            tries = (_figures(settings, name, scaled(value, by), benchmark) for by in (0.5, 2))
            yield Ablation(name, units.get(name, ""), value, *tries)


def units_of(cls):
    """Units by field: the first word of the comment on a field's line in the source."""
    lines = re.findall(r"^ +(\w+): [^#\n]*#\s*([^\s,;:]+)", inspect.getsource(cls), re.MULTILINE)
    return dict(lines)


def report(name, settings, benchmark, names=(), tolerance=TOLERANCE):
    """Print a room's figures and a line or more for each field: what moved at half and double.

    Parameters
    ----------
    name : str
        Of the room.
    settings, benchmark, names
        As of ``ablate``.
    tolerance : float
        Of a figure, below which it did not move.
    """
    start = perf_counter()
    figures = benchmark()
    print(f"{name}: a run of {perf_counter() - start:.0f} s gives {_numbers(figures)}\n")
    print(f"{'field':32s} {'unit':8s} {'value':>14s}  figures at half and at double")
    for ablation in ablate(settings, benchmark, names):
        changes = ablation.changes(figures, tolerance)
        pairs = zip(("half:", "double:"), changes, strict=True)
        lines = [f"{factor} {'; '.join(moved)}" for factor, moved in pairs if moved]
        value = str(ablation.value)
        for line in lines or ["no figure feels it"]:
            print(f"{ablation.field:32s} {ablation.unit:8s} {value:>14s}  {line}", flush=True)


def _is_numeric(value):
    if isinstance(value, tuple):
        return len(value) > 0 and all(map(_is_numeric, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _figures(settings, field, value, benchmark):
    with setting(settings, field, value):
        try:
            return benchmark()
        except (ValueError, IndexError, ArithmeticError) as error:
            return f"{type(error).__name__}: {error}"


def _changes(figures, other, tolerance):
    if isinstance(other, str):
        return [other]
    pairs = [(name, value, other.get(name, math.nan)) for name, value in figures.items()]
    return [
        f"{name} {value:.4g} -> {now:.4g}"
        for name, value, now in pairs
        if not math.isclose(value, now, rel_tol=tolerance, abs_tol=1e-12)
        and not (math.isnan(value) and math.isnan(now))
    ]


def _numbers(figures):
    return ", ".join(f"{name} {value:.4g}" for name, value in figures.items())


def main(words):
    """Report on the rooms or fields named, or on all; a number at the end is the tolerance."""
    if words and words[-1][0].isdigit():
        tolerance = float(words.pop())
    else:
        tolerance = TOLERANCE
    unknown = {word.split(".")[0] for word in words} - {room for room, *_ in ROOMS}
    if unknown:
        rooms = ", ".join(room for room, *_ in ROOMS)
        raise SystemExit(f"No room {', '.join(sorted(unknown))} here. Rooms: {rooms}.")
    for room, settings, benchmark in ROOMS:
        names = [word.partition(".")[2] for word in words if word.split(".")[0] == room]
        if names or not words:
            report(room, settings, benchmark, [name for name in names if name], tolerance)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("words", nargs="*", metavar="room, room.field or tolerance")
    main(parser.parse_args().words)
