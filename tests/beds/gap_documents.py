"""Documents of gap.json and plan.json with made-up numbers: one of every kind of verdict."""

import numpy as np

GAP = {"before": 17.04, "after": -1.52, "unit": "mm", "null_band": [-2.3, 3.9]}
WITHIN = {"before": 1.04, "after": 1.04, "unit": "mm", "null_band": [-2.3, 3.9]}  # chance
START = 413200.0  # s, GPS week seconds
NAMES = [
    *("time_offset", "clock_drift", "range_bias", "range_scale", "range_walk"),
    *("boresight right", "boresight forward", "boresight up"),
    *("lever_arm right", "lever_arm forward", "lever_arm up"),
    *("vertical_datum", "horizontal_datum easting", "horizontal_datum northing"),
]
UNITS = {"time_offset": "s", "clock_drift": "s per s", "range_scale": "ratio", "boresight": "deg"}
UNITS |= {"range_walk": "m per decade"}


def parameter(name, unit, estimate, sigma, detectable=None):
    return {
        "name": name,
        "unit": unit,
        "estimate": estimate,
        "sigma": sigma,
        "detectable": detectable,
    }


LEVER_ARM = [
    parameter("right", "m", -0.0932, 0.0041, 0.0163),
    parameter("forward", "m", 0.0051, 0.0039, 0.0157),
    parameter("up", "m", 0.0192, 0.0168, 0.0680),
]
CAUSES = {  # label: parameters
    "none": [],
    "unknown": [],
    "time_offset": [parameter("magnitude", "s", -0.0045256, 0.000527, 0.00218)],
    "lever_arm": LEVER_ARM,
    "vertical_datum": [parameter("magnitude", "m", 0.0312, 0.0069, 0.07)],
    "range_noise": [parameter("magnitude", "m", 0.0071, 0.0004, 0.002)],
    "position_bump": [
        parameter("easting", "m", 0.172, 0.02, 0.08),
        parameter("northing", "m", 0.004, 0.02, 0.08),
        parameter("height", "m", None, None, None),
        parameter("time", "s", 20.0, None, None),
        parameter("width", "s", 5.0, None, None),
    ],
    "time_offset+lever_arm": [
        parameter("time_offset magnitude", "s", 0.0021, 0.0004, 0.0015),
        *({**one, "name": f"lever_arm {one['name']}"} for one in LEVER_ARM),
    ],
}


def gap_document(label="time_offset", probability=0.9817, rows=300, rng=None, **changes):
    "The document of a survey in two passes; its keys may be given anew"
    rng = rng or np.random.default_rng(4)
    others = [name for name in (*CAUSES, "angle_noise") if name != label]
    share = [probability, *((1 - probability) * 0.5 ** (1 + np.arange(len(others))))]
    chance = dict(zip([label, *others], share, strict=True))
    tested = "lever_arm" if label == "unknown" else label
    document = {
        "schema": "mlscorr.gap/1",
        "name": "street",
        "verdict": {
            "label": label,
            "probability": probability,
            "set": [label],
            "p_value": 0.0497 if label == "none" else 1e-12,
            "same": [],
            "lead": "height error that grows with speed squared" if label == "unknown" else "",
            "excess": "",
            "sentence": f"{label} explains it.",
        },
        "gap": WITHIN if label == "none" else GAP,
        "headline": "Observed and simulated differ by 17.0 mm; 38 % of it is in the axis E.",
        "assumed": [],
        "agreement": [
            {
                "channel": "target",
                "things": 16,
                "rms_mm": 14.0 if label == "none" else 41.0,
                "stated_mm": 12.0,
            },
            {"channel": "surface", "things": 500, "rms_mm": 9.0, "stated_mm": 8.0},
        ],
        "advice": ["Have the scanner looked at.", "Then diagnose the survey again."],
        "where": splits(rng),
        "causes": [
            {
                "effect": name,
                "probability": chance[name],
                "rms_mm": 0.0 if name in ("none", "unknown") else 12.34,
                "parameters": CAUSES[name],
            }
            for name in [label, *others]
            if name in CAUSES
        ],
        "separability": {**apart(rng), "detectable": detectable()},
        "closure": {
            "effect": tested,
            "before": 16.42,
            "after": 16.42 if label == "none" else 1.87,
            "unit": "mm",
            "shrink": None if label == "none" else 0.9871,
            "interval": [None, None] if label == "none" else [0.931, 0.994],
            "null_band": [-2.1, 4.2],
            "held_out": "Each of 4 blocks of 25 s was held out in turn.",
            "is_held_out": label != "none",
            "folds": [
                {"label": tested, "before": before, "after": after}
                for before, after in [(14.1, 2.2), (18.0, -1.1), (16.6, None), (17.3, 0.4)]
            ],
        },
        "next_data": [
            {
                "survey": "the same road at twice the speed",
                "why": "time_offset and lever_arm: squared correlation decreases from 0.97 to "
                "0.31.",
                "before": 0.97,
                "after": 0.31,
            }
        ],
        "evidence": [
            {"label": name, "log_evidence_ratio": float(40.0 - 7.0 * i), "probability": value}
            for i, (name, value) in enumerate(chance.items())
        ],
        "innovations": innovations(rng, rows),
        "windows": [],
        "map": plan_of(rng, rows),
        "channels": {"target": 48, "surface": 1000, "roughness": 961},
        "simulator": {"effects": []},
        "contrasts": contrasts(),
        "distances": [
            {
                "channel": channel,
                "figure": figure,
                "unit": "m",
                "before": 0.0821,
                "after": None,
                "floor": -0.0003,
                "floor_high": 0.0114,
                "drawn": 500,
                "halves": 40,
            }
            for channel, figure in (("points", "chamfer"), ("surface", "energy_distance"))
        ],
        "left_out": {"beam_divergence": "No residual of this survey depends on it."},
        "mendable": [],
        "warnings": ["No plane was scanned twice."],
    }
    return document | changes


