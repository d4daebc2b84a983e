"""What the report says in words and numbers, read from the document of report.json."""

import numpy as np

AXES = ("E", "N", "H")
GROUPS = ("control", "check", "unused")
QUANTITIES = ("Easting", "Northing", "Height (vertical)", "Horizontal distance", "3D distance")
WORSE = 0.002  # m; less is below what surveying a target can tell


def group(row):
    """Where a row of targets[] belongs: ``control``, ``check`` or ``unused``.

    No check point takes part in the estimate, so its ``used`` may be false without a fault: it
    counts as unused only when another reason than its role is given.

    >>> group({"role": "check", "used": False, "reason": None})
    'check'
    """
    reason = (row.get("reason") or "").strip().lower()
    if row["used"] or (row["role"] == "check" and reason in ("", "check", "check point")):
        return row["role"]
    return "unused"


def ordered(rows, *groups):
    """Rows of targets[] in these groups (all, when none is named), each group in time."""

    def key(row):
        time = row.get("gps_time")
        return GROUPS.index(group(row)), np.inf if time is None else time, row["name"] or ""

    return sorted((row for row in rows if group(row) in (groups or GROUPS)), key=key)


def array(rows, key):
    """A field of three numbers as an (n, 3) array, NaN where it is not determined."""
    blank = [np.nan] * 3
    values = [[np.nan if v is None else v for v in (row.get(key) or blank)] for row in rows]
    return np.array(values, dtype=float).reshape(-1, 3)


def norm(values, axes=3):
    """Length of the first axes of a vector: 2 is horizontal, 3 is 3D; None when one is missing."""
    if values is None or any(value is None for value in values[:axes]):
        return None
    return float(np.linalg.norm(values[:axes]))


def number(value, decimals=3):
    """A number with fixed decimals, a dash where there is none, and no negative zero.

    >>> number(-0.00004), number(None), number(531400.25, 1)
    ('0.000', '–', '531400.2')
    """
    if value is None or not np.isfinite(value):
        return "–"
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0 else text


def thousands(value):
    """A whole number with narrow spaces between thousands.

    >>> thousands(1847911)
    '1 847 911'
    """
    return f"{value:,}".replace(",", " ")


def statistic(document, role, when, what="rmse"):
    """One of rmse, mean, min, max of control or check, before or after; None where not known."""
    return ((document.get(role) or {}).get(when) or {}).get(what)


def rmse_rows(document):
    """Rows of the RMSE table: label, n, rmse, horizontal and 3D, the independent ones first."""
    kinds = [
        ("check", "before", "Check points, before"),
        ("check", "after", "Check points, after"),
        ("control", "before", "Control points, before"),
        ("control", "leave_one_out", "Control points, left out in turn"),
        ("control", "after", "Control points, after (fit)"),
    ]
    rows = []
    for role, when, label in kinds:
        rmse = statistic(document, role, when)
        n = (document.get(role) or {}).get("n", 0)
        if rmse is None and (role == "check" or when == "leave_one_out"):
            continue
        rows.append(
            {
                "label": label,
                "strong": (role, when) in (("check", "after"), ("control", "leave_one_out")),
                "n": statistic(document, role, when, "n") or n,
                "rmse": rmse or [None] * 3,
                "horizontal": norm(rmse, 2),
                "spatial": norm(rmse, 3),
            }
        )
    return rows


def statistics_rows(document):
    """Blocks (title, n, rows) of all statistics, a row (name, before, after) for each quantity.

    before and after are mean, std, RMSE, min, max, None where it is not determined.
    """
    kinds = [
        ("check", "after", "Check points"),
        ("control", "leave_one_out", "Control points, after: left out in turn"),
        ("control", "after", "Control points, after: fit"),
    ]
    blocks = []
    for role, when, title in kinds:
        if statistic(document, role, when) is None:
            continue
        n = statistic(document, role, when, "n") or document[role]["n"]
        columns = zip(
            (*QUANTITIES,),
            _columns(document[role]["before"]),
            _columns(document[role][when]),
            strict=True,
        )
        blocks.append((title, n, list(columns)))
    return blocks


