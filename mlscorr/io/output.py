"""Results: a folder that appears whole or not at all, and JSON documents."""

import csv
import json
import math
import os
import shutil
import tempfile
from contextlib import contextmanager
from pathlib import Path


def check_output(out, inputs, overwrite=False):
    """Refuse an output folder that holds an input, or holds anything without overwrite.

    Raises ValueError.
    """
    out = Path(out)
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; the results need a folder. Choose another name.")
    for path in inputs:
        if Path(path).resolve().parent == out.resolve():
            raise ValueError(
                f"The output folder {out} holds the input {Path(path).name}, which would be lost. "
                "Choose another folder."
            )
    if out.is_dir() and not overwrite and (present := sorted(p.name for p in out.iterdir())):
        raise ValueError(
            f"The output folder {out} holds {len(present)} entries already (first: {present[0]}). "
            "Choose another folder, or allow with --overwrite that files of the same name are "
            "replaced."
        )


@contextmanager
def output_folder(out):
    """A folder to write into, which takes the name out only when all went well.

    It stands beside out until then. Files of the same name in out are replaced, others stay.
    """
    out = Path(out).absolute()
    out.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=f".{out.name}.", suffix=".part", dir=out.parent))
    try:
        part.chmod(0o777 & ~_umask())
        yield part
        if out.exists():
            for path in sorted(part.rglob("*")):
                target = out / path.relative_to(part)
                if path.is_dir():
                    target.mkdir(exist_ok=True)
                else:
                    os.replace(path, target)
            shutil.rmtree(part)
        else:
            os.replace(part, out)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise


def _umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


def document(name, content):
    """A JSON document with its schema first; values that are not finite become None."""
    return {"schema": f"mlscorr.{name}/1", **_finite(content)}


def _finite(value):
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_json(path, content):
    """Write a document as JSON."""
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
    Path(path).write_text(text + "\n", encoding="utf-8")


def write_targets_csv(path, targets):
    """Write the targets of report.json as a table; misclosures are surveyed - observed, in m."""
    vectors = ("surveyed", "observed", "sigma", "before", "after")
    single = ("name", "pass", "gps_time", "role")
    axes = ("easting", "northing", "height")
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = [f"{vector}_{axis}" for vector in vectors for axis in axes]
        writer.writerow([*single, *names, "used", "reason"])
        for row in targets:
            numbers = [
                "" if value is None else f"{value:.4f}"
                for vector in vectors
                for value in (row[vector] or (None,) * 3)
            ]
            time = "" if row["gps_time"] is None else f"{row['gps_time']:.6f}"
            first = [row["name"], row["pass"] or "", time, row["role"]]
            writer.writerow([*first, *numbers, str(row["used"]).lower(), row["reason"] or ""])
