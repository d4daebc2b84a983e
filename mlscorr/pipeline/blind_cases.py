"""One survey of a blind check: simulated, sized by its own geometry, stripped of its truth."""

import importlib.util
import json
import tempfile
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np

from mlscorr.effects import EFFECTS
from mlscorr.gap.mix import RANDOM, SYSTEMATIC
from mlscorr.gap.pairing import build_rows
from mlscorr.gap.signatures import signatures
from mlscorr.gap.sizing import Scale, likeness, shift_by, sized
from mlscorr.io.survey_file import read_survey
from mlscorr.pipeline.finding import find_targets

KINDS = {kind.name: kind for kind in EFFECTS}
TRIES = 6  # surveys, where one shows none of what it should have, or can't be made
REDRAWN = 12  # effects tried in one survey
ALIKE = 0.8  # squared correlation with an effect above which a mechanism is that effect
ONE_CAUSE = 0.9  # between two effects above which they are no pair
TRUTH = ("truth.json", "truth.npz")


def make_case(folder, case, entropy, mechanisms=None):
    """Write the survey of a Case into a folder, without its truth; returns its label, a dict.

    Parameters
    ----------
    folder : Path
        Made here; its name is the survey's.
    case : Case
    entropy : tuple of int
        The same gives the same bytes and label.
    mechanisms : Path, optional
        File with MECHANISMS, LEADS and UNITS.

    Raises ValueError when no survey can be made that shows what the case should have.
    """
    for number in range(TRIES):
        try:
            label, survey = _drawn(folder.name, case, (*entropy, number), mechanisms)
            if label is not None:
                survey.write(folder)
                break
        except ValueError:
            if number == TRIES - 1:
                raise
    else:
        raise ValueError(
            f"None of {TRIES} surveys shows a {case.kind} case of {case.mdb:.1f} times the minimal "
            f"detectable bias ({', '.join(case.names)} first): choose another seed."
        )
    for name in TRUTH:
        (folder / name).unlink()
    (folder / "library.json").write_text(json.dumps({"without": [label["without"]]}) + "\n")
    return label


def _drawn(name, case, entropy, mechanisms):
    """Label and SimulatedSurvey of one try; the label is None when nothing shows."""
    from mlscorr.simulate.moved import MovedSurvey
    from mlscorr.simulate.varied import varied_survey

    survey, rng = varied_survey((*entropy, 0), name), np.random.default_rng((*entropy, 1))
    label = {
        "kind": case.kind, "names": [], "mdb": [], "without": case.without, "effects": [],
        "parameters": {}, "normal": {}, "likeness": {}, "mechanism": None,
    }  # fmt: skip
    if case.kind == "clean":
        return label, survey
    scale = _scale(survey)
    known = signatures(scale.rows, scale.survey)[0]
    if case.kind == "outside":
        told, move = _mechanism(scale, known, case, mechanisms, rng)
        return (None, None) if told is None else (label | told, MovedSurvey.of(survey, move))
    found = _effects(scale, known, case, rng)
    if found is None:
        return None, None
    label |= _told(found)
    if case.kind == "withheld":
        label["without"] = label["names"][0]
    elif label["without"] in label["names"]:
        others = [other for other in SYSTEMATIC if other not in label["names"]]
        label["without"] = str(rng.choice(others))
    return label, varied_survey((*entropy, 0), name, label["effects"])


def _scale(survey):
    """Scale of a survey without effects, as a diagnosis would read it."""
    with tempfile.TemporaryDirectory() as place:
        survey.write(Path(place) / "survey")
        read = read_survey(Path(place) / "survey")
        found = find_targets(read)
        return Scale.of(build_rows(read, found.matches.matched, found.candidates).rows, read)


def _effects(scale, known, case, rng):
    """Pairs of Sized and its likeness; None when the geometry shows too few."""
    pool = RANDOM if case.kind == "noise" else SYSTEMATIC
    names, found = list(case.names), []
    for _ in range(REDRAWN):
        name = names.pop(0) if names else str(rng.choice(pool))
        if name in (one.effect.name for one, _ in found):
            continue
        one = sized(scale, KINDS[name], case.mdb, rng)
        if one is None:
            continue
        like = likeness(scale, one.shift, known)
        if all(like.get(other.effect.name, 0.0) < ONE_CAUSE for other, _ in found):
            found.append((one, like))
        if len(found) == len(case.names):
            return found
    return None


def _told(found):
    """The part of a label that tells of effects."""
    return {
        "names": [one.effect.name for one, _ in found],
        "mdb": [one.mdb for one, _ in found],
        "effects": [{"name": one.effect.name, **asdict(one.effect)} for one, _ in found],
        "parameters": {one.effect.name: one.parameters for one, _ in found},
        "normal": {one.effect.name: one.normal.tolist() for one, _ in found},
        "likeness": {one.effect.name: like for one, like in found},
    }


def load_mechanisms(path):
    """Module with MECHANISMS (functions), LEADS (words) and UNITS (unit, largest) by name.

    Raises ValueError when one of them is missing; FileNotFoundError when the file is.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist; it should hold MECHANISMS.")
    spec = importlib.util.spec_from_file_location("mechanisms", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in ("MECHANISMS", "LEADS", "UNITS"):
        if set(getattr(module, name, {})) != set(getattr(module, "MECHANISMS", {"": None})):
            raise ValueError(
                f"{path} has no {name} with the names of its MECHANISMS: a file of mechanisms "
                "needs MECHANISMS (functions), LEADS (words) and UNITS (unit and largest size)."
            )
    return module


def _mechanism(scale, known, case, path, rng):
    """The part of a label that tells of a mechanism, and how it moves points; None, None when
    the geometry shows none that is unlike all effects."""
    module, names = load_mechanisms(path), list(case.names)
    for _ in range(REDRAWN):
        name = names.pop(0) if names else str(rng.choice(list(module.MECHANISMS)))
        function, (unit, largest) = module.MECHANISMS[name], module.UNITS[name]
        chance, sign = int(rng.integers(2**32)), float(rng.choice([-1, 1]))

        def move(seen, size=1.0, function=function, chance=chance):
            return function(seen, size, np.random.default_rng(chance))

        shift = shift_by(scale, move)
        unit_mdb = scale.size(shift)
        if unit_mdb == 0.0 or case.mdb / unit_mdb > largest:
            continue
        like = likeness(scale, shift, known)
        if max(like.values()) > ALIKE:
            continue
        size = sign * case.mdb / unit_mdb
        told = {
            "mdb": [case.mdb],
            "likeness": {name: like},
            "mechanism": {
                "name": name, "size": size, "unit": unit, "lead": list(module.LEADS[name]),
            },
        }  # fmt: skip
        return told, partial(move, size=size)
    return None, None
