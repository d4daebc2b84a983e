"""One survey of a blind check: simulated, sized by its own geometry, stripped of its truth."""

import json
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mlscorr.blind._grading import grading_mechanisms
from mlscorr.blind._mix import Case, causes
from mlscorr.gap.plan import ATTEMPTS, Ruler, draw_effects, draw_mechanism, names_to_try
from mlscorr.gap.residuals import build_rows, find_patches
from mlscorr.gap.signatures import signatures
from mlscorr.io.surveys import read_survey
from mlscorr.simulate import Described, described, load_mechanisms

TRUTH = ("truth.json", "truth.npz")


def make_case(
    folder: Path,
    case: Case,
    entropy: tuple[int, ...],
    find_targets: Callable,
    mechanisms: Path | None = None,
) -> dict:
    """Write the survey of a Case into a folder, without its truth; return its label.

    Parameters
    ----------
    folder : Path
        New folder with the name of the survey.
    case : Case
    entropy : tuple of int
        The same entropy gives the same bytes and label.
    find_targets : function
        From a Survey to its Finding, as in the diagnosis.
    mechanisms : Path, optional
        File with MECHANISMS, LEADS and UNITS; by default those for grading.

    Raises
    ------
    ValueError
        If no survey can be made that shows the case.
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
            f"None of {ATTEMPTS} surveys contains a {case.kind} case of {case.mdb:.1f} times the "
            f"minimal detectable bias ({', '.join(case.names)} first). Choose another seed."
        )
    for name in TRUTH:
        (folder / name).unlink()
    (folder / "library.json").write_text(json.dumps({"without": [label["without"]]}) + "\n")
    return label


def _drawn(name, case, entropy, find_targets, mechanisms):
    """Label and SimulatedSurvey of one attempt; the label is None if nothing is visible."""
    from mlscorr.simulate import DisplacedSurvey, random_survey

    survey = random_survey((*entropy, 0), name)
    rng = np.random.default_rng((*entropy, 1))
    pos = survey.scenario.pos
    label = {
        "sky": "bad" if pos.outages or pos.canyons else "open",
        "kind": case.kind,
        "names": [],
        "mdb": [],
        "without": case.without,
        "effects": [],
        "parameters": {},
        "normal": {},
        "likeness": {},
        "mechanism": None,
    }
    if case.kind == "clean":
        return label, survey
    ruler = _ruler(survey, find_targets)
    known = signatures(ruler.rows, ruler.survey)[0]
    if case.kind == "outside":
        outside = outside_mechanisms(mechanisms)
        names = names_to_try(list(outside), rng, case.names)
        moved = draw_mechanism(ruler, known, names, outside, case.mdb, rng)
        if moved is None:
            return None, None
        mechanism, _, like = moved
        _, (unit, _), hint = outside[mechanism.name]
        label |= {
            "mdb": [case.mdb],
            "likeness": {mechanism.name: like},
            "mechanism": {
                "name": mechanism.name,
                "size": mechanism.size,
                "unit": unit,
                "lead": list(hint),
            },
        }
        return label, DisplacedSurvey.of(survey, mechanism)
    names = names_to_try(causes(case.kind == "noise"), rng, case.names)
    drawn = draw_effects(ruler, known, names, len(case.names), case.mdb, rng)
    if drawn is None:
        return None, None
    label |= _of_effects(drawn)
    if case.kind == "withheld":
        label["without"] = label["names"][0]
    elif label["without"] in label["names"]:
        others = [other for other in causes() if other not in label["names"]]
        label["without"] = str(rng.choice(others))
    return label, random_survey((*entropy, 0), name, label["effects"])


def _ruler(survey, find_targets):
    """Ruler of a survey without effects, as read by a diagnosis."""
    with tempfile.TemporaryDirectory() as place:
        survey.write(Path(place) / "survey")
        read = read_survey(Path(place) / "survey")
        finding = find_targets(read)
        matched = finding.matches.matched
        patches = find_patches(read)
        return Ruler.of(build_rows(read, matched, finding.candidates, patches).rows, read)


def _of_effects(drawn):
    """Part of a label on effects."""
    effects = [(sized, like, sized.effect.name) for sized, like in drawn]
    return {
        "names": [name for *_, name in effects],
        "mdb": [sized.mdb for sized, *_ in effects],
        "effects": [sized.effect.document() for sized, *_ in effects],
        "parameters": {name: sized.parameters for sized, _, name in effects},
        "normal": {name: sized.normal.tolist() for sized, _, name in effects},
        "likeness": {name: like for _, like, name in effects},
    }


def outside_mechanisms(path: Path | None = None) -> Described:
    """Functions, units and hints of mechanisms by name: those for grading, or those of a file.

    Parameters
    ----------
    path : Path, optional
        File with MECHANISMS, UNITS and LEADS.

    Raises
    ------
    ValueError
        If one of them is missing.
    FileNotFoundError
        If the file is missing.
    """
    if path is None:
        return described(grading_mechanisms())
    return load_mechanisms(path)
