import numpy as np
import pytest

from mlscorr.collocation import FAMILIES, Covariance, Noise, Signal, collocate
from tests.collocation.random_survey import SPAN, START, RandomSurvey


def exact(gps_time, misclosure, sigma, covariance, asked):
    "Mean and variance by a Cholesky factor in extended precision, 19 digits, without trend"
    time = (np.concatenate([gps_time, asked]) - START).astype(np.longdouble)
    a = np.sqrt(np.longdouble(2 * covariance.states - 1)) / np.longdouble(
        covariance.correlation_time
    )
    a = a * np.abs(time[:, None] - time)
    total = (1.0, 1.0 + a, 1.0 + a + a * a / 3)[covariance.states - 1] * np.exp(-a)
    n = len(gps_time)
    total[np.arange(n), np.arange(n)] += np.longdouble(sigma) ** 2
    rows = np.vstack([total, np.append(misclosure, np.zeros(len(asked)))[None]])
    for j in range(n):  # eliminate the observations: what is left is conditional on them
        rows[j + 1 :] -= np.outer(rows[j + 1 :, j] / rows[j, j], rows[j])
    return -rows[-1, n:].astype(float), np.diag(rows[n:-1, n:]).astype(float)


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no extended precision here")
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("correlation_time", [40.0, 1e4])
@pytest.mark.parametrize("sigma", [1e-3, 1e-4])
def test_nearly_singular_surveys_are_solved_to_the_last_digits(family, correlation_time, sigma):
    """Mean to 1e-9 and sigma to 1e-6 of itself where V is nearly singular.

    Signals of 1 m, noise down to 0.1 mm, correlation times up to 50 times the survey's length,
    targets a millisecond apart, a gap of a day. The posterior sigmas get down to the noise's.
    """
    rng = np.random.default_rng(7)
    gps_time = START + np.sort(rng.uniform(0, SPAN, 16))
    gps_time[4], gps_time[9] = gps_time[3] + 1e-3, gps_time[8]
    gps_time[13:] += 86_400.0
    asked = START + np.append(rng.uniform(-50, SPAN + 50, 12), [-1e5, 5e4, 1e6])
    covariance = Covariance(family, correlation_time)
    joint = covariance(gps_time[:, None] - gps_time)
    values, vectors = np.linalg.eigh(joint)
    misclosure = vectors @ (np.sqrt(np.maximum(values, 0)) * rng.normal(size=16))
    misclosure += sigma * rng.normal(size=16)
    one = np.ones((16, 1, 1))
    many = np.ones((len(asked), 1, 1))
    noise = Noise(sigma**2 * one)
    solved = collocate(
        gps_time, misclosure[:, None], noise, one[:, :, :0], [Signal(one, covariance)]
    )
    mean, variance = solved.predict(asked, many[:, :, :0], [many])
    expected, spread = exact(gps_time, misclosure, sigma, covariance, asked)
    assert np.abs(mean[:, 0] - expected).max() < 1e-9  # m
    assert np.sqrt(variance[:, 0, 0]) == pytest.approx(np.sqrt(spread), rel=1e-6)


def test_origin_of_time_and_order_of_observations_do_not_matter():
    "A day later and shuffled: the same result to 1e-9, save what rounding leaves of the times"
    survey = RandomSurvey(3)
    survey.gps_time = np.round(survey.gps_time * 1024) / 1024
    survey.asked = survey.asked
    survey.asked = np.round(survey.asked * 1024) / 1024
    solved = survey.solve()
    before = survey.predict(solved)
    order = survey.rng.permutation(len(survey.gps_time))
    survey.gps_time = survey.gps_time[order] + 86_400.0
    survey.misclosure = survey.misclosure[order]
    survey.design = survey.design[order]
    survey.mixing = [mixing[order] for mixing in survey.mixing]
    survey.noise = survey.noise.select(order)
    survey.asked = survey.asked + 86_400.0
    again = survey.solve()
    assert again.trend == pytest.approx(solved.trend, abs=1e-9)
    assert again.log_likelihood == pytest.approx(solved.log_likelihood, abs=1e-9)
    shuffled = solved.weights.reshape(-1, 3)[order].ravel()
    assert again.weights == pytest.approx(shuffled, rel=1e-8, abs=1e-8)
    for here, there in zip(survey.predict(again), before, strict=True):
        assert np.abs(here - there).max() < 1e-9