def _columns(found):
    """Mean, std, RMSE, min, max of E, N, H, horizontal and 3D."""
    names = ("mean", "std", "rmse", "min", "max")
    axes = [[(found.get(name) or [None] * 3)[k] for name in names] for k in range(3)]
    return axes + [[found.get(f"{name}_{end}") for name in names] for end in ("horizontal", "3d")]


def seen(document, role):
    """How many points of a role, and how many observations (one for each pass) of them."""
    n = document[role]["n"]
    points = len({row["name"] for row in document["targets"] if group(row) == role})
    return (points if n else 0) or n, n


def count(document, role):
    """How many points in words: '8 points', or '12 observations of 8 points'."""
    points, n = seen(document, role)
    words = "1 point" if points == 1 else f"{points} points"
    return words if points == n else f"{n} observations of {words}"


def independent(document):
    """RMSE (3,) before and after that the verdict rests on, and what it is: check, leave-one-out
    or fit. (None, None, 'nothing') when there is no residual at all."""
    kinds = [("check", "after"), ("control", "leave_one_out"), ("control", "after")]
    for (role, when), kind in zip(kinds, ("check", "leave-one-out", "fit"), strict=True):
        before, after = statistic(document, role, "before"), statistic(document, role, when)
        if before is not None and after is not None and None not in [*before, *after]:
            return before, after, kind
    return None, None, "nothing"


def verdict(document):
    """The result in sentences, and whether it became worse on an axis: (list of str, bool)."""
    before, after, kind = independent(document)
    if kind == "nothing":
        return ["No target was found that could tell how good the correction is."], True
    rise = {a: new - old for a, old, new in zip(AXES, before, after, strict=True)}
    worse = [f"{axis} by {number(by)} m" for axis, by in rise.items() if by > WORSE]
    sentences = [_plainly(norm(before), norm(after), kind), _result(document, before, after, kind)]
    if worse:
        sentences.append(f"After the correction it is worse than before: {', '.join(worse)}.")
    return sentences, bool(worse)


def _plainly(before, after, kind):
    """What the correction did, in plain words; lengths are 3D RMSE in m."""
    by = {
        "check": "as independent check points tell",
        "leave-one-out": "as control points tell that were left out in turn",
        "fit": "but only at the points that it was made from: nothing independent can judge it",
    }[kind]
    pair = f"from {_length(before)} to {_length(after)} off the surveyed places"
    if kind != "fit" and abs(before - after) <= WORSE:
        return f"The correction changed next to nothing, {by}: {pair}."
    if after > before:
        return f"The correction made the cloud worse, {by}: {pair}. Don't use it."
    closer = before / max(after, 1e-4)
    times = f" ({closer:.0f} times closer)" if closer >= 1.5 and kind != "fit" else ""
    return f"The correction brought the cloud {pair}{times}, {by}."


def _length(value):
    """A length in words: '7 mm', '4.6 cm', '1.23 m'.

    >>> _length(0.0071), _length(0.046), _length(1.234)
    ('7 mm', '4.6 cm', '1.23 m')
    """
    if value < 0.0095:
        return f"{1000 * value:.0f} mm"
    return f"{100 * value:.1f} cm" if value < 0.995 else f"{value:.2f} m"


def _result(document, before, after, kind):
    """RMSE before and after in one sentence that says what it rests on."""
    low = min(*before, *after)
    decimals = 2 if low >= 0.03 else 3 if low >= 0.003 else 4
    shown = ["/".join(number(value, decimals) for value in values) for values in (before, after)]
    figures = f"RMSE {shown[0]} m before, {shown[1]} m after (E/N/H)"
    if kind == "check":
        points = count(document, "check")
        return f"Check points: {figures}, {points} that took no part in the estimate."
    points = count(document, "control")
    if kind == "leave-one-out":
        return (
            "There are no check points. Control points, each left out in turn and predicted from "
            f"the others: {figures}, {points}."
        )
    return (
        f"There is no independent check: every target used ({points}) made the correction. The "
        f"fit, {figures}, does not tell how good the correction is elsewhere."
    )
