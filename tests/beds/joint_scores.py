"""Hand-made evidence of surveys: what decisions are learned from."""

import numpy as np
from gap_training.records import Record

from mlscorr.gap.evidence.labels import JointScore

FACTS = dict.fromkeys(("rough", "raised", "event", "event in raised", "scale", "size", "odd"), 0.0)
FACTS |= {"rough": 1.0, "size": 6.0}
EFFECTS = ("range_bias", "time_offset", "boresight")


def joint(**score):
    "JointScore with these scores; all others are those of a survey in which nothing shows"
    known = {"none": 0.0, "unknown": -4.0, "range_noise": -4.0}
    known |= dict.fromkeys(EFFECTS, -5.0)
    known |= {name.replace("_and_", "+"): value for name, value in score.items()}
    single = {name: value for name, value in known.items() if "+" not in name}
    beside = {"unknown": -4.0, "range_noise": -4.0, "time_offset": -5.0}
    return JointScore(known, single, beside, dict(FACTS), ["range_noise"])


def records(number, seed=0, worlds=8):
    "Records of clean surveys, effects, noise, unknown and pairs whose evidence mostly shows them"
    rng = np.random.default_rng(seed)
    made = []
    for i in range(number):
        kind = str(rng.choice(["clean", "single", "noise", "outside", "pair"]))
        size = float(rng.uniform(1.0, 8.0))
        gain = rng.standard_normal() + size - 2.0
        name = str(rng.choice(EFFECTS))
        truth, score = {
            "clean": ("none", {}),
            "single": (name, {name: gain}),
            "noise": ("range_noise", {"range_noise": gain}),
            "outside": ("unknown", {"unknown": gain}),
            "pair": (
                "range_bias+boresight",
                {"range_bias_and_boresight": gain, "range_bias": -1.0},
            ),
        }[kind]
        mdb = 0.0 if kind == "clean" else size
        p = float(rng.beta(0.5, 1.0)) if kind == "clean" else 0.01
        made.append(Record(i % worlds, bool(i % 2), kind, truth, mdb, p, joint(**score)))
    return made