def test_prediction_in_parts_equals_the_whole():
    "Epochs one at a time, backward, or as broadcast arrays: bit for bit what all together are"
    survey = RandomSurvey(4)
    solved = survey.solve()
    mean, covariance = survey.predict(solved)
    for i in range(len(survey.asked) - 1, -1, -1):
        one = slice(i, i + 1)
        mixing = [m[one] for m in survey.asked_mixing]
        single = solved.predict(survey.asked[one], survey.asked_design[one], mixing)
        assert np.array_equal(single[0][0], mean[i])
        assert np.array_equal(single[1][0], covariance[i])
    constant = [np.broadcast_to(m[:1], m.shape) for m in survey.asked_mixing]
    lazy = solved.predict(survey.asked, survey.asked_design, constant)
    copied = solved.predict(survey.asked, survey.asked_design, [m.copy() for m in constant])
    assert np.array_equal(lazy[1], copied[1])


def test_passes_do_not_average_the_survey_error_away():
    "Ten passes of a target surveyed to 2 cm leave 2 cm; of ten targets, 2 cm over root ten"
    n = 10
    sigma = 0.02
    one = np.ones((n, 1, 1))
    own = Noise(1e-10 * one).own
    nothing = np.full((n, 1, 1), 1e-9)
    for group, expected in ((np.zeros(n, int), sigma), (np.arange(n), sigma / np.sqrt(n))):
        noise = Noise(own, group, np.full((n, 1), sigma))
        signal = Signal(nothing, Covariance("matern32", 30.0))
        solved = collocate(START + np.arange(n), np.ones((n, 1)), noise, one, [signal])
        assert solved.trend == pytest.approx([1.0], abs=1e-9)
        assert np.sqrt(solved.trend_covariance[0, 0]) == pytest.approx(expected, rel=1e-4)


def test_without_observations_near_or_at_all_the_prior_remains():
    "A million seconds away, or of no observation at all, the covariance is B B^T"
    survey = RandomSurvey(5, p=0)
    _, covariance = survey.predict(survey.solve())
    prior = sum(m @ m.swapaxes(1, 2) for m in survey.asked_mixing)
    assert np.abs(covariance[1:3] - prior[1:3]).max() < 1e-12
    survey.gps_time = survey.gps_time[:0]
    survey.misclosure = survey.misclosure[:0]
    survey.mixing = [m[:0] for m in survey.mixing]
    survey.noise = survey.noise.select(slice(0))
    survey.design = survey.design[:0]
    mean, covariance = survey.predict(survey.solve())
    assert np.array_equal(mean, np.zeros_like(mean))
    assert np.abs(covariance - prior).max() < 1e-12


def test_what_cannot_be_solved_is_refused_in_a_sentence():
    "No number, no noise, no rank, and mixings of other signals are named"
    survey = RandomSurvey(6)
    survey.misclosure[4, 1] = np.nan
    with pytest.raises(ValueError, match="1 of 14 observation epochs have a time, misclosure"):
        survey.solve()
    survey = RandomSurvey(6)
    survey.noise = Noise(np.zeros((14, 3, 3)))
    with pytest.raises(ValueError, match="42 misclosures is not positive definite: two obs"):
        survey.solve()
    survey = RandomSurvey(6)
    survey.design[:, :, 2] = survey.design[:, :, 1]
    with pytest.raises(ValueError, match="42 misclosures do not determine 3 trend"):
        survey.solve()
    solved = RandomSurvey(6).solve()
    with pytest.raises(
        ValueError, match=r"30 epochs were requested with a design .* with 3 and \[3, 2, 3\]"
    ):
        solved.predict(survey.asked, survey.asked_design, survey.asked_mixing[:2])
