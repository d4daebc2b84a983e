"""Blind check: surveys with sealed labels, answers to them, and the score."""

import hashlib
import json
import os
import secrets
import shutil
import tempfile
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from time import monotonic

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.blind import make_case, mix, outside_mechanisms, score
from mlscorr.effects import EFFECTS, known_effects, register_file
from mlscorr.io.store import document, output_file, write_json
from mlscorr.io.surveys import read_survey
from mlscorr.pipeline.finding import find_targets, match_targets, silent

SECRET = ("truth*", "key*")  # names of files that no diagnosis may see


def make_blind(
    out: Path,
    cases: int,
    seed: int,
    workers: int,
    mechanisms: Path | None = None,
    progress: Callable | None = None,
    effects: Path | None = None,
) -> int:
    """Make the surveys of a blind check: OUT/cases, seals.json (public) and key.json (labels).

    An interrupted run is continued. Returns the number of existing cases.

    Parameters
    ----------
    out : Path
    cases : int
    seed : int
    workers : int
        Number of processes: each needs a core and a gigabyte.
    mechanisms : Path, optional
        File with mechanisms outside the library; by default the half of the grammar for grading.
    progress : function, optional
        progress(title, total) returns a function of the number of cases just done.
    effects : Path, optional
        Python file of a user's effects, already registered: they are drawn like others.

    Raises
    ------
    ValueError
        If OUT contains another check, or a case cannot be made.
    """
    out = Path(out)
    names = tuple(outside_mechanisms(mechanisms))
    own = [kind.name for kind in known_effects()[len(EFFECTS) :]]
    key = _opened(out, {"cases": cases, "seed": seed, "mechanisms": list(names), "effects": own})
    drawn = enumerate(mix(cases, np.random.default_rng([seed]), names), start=1)
    each = [(out / "cases" / f"{i:04d}", case, (seed, i), mechanisms) for i, case in drawn]
    jobs = [(_make, folder, *job) for folder, *job in each if folder.name not in key["labels"]]
    done = (progress or silent)("Making surveys", len(jobs))
    for folder, label in _in_processes(jobs, workers, effects):
        key["labels"][folder.name] = {"label": label, "salt": secrets.token_hex(16)}
        _write_key(out, key)
        done(1)
    seals = {name: _seal(sealed) for name, sealed in sorted(key["labels"].items())}
    write_json(out / "seals.json", document("seals", {"seals": seals}))
    return len(seals)


def run_blind(
    out: Path, workers: int, progress: Callable | None = None, effects: Path | None = None
) -> tuple[int, int]:
    """Diagnose each survey of a blind check without an answer: OUT/answers.

    Each diagnosis receives a copy of its survey's folder in a separate process; the key is not
    readable meanwhile.

    Parameters
    ----------
    out : Path
    workers : int
    progress, effects
        See ``make_blind``.

    Returns
    -------
    answered, failed : int
        Numbers of answers, and of failed diagnoses.

    Raises
    ------
    ValueError
        If there are no cases, or a folder contains a truth or a key.
    """
    out = Path(out)
    folders = sorted(path for path in (out / "cases").glob("*") if not path.name.startswith("."))
    if not folders:
        raise ValueError(f"{out} has no cases. Create them first with mlscorr blind make.")
    for folder in folders:
        _check_blind(folder)
    answers = out / "answers"
    answers.mkdir(exist_ok=True)
    todo = (folder for folder in folders if not (answers / f"{folder.name}.json").exists())
    jobs = [(_diagnose, folder) for folder in todo]
    done = (progress or silent)("Diagnosing", len(jobs))
    with _locked(out / "key.json"):
        for folder, answer in _in_processes(jobs, workers, effects):
            write_json(answers / f"{folder.name}.json", answer)
            done(1)
    texts = (path.read_text() for path in answers.glob("*.json"))
    return len(folders), sum("error" in json.loads(text) for text in texts)


