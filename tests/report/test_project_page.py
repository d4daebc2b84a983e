"""The map of a project: names of drives that can be read."""

import numpy as np

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
