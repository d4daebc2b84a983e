"""A whole correction with all that other programs can be given."""

import hashlib
import json
import shutil
import sqlite3
from contextlib import closing

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from mlscorr.cli import app

OPTIONS = "--targets t.gpkg --targets t.geojson --trajectory d.gpkg --trajectory d.sbet".split()
POINTS = "--displacement --provenance --sigma --no-report --json".split()


@pytest.mark.long
def test_all_outputs_for_others_stand_in_the_folder(street, tmp_path):
    "Each is named in report.json; points come back; the VLR's hash is that of the inputs"
    folder = shutil.copytree(street, tmp_path / "survey")
    out = tmp_path / "out"
    arguments = ["correct", str(folder), "-o", str(out), *OPTIONS, *POINTS]
    ended = CliRunner().invoke(app, arguments)
    assert ended.exit_code == 0, ended.stderr
    report = json.loads(ended.stdout)
    named = {row["name"] for row in report["outputs"]}
    assert {"t.gpkg", "t.geojson", "d.gpkg", "d.sbet", "smrmsg_d.out"} <= named
    with closing(sqlite3.connect(out / "t.gpkg")) as package:
        rows = package.execute("SELECT name, kind, role FROM targets ORDER BY name").fetchall()
    assert [row[0] for row in rows] == sorted(row["name"] for row in report["targets"])
    assert all(kind in ("circle", "square") for _, kind, _ in rows)
    assert np.fromfile(out / "d.sbet", "<f8").reshape(-1, 17)[:, 4:7].any()
    source = laspy.read(folder / "pass-1.laz")
    las = laspy.read(out / "pass-1.laz")
    for axis, name in zip("XYZ", ("easting", "northing", "height"), strict=True):
        raw = las.points.array[f"displacement_{name}"]
        assert raw.any() and np.array_equal(las[axis] - raw, source[axis])
    (vlr,) = [v for v in las.header.vlrs if (v.user_id, v.record_id) == ("mlscorr", 1)]
    stated = json.loads(vlr.record_data)
    assert las.header.generating_software == f"mlscorr {stated['version']}"
    lines = sorted(f"{row['name']}\n{row['sha256']}" for row in report["inputs"])
    text = "".join("{1}  {0}\n".format(*line.split("\n")) for line in lines)
    assert stated["inputs_sha256"] == hashlib.sha256(text.encode()).hexdigest()
    settings = json.dumps(stated["settings"], sort_keys=True)
    assert stated["settings_sha256"] == hashlib.sha256(settings.encode()).hexdigest()
