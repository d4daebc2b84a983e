"""Results: a folder that appears whole or not at all, and JSON documents."""

import csv
import json
import math
import os
import shutil
import tempfile
from contextlib import contextmanager
from pathlib import Path

PART = ".part"  # ends the name of a folder that isn't whole yet


def check_output(out, inputs, overwrite=False):
    """Refuse an output folder that holds an input, holds anything without overwrite, or that
    can't be written.

    Raises ValueError; OSError when it can't be written.
    """
    out = Path(out)
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; the results need a folder. Choose another name.")
    for path in map(Path, inputs):
        # a link to an input counts where it stands and where it leads
        if out.resolve() in (path.resolve().parent, path.parent.resolve()):
            raise ValueError(
                f"The output folder {out} holds the input {path.name}, which must stay as it is. "
                "Choose another folder."
            )
    if out.is_dir() and not overwrite and (present := sorted(p.name for p in out.iterdir())):
        raise ValueError(
            f"The output folder {out} holds {len(present)} entries already (first: {present[0]}). "
            "Choose another folder, or allow with --overwrite that files of the same name are "
            "replaced."
        )
    _check_writable(out)


def _check_writable(out):
    """Make a folder where out will stand, and remove it: what can't be written is told early."""
    out = out.absolute()
    place = next(path for path in out.parents if path.exists())
    try:
        Path(tempfile.mkdtemp(suffix=PART, dir=place)).rmdir()
    except OSError as error:
        raise OSError(
            f"the output folder {out} can't be made, as {place} takes no folder "
            f"({error.strerror}). Choose another place."
        ) from None


@contextmanager
def output_folder(out):
    """A folder to write into, which takes the name out only when all went well.

    It stands beside out until then. Files of the same name in out are replaced, others stay.
    """
    out = Path(out).absolute()
    out.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=f".{out.name}.", suffix=PART, dir=out.parent))
    try:
        part.chmod(0o777 & ~_umask())
        yield part
        if out.exists():
            _move_into(out, part)
        else:
            os.replace(part, out)
    finally:
        _remove(part)


def _move_into(out, part):
    """Move the files of part into out; what they replace is put back when one can't be moved."""
    files = [path.relative_to(part) for path in sorted(part.rglob("*")) if path.is_file()]
    replaced, made = Path(tempfile.mkdtemp(dir=part)), []
    try:
        for file in files:
            if not (out / file).parent.exists():
                (out / file).parent.mkdir()
                made.append(file.parent)
            if (out / file).is_dir():
                raise IsADirectoryError(f"{out / file} is a folder, where a file belongs.")
            if (out / file).exists():
                (replaced / file).parent.mkdir(exist_ok=True)
                os.replace(out / file, replaced / file)
            os.replace(part / file, out / file)
    except BaseException:
        for file in files:
            if not (part / file).exists():
                (out / file).unlink(missing_ok=True)
            if (replaced / file).exists():
                os.replace(replaced / file, out / file)
        for folder in made:
            (out / folder).rmdir()
        raise


def _remove(folder):
    """Remove a folder, also when an impatient user interrupts once more."""
    while folder.exists():
        try:
            shutil.rmtree(folder, ignore_errors=True)
            return
        except KeyboardInterrupt:
            continue


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


def write_extracted_csv(path, targets):
    """Write the targets of targets.json as a table; sigmas are those of each axis, in m."""
    axes = ("easting", "northing", "height")
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = [*axes, *(f"sigma_{axis}" for axis in axes), "normal_e", "normal_n", "normal_h"]
        first = ("name", "pass", "gps_time", "kind", "size", "size_sigma")
        writer.writerow([*first, *names, "points", "score", "matched", "reason"])
        for row in targets:
            sigma = [math.sqrt(row["covariance"][axis][axis]) for axis in range(3)]
            numbers = [f"{value:.4f}" for value in (*row["observed"], *sigma, *row["normal"])]
            sizes = [f"{row[key]:.4f}" for key in ("size", "size_sigma")]
            head = [row["name"] or "", row["pass"], f"{row['gps_time']:.6f}", row["kind"], *sizes]
            last = [row["points"], f"{row['score']:.3f}", str(row["matched"]).lower()]
            writer.writerow([*head, *numbers, *last, row["reason"] or ""])
