"""One survey of a blind check: simulated, sized by its own geometry, stripped of its truth."""

import json
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from mlscorr.blind.grading import grading_mechanisms
from mlscorr.blind.mix import Case
from mlscorr.effects.catalogue import RANDOM, SYSTEMATIC, effect_class
from mlscorr.gap.infer.settings import SETTINGS as INFERENCE
from mlscorr.gap.observe.pairing import build_rows
from mlscorr.gap.observe.patch_search import find_patches
from mlscorr.gap.signatures.signatures import signatures
from mlscorr.gap.train.cases import ATTEMPTS, LIKENESS
from mlscorr.gap.train.sizing import Ruler, draw_effect, likeness, shift_by
from mlscorr.io.survey_file import read_survey
from mlscorr.simulate.mechanisms import load_mechanisms

TRUTH = ("truth.json", "truth.npz")


def make_case(
    folder: Path,
    case: Case,
    entropy: tuple[int, ...],
    find_targets: Callable,
    mechanisms: Path | None = None,
) -> dict:
    """Write the survey of a Case into a folder, without its truth; returns its label.

    Parameters
    ----------
    folder : Path
        Made here; its name is the survey's.
    case : Case
    entropy : tuple of int
        The same gives the same bytes and label.
    find_targets : function
        From a Survey to its Finding, as the diagnosis has it.
    mechanisms : Path, optional
        File with MECHANISMS, LEADS and UNITS; those that grade by default.

    Raises
    ------
    ValueError
        When no survey can be made that shows what the case should have.
    """
    for number in range(ATTEMPTS):
        try:
            label, survey = _drawn(folder.name, case, (*entropy, number), find_targets, mechanisms)
            if label is not None:
                survey.write(folder)
                break
        except ValueError:
            if number == ATTEMPTS - 1:
                raise
    else:
        raise ValueError(
            f"None of {ATTEMPTS} surveys shows a {case.kind} case of {case.mdb:.1f} times "
            f"the minimal detectable bias ({', '.join(case.names)} first): choose another seed."
        )
    for name in TRUTH:
        (folder / name).unlink()
    (folder / "library.json").write_text(json.dumps({"without": [label["without"]]}) + "\n")
    return label


def _drawn(name, case, entropy, find_targets, mechanisms):
    """Label and SimulatedSurvey of one try; the label is None when nothing shows."""
    from mlscorr.simulate.displacement import DisplacedSurvey
    from mlscorr.simulate.random_survey import random_survey

    survey, rng = random_survey((*entropy, 0), name), np.random.default_rng((*entropy, 1))
    label = {
        "kind": case.kind, "names": [], "mdb": [], "without": case.without, "effects": [],
        "parameters": {}, "normal": {}, "likeness": {}, "mechanism": None,
    }  # fmt: skip
    if case.kind == "clean":
        return label, survey
    ruler = _ruler(survey, find_targets)
    known = signatures(ruler.rows, ruler.survey)[0]
    if case.kind == "outside":
        part, move = _mechanism(ruler, known, case, mechanisms, rng)
        return (None, None) if part is None else (label | part, DisplacedSurvey.of(survey, move))
    drawn = _effects(ruler, known, case, rng)
    if drawn is None:
        return None, None
    label |= _of_effects(drawn)
    if case.kind == "withheld":
        label["without"] = label["names"][0]
    elif label["without"] in label["names"]:
        others = [other for other in SYSTEMATIC if other not in label["names"]]
        label["without"] = str(rng.choice(others))
    return label, random_survey((*entropy, 0), name, label["effects"])


def _ruler(survey, find_targets):
    """Ruler of a survey without effects, as a diagnosis would read it."""
    with tempfile.TemporaryDirectory() as place:
        survey.write(Path(place) / "survey")
        read = read_survey(Path(place) / "survey")
        finding = find_targets(read)
        matched, patches = finding.matches.matched, find_patches(read)
        return Ruler.of(build_rows(read, matched, finding.candidates, patches).rows, read)


def _effects(ruler, known, case, rng):
    """Pairs of SizedEffect and its likeness; None when the geometry shows too few."""
    pool = RANDOM if case.kind == "noise" else SYSTEMATIC
    names, drawn = list(case.names), []
    for _ in range(ATTEMPTS):
        name = names.pop(0) if names else str(rng.choice(pool))
        if name in (sized.effect.name for sized, _ in drawn):
            continue
        sized = draw_effect(ruler, effect_class(name), case.mdb, rng)
        if sized is None:
            continue
        like = likeness(ruler, sized.shift, known)
        if all(like.get(other.effect.name, 0.0) < INFERENCE.same for other, _ in drawn):
            drawn.append((sized, like))
        if len(drawn) == len(case.names):
            return drawn
    return None


def _of_effects(drawn):
    """The part of a label that tells of effects."""
    effects = [(sized, like, sized.effect.name) for sized, like in drawn]
    return {
        "names": [name for *_, name in effects],
        "mdb": [sized.mdb for sized, *_ in effects],
        "effects": [sized.effect.document() for sized, *_ in effects],
        "parameters": {name: sized.parameters for sized, _, name in effects},
        "normal": {name: sized.normal.tolist() for sized, _, name in effects},
        "likeness": {name: like for _, like, name in effects},
    }


def outside_mechanisms(path: Path | None = None) -> dict[str, tuple[Callable, tuple, tuple]]:
    """Functions, units and leads of mechanisms by name: those that grade, or those of a file.

    Parameters
    ----------
    path : Path, optional
        File with MECHANISMS, UNITS and LEADS.

    Raises
    ------
    ValueError
        When one of them is missing.
    FileNotFoundError
        When the file is.
    """
    if path is None:
        return {each.name: (each, each.unit, each.lead) for each in grading_mechanisms()}
    module = load_mechanisms(path)
    return {
        name: (function, module.UNITS[name], module.LEADS[name])
        for name, function in module.MECHANISMS.items()
    }


def _mechanism(ruler, known, case, path, rng):
    """The part of a label that tells of a mechanism, and how it moves points; None, None when
    the geometry shows none that is unlike all effects.
    """
    outside, names = outside_mechanisms(path), list(case.names)
    for _ in range(ATTEMPTS):
        name = names.pop(0) if names else str(rng.choice(list(outside)))
        function, (unit, largest), lead = outside[name]
        chance, sign = int(rng.integers(2**32)), float(rng.choice([-1, 1]))

        def move(points, size=1.0, function=function, chance=chance):
            return function(points, size, np.random.default_rng(chance))

        shift = shift_by(ruler, move)
        unit_mdb = ruler.size(shift)
        if unit_mdb == 0.0 or case.mdb / unit_mdb > largest:
            continue
        like = likeness(ruler, shift, known)
        if max(like.values()) > LIKENESS:
            continue
        size = sign * case.mdb / unit_mdb
        part = {
            "mdb": [case.mdb],
            "likeness": {name: like},
            "mechanism": {
                "name": name, "size": size, "unit": unit, "lead": list(lead),
            },
        }  # fmt: skip
        return part, partial(move, size=size)
    return None, None
