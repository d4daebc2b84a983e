"""The first screen of a correction's page: names, dates, numbers, the worst target, the map."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.evaluate import CheckSigmas
from mlscorr.report import recorded_time, well_determined
from mlscorr.report.cloud import CloudViews, viewer_data
from mlscorr.report.correction_page import write_report
from mlscorr.report.first_figures import locator_map, sigma_figure
from mlscorr.report.first_look import three_numbers, worst_target
from mlscorr.report.model_rows import MEANINGS, model_rows
from mlscorr.report.render import Picture
from mlscorr.report.render._views import View
from mlscorr.report.render.quantities import ColourScale, colour_scale
from mlscorr.report.render.view import Camera
from mlscorr.survey import ProjectNames
from tests.beds.reports import SPEED, drive, fabricate, page, words
from tests.beds.street_of_points import ORIGIN, street

NAMES = ProjectNames("Ring <road>", "City of Wuhan", "2024-017", "Scanner 7", "J. Meyer")


def viewed(folder, survey, correction, report):
    "A page with pictures of two panels and of each of the first three targets"
    rng = np.random.default_rng(3)

    def picture(name):
        camera = Camera.towards(ORIGIN, 0.0, 30.0, 100.0, (64, 48))
        sides = rng.integers(0, 256, (2, 48, 64, 3), dtype=np.uint8)
        view = View(name, name, "", camera, "intensity")
        return Picture(view, *sides, ColourScale(0.0, 1.0))

    names = ["overview", "section", *(f"target-{row.name}" for row in report.targets[:3])]
    scene = viewer_data(correction, street(20_000, rng), report.targets, report.targets)
    views = CloudViews(tuple(map(picture, names)), scene, 1)
    write_report(folder / "report.html", survey, correction, report, views)
    return (folder / "report.html").read_text(encoding="utf-8")


def test_the_date_is_known_where_a_cloud_states_the_week():
    "Seconds of week alone tell a day of the week; a cloud in standard time tells the date"
    survey, _, _ = fabricate(drive())
    unknown = recorded_time(survey)
    assert unknown["start"] is None
    assert unknown["text"].startswith("Thursday, 03:24:41 to 03:25:40 GPS time")
    week = 2300 * 604_800.0  # s
    cloud = replace(survey.clouds[0], time_system="standard", time_constant=1e9 - week)
    known = recorded_time(replace(survey, clouds=(cloud,)))
    assert (known["start"], known["end"]) == ("2024-02-08T03:24:41", "2024-02-08T03:25:41")
    later = replace(survey.trajectory, gps_time=survey.trajectory.gps_time + week - 1e9)
    assert recorded_time(replace(survey, trajectory=later))["start"] == known["start"]


def test_the_worst_check_point_comes_before_the_worst_control_point():
    "A control point with a larger residual is taken only where there is no check point"
    _, _, report = fabricate(drive())
    checks = [row for row in report.targets if row.role == "check"]
    control = [row for row in report.targets if row.role == "control"]
    control[2] = replace(control[2], left_out=np.array([0.5, 0.0, 0.0]))
    largest = max(checks, key=lambda row: np.linalg.norm(row.after))
    assert worst_target([*control, *checks]).name == largest.name
    assert worst_target(control).name == control[2].name
    assert worst_target([]) is None


def test_three_numbers_sum_a_correction_up():
    "RMSE of check points, control used of surveyed, and the share without poorly constrained parts"
    trajectory = drive(gap=(20.0, 31.0))
    _, correction, report = fabricate(trajectory)
    (rmse, what), (used, _), (share, _) = three_numbers(correction, report)
    before, after = report.check.before.rmse[4], report.check.after.rmse[4]
    assert rmse == f"{before:.3f} → {after:.3f} m" and "check points" in what
    assert used == "6 of 6"
    driven = SPEED * (60.0 - 11.0)  # m; nothing is driven within the gap
    expected = 1 - report.metres_extrapolated / driven
    assert abs(well_determined(correction, report) - expected) < 0.02
    assert share == f"{100 * well_determined(correction, report):.0f} %"


def test_the_page_is_headed_by_the_names_of_its_project(tmp_path):
    "Title, client, project, instrument and operator, before any verdict; they are text"
    survey, correction, report = fabricate(drive())
    html = page(tmp_path, replace(survey, project=NAMES), correction, report)
    first = html[: html.index('class="verdict')]
    assert "<h1>Ring &lt;road&gt;</h1>" in first
    for name in (*NAMES.known, *NAMES.known.values(), "EPSG:32650", "pass-1.laz", "Thursday"):
        assert name in words(first)
    assert "<h1>street</h1>" in page(tmp_path, survey, correction, report)


def test_rows_of_tables_lead_to_their_close_up_and_to_their_place(tmp_path):
    "Each target row has a link into the 3D view, and one to its close-up where it has one"
    survey, correction, report = fabricate(drive())
    html = viewed(tmp_path, survey, correction, report)
    table = html[html.index('id="residuals"') : html.index('id="model"')]
    for number, row in enumerate(report.targets, start=1):
        assert f'href="#turn" data-target="{row.name}"' in table
        assert (f'<a href="#close-up-{number}">{row.name}</a>' in table) == (number <= 3)
    assert html.count('id="close-up-') == 3
    assert html.count("data-place=") == len(report.support.weak)
    assert 'alt="Worst target, before the correction"' in html  # T03, the worst check point
    assert '<input type="range" min="0" max="100" step="1" value="50"' in html


def test_every_parameter_of_the_model_has_a_meaning_and_its_unit(commanded):
    "None of a real correction's model is left without words"
    from json import loads

    report = loads((commanded[1] / "report.json").read_text(encoding="utf-8"))
    tables = ("outliers", "warnings", "alternatives", "orders", "tests")
    model = {key: value for key, value in report["model"].items() if key not in tables}
    rows = model_rows(model)
    assert [row.name for row in rows if not row.meaning] == []
    assert {row.unit for row in rows} == {"", "1", "s"}
    assert {"project", "recorded", "check_sigmas", "well_determined"} <= set(report)
    assert len(MEANINGS) == len({name for name, _, _ in MEANINGS.values()})


def test_the_darker_picture_shows_structure_by_the_scale_of_both():
    "Centimeters beside decimeters: the medians of both lie well within the scale, its ends hold"
    rng = np.random.default_rng(4)
    before, after = rng.uniform(0.2, 0.6, 5000), rng.uniform(0.005, 0.02, 5000)  # m
    scale = colour_scale("correction", before, after)
    assert 0.3 < np.median(scale.share(after)) < np.median(scale.share(before)) < 0.95
    assert np.ptp(scale.share(after)) > 0.1 and np.ptp(scale.share(before)) > 0.1
    assert scale.low == 0.0 and abs(scale.high - 0.6) < 0.01
    assert scale.share(np.array([scale.middle]))[0] == pytest.approx(0.5)
    even = colour_scale("correction", rng.uniform(0.3, 0.6, 5000), rng.uniform(0.3, 0.6, 5000))
    assert even.exponent == 1.0


def test_the_small_map_holds_every_target_and_rings_the_worst():
    "All that was observed lies within its axes"
    _, correction, report = fabricate(drive())
    figure = locator_map(correction, report, report.targets[2])
    (axes,) = figure.axes
    for row in report.targets:
        for value, ends in zip(row.surveyed[:2], (axes.get_xlim(), axes.get_ylim()), strict=True):
            assert ends[0] < value < ends[1]
    assert "T03" in [text.get_text() for text in axes.texts]


def test_the_test_of_sigmas_stands_in_words_and_as_a_figure(tmp_path):
    "Sigmas that are half of the truth are said to be too small; bars count every residual"
    sigma = np.full((30, 3), 0.01)
    residuals = np.random.default_rng(5).normal(0, 2 * sigma)
    sigmas = CheckSigmas.of(residuals, sigma, 30)
    survey, correction, report = fabricate(drive())
    html = page(tmp_path, survey, correction, replace(report, check_sigmas=sigmas))
    text = words(html)
    assert "exceed their stated sigmas: chi-squared" in text and "too small by a factor" in text
    (axes,) = sigma_figure(sigmas.z).axes
    assert sum(bar.get_height() for bar in axes.patches) == 90
    assert 'id="sigmas"' not in page(tmp_path, survey, correction, report)
