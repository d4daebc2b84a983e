"""Rows compare like with like: what the POS erred by, and nothing else, is in a clean survey's."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.assemble import consistent, spread
from mlscorr.gap.channels import return_rate, roughness
from mlscorr.gap.pairing import build_rows, target_rows
from mlscorr.gap.patches import find_patches
from mlscorr.gap.rows import Rows, background
from mlscorr.io.las import read_chunks
from mlscorr.io.survey_file import read_survey
from mlscorr.pipeline.finding import find_targets
from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import PointCloud

ARRAYS = ("channel", "item", "gps_time", "position", "direction", "residual", "noise")


def write_reference(simulated, path, shift=(0.0, 0.0, 0.0), lost=0.25):
    "The scene as an OBJ in map coordinates, without a share of its triangles"
    rng = np.random.default_rng(8)
    triangles = simulated.scene.mesh.triangles
    triangles = triangles[rng.random(len(triangles)) >= lost]
    places = triangles.reshape(-1, 3) + np.array(simulated.scenario.origin) + shift
    lines = ["v {:.4f} {:.4f} {:.4f}".format(*place) for place in places]
    lines += [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(triangles))]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def simulated():
    "Two passes of eight seconds, there and back, with what a POS errs by in a street"
    scenario = Scenario(
        drive={
            "duration": 8.0,
            "speed": 6.0,
            "passes": [{}, {"direction": "back", "lateral": -3.0, "pause": 20.0}],
        },
        targets={"control": 4, "check": 2, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        pos={"outages": [[2.0, 5.0]], "processing": "filtered"},
    )
    return simulate(scenario, np.random.default_rng(3))


@pytest.fixture(scope="module")
def survey(simulated, tmp_path_factory):
    folder = tmp_path_factory.mktemp("gap") / "survey"
    simulated.write(folder)
    write_reference(simulated, folder / "reference.obj")
    with (folder / "survey.toml").open("a") as file:
        file.write('\n[scene]\nreference = "reference.obj"\n')
    return read_survey(folder)


@pytest.fixture(scope="module")
def targets(survey):
    found = find_targets(survey)
    matches, candidates = found.matches, found.candidates
    return matches.matched, candidates


@pytest.fixture(scope="module")
def pairing(survey, targets):
    return build_rows(survey, *targets)


@pytest.fixture(scope="module")
def patches(survey):
    return find_patches(survey)


def pos_error(simulated, gps_time):
    "Recorded minus true pose at times (m,): position (m) and rotation about map axes (rad)"
    recorded, true = simulated.trajectory.at(gps_time), simulated.true_trajectory.at(gps_time)
    turn = (recorded.attitude * true.attitude.inv()).as_rotvec()
    return np.hstack([recorded.position - true.position, turn])


@pytest.mark.parametrize("channel, limit", [("target", 6e-3), ("surface", 3e-3), ("shared", 3e-3)])
def test_the_pos_error_explains_all_of_a_clean_survey(simulated, pairing, channel, limit):
    "Residuals less the partials times the true POS error are millimetres, however large it is"
    rows = pairing.rows.select(pairing.rows.channel == channel)
    explained = np.sum(rows.partials * pos_error(simulated, rows.gps_time), axis=1)
    two = rows.two_times
    assert two.all() if channel == "shared" else not two.any()
    second = pos_error(simulated, rows.gps_time_2[two])
    explained[two] += np.sum(rows.partials_2[two] * second, axis=1)
    left = rows.residual - explained
    assert len(rows) >= (12 if channel == "target" else 100)
    assert np.std(rows.residual) > 0.012  # the POS error
    assert np.sqrt(np.mean(left**2)) < limit
    sigma = np.sqrt(rows.noise + rows.survey)
    assert np.median(np.abs(left) / sigma) < 1.5


def test_check_points_are_kept_apart(survey, pairing):
    "Rows that the diagnosis may use hold control points alone, the others are check rows"
    surveyed = np.array(pairing.rows.targets.name)
    used = surveyed[pairing.rows.survey_item[pairing.rows.survey_item >= 0]]
    held_out = surveyed[pairing.check.survey_item]
    assert set(used) <= set(survey.control.name)
    assert len(held_out) and set(held_out) <= set(survey.check.name)
    assert (pairing.check.channel == "target").all()


def test_residuals_of_targets_are_minus_the_misclosure(survey, targets):
    "Observed - surveyed, in axes in which the extraction's noise is independent"
    matched, candidates = targets
    matched = replace(matched, covariance=matched.covariance + 4e-6 * skewed(len(matched)))
    rows = target_rows(survey, matched, candidates)
    axes = rows.direction.reshape(-1, 3, 3)
    surveyed = rows.targets.position[rows.survey_item[::3]]
    back = np.einsum("nij,ni->nj", axes, rows.residual.reshape(-1, 3))
    np.testing.assert_allclose(back, matched.position - surveyed, atol=1e-9)
    covariance = np.einsum("nij,ni,nik->njk", axes, rows.noise.reshape(-1, 3), axes)
    np.testing.assert_allclose(covariance, matched.covariance, atol=1e-12)
    np.testing.assert_array_equal(rows.covariates["axis"], np.tile([0, 1, 2], len(matched)))


def skewed(n):
    "A covariance that mixes the axes, (n, 3, 3)"
    return np.tile([[2.0, 0.5, 0.1], [0.5, 1.0, 0.0], [0.1, 0.0, 0.5]], (n, 1, 1))


def test_passes_share_the_survey_error_of_a_target(survey, pairing):
    "The rows' survey covariance is that of the surveyed points, the same in both passes"
    rows = pairing.rows.select(pairing.rows.channel == "target")
    design = rows.survey_design()
    covariance = (design @ design.T).toarray()
    np.testing.assert_allclose(np.diag(covariance), rows.survey, atol=1e-15)
    one, two = np.triu_indices(len(rows), 1)
    same = rows.survey_item[one] == rows.survey_item[two]
    assert not covariance[one[~same], two[~same]].any()
    sigma = rows.targets.sigma[rows.survey_item]
    wanted = np.sum(rows.direction[one] * sigma[one] ** 2 * rows.direction[two], axis=1)
    np.testing.assert_allclose(covariance[one[same], two[same]], wanted[same], atol=1e-15)


def test_roughness_is_what_the_scanner_is_believed_to_make(survey, targets, pairing):
    "With the right belief the median ratio is 1 within 3 %; with half the noise it is near 4"
    rows = pairing.rows.select(pairing.rows.channel == "roughness")
    assert np.median(rows.residual) == pytest.approx(0.0, abs=0.03)
    scatter = 1.4826 * np.median(np.abs(rows.residual - np.median(rows.residual)))
    assert scatter == pytest.approx(np.sqrt(np.median(rows.noise)), rel=0.25)
    noise = survey.scanner.range_noise / 2
    quieter = replace(survey, scanner=replace(survey.scanner, range_noise=noise), reference=None)
    again = build_rows(quieter, *no_targets(targets)).rows
    again = again.residual[again.channel == "roughness"]
    assert np.median(again) == pytest.approx(np.log(4.0), abs=0.1)


def test_what_is_curved_does_not_count_as_noisy(survey):
    "Waves of 1 cm height and 0.6 m length are not told as roughness, noise of 1 cm is"

    def waves(chunk, rng):
        return 0.01 * np.sin(chunk.xyz[:, :2].sum(axis=1) * 2 * np.pi / 0.8)

    def noise(chunk, rng):
        return rng.normal(0.0, 0.01, len(chunk))

    told = []
    for disturbance in (waves, noise):
        rng = np.random.default_rng(6)

        def chunks(file, disturbance=disturbance, rng=rng):
            for chunk in read_chunks(file):
                up = disturbance(chunk, rng)[:, None] * np.array([0.0, 0.0, 1.0])
                yield replace(chunk, xyz=chunk.xyz + up)

        found = find_patches(survey, chunks=chunks)
        road = found.normal[:, 2] > 0.9
        told.append(roughness(survey, found[road])[3].mean())
    assert told[0] < 0.2 and told[1] > 0.85


def no_targets(targets):
    "No matched target, and what find_targets read"
    return targets[0][np.zeros(len(targets[0]), dtype=bool)], targets[1]


def thinned(keep):
    "A reader of clouds that keeps some points: keep(n) gives (n,) bool"

    def chunks(file):
        for chunk in read_chunks(file):
            yield chunk[keep(len(chunk))]

    return chunks


def test_lost_returns_are_told_from_a_thinned_cloud(survey, pairing):
    "No loss is 0; a loss of 8 % is found to 1 %; every third point, or 1 of 4, is a delivery"
    rate = pairing.rows.channel == "return_rate"
    assert rate.sum() > 100
    assert np.abs(pairing.rows.residual[rate]).max() < 0.02
    rng = np.random.default_rng(2)
    lossy = find_patches(survey, chunks=thinned(lambda n: rng.random(n) >= 0.08))
    share, _, told = return_rate(lossy)
    assert share[told].mean() == pytest.approx(-0.08, abs=0.01)
    third = find_patches(survey, chunks=thinned(lambda n: np.arange(n) % 3 == 0))
    share, _, told = return_rate(third)
    assert np.median(share[told]) == 0.0
    quarter = find_patches(survey, chunks=thinned(lambda n: rng.random(n) < 0.25))
    assert not return_rate(quarter)[2].any()


@pytest.mark.parametrize(
    "shift, what",
    [((0.0, 0.0, 100.0), "height datum"), ((900.0, -400.0, 0.0), "another CRS or place")],
)
def test_a_reference_in_other_coordinates_is_refused(
    simulated, survey, targets, tmp_path, shift, what
):
    "A datum gap of 100 m, or another place, is bad input and named as such"
    write_reference(simulated, tmp_path / "reference.obj", shift, lost=0.0)
    elsewhere = replace(survey, reference=tmp_path / "reference.obj")
    with pytest.raises(ValueError, match=what):
        build_rows(elsewhere, *targets)


def test_without_mounting_or_reference_targets_and_planes_remain(survey, targets):
    "Targets and shared planes need no mounting; what can't be compared is told"
    pairing = build_rows(replace(survey, mounting=None, reference=None), *targets)
    assert {"target", "shared"} <= set(pairing.rows.channel)
    assert "surface" not in pairing.rows.channel
    assert any("reference" in note for note in pairing.notes)
    assert np.isfinite(pairing.rows.residual).all()
    assert np.isnan(pairing.rows.pulses.scanner_xyz).all()


def test_the_number_of_patches_is_bounded_and_spread(survey, targets):
    "Fifty patches are fifty, from all of the time, and the same each time"
    pairings = [build_rows(survey, *targets, patches=50).rows for _ in range(2)]
    for name in ARRAYS:
        np.testing.assert_array_equal(*(getattr(rows, name) for rows in pairings))
    surface = pairings[0].select(pairings[0].channel == "surface")
    assert len(surface) == 50
    time = surface.covariates["time"]
    span = survey.trajectory.gps_time[-1] - survey.trajectory.gps_time[0]
    assert time.min() < 2.0 and time.max() > span - 2.0


def test_little_memory_is_enough_for_any_cloud(survey):
    "A pool of 200 patches holds no more, with the same blocks of ground in both passes"
    few = find_patches(survey, pool=200)
    assert 20 <= len(few) <= 200
    assert set(np.unique(few.pass_number)) == {1, 2}


def test_patches_do_not_depend_on_the_order_of_points(survey, patches):
    "Points in another order give the same planes; only the pulses between them are not told"
    rng = np.random.default_rng(1)
    mixed = find_patches(
        survey, chunks=lambda file: (c[rng.permutation(len(c))] for c in read_chunks(file))
    )
    assert len(mixed) == len(patches)
    for name in ("centre", "variance"):
        one, two = (np.sort(getattr(p, name), axis=0) for p in (mixed, patches))
        np.testing.assert_allclose(one, two, rtol=1e-6, atol=1e-7)


def test_rows_join_and_part_without_mixing_items(pairing):
    "Joined with itself, a set of rows has twice the items, each with its own pulses"
    rows = pairing.rows
    twice = Rows.concatenate([rows, rows])
    assert len(np.unique(twice.item)) == 2 * len(np.unique(rows.item))
    last = twice.select(np.arange(len(rows), 2 * len(rows)))
    np.testing.assert_array_equal(last.residual, rows.residual)
    np.testing.assert_allclose(last.pulses.xyz.sum(), rows.pulses.xyz.sum())


def test_the_background_has_a_leg_for_each_time(survey, pairing):
    "A target's drift sigma along its axis is the POS's own; shared planes have two legs"
    rows = pairing.rows
    legs = background(rows, survey)
    assert len(legs.row) == rows.metric.sum() + rows.two_times.sum()
    first = np.flatnonzero(rows.channel == "target")[0]
    leg = np.flatnonzero(legs.row == first)
    assert len(leg) == 1
    sigma = survey.trajectory.at(rows.gps_time[[first]]).position_sigma[0]
    total = np.sum(legs.drift[leg] ** 2 + legs.jitter[leg] ** 2)
    assert total == pytest.approx(np.sum((rows.direction[first] * sigma) ** 2))


def test_odd_surfaces_are_left_out_but_no_shift():
    "A shift of half a metre along any normal stays; a car 10 cm before its wall goes"
    rng = np.random.default_rng(0)
    normal = rng.standard_normal((60, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    time = 413_200.0 + rng.uniform(0, 4, 60)
    residual = normal @ [0.5, -0.3, 0.2] + rng.normal(0, 0.003, 60)
    residual[:6] += 0.10
    agree = consistent(time, normal, residual)
    assert not agree[:6].any() and agree[6:].all()


def test_a_choice_is_spread_over_each_covariate():
    "Of 1000 things of which 20 are rare, 100 chosen hold at least ten of the rare ones"
    rng = np.random.default_rng(0)
    rare = np.zeros(1000)
    rare[:20] = 1.0
    chosen = spread([rng.random(1000), rare], 100, rng)
    assert len(chosen) == 100 and (chosen < 20).sum() >= 10


def test_there_must_be_something_to_compare(survey, targets):
    "A cloud without planes and targets is refused, with the way out"
    empty = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))
    assert find_patches(survey, chunks=lambda file: [empty]) is None
    with pytest.raises(ValueError, match="Survey targets, or give a"):
        build_rows(survey, *no_targets(targets), patches=0)
