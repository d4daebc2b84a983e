"""The pictures of the cloud and their legends, as the page's template shows them."""

import base64

from mlscorr.report import tables
from mlscorr.report.look import AFTER, BEFORE
from mlscorr.report.render.quantities import FIRST, GHOST, LABELS, SECOND, colour_table
from mlscorr.report.render.symbols import MARK

STOPS = 9  # of a colour scale as a gradient
SWATCHES = {
    "visit": ((FIRST, "scanned at the first visit"), (SECOND, "scanned at the second visit")),
    "state": ((BEFORE, "as recorded"), (AFTER, "corrected"), (GHOST, "the other of the two")),
}


def shown(seen, document):
    """What the template shows of a CloudViews."""
    pictures = [shot(picture) for picture in seen.pictures]
    names = {row["name"] for row in document["targets"] if row["observed"] is not None}
    close = [one for one in pictures if one["kind"] == "target"]
    return {
        "overview": next(one for one in pictures if one["kind"] == "overview"),
        "section": next((one for one in pictures if one["kind"] == "section"), None),
        "close_ups": close,
        "close_up_legend": legend("intensity", None),
        "targets_seen": len(names),
        "mark": MARK,
        "step": seen.step,
        "scene": seen.scene,
        "scene_points": tables.thousands(len(base64.b64decode(seen.scene["intensity"]))),
    }


def shot(picture):
    """One pair of pictures in words and as addresses of images."""
    view = picture.view
    before, after = (
        "data:image/png;base64," + base64.b64encode(b).decode() for b in picture.panels()
    )
    times = {mark.text for side in view.marks for mark in side if mark.kind == "residual"}
    return {
        "name": picture.name,
        "kind": view.name.partition("-")[0],
        "title": view.title,
        "note": view.note,
        "size": view.camera.size,
        "before": before,
        "after": after,
        "times": times.pop() if len(times) == 1 else None,
        "legend": legend(view.colour, picture.limits),
    }


def legend(colour, limits):
    """A colour's scale (words, low, high, gradient) or its swatches (colour, words)."""
    if colour in SWATCHES:
        return {"swatches": SWATCHES[colour]}
    words, unit = LABELS[colour]
    table = colour_table(colour)
    stops = [table[round(k * 255 / (STOPS - 1))] for k in range(STOPS)]
    gradient = ", ".join(f"#{r:02x}{g:02x}{b:02x}" for r, g, b in stops)
    low, high = ("low", "high") if not unit else (f"{v:.2f} {unit}" for v in limits)
    return {"words": words, "low": low, "high": high, "gradient": gradient}
