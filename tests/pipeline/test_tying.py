"""From two passes in a file each to one street: ties that a correction finds by itself."""

import json
from dataclasses import replace

import numpy as np
import pytest

import mlscorr
from mlscorr.estimate import prior_correction
from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import Pos
from mlscorr.ties import tie_passes
from tests.beds import painted_roads as road_bed
from tests.beds import tie_streets as street_bed
from tests.beds.reports import words


@pytest.fixture(scope="module")
def survey(tmp_path_factory):
    "A street driven there and back, with an outage of 20 s on the way there, 4 control points"
    folder = tmp_path_factory.mktemp("tied")
    scenario = Scenario(
        drive={"duration": 30.0, "speed": 6.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 4, "check": 4},
        scanner=[{"lines_per_second": 75, "points_per_line": 300}],
        pos={"grade": "mems", "processing": "filtered", "outages": [[6.0, 18.0]]},
    )
    simulate(scenario, np.random.default_rng(5)).write(folder)
    return mlscorr.read_survey(folder)


@pytest.fixture(scope="module")
def tied(survey):
    return mlscorr.correct(survey)


def misfit(result):
    "Median size of the misclosures of used ties before and after. Units: m"
    ties = result.estimate.ties
    return (np.median(np.abs(values[ties.used])) for values in (ties.ties.misclosure, ties.after))


def test_passes_come_together(tied):
    "Planes that both passes saw are centimetres apart before, less than 5 mm after"
    before, after = misfit(tied)
    assert before > 0.02  # m
    assert after < 0.005  # m
    assert tied.estimate.ties.used.mean() > 0.9


@pytest.mark.long
def test_check_points_fit_no_worse(survey, tied):
    "With ties check points fit as well as without, to 2 mm, or better"
    alone = mlscorr.correct(survey, ties="off")
    assert alone.estimate.ties is None
    assert "not used, as requested" in alone.estimate.untied
    left = [np.linalg.norm(result.check["after"]["rmse"]) for result in (alone, tied)]
    assert left[1] < left[0] + 0.002  # m


@pytest.mark.long
def test_ties_alone_bring_passes_together(survey):
    "Without control all points are check points, passes agree, and all rests on the POS"
    with pytest.warns(UserWarning, match="relative only"):
        result = mlscorr.correct(survey, ties="only")
    assert result.control["n"] == 0
    assert result.check["n_surveyed"] == 8
    assert list(misfit(result))[1] < 0.005  # m


def test_another_use_of_ties_is_refused(survey):
    "A misspelt use is no silent default: what may be given is named"
    with pytest.raises(ValueError, match=r"ties = 'never' .* 'auto', 'off', 'only', or None"):
        mlscorr.correct(survey, ties="never")


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"order": 1.5}, "order of the trend is 1.5; it must be"),
        ({"order": None}, "order of the trend is None; it must be"),
        ({"rng": 5}, r"rng = '5' is not a random generator. .*numpy.random.default_rng\(seed\)"),
    ],
)
def test_what_is_no_order_and_no_generator_is_refused(survey, given, sentence):
    """An order between two, and a seed in place of a generator, end in a sentence."""
    with pytest.raises(ValueError, match=sentence):
        mlscorr.correct(survey, **given)