def round_document(label, **changes):
    "A round of diagnose --until-none"
    gap = {"before": 38.24, "after": 14.68, "unit": "mm", "shrink": 0.853, "kind": "systematic"}
    found = {"round": 1, "label": label, "probability": 0.9, "parameters": [], "windows": []}
    return found | gap | changes


def contrasts():
    "Intensity that falls off beyond 20 m, of all 3 bins one unknown; nothing of the others"
    table = {
        "by": "range",
        "edges": [0, 10, 20, 40],
        "real": [8660.0, 8101.6, None],
        "simulated": [8669.5, 11342.0, None],
        "value": [0.9989, 0.7143, None],
        "sigma": [0.0021, 0.0052, None],
        "blocks": [20.1, 17.3, 2.0],
        "differs": [False, True, False],
    }
    common = {"unit": "counts", "whole": None, "confidence": 0.99, "replicas": 400}
    said = "Real returns are 1.40 ± 0.01 times weaker than simulated ones beyond 10 m."
    return [
        {
            "channel": "intensity",
            "figure": "ratio",
            "silent": "",
            "tables": [table],
            "sentences": [said],
            **common,
        },
        {
            "channel": "edge_width",
            "figure": "difference",
            "silent": "Too few depth edges.",
            "tables": [],
            "sentences": [],
            **common,
        },
    ]


def splits(rng):
    def one(by, name, unit, count, **bins):
        before = rng.normal(12.0, 5.0, count)
        after = rng.normal(0.0, 2.0, count)
        return {
            "by": by,
            "name": name,
            "unit": unit,
            **bins,
            "count": [100] * count,
            "before": before.tolist(),
            "after": after.tolist(),
            "share": (before**2 / (before**2).sum()).tolist(),
            "null_band": [[-3.0, 4.0]] * count,
        }

    return [
        one("time", "time", "s", 4, edges=[0.0, 25.0, 50.0, 75.0, 100.0]),
        one("incidence", "incidence angle", "deg", 3, edges=[10.0, 30.0, 50.0, 80.0]),
        one("axis", "axis", "", 3, bins=["E", "N", "H"]),
        one("channel", "channel", "", 2, bins=["surface", "target"]),
    ]


def apart(rng):
    "Classes and correlation: lever arm up and vertical datum are one class"
    signature = rng.normal(size=(len(NAMES), 40))
    up = NAMES.index("lever_arm up")
    datum = NAMES.index("vertical_datum")
    signature[datum] = signature[up] + 0.1 * signature[datum]
    matrix = np.corrcoef(signature)
    return {
        "classes": [["lever_arm", "vertical_datum"]],
        "correlation": {"names": NAMES, "matrix": matrix.tolist()},
    }


def detectable():
    found = {}
    for i, name in enumerate(NAMES):
        effect = name.partition(" ")[0]
        one = {"name": name, "unit": UNITS.get(effect, "m"), "detectable": 0.0012 * (1 + i)}
        found.setdefault(effect, []).append(one)
    return found


