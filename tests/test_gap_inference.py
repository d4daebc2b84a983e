"""From rows to a verdict: the algebra against plain formulas, and surveys whose cause is known."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mlscorr.covariance import Covariance
from mlscorr.effects import EFFECTS, make_effect
from mlscorr.gap.background import (
    BELIEVED,
    Setting,
    epochs,
    settings,
)
from mlscorr.gap.causes import infer
from mlscorr.gap.changes import Bench
from mlscorr.gap.contaminated import contaminated
from mlscorr.gap.estimate import DETECTABLE
from mlscorr.gap.evidence import AMPLITUDES, USED, block_gain, evidence, novel, table
from mlscorr.gap.plan import additions, next_data
from mlscorr.gap.rows import background
from mlscorr.gap.separability import separability
from mlscorr.gap.signatures import signatures
from mlscorr.gap.tails import without_tails
from mlscorr.gap.unknown import unknown_blocks
from mlscorr.gap.verdict import compare, p_value, pairs, verdict
from mlscorr.gap.whitening import FIX_TIME, whitener

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@pytest.fixture(scope="module")
def study():
    "The feature-level study, whose geometries and drifts are used here"
    sys.path.insert(0, str(BENCHMARKS))
    module = importlib.import_module("gap_study")
    sys.path.remove(str(BENCHMARKS))
    return module


@pytest.fixture(scope="module")
def with_surface(study):
    "Two passes, 24 targets, 80 patches on a reference surface; signatures of all effects"
    g = study.geometry(3, targets=24, patches=80)
    return g, signatures(g.rows, g.survey)[0]


@pytest.fixture(scope="module")
def with_planes(study):
    "Two passes, 24 targets, 60 planes that both saw, no reference surface"
    g = study.geometry(4, targets=24, patches=60, shared=True)
    return g, signatures(g.rows, g.survey)[0]


def surveyed(study, g, seed, *effects, kind="sines", outside=None):
    "Rows of a survey with drift from no covariance function, and effects at finite size"
    rng = np.random.default_rng(seed)
    residual = study.errors(g, rng, kind)
    for effect in effects:
        change = Bench(g.rows, g.survey).change(effect, rng)
        residual += change.shift + np.log1p(change.growth)
    if outside is not None:
        residual += outside
    return replace(g.rows, residual=residual)


def named(rows, g, signs, replicas=0):
    "Verdict on rows"
    found = compare(rows, g.background, g.survey, signs, np.random.default_rng(0), replicas)
    return verdict(found, pairs(rows, signs, found))


def dense(g, setting):
    "V of all metric rows, written out"
    rows, m = g.rows, len(g.rows)
    bg, tau = g.background, setting.time * g.background.correlation_time
    lag = np.subtract.outer(bg.gps_time, bg.gps_time)
    smooth = Covariance(setting.family, tau)(lag)
    legs = setting.scale**2 * smooth * (bg.drift @ bg.drift.T + bg.attitude @ bg.attitude.T)
    short = Covariance("exponential", setting.jitter_time)(lag)
    legs += setting.scale**2 * short * (bg.jitter @ bg.jitter.T)
    first = np.arange(len(bg.row)) < rows.metric.sum()
    place = np.where(first[:, None], rows.partials[bg.row, :3], rows.partials_2[bg.row, :3])
    legs += setting.fixes**2 * Covariance("exponential", FIX_TIME)(lag) * (place @ place.T)
    sums = np.zeros((m, len(bg.row)))
    sums[bg.row, np.arange(len(bg.row))] = 1.0
    design = rows.survey_design().toarray()
    v = sums @ legs @ sums.T + design @ design.T + setting.noise**2 * np.diag(rows.noise)
    return v[np.ix_(rows.metric, rows.metric)]


@pytest.mark.parametrize("bed", ["with_surface", "with_planes"])
def test_whitens_as_the_covariance_written_out_does(bed, request):
    "Products c^T V^-1 c and log det V up to a constant, also for planes that were seen twice"
    g, signs = request.getfixturevalue(bed)
    observed = epochs(g.rows, g.background)
    columns = np.hstack([one.jacobian for one in signs[:8] if one.jacobian.any()])
    others = (BELIEVED, Setting(1.5, "exponential", 0.3, 1.0, 1.6, 0.01))
    determinants = []
    for setting in others:
        factor = whitener(observed, setting)
        white = factor.whiten(observed.columns(columns))
        v = dense(g, setting)
        plain = columns[g.rows.metric].T @ np.linalg.solve(v, columns[g.rows.metric])
        scale = np.sqrt(np.diag(plain))
        assert np.allclose(white.product(white) / np.outer(scale, scale),
                           plain / np.outer(scale, scale), atol=2e-3)  # fmt: skip
        determinants.append([factor.log_determinant, np.linalg.slogdet(v)[1]])
    fast, plain = np.diff(determinants, axis=0)[0]
    assert fast == pytest.approx(plain, abs=0.2)


def test_innovations_are_those_of_the_rows_in_their_order(with_surface):
    "u and sigma are the Cholesky factor's, each row against all earlier ones"
    g, _ = with_surface
    observed = epochs(g.rows, g.background)
    residual = np.random.default_rng(1).standard_normal((len(g.rows), 2))
    u, sigma = whitener(observed, BELIEVED).innovations(observed.columns(residual))
    place = np.searchsorted(np.flatnonzero(g.rows.metric), observed.row)
    lower = np.linalg.cholesky(dense(g, BELIEVED)[np.ix_(place, place)])
    assert np.allclose(sigma, np.diag(lower))
    assert np.allclose(u, np.linalg.solve(lower, residual[observed.row]))


def test_replicas_have_the_covariance_that_they_are_drawn_from(with_surface):
    "The mean of r^T V^-1 r over many replicas is the number of rows"
    g, _ = with_surface
    factor = whitener(epochs(g.rows, g.background), BELIEVED)
    squares = factor.whiten(factor.draw(np.random.default_rng(2), 400)).squares
    n = len(factor.epochs)
    assert squares.mean() == pytest.approx(n, abs=4 * np.sqrt(2 * n / 400))


def test_evidence_is_the_likelihood_with_the_amplitudes_integrated():
    "Closed form against the normal density of covariance I + s^2 A A^T, averaged over s"
    rng = np.random.default_rng(3)
    a, r = 30 * rng.standard_normal((50, 3)), rng.standard_normal(50) * 3
    gain = block_gain((a.T @ a)[None], (a.T @ r)[None, :, None])[0, 0]
    each = []
    for s in AMPLITUDES[:USED]:
        v = np.eye(50) + s**2 * a @ a.T
        each.append(-0.5 * (np.linalg.slogdet(v)[1] + r @ np.linalg.solve(v, r) - r @ r))
    assert gain == pytest.approx(np.logaddexp.reduce(each) - np.log(USED))


def test_settings_are_a_prior():
    "Weights of all settings sum to one"
    assert sum(setting.weight for setting in settings()) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["sines", "walk"])
def test_a_clean_survey_is_called_clean_whatever_its_drift(kind, study, with_surface, with_planes):
    "Drift of sinusoids, or of a random walk through a smoother, is no effect"
    for seed, (g, signs) in enumerate((with_surface, with_planes)):
        assert named(surveyed(study, g, 20 + seed, kind=kind), g, signs).label == "none"


def test_without_the_drift_in_the_covariance_a_clean_survey_alarms(study, with_surface):
    "White residuals and nothing else: some effect explains the drift of any survey"
    g, signs = with_surface
    rows, observed = surveyed(study, g, 20), epochs(g.rows, g.background)
    columns = table(rows, signs, (), observed.sigma)
    residual = observed.columns(rows.residual[:, None])
    white = evidence(observed, [Setting(scale=1e-3)], residual, columns)
    assert white.gain.max() > 20
    assert evidence(observed, settings(), residual, columns).gain.max() < 8


@pytest.mark.parametrize(
    "effect",
    [
        make_effect("time_offset", magnitude=0.006),
        make_effect("range_bias", magnitude=-0.02),
        make_effect("lever_arm", magnitude=[0.06, -0.08, 0.15]),
        make_effect("boresight", magnitude=[0.06, -0.08, 0.10]),
    ],
    ids=lambda effect: effect.name,
)
def test_an_effect_is_named_and_measured(effect, study, with_surface):
    "The right label, and the truth within four sigmas of the estimate"
    g, signs = with_surface
    rows = surveyed(study, g, 31, effect)
    found = infer(rows, g.background, g.survey, signs, np.random.default_rng(1), replicas=20)
    assert found.verdict.label == effect.name
    assert found.verdict.p_value < 0.01
    best = found.causes[0]
    truth = np.atleast_1d(effect.magnitude)
    for parameter, true in zip(best.parameters, truth, strict=True):
        assert abs(parameter.estimate - true) < 4 * parameter.sigma
        assert 0 < parameter.detectable < 10 * parameter.sigma
    assert best.effects[0].name == effect.name
    assert abs(found.where.after) < found.where.before


def test_an_event_is_found_between_the_times_of_the_bank(study, with_surface):
    "Time within 1 s, width within 30 %, size within four sigmas"
    g, signs = with_surface
    effect = make_effect("position_bump", magnitude=[0.3, 0.2, -0.3], time=31.7, width=8.0)
    rows = surveyed(study, g, 32, effect)
    best = infer(rows, g.background, g.survey, signs, np.random.default_rng(1), 20).causes[0]
    assert best.effect == "position_bump"
    told = {parameter.name: parameter for parameter in best.parameters}
    assert told["time"].estimate == pytest.approx(31.7, abs=1.0)
    assert told["width"].estimate == pytest.approx(8.0, rel=0.3)
    for name, true in zip(("easting", "northing", "height"), effect.magnitude, strict=True):
        assert abs(told[name].estimate - true) < 4 * told[name].sigma


def test_a_withheld_effect_is_unknown_and_the_lead_points_at_it(study, with_surface):
    "Without range_scale in the library nothing else takes its name"
    g, signs = with_surface
    rows = surveyed(study, g, 33, make_effect("range_scale", magnitude=1.5e-3))
    assert named(rows, g, signs).label == "range_scale"
    answer = named(rows, g, tuple(s for s in signs if s.name != "range_scale"))
    assert answer.label == "unknown"
    assert "range" in answer.lead


@pytest.mark.parametrize("name, word", [("roll with turn rate", "turn"), ("cyclic range", "range")])
def test_an_effect_of_no_library_is_unknown(name, word, study, with_surface):
    "Rotations and fine functions are in the bank of the unknown"
    g, signs = with_surface
    shift = study.Outside(g).shift(name, np.random.default_rng(0))
    shift *= 6.0 / study.metric(g)(shift)
    answer = named(surveyed(study, g, 34, outside=shift), g, signs)
    assert answer.label == "unknown"
    assert word in answer.lead


def test_noise_is_named_alone_and_found_again_beside_a_cause(study, with_surface):
    "range_noise shows in the roughness, with and without a range bias"
    g, signs = with_surface
    noise, bias = (
        make_effect("range_noise", magnitude=0.006),
        make_effect("range_bias", magnitude=0.02),
    )
    assert named(surveyed(study, g, 35, noise), g, signs).label == "range_noise"
    both = named(surveyed(study, g, 35, noise, bias), g, signs).label
    assert set(both.split("+")) == {"range_noise", "range_bias"}


def test_patches_that_are_no_planes_are_no_noise(study, with_surface):
    "One patch in twelve fifteen times as rough as the scanner: leaves and kerbs; and noise beside"
    g, signs = with_surface
    for effects, label in (
        ((), "none"),
        ((make_effect("range_noise", magnitude=0.006),), "range_noise"),
    ):
        rows = surveyed(study, g, 40, *effects)
        rough = np.flatnonzero(rows.channel == "roughness")[::12]
        residual = rows.residual.copy()
        residual[rough] += np.random.default_rng(0).uniform(3.0, 6.0, len(rough))
        assert named(replace(rows, residual=residual), g, signs).label == label


def test_the_likelihood_with_odd_values_is_that_of_the_mixture():
    "Without an offset the closed form; a value far away costs no more than its share"
    rng = np.random.default_rng(6)
    values = 0.2 * rng.standard_normal((300, 1))
    values[:15] = rng.uniform(2.0, 6.0, (15, 1))
    variance = np.full(300, 0.04)
    told = contaminated(values, np.zeros(300), variance, 1 / 6)
    share = told.share[0]
    assert share == pytest.approx(0.05, abs=0.02)
    normal = np.exp(-0.5 * values[:, 0] ** 2 / variance) / np.sqrt(2 * np.pi * variance)
    plain = np.log((1 - share) * normal + share / 6).sum()
    assert told.log_likelihood(1e-6)[0] == pytest.approx(plain, abs=0.1)
    values[0] = 100.0
    farther = contaminated(values, np.zeros(300), variance, 1 / 6)
    assert farther.best[0] == pytest.approx(told.best[0], abs=1e-6)


def test_an_offset_that_all_share_is_integrated_over():
    "Laplace's approximation against the normal density with the offset in its covariance"
    rng = np.random.default_rng(7)
    values, variance = 0.3 + 0.1 * rng.standard_normal((60, 1)), np.full(60, 0.01)
    told = contaminated(values, np.zeros(60), variance, 1e-9)
    v = np.diag(variance) + 0.2**2
    plain = -0.5 * (
        np.linalg.slogdet(2 * np.pi * v)[1] + values[:, 0] @ np.linalg.solve(v, values[:, 0])
    )
    plain += 60 * np.log(1 - told.share[0])  # nothing is odd, but it might have been
    assert told.log_likelihood(0.2)[0] == pytest.approx(plain, abs=0.02)


def test_an_unknown_error_that_a_known_effect_makes_is_not_unknown(with_surface):
    "A range error in proportion to the range is range_scale, as long as that is in the library"
    g, signs = with_surface
    unknown, observed = unknown_blocks(g.rows, g.survey), epochs(g.rows, g.background)
    leads = []
    for library in (signs, tuple(s for s in signs if s.name != "range_scale")):
        kept = novel(observed, table(g.rows, library, unknown, observed.sigma))
        members = {block.member for block in kept.blocks if block.label == "unknown"}
        leads.append({unknown[i].lead for i in members})
    assert leads[1] - leads[0] == {"range error in proportion to the range"}


def test_without_the_time_offset_another_error_of_the_clock_does_not_take_its_name(
    study, with_surface
):
    "A time error that is constant is unknown then, not clock_drift"
    g, signs = with_surface
    rows = surveyed(study, g, 41, make_effect("time_offset", magnitude=0.004))
    answer = named(rows, g, tuple(s for s in signs if s.name != "time_offset"))
    assert answer.label == "unknown"
    assert "time error" in answer.lead


def test_two_effects_are_named_together(study, with_surface):
    "A pair is needed when each alone leaves what the other explains"
    g, signs = with_surface
    effects = [
        make_effect("time_offset", magnitude=0.006),
        make_effect("range_bias", magnitude=0.02),
    ]
    assert named(surveyed(study, g, 36, *effects), g, signs).label == "time_offset+range_bias"


def test_a_drift_far_beyond_its_sigma_is_a_noisy_pos_not_an_effect(study, with_surface):
    "Five times the stated sigma is neither absorbed nor explained by an effect"
    g, signs = with_surface
    wider = replace(
        g.survey.pos, position_sigma=0.1, attitude_sigma=5 * g.survey.pos.attitude_sigma
    )
    large = replace(g, survey=replace(g.survey, pos=wider))
    assert named(surveyed(study, large, 37), g, signs).label == "position_noise"


def test_a_wrong_target_is_named_before_it_is_taken_for_a_tail(study, with_surface):
    "Both passes find the target off; a single row that is off is noise"
    g, signs = with_surface
    effect = make_effect("target_outlier", magnitude=[0.08, -0.05, 0.0], target="T05")
    rows = surveyed(study, g, 38, effect)
    assert named(rows, g, signs).label == "target_outlier"
    clean = surveyed(study, g, 38)
    one = np.flatnonzero((clean.channel == "target") & (clean.survey_item == 7))[0]
    residual = clean.residual.copy()
    residual[one] += 0.08
    odd = replace(clean, residual=residual)
    observed = epochs(odd, g.background)
    assert one in without_tails(observed, odd, np.zeros((len(observed), 0)))[1]
    assert named(odd, g, signs).label in ("none", "target_outlier")


def test_the_gap_adds_up_over_every_split_and_may_be_negative(study, with_surface):
    "Shares sum to one; a survey quieter than believed has a negative gap, inside the band or below"
    g, signs = with_surface
    quiet = replace(g.rows, residual=_quiet(g))
    where = infer(quiet, g.background, g.survey, signs, np.random.default_rng(1), 20).where
    assert where.before < 0
    assert "not measurable" in where.headline
    for split in where.splits:
        assert split.share.sum() == pytest.approx(1.0)
        total = np.sum(split.count * np.sign(split.before) * split.before**2) / split.count.sum()
        assert total == pytest.approx(-(where.before**2))


def _quiet(g):
    "Half of what the believed covariance draws, in the order of the rows"
    observed = epochs(g.rows, g.background)
    residual = np.zeros(len(g.rows))
    drawn = whitener(observed, BELIEVED).draw(np.random.default_rng(5), 1)[:, 0]
    residual[observed.row] = 0.5 * drawn
    return residual


def test_the_order_of_rows_and_the_zero_of_time_do_not_matter(study, with_surface):
    "Rows shuffled give the same evidence"
    g, signs = with_surface
    rows = surveyed(study, g, 39, make_effect("range_bias", magnitude=0.01))
    order = np.random.default_rng(0).permutation(len(rows))
    mixed = rows.select(order)
    effects = [kind for kind in EFFECTS if kind.name in ("range_bias", "time_offset", "lever_arm")]
    gains = []
    for some in (rows, mixed):
        signs, _ = signatures(some, g.survey, effects)
        observed = epochs(some, background(some, g.survey))
        columns = table(some, signs, (), observed.sigma)
        residual = observed.columns(some.residual[:, None])
        gains.append(evidence(observed, [BELIEVED], residual, columns).gain[:, 0])
    assert np.allclose(*gains, rtol=1e-6)


def test_the_p_value_is_the_share_of_replicas_that_go_as_far():
    "And beyond the last of them it goes on falling"
    rng = np.random.default_rng(0)
    replicas = rng.exponential(size=100)
    told = [
        p_value({"none": np.zeros(101), "range_bias": np.append(score, replicas)})
        for score in (np.median(replicas), 10.0)
    ]
    assert told[0] == pytest.approx(0.5, abs=0.02)
    assert 1e-6 < told[1] < 1e-3


def test_detectable_biases_are_those_of_baarda(with_surface):
    "4.13 sigmas of a parameter alone: 80 % power at 0.1 % significance"
    g, signs = with_surface
    observed = epochs(g.rows, g.background)
    compared = separability(observed, signs)
    one = next(s for s in signs if s.name == "range_bias")
    column = one.jacobian[g.rows.metric, 0]
    sigma = 1 / np.sqrt(column @ np.linalg.solve(dense(g, BELIEVED), column))
    told = compared.detectable[compared.names.index("range_bias")]
    assert told == pytest.approx(DETECTABLE * sigma, rel=1e-6)


def test_targets_alone_confuse_a_datum_with_a_lever_arm_and_more_speed_does_not_help(study):
    "One class by its squared correlation; what is next to measure tells the two apart"
    g = study.geometry(6, targets=24, patches=0)
    signs, _ = signatures(g.rows, g.survey)
    compared = separability(epochs(g.rows, g.background), signs)
    assert any({"lever_arm", "vertical_datum"} <= set(names) for names in compared.classes)
    assert "vertical_datum" in compared.same("lever_arm", [0.0, 0.0, 0.1])
    for one in next_data(g.rows, g.survey, EFFECTS, ("time_offset", "clock_drift"), compared):
        assert one.after < one.before
        assert "time_offset and clock_drift" in one.why


def test_every_addition_can_be_made_where_pulses_spread_about_their_targets(study):
    "Five additions, though the first pulse is earlier than the first target; each has more rows"
    g = study.geometry(6, targets=24, patches=0)
    time = g.rows.pulses.gps_time
    early = replace(g.rows.pulses, gps_time=time - 0.2 * (time == time.min()))
    made = additions(replace(g.rows, pulses=early), g.survey)
    assert len(made) == 5
    assert all(len(one.rows) > len(g.rows) for one in made)


def test_the_unknown_leaves_out_what_a_survey_does_not_vary(study):
    "A survey of one pass has no block of passes; every block shows in some row"
    g = study.geometry(8, targets=12, patches=20, passes=1)
    blocks = unknown_blocks(g.rows, g.survey)
    assert not any("passes" in block.lead for block in blocks)
    assert all(np.abs(block.columns).max() > 0 for block in blocks)


def test_rows_without_a_metre_are_refused(with_surface):
    "Roughness alone can't say where anything is"
    g, _ = with_surface
    rough = g.rows.select(g.rows.channel == "roughness")
    with pytest.raises(ValueError, match="rows has a residual in m"):
        epochs(rough, background(rough, g.survey))


def test_a_sigma_of_zero_is_refused(with_surface):
    "V must be positive definite"
    g, _ = with_surface
    exact = replace(g.rows, noise=np.zeros(len(g.rows)), survey_factor=np.zeros((len(g.rows), 3)))
    none = replace(g.background, drift=0 * g.background.drift, attitude=0 * g.background.attitude)
    with pytest.raises(ValueError, match="sigma of zero"):
        whitener(epochs(exact, none), BELIEVED)