@pytest.mark.long
def test_the_report_tells_what_ties_did(tied, tmp_path):
    """report.json has misfits by pair of passes, and shares that add up to one; the page shows the
    ties on a map, and a wall as each pass saw it
    """
    section = tied.write(tmp_path / "out")["ties"]
    text = words((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
    assert "Tie features" in text
    assert "scanned in pass 1" in text and "scanned in pass 2" in text
    assert (tmp_path / "out" / "pictures" / "ties.png").exists()
    assert [row["passes"] for row in section["pairs"]] == [[1, 2]]
    assert section["pairs"][0]["after"]["median"] < 0.005  # m
    assert sum(section["share"].values()) == pytest.approx(1.0)
    assert 1 <= section["sufficient_control"] <= 4


@pytest.mark.long
def test_one_pass_has_no_ties(street):
    "A survey of one pass is corrected as without ties, and ties alone are refused in a sentence"
    survey = mlscorr.read_survey(street)
    result = mlscorr.correct(survey)
    assert result.estimate.ties is None
    with pytest.raises(ValueError, match=r"No two passes .* overlap"):
        mlscorr.correct(survey, ties="only")


def test_one_pass_is_named_as_the_reason_in_terminal_report_and_page(commanded):
    "Nothing was scanned twice: what that costs and what a second pass brings"
    process, out = commanded
    report = json.loads(process.stdout)
    assert report["ties"]["n"] == report["ties"]["used"] == 0
    reason = report["ties"]["reason"]
    assert reason.startswith("Passes hardly overlap") and "A second pass" in reason
    assert reason in report["notes"]
    assert reason in " ".join(process.stderr.split())
    assert reason in words((out / "report.html").read_text(encoding="utf-8"))


@pytest.mark.long
def test_one_pass_of_a_scanner_that_spins_is_tied_to_itself(tmp_path):
    "Things seen for seconds as it passes: ties of one visit, which agree to 6 mm"
    rings = np.linspace(-15.0, 15.0, 16).tolist()
    spinning = {"kind": "spinning", "rings": rings, "boresight": [-30.0, 0.0, 0.0]}
    scenario = Scenario(
        drive={"duration": 14.0, "speed": 6.0},
        targets={"control": 3, "check": 1},
        scanner=[{**spinning, "lines_per_second": 10.0, "points_per_line": 400}],
    )
    simulate(scenario, np.random.default_rng(5)).write(tmp_path)
    result = mlscorr.correct(mlscorr.read_survey(tmp_path))
    ties = result.estimate.ties
    assert ties.used.sum() > 50
    assert ties.ties.is_of_visit.all()
    _, after = misfit(result)
    assert after < 0.006  # m
    assert (ties.ties.pass_number == 1).all()


def tied_street(features):
    "The bed's street with some TieFeatures, under what its POS states"
    recorded = street_bed.survey()
    return tie_passes(recorded, prior_correction(recorded.trajectory), features)


def of_second(features, values):
    "Values (n, 3) at the features of the second pass, else zero"
    return np.where(features.pass_number[:, None] == 2, values, 0.0)


def test_passes_that_never_meet_are_named():
    "Streets 500 m apart: no tie, how many features were compared, and what would help; no warning"
    features = street_bed.features()
    apart = replace(features, centre=features.centre + of_second(features, [0.0, 500.0, 0.0]))
    estimate = tied_street(apart)
    assert estimate.ties is None
    number = f"0 of {len(features)} planes, poles and markings are within"
    assert f"hardly overlap: {number}" in estimate.untied
    assert estimate.untied not in estimate.warnings


def test_tiles_of_one_visit_are_not_blamed_for_having_no_ties():
    "One drive in two files, whose ends meet: nothing was scanned at another time"
    features = street_bed.features(1, 1)
    late = features.gps_time > np.median(features.gps_time)
    estimate = tied_street(replace(features, pass_number=1 + late))
    assert estimate.untied.startswith("Passes hardly overlap: 0 of")
    assert estimate.untied not in estimate.warnings


def test_passes_that_meet_and_agree_nowhere_are_warned_of():
    "Walls that the second pass saw from behind are no ties: a warning that names calibrate"
    features = street_bed.features()
    back = features.direction - of_second(features, 2 * features.direction)
    estimate = tied_street(replace(features, direction=back))
    assert estimate.ties is None
    assert estimate.untied.startswith("No overlapping features agree")
    assert "mlscorr calibrate" in estimate.untied
    assert estimate.untied in estimate.warnings


def test_a_tunnel_names_the_direction_that_nobody_holds():
    "Walls and road along the way, their normals noisy: east is unheld where a pass lacks control"
    features = street_bed.features()
    features = features[(np.abs(features.direction[:, 0]) < 0.1) & (features.kind == "plane")]
    estimate = tied_street(features)
    (sentence,) = [text for text in estimate.warnings if "unconstrained" in text]
    assert "E, N, H = 1.00" in sentence.replace("-", "")
    assert estimate.untied == ""


def apart_on_road(features, shift):
    "Residual shift (3,) between both passes of the painted road. Units: m"
    recorded = replace(road_bed.survey(), pos=Pos(position_sigma=0.1))
    start = prior_correction(recorded.trajectory, recorded.pos)
    correction = tie_passes(recorded, start, features).correction
    change = correction.corrected.position - recorded.trajectory.position
    back = recorded.trajectory.gps_time > road_bed.START + road_bed.PAUSE / 2
    return shift + np.median(change[back], axis=0) - np.median(change[~back], axis=0)


@pytest.mark.long
def test_paint_holds_passes_on_a_bare_road():
    """Passes 0.12 m apart along, across and up: the road alone tells the height, with paint 5 mm
    are left across and 15 mm along, where dashes are 9 m apart
    """
    shift = road_bed.turned(np.array([[0.12, -0.12, 0.12]]), 70.0)[0] - road_bed.ORIGIN
    features = road_bed.features(shift=shift)
    planes = features[features.kind == "plane"]
    bare, painted = (
        road_bed.along_and_left(road_bed.ORIGIN + apart_on_road(part, shift)[None])[0]
        for part in (planes, features)
    )
    assert np.abs(bare).min() > 0.05  # m
    assert np.abs(painted[0]) < 0.015  # m
    assert np.abs(painted[1]) < 0.005  # m


@pytest.mark.long
def test_ties_of_paint_are_counted(tmp_path):
    "Through files: lines and dashes of a painted street are in ties.json, and in what is printed"
    scenario = Scenario(
        scene={"markings": True, "cars": 0.0},
        drive={"duration": 8.0, "turns": 2.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 2, "check": 1},
        scanner=[{"lines_per_second": 75, "points_per_line": 1600}],
    )
    simulate(scenario, np.random.default_rng(4)).write(tmp_path / "survey")
    tied = mlscorr.find_ties(mlscorr.read_survey(tmp_path / "survey"))
    (pair,) = tied.write(tmp_path / "out")["pairs"]
    assert pair["lines"] > 20
    assert pair["dashes"] >= 3
    assert pair["n"] == pair["planes"] + 2 * pair["poles"] + pair["lines"] + pair["dashes"]
    assert "dashes" in tied._repr_html_()
