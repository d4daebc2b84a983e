"""The page of a project: names of drives that can be read, and a row for each drive."""

import numpy as np

from mlscorr.report import write_project
from mlscorr.report.project_page import project_map


def test_names_of_drives_from_one_yard_do_not_cover_one_another():
    "Twelve drives that leave from one place are named half way; names in the way are left out"
    way = np.linspace(0.0, 1000.0, 50)  # m
    tracks = {
        f"drive-{k:02d}": np.column_stack(
            [5e5 + way * np.cos(0.1 * k), 5.5e6 + way * np.sin(0.1 * k), 0.01 + 1e-5 * way]
        )
        for k in range(12)
    }
    tracks["drive-00"][::7] = np.nan  # gaps
    figure = project_map(tracks)
    figure.draw_without_rendering()
    names = [text for text in figure.axes[0].texts if text.get_text().startswith("drive-")]
    boxes = [text.get_window_extent() for text in names]
    assert 6 < len(names) <= 12
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_labels_of_a_project_that_runs_north_do_not_touch():
    "Six kilometres of one avenue: the map is widened until its eastings can be read"
    way = np.linspace(0.0, 6000.0, 50)  # m
    track = np.column_stack([532_000.0 + 0.01 * way, 3_374_000.0 + way, 0.01 + 1e-6 * way])
    figure = project_map({"monday": track})
    figure.draw_without_rendering()
    labels = [label for label in figure.axes[0].get_xticklabels() if label.get_text()]
    boxes = [label.get_window_extent() for label in labels]
    assert len(boxes) >= 2
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_a_drive_without_result_and_the_misfit_of_ties_stand_in_the_table(tmp_path):
    "A drive of which nothing could be corrected has a row, a tied one says 0.412 to 0.021 m"
    counts = {"n_surveyed": 0, "n_seen": 0, "n_scored": 0}
    ties = {"friday": {"n": 31, "before": 0.4123, "after": 0.0214}}
    row = {
        "name": "monday",
        "state": "tied",
        "tied_with": ties,
        "meaning": "held by others",
        "rating": "green",
        "files": 2,
        "points": 10,
        "control": counts,
        "check": counts,
        "tested_by": None,
        "before": None,
        "after": None,
        "position_sigma": None,
        "metres_extrapolated": 0.0,
        "headline": "",
    }
    fault = {"drive": "sunday", "name": "a.laz", "stage": "find", "fault": "a.laz ends"}
    document = {
        "name": "city",
        "crs": "EPSG:25832",
        "headline": "1 drive",
        "rating": "amber",
        "statements": [],
        "drives": [row],
        "faults": [fault, fault | {"name": "b.laz"}, fault | {"drive": "monday"}],
    }
    write_project(tmp_path / "project.html", document, {})
    text = (tmp_path / "project.html").read_text(encoding="utf-8")
    assert "friday (31: 0.412 to 0.021)" in text
    assert text.count('<th scope="row">sunday</th>') == 1
    assert "not corrected: see Failures (2)" in text
    assert text.count('<th scope="row">') == 2