def innovations(rng, rows):
    "Two passes with 60 s between them"
    time = np.sort(rng.uniform(0.0, 100.0, rows))
    time += 60.0 * (time > 50.0)
    return {
        "gps_time": (START + time).tolist(),
        "channel": rng.choice(["target", "surface"], rows).tolist(),
        "before": rng.normal(0.0, 2.5, rows).tolist(),
        "after": rng.normal(0.0, 1.0, rows).tolist(),
        "sigma_mm": [4.0] * rows,
    }


def plan_of(rng, rows):
    way = np.linspace(0.0, 400.0, 200)
    track = np.column_stack([523000.0 + way, 3378000.0 + 30.0 * np.sin(way / 60.0)])
    place = track[rng.integers(0, 200, rows)] + rng.normal(0.0, 8.0, (rows, 2))
    return {
        "trajectory": track.tolist(),
        "targets": [
            {"name": f"T{i + 1:02d}", "role": role, "position": (track[20 * i] + [0, 9]).tolist()}
            for i, role in enumerate(["control", "check"] * 4)
        ],
        "rows": [
            {"position": p.tolist(), "channel": c, "before": float(b), "after": float(a)}
            for p, c, b, a in zip(
                place,
                rng.choice(["target", "surface"], rows),
                rng.normal(0.0, 2.5, rows),
                rng.normal(0.0, 1.0, rows),
                strict=True,
            )
        ],
    }


def plan_document(**changes):
    "The document of a plan: half of the effects show at their usual size"
    rng = np.random.default_rng(5)
    found = detectable()
    for parts in found.values():
        for one in parts:
            one["typical"] = 0.0081
    found["clock_drift"][0]["typical"] = None
    place = plan_of(rng, 10)
    del place["rows"]
    return {
        "schema": "mlscorr.plan/1",
        "name": "street",
        "detectable": found,
        **apart(rng),
        "next_data": gap_document()["next_data"],
        "accuracy": {
            "gps_time": [413_200.0, 413_205.0, 413_210.0, 414_000.0, 414_005.0, 414_010.0],
            "sigma": [0.01, 0.04, 0.02, 0.02, 0.06, 0.01],
            "rms": 0.0317,
            "largest": 0.06,
            "control_times": [413_201.0, 414_009.0],
        },
        "next_control": [],
        "map": place,
        "advice": [],
        "warnings": [],
    } | changes


def too_little():
    "Document of a survey in which nothing could be compared"
    empty = gap_document()
    gap = {"before": None, "after": None, "unit": "mm", "null_band": [None, None]}
    verdict = {"label": "none", "probability": None, "set": [], "p_value": None, "same": []}
    verdict |= {"lead": "", "sentence": "Only 2 targets were seen; 12 are needed."}
    closure = gap | {"effect": "none", "shrink": None, "interval": [None, None], "held_out": ""}
    closure["is_held_out"] = False
    nothing = {"names": [], "matrix": []}
    return empty | {
        "verdict": verdict,
        "gap": gap,
        "headline": "Nothing could be compared.",
        "advice": [],
        "where": [],
        "causes": [],
        "separability": {"classes": [], "correlation": nothing, "detectable": {}},
        "closure": closure | {"folds": []},
        "evidence": [],
        "innovations": {key: [] for key in empty["innovations"]},
        "map": empty["map"] | {"rows": []},
        "channels": {"target": 6},
    }


def alike():
    "A class: lever arm or vertical datum, which this survey can't tell apart"
    document = gap_document("lever_arm", 0.61)
    document["verdict"] |= {"set": ["lever_arm", "vertical_datum"], "same": ["vertical_datum"]}
    for rows, key in ((document["causes"], "effect"), (document["evidence"], "label")):
        for row in rows:
            if row[key] == "vertical_datum":
                row["probability"] = 0.36
    return document


def bump():
    window = {"effect": "position_bump", "start": START + 15.0, "end": START + 25.0}
    document = gap_document("position_bump", 0.883, windows=[window])
    document["verdict"]["set"] = ["position_bump", "unknown"]
    return document


KINDS = {
    "effect": gap_document,
    "vector": lambda: gap_document("lever_arm"),
    "none": lambda: gap_document("none", 0.967),
    "unknown": lambda: gap_document("unknown", 0.91),
    "pair": lambda: gap_document("time_offset+lever_arm", 0.93),
    "noise": lambda: gap_document("range_noise", 0.995),
    "alike": alike,
    "bump": bump,
    "too little": too_little,
}
