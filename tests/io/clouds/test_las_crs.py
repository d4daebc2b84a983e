"""The CRS that a file states: as WKT, as EPSG codes, in feet, or not at all."""

import re
import struct

import laspy
import numpy as np
import pytest

from mlscorr.io.clouds import cloud_box, crs_conflict, read_layout, stated_crs
from mlscorr.io.trajectories import crs_code, crs_name
from tests.beds.las_crs import add_crs
from tests.beds.shared import shared

PLACE = np.array([532_000.0, 3_374_000.0, 40.0])  # in UTM zone 50


def written(path, crs=None, keys=(), place=PLACE):
    "LasLayout of a file of two points, with its CRS as WKT or as GeoKeys"
    header = laspy.LasHeader(point_format=6 if crs else 1, version="1.4" if crs else "1.2")
    header.scales = [0.001] * 3
    header.offsets = place
    add_crs(header, crs)
    if keys:
        rows = [(1, 1, 0, len(keys)), *((key, 0, 1, value) for key, value in keys)]
        data = b"".join(struct.pack("<4H", *row) for row in rows)
        header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", data))
    las = laspy.LasData(header)
    las.xyz = np.add(place, [[0.0, 0.0, 0.0], [10.0, 20.0, 3.0]])
    las.write(path)
    return read_layout(path)


def test_wkt_and_codes_state_the_same(tmp_path):
    "A CRS in WKT and its number in GeoKeys give one code; a file without either states none"
    wkt = written(tmp_path / "a.las", "EPSG:32650")
    keys = written(tmp_path / "b.las", keys=[(3072, 32650), (3076, 9001)])
    for layout in (wkt, keys):
        assert crs_code(stated_crs(layout)) == "EPSG:32650"
        assert crs_conflict(layout, "EPSG:32650") == ""
    assert crs_name(stated_crs(keys)) == "EPSG:32650 (WGS 84 / UTM zone 50N)"
    assert stated_crs(written(tmp_path / "c.las")) is None
    assert stated_crs(written(tmp_path / "d.las", keys=[(3072, 32767)])) is None
    np.testing.assert_allclose(cloud_box(wkt) - PLACE, [[0, 0, 0], [10, 20, 3]], atol=1e-6)


@pytest.mark.parametrize(
    ("stated", "crs", "words"),
    [
        ("EPSG:32650", "EPSG:32649", "of the cloud .* km apart"),
        ("EPSG:32650+5773", "EPSG:32650+3855", "the height systems differ"),
        ("EPSG:2263", "EPSG:32618", "in US survey foot, and mlscorr needs meters"),
        ("EPSG:4326", "EPSG:32650", "in degree, and mlscorr needs meters"),
        ("EPSG:32650", "EPSG:32650+5773", None),
        ("EPSG:25832", "EPSG:32632", None),  # one place by both, as far as PROJ knows
    ],
)
def test_a_conflict_is_of_places_units_or_heights(stated, crs, words, tmp_path):
    "Names don't count: what puts the cloud elsewhere, or is not in metres, does"
    if stated == "EPSG:4326":
        place = np.array([40.0, 30.0, 5.0])
    else:
        place = PLACE
    sentence = crs_conflict(written(tmp_path / "a.las", stated, place=place), crs)
    if words is None:
        assert sentence == ""
    else:
        assert re.search(words, sentence)
        assert sentence.startswith("The VLRs of a.las state ")


def test_a_code_in_metres_with_a_unit_in_feet_is_in_feet():
    "A public file states NAD83 / Mississippi West in metres and coordinates in US survey feet"
    layout = read_layout(shared("data/las_samples/mvk-thin.las"))
    assert crs_code(stated_crs(layout)) == "EPSG:26995"
    assert "in US survey feet" in crs_conflict(layout, "EPSG:26995")


def test_a_crs_behind_the_points_is_seen(tmp_path):
    "LAS 1.4 may hold the WKT in an EVLR: it states the same as in a VLR"
    path = tmp_path / "a.las"
    written(path, "EPSG:2263")
    las = laspy.read(path)
    (vlr,) = las.header.vlrs.extract("WktCoordinateSystemVlr")
    las.evlrs = laspy.vlrs.vlrlist.VLRList([vlr])
    las.write(path)
    layout = read_layout(path)
    assert not list(layout.vlr_data(b"LASF_Projection", 2112))
    assert crs_code(stated_crs(layout)) == "EPSG:2263"
    assert "US survey foot" in crs_conflict(layout, "EPSG:32618")