def score_blind(out: Path) -> dict:
    """Unseal the labels of a blind check and score its answers: OUT/score.json, returned.

    Parameters
    ----------
    out : Path

    Raises
    ------
    ValueError
        If a label or its key was changed after sealing, or there are no answers yet.
    """
    out = Path(out)
    key = _read(out / "key.json")["labels"]
    seals = _read(out / "seals.json")["seals"]
    broken = sorted(n for n in {*key, *seals} if n not in key or _seal(key[n]) != seals.get(n))
    if broken:
        raise ValueError(
            f"{len(broken)} of {len(seals)} seals of {out} are broken (first: {broken[0]}): a "
            "label or its salt was changed after sealing, so nothing can be scored. Create the "
            "cases again."
        )
    answers = {path.stem: _read(path) for path in sorted((out / "answers").glob("*.json"))}
    answered = [name for name in sorted(seals) if name in answers]
    if not answered:
        raise ValueError(f"{out} has no answers. Run mlscorr blind run first.")
    scored = score({name: (key[name]["label"], answers[name]) for name in answered})
    content = document("score", {"cases": len(seals), "answered": len(answered), **scored})
    write_json(out / "score.json", content)
    return content


def _read(path):
    if not path.is_file():
        raise ValueError(f"{path} is missing; mlscorr blind make and run create it.")
    return json.loads(path.read_text(encoding="utf-8"))


def _seal(sealed):
    """SHA-256 of a label's canonical JSON and its salt."""
    text = json.dumps(sealed["label"], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256((text + sealed["salt"]).encode()).hexdigest()


def _opened(out, plan):
    """Key of a check begun with this plan, or a new one."""
    path = out / "key.json"
    if path.exists():
        key = _read(path)
        if key["plan"] != plan:
            raise ValueError(
                f"{out} has a blind check of {key['plan']['cases']} cases with seed "
                f"{key['plan']['seed']} and {len(key['plan']['mechanisms'])} mechanisms, not "
                "this one. Choose another folder."
            )
        return key
    if out.exists() and any(out.iterdir()):
        raise ValueError(f"{out} contains other files. Choose another folder.")
    (out / "cases").mkdir(parents=True)
    key = {"plan": plan, "labels": {}}
    _write_key(out, key)
    return key


def _write_key(out, key):
    with output_file(out / "key.json") as part:
        part.touch(mode=0o600)
        part.write_text(json.dumps(key, indent=1, allow_nan=False) + "\n", encoding="utf-8")


@contextmanager
def _locked(path):
    """Make a file unreadable for everyone except root meanwhile."""
    path.chmod(0o000)
    try:
        yield
    finally:
        path.chmod(0o600)


def _check_blind(folder):
    """Refuse a folder in which a diagnosis could read its answer."""
    readable = sorted(p for name in SECRET for p in folder.rglob(name) if p.is_file())
    if readable:
        raise ValueError(
            f"The diagnosis can read {readable[0]}, but must not know the truth. Remove it, or "
            "create the cases again."
        )


def _in_processes(jobs, workers, effects):
    """Yield results of jobs (function, folder, ...) as (folder, result), in order of
    completion. A process is a fresh interpreter with one BLAS thread.
    """
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, context, _begin, (effects,)) as pool:
        futures = {pool.submit(*job): job[1] for job in jobs}
        try:
            yield from ((futures[future], future.result()) for future in as_completed(futures))
        finally:
            pool.shutdown(cancel_futures=True)


def _begin(effects):
    """Initialize a process."""
    threadpool_limits(1)
    if effects is not None:
        register_file(effects)


def _matched(survey):
    """Targets of a survey with their names."""
    return match_targets(find_targets(survey), survey)


def _make(folder, case, entropy, mechanisms):
    """Make a case in a separate process, atomically, and return its label."""
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory(prefix=".", dir=folder.parent) as place:
        made = Path(place) / folder.name
        label = make_case(made, case, entropy, _matched, mechanisms)
        if folder.exists():  # of a run that was interrupted before it had the label
            shutil.rmtree(folder)
        os.replace(made, folder)
    return label


def _diagnose(folder):
    """Answer of the diagnosis, which receives only a copy of the folder."""
    from mlscorr.pipeline.diagnosis import diagnose

    warnings.simplefilter("ignore")
    start = monotonic()
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place) / "survey"
        shutil.copytree(folder, copy, ignore=shutil.ignore_patterns(*SECRET))
        without = json.loads((copy / "library.json").read_text())["without"]
        (copy / "library.json").unlink()
        library = tuple(kind for kind in known_effects() if kind.name not in without)
        try:
            rng = np.random.default_rng(0)
            answer = {"document": diagnose(read_survey(copy), library=library, rng=rng).document}
        except ValueError as error:
            answer = {"error": str(error)}
    return answer | {"seconds": round(monotonic() - start, 2)}
