"""Evidence of diagnoses of many synthetic surveys, kept in files so that a fit takes seconds."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gap_training.cases import draw_case
from gap_training.worlds import World
from mlscorr.gap.evidence import weigh_labels
from mlscorr.gap.evidence.labels import JointScore, joint_score
from mlscorr.simulate import Described


@dataclass(frozen=True)
class Record:
    """One case: the effects that acted, and the evidence.

    Parameters
    ----------
    world : int
        Seed.
    is_open : bool
        True if GNSS was never missing.
    kind : str
        clean, noise, single, pair, withheld or outside.
    truth : str
        The correct label.
    mdb : float
        Size in minimal detectable biases.
    p_value : float or None
        Of none, from replicas, where there were any.
    joint : JointScore
    """

    world: int
    is_open: bool
    kind: str
    truth: str
    mdb: float
    p_value: float | None
    joint: JointScore

    def is_right(self, label: str) -> bool:
        """True if a label is the truth."""
        return sorted(label.split("+")) == sorted(self.truth.split("+"))


def collect(
    folder: Path,
    seeds: Iterable[int],
    cases: int,
    mechanisms: Described,
    replicas: int = 0,
    progress: Callable[[str], None] = print,
) -> list[Record]:
    """Collect records of worlds, and read those that are already in the folder.

    Parameters
    ----------
    folder : Path
    seeds : iterable of int
        One of each world.
    cases : int
        In each world.
    mechanisms : dict
        Those outside the library: function, unit with largest size, and hint, by name.
    replicas : int
        For p-values of clean surveys; none by default.
    progress : function
        Called after each world.
    """
    folder = Path(folder)
    records = []
    folder.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        path = folder / f"{seed}.json"
        if not path.exists():
            text = json.dumps(
                [
                    vars(r) | {"joint": vars(r.joint)}
                    for r in _records(seed, cases, mechanisms, replicas)
                ]
            )
            part = folder / f".{seed}.part"
            part.write_text(text + "\n", encoding="utf-8")
            os.replace(part, path)
            progress(f"world {seed}: {cases} cases")
        records += read_records(path)
    return records


def read_records(path: Path) -> list[Record]:
    """Read the records of one world.

    Parameters
    ----------
    path : Path
    """
    known = json.loads(Path(path).read_text(encoding="utf-8"))
    return [Record(**{**each, "joint": JointScore(**each["joint"])}) for each in known]


def _records(seed, cases, mechanisms, replicas):
    """Records of a newly made world."""
    world = World.random(seed)
    for number in range(cases):
        rng = np.random.default_rng([seed, 1, number])
        case = draw_case(world, rng, mechanisms)
        drawn = replicas if case.kind == "clean" else 0
        evidence = weigh_labels(
            case.rows, case.background, case.survey, case.signatures, rng, drawn
        )
        joint, _ = joint_score(case.rows, case.survey, case.signatures, evidence)
        joint = JointScore(**{**vars(joint), "noisy": sorted(joint.noisy)})
        p = evidence.p_value if drawn else None
        yield Record(seed, world.is_open, case.kind, case.truth, case.mdb, p, joint)


def first_evidence(seed: int, mechanisms: Described) -> dict[str, float]:
    """Log evidence of every label in the first case of a world, which identifies the code version.

    Parameters
    ----------
    seed : int
        Of the world.
    mechanisms : dict
        See ``collect``.
    """
    record = next(_records(seed, 1, mechanisms, 0))
    return {label: round(score, 4) for label, score in record.joint.score.items()}
