"""Drives estimated together: at other times, at the same time, and with nothing in common."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.io.store import TaskStore
from mlscorr.io.surveys import read_project
from mlscorr.io.trajectories import WEEK
from mlscorr.pipeline.file_finding import find_in_file
from mlscorr.pipeline.project.areas import areas_of, margin_of, pieces_of, places_each_second
from mlscorr.pipeline.project.city import drives_by_areas, project_drives
from mlscorr.pipeline.project.corrected import found_drive
from mlscorr.pipeline.project.engine import engine
from mlscorr.pipeline.project.joint import distinct_times
from mlscorr.pipeline.project.running import Run
from mlscorr.pipeline.project.stages import area_tasks
from tests.beds import project_street as bed

pytestmark = pytest.mark.long

ORIGIN = np.array([*bed.PLACE, 0.0])
AWAY = np.array([5000.0, 0.0, 0.0])  # m
ABOVE = np.array([0.0, 0.0, 60.0])  # m


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    "FoundDrives of the first drive, with control, and of the second, off and without it"
    project = read_project(bed.write_project(tmp_path_factory.mktemp("city"), duration=5.0))
    found = []
    for drive in project.drives:
        read = [drive.parts.cloud_file(path) for path in drive.parts.files.clouds]
        survey = replace(drive.parts.survey(read), control=project.control, check=project.check)
        found.append(found_drive(survey, [find_in_file(survey, ORIGIN)]))
    return found


def results(drives):
    "CorrectedSurvey and DriveState of each drive by its name"
    parted = project_drives(drives, 1, ORIGIN, True)
    return {state.name: (corrected, state) for corrected, state in parted}


@pytest.fixture(scope="module")
def together(drives):
    "Results of both drives as they are"
    return results(drives)


def elsewhere(drive, seconds=0.0, way=bed.SHIFT * 0):
    "A FoundDrive without control, at another time and place"
    trajectory = drive.survey.trajectory
    features = drive.features
    survey = replace(
        drive.survey,
        trajectory=replace(
            trajectory,
            gps_time=trajectory.gps_time + seconds,
            position=trajectory.position + way,
        ),
    )
    moved = replace(features, gps_time=features.gps_time + seconds, centre=features.centre + way)
    return replace(drive, survey=survey, features=moved)


def added(corrected):
    "Increment of the correction to the position (n, 3). Units: m"
    return corrected.trajectory.position - corrected.survey.trajectory.position


def test_a_drive_without_control_comes_to_that_with_it(together):
    "43 cm off, it is within 3 cm of the truth, and its sigma says so"
    corrected, state = together["second"]
    assert state.state == "tied" and list(state.tied_with) == ["first"]
    left = np.linalg.norm(added(corrected) + bed.SHIFT, axis=1)
    assert left.max() < 0.03
    assert left.max() < 3.5 * np.linalg.norm(corrected.trajectory.position_sigma, axis=1).max()
    assert "nothing" not in corrected.estimate.untied
    assert corrected.tie_section["n"] == 0 and "with first" in corrected.tie_section["reason"]


def test_times_of_a_drive_stay_its_own(together, drives):
    "Trajectory, targets, support and ties of each drive lie within its own times"
    for drive in drives:
        corrected, _ = together[drive.survey.name]
        first, last = drive.survey.trajectory.gps_time[[0, -1]]
        times = [row.gps_time for row in corrected.targets if row.gps_time is not None]
        times += [
            t
            for interval in corrected.estimate.support.weak
            for t in (interval.start, interval.end)
        ]
        times += [*corrected.estimate.span, *(place.gps_time for place in corrected.next_control)]
        assert all(first <= time <= last for time in times)
        assert corrected.estimate.guards.gap[1] <= last
        assert all(interval.chainage >= 0 for interval in corrected.estimate.support.weak)


def test_two_vehicles_may_drive_at_the_same_time(drives, together):
    "Times that both share are told apart inside, and the correction is that of distinct times"
    first, second = drives
    begin = [drive.survey.trajectory.gps_time[0] for drive in drives]
    at_once = results([first, elsewhere(second, begin[0] - begin[1])])
    for name in ("first", "second"):
        apart = added(at_once[name][0]) - added(together[name][0])
        assert np.abs(apart).max() < 0.002
    spans = [drive.survey.trajectory for drive in (first, elsewhere(second, begin[0] - begin[1]))]
    assert distinct_times(spans).tolist() == [0.0, WEEK]
    assert distinct_times([drive.survey.trajectory for drive in drives]).tolist() == [0.0, 0.0]


def test_a_long_drive_is_cut_as_many_drives_are(drives, together):
    "By areas the first drive alone is within 3 cm of what it is as a whole, with a shift in each"
    parted = drives_by_areas(drives[:1], cut(drives), 1, ORIGIN)
    ((corrected, state),) = parted
    assert state.state == "controlled" and not state.tied_with
    change = np.linalg.norm(added(corrected) - added(together["first"][0]), axis=1)
    assert change.max() < 0.03  # m


@pytest.fixture(scope="module")
def by_areas(drives):
    "Results of both drives by two areas, cut in the middle of the street"
    areas = cut(drives)
    parted = drives_by_areas(drives, areas, 1, ORIGIN)
    return areas, {state.name: (corrected, state) for corrected, state in parted}


def cut(drives):
    "Two areas with margins of 4 m"
    places = np.vstack([drive.features.centre for drive in drives])
    assert 20.0 < margin_of(drives) < 200.0  # m, of 10 s of driving: wider than half of this street
    areas = areas_of(places, int(0.8 * len(places)), 4.0)
    assert len(areas) == 2
    return areas


def test_areas_give_what_all_give_together(drives, together, by_areas):
    "Cut in two, a street is corrected as whole, within its sigmas and 3 cm, and nothing jumps"
    for drive in drives:
        whole, (parted, state) = together[drive.survey.name], by_areas[1][drive.survey.name]
        change = added(parted) - added(whole[0])
        assert np.linalg.norm(change, axis=1).max() < 0.03  # m
        sigma = [c.trajectory.position_sigma for c in (parted, whole[0])]
        assert (np.abs(change) < 3 * sigma[0]).all()
        assert 0.95 < sigma[0].mean() / sigma[1].mean() < 3
        assert np.linalg.norm(np.diff(added(parted), axis=0), axis=1).max() < 0.002  # m
        assert state.state == whole[1].state
        assert parted.estimate.used.tolist() == whole[0].estimate.used.tolist()
        assert {test.name for test in parted.estimate.tests} == set(drive.control.name)
        assert np.isfinite(parted.estimate.left_out).any() == bool(len(drive.control))


def test_two_visits_move_alike_across_an_edge(together, by_areas):
    "Both drives are no farther apart in a place than by one estimate of all, but for 5 mm"

    def apart(results):
        (first, _), (second, _) = results["first"], results["second"]
        place = [c.survey.trajectory.position[:, :2] for c in (first, second)]
        away = np.linalg.norm(place[0][:, None] - place[1], axis=2)
        left = added(first) - (added(second) + bed.SHIFT)[away.argmin(axis=1)]
        return np.linalg.norm(left[away.min(axis=1) < 3.0], axis=1)

    whole = apart(together)
    parted = apart(by_areas[1])
    assert parted.max() < whole.max() + 0.005  # m


def test_areas_are_tasks_of_workers(drives, by_areas, tmp_path):
    "By two workers each area is estimated to the same bytes, and a second run finds them done"
    store = TaskStore(tmp_path)
    ended = []
    with engine(2, None) as workers:
        run = Run(store, workers, ended.append)

        def work(areas):
            return list(run.results(area_tasks(store, "key", areas)).values())

        for _ in range(2):
            parted = drives_by_areas(drives, by_areas[0], 1, ORIGIN, work)
            for corrected, state in parted:
                assert np.array_equal(added(corrected), added(by_areas[1][state.name][0]))
                assert state == by_areas[1][state.name][1]
    assert [outcome.seconds > 0 for outcome in ended] == [True, True, False, False]
    assert not run.faults


def test_ties_of_areas_count_once(together, by_areas):
    "The ties of all areas are as many as those of the whole to a fifth, and name their drive"
    whole, parted = (part["second"][1].tied_with["first"] for part in (together, by_areas[1]))
    assert parted["n"] == pytest.approx(whole["n"], rel=0.2)
    assert parted["before"] == pytest.approx(whole["before"], rel=0.1)
    assert parted["after"] < 0.02  # m
    for results_of in (together, by_areas[1]):
        corrected = results_of["second"][0]
        notes = *corrected.survey.notes, corrected.estimate.untied
        assert sum("with first" in note for note in notes) == 1


def test_pieces_hold_what_lies_in_their_area(drives):
    "Epochs, control and planes of a piece lie in its area or margin, and all have one at least"
    areas = cut(drives)
    for drive in drives:
        pieces = [piece for area in areas for piece in pieces_of([drive], area)]
        assert np.sum([piece.rows for piece in pieces], axis=0).min() >= 1
        held = sum(len(piece.drive.features) for piece in pieces)
        assert len(drive.features) <= held < 2 * len(drive.features)
        for area, piece in zip(areas, pieces, strict=True):
            weight = area.weight(piece.drive.survey.trajectory.position)
            assert (weight[1:-1] > 0).all() and piece.rows.sum() == len(weight)
            assert piece.control.sum() == len(piece.drive.control)


def test_an_area_where_nothing_was_seen_corrects_nothing(drives):
    "Without planes and control a drive through two areas stays as it is, and that is said"
    drive = drives[1]
    areas = cut(drives)
    bare = replace(drive, features=drive.features[[]])
    ((corrected, state),) = drives_by_areas([bare], areas, 1, ORIGIN)
    assert state.state == "uncorrected" and np.abs(added(corrected)).max() < 1e-9
    assert {interval.why for interval in corrected.held[1].weak} == {"pass without control point"}


def test_nothing_corrects_a_drive_elsewhere(drives):
    "Without control and overlap a drive stays as it is, and that is said; the other is by itself"
    first, second = drives
    apart = results([first, elsewhere(second, way=AWAY)])
    corrected, state = apart["second"]
    assert state.state == "uncorrected" and not state.tied_with
    assert np.abs(added(corrected)).max() < 1e-9
    assert {interval.why for interval in corrected.held[1].weak} == {"pass without control point"}
    alone = results([first])["first"][0]
    assert np.array_equal(added(apart["first"][0]), added(alone))
    assert apart["first"][1].state == "controlled"


def test_a_drive_that_nothing_ties_leaves_the_others_as_they_are(drives, together):
    "60 m above them a third one is uncorrected, and changes both others by 2 mm at most"
    first, second = drives
    third = elsewhere(second, 3600.0, ABOVE)
    third = replace(third, survey=replace(third.survey, name="third"))
    three = results([first, second, third])
    assert [three[name][1].state for name in ("first", "second", "third")] == [
        "controlled",
        "tied",
        "uncorrected",
    ]
    assert np.abs(added(three["third"][0])).max() < 1e-9
    for name in ("first", "second"):
        assert np.abs(added(three[name][0]) - added(together[name][0])).max() < 0.002  # m
        assert three[name][1].tied_with.keys() == together[name][1].tied_with.keys()


def test_areas_count_time_and_not_what_was_seen(drives):
    "With a fifth of the planes there are as many seconds in the order of time, 5 or 6 of a drive"
    thin = [replace(drive, features=drive.features[::5]) for drive in drives]
    places = [places_each_second([drive]) for drive in drives]
    assert {len(places_each_second([drive])) for drive in thin} <= {5, 6}
    assert [len(part) for part in places] == [len(places_each_second([drive])) for drive in thin]
    np.testing.assert_array_equal(places_each_second(drives), np.vstack(places))


def test_passes_without_any_control_fit_to_one_another_only(drives):
    "Two drives that see each other, and no control: relative, and their misfit is gone"
    first, second = drives
    none = replace(first, control=first.control[[]], check=first.check[[]])
    _, state = results([none, second])["second"]
    assert state.state == "relative"
    ties = state.tied_with["first"]
    assert ties["after"] < ties["before"] / 5
