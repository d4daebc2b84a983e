"""Halve and double each setting of a room in turn, and print the figures that react.

    python benchmarks/ablation.py [room or room.field ...] [--seeds 1 2] [--tolerance 0.01]

A number that affects no figure should be removed, or be derived from another one. A number counts
as effective if a figure changes by more than the tolerance (a hundredth by default) of its value,
or if the benchmark rejects the number; those that guard against bad input or limit resources are
covered by tests instead. Each room of ``ROOMS`` names its frozen ``SETTINGS`` and a function of
seeds that returns figures by name (room_figures.py), the same ones each time: it runs twice for
every field. A field's unit is the first word of the comment on its line. Values that a module
copies when it is imported (defaults of arguments, settings of a higher room) aren't reached.
"""

import argparse
import inspect
import math
import re
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import partial
from importlib import import_module
from time import perf_counter

import room_figures

TOLERANCE = 0.01  # of a figure: smaller changes are chance in a small benchmark
SEEDS = (1,)
SHOWN = 3  # figures of a number, those that move most
ROOMS = {  # name: module of the settings, function of seeds that returns a dict of figures
    "baselines": ("baselines._settings", room_figures.baselines),
    "effects": ("effects._settings", room_figures.effects),
    "estimate": ("estimate.settings", room_figures.estimate),
    "evaluate": ("evaluate._settings", room_figures.evaluate),
    "gap/closure": ("gap.closure._settings", room_figures.diagnosed),
    "gap/contrast": ("gap.contrast._settings", room_figures.diagnosed),
    "gap/evidence": ("gap.evidence.settings", room_figures.evidence),
    "gap/plan": ("gap.plan._settings", room_figures.plan),
    "gap/residuals": ("gap.residuals.settings", room_figures.diagnosed),
    "gap/signatures": ("gap.signatures.settings", room_figures.diagnosed),
    "io": ("io.settings", room_figures.io),
    "matching": ("matching.settings", room_figures.matching),
    "pipeline": ("pipeline.settings", room_figures.correction),
    "pipeline/project": ("pipeline.project.settings", room_figures.project),
    "pos": ("pos.settings", room_figures.pos),
    "report": ("report.settings", room_figures.report),
    "report/gap": ("report.gap._settings", room_figures.diagnosis_page),
    "simulate": ("simulate.settings", room_figures.simulated),
    "surfaces": ("surfaces.settings", room_figures.ties),
    "targets": ("targets.settings", room_figures.targets),
    "ties": ("ties.settings", room_figures.ties),
}


@dataclass(frozen=True)
class Ablation:
    """One setting, and the figures with it halved and doubled.

    Parameters
    ----------
    field, unit : str
    value : number or tuple of numbers
    half, double : dict of str to float, or str
        Figures, or the error message if the benchmark rejects the value.
    """

    field: str
    unit: str
    value: object
    half: dict[str, float] | str
    double: dict[str, float] | str

    def changes(self, figures, tolerance=TOLERANCE):
        """Relative changes of the affected figures at half and double the value: two lists of text.

        Parameters
        ----------
        figures : dict of str to float
            With the original value.
        tolerance : float
            Of a figure; smaller changes are ignored.
        """
        return [_changes(figures, other, tolerance) for other in (self.half, self.double)]


def scaled(value, factor):
    """Multiply a number, or each one of a tuple; whole numbers stay whole and at least one."""
    if isinstance(value, tuple):
        return tuple(scaled(part, factor) for part in value)
    if isinstance(value, int):
        if value > 0:
            return max(1, int(value * factor))
        return int(value * factor)
    return value * factor


@contextmanager
def setting(settings, field, value):
    """Temporarily give a field of a frozen instance another value."""
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
        As its modules import it; every field is restored.
    benchmark : function
        Without arguments; returns a dict of figures, the same ones each time.
    names : collection of str
        Fields to examine; all by default.

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
    """Print a room's figures, and one or more lines on each field: the changes at half and double.

    Parameters
    ----------
    name : str
        Of the room.
    settings, benchmark, names
        As of ``ablate``.
    tolerance : float
        Of a figure; smaller changes are ignored.
    """
    benchmark()  # compiled loops are loaded, simulated surveys written
    start = perf_counter()
    figures = benchmark()
    print(f"{name}: a run of {perf_counter() - start:.1f} s gives {_numbers(figures)}\n")
    print(f"{'field':32s} {'unit':8s} {'value':>14s}  figures at half and at double")
    for ablation in ablate(settings, benchmark, names):
        changes = ablation.changes(figures, tolerance)
        pairs = zip(("half:", "double:"), changes, strict=True)
        lines = [f"{factor} {'; '.join(moved)}" for factor, moved in pairs if moved]
        value = str(ablation.value)
        for line in lines or ["not felt"]:
            print(f"{ablation.field:32s} {ablation.unit:8s} {value:>14s}  {line}", flush=True)


def _is_numeric(value):
    if isinstance(value, tuple):
        return len(value) > 0 and all(map(_is_numeric, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _figures(settings, field, value, benchmark):
    with setting(settings, field, value):
        try:
            with warnings.catch_warnings(action="ignore"):
                return benchmark()
        except (ValueError, IndexError, ArithmeticError) as error:
            return f"{type(error).__name__}: {error}"


def _changes(figures, other, tolerance):
    """Describe the figures that changed, largest changes first."""
    if isinstance(other, str):
        return [other]
    moved = []
    for name, value in figures.items():
        now = other.get(name, math.nan)
        is_same = math.isclose(value, now, rel_tol=tolerance, abs_tol=1e-12)
        if is_same or (math.isnan(value) and math.isnan(now)):
            continue
        change = (now - value) / abs(value) if value else math.copysign(math.inf, now - value)
        moved.append((name, change))
    moved.sort(key=lambda figure: -abs(figure[1]) if math.isfinite(figure[1]) else -math.inf)
    words = [f"{name} {change:+.1%}" for name, change in moved[:SHOWN]]
    if len(moved) > SHOWN:
        words.append(f"{len(moved) - SHOWN} more")
    return words


def _numbers(figures):
    return ", ".join(f"{name} {value:.4g}" for name, value in figures.items())


def settings_of(room):
    """The frozen SETTINGS of a room of ROOMS, as its modules import them."""
    return import_module(f"mlscorr.{ROOMS[room][0]}").SETTINGS


def main():
    """Report on the rooms or fields named, or on all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="room or room.field")
    parser.add_argument("--seeds", nargs="+", type=int, default=SEEDS)
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of a figure")
    given = parser.parse_args()
    unknown = {name.split(".")[0] for name in given.names} - set(ROOMS)
    if unknown:
        parser.error(f"No room {', '.join(sorted(unknown))} here. Rooms: {', '.join(ROOMS)}.")
    for room, (_, figures) in ROOMS.items():
        names = [name.partition(".")[2] for name in given.names if name.split(".")[0] == room]
        if names or not given.names:
            benchmark = partial(figures, tuple(given.seeds))
            chosen = [name for name in names if name]
            report(room, settings_of(room), benchmark, chosen, given.tolerance)


if __name__ == "__main__":
    main()
