"""Accuracy of the collocation over many simulated surveys, and on real drift.

    python benchmarks/lsc_study.py windows SERIES.err
    python benchmarks/lsc_study.py STUDY [--seeds 25] [--first 0]

windows    16 ideal targets in each window of a real series of POS errors, against order-5 least
           squares and a stationary exponential collocation
coverage how often the truth lies within one and 1.96 stated sigmas, and good points rejected gross
15 % of the control points wrong by 0.1 to 1 m adjacent two neighbors wrong by one vector: found, or
reported as doubtful order orders 0 to 3 of the trend, and the most probable one tuned parameters
from control points alone against those tuned on the truth count 3 to 60 control points, against
least squares

Surveys are simulated at feature level (feature_surveys.py); seeds count from --first. Intervals are
95 % by bootstrap over surveys. Errors in m, RMS over E, N, H together unless noted.
"""

import argparse
import warnings
from dataclasses import replace

import numpy as np
from feature_surveys import feature_survey, scenarios
from real_windows import interval, windows

from mlscorr.collocation import FAMILIES
from mlscorr.estimate import estimate_correction
from mlscorr.estimate._prediction import predict_under

FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
COUNTS = (3, 4, 6, 8, 12, 16, 24, 40, 60)


def estimate(survey, **arguments):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return estimate_correction(survey.recorded, survey.matched, **arguments)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def surveys(seeds, names=None):
    """Name, seed and FeatureSurvey of every scenario."""
    for name, scenario in scenarios().items():
        if names is None or name in names:
            for seed in seeds:
                yield name, seed, feature_survey(scenario, seed)


def by_scenario(rows, statistic):
    """Statistic of the rows (name, ...) of each scenario, and of all."""
    names = list(dict.fromkeys(row[0] for row in rows))
    for name in names:
        yield name, statistic([row[1:] for row in rows if row[0] == name])
    yield "all", statistic([row[1:] for row in rows])


def inside(survey, found):
    """Mask (n,) of the epochs within the control span."""
    time = survey.recorded.gps_time
    return (time >= found.span[0]) & (time <= found.span[1])


def coverage(seeds):
    rows = []
    for name, _, survey in surveys(seeds):
        if name == "calibration":  # its mounting is wrong: the trajectory isn't what's corrected
            continue
        found = estimate(survey)
        sigma = found.correction.corrected.position_sigma
        ratio = np.abs(survey.position_left(found.correction) / sigma)[inside(survey, found)]
        within = [np.mean(ratio < limit) for limit in (1.0, 1.96)]
        rows.append((name, *within, len(found.outliers), len(survey.control)))
    print("scenario        surveys  within 1 sigma          within 1.96 sigma       rejected")
    for name, part in by_scenario(rows, np.array):
        shares = "   ".join(interval(part[:, i], np.mean) for i in (0, 1))
        print(f"{name:14s} {len(part):6d}    {shares}   {part[:, 2].sum() / part[:, 3].sum():.2%}")


def gross(seeds, adjacent=False):
    rows = []
    for name, seed, clean in surveys(seeds):
        rng = np.random.default_rng([seed, 2])
        count = len(set(clean.observations.name))
        spoiled, wrong = clean.spoil(2 / count if adjacent else 0.15, rng, adjacent)
        right = clean.keep(set(clean.observations.name) - wrong)
        found = estimate(spoiled)
        named = {outlier.name for outlier in found.outliers}
        told = any("follow each other" in sentence for sentence in found.warnings)
        left = [
            rms(s.check_rmse(f.correction))
            for s, f in ((clean, estimate(clean)), (right, estimate(right)), (clean, found))
        ]
        hits = (len(wrong), len(wrong & named), len(named - wrong), told or wrong <= named)
        rows.append((name, *left, *hits))
    print(
        "scenario        wrong found  good rejected  found or told   clean   known   found  "
        " found/clean             found/known"
    )
    for name, part in by_scenario(rows, np.array):
        wrong, hit, false = part[:, 3:6].sum(axis=0)
        errors = " ".join(f"{rms(column):7.4f}" for column in part[:, :3].T)
        ratios = "   ".join(interval(part[:, 2] / part[:, i]) for i in (0, 1))
        print(
            f"{name:14s} {wrong:6.0f} {hit / wrong:6.1%} {false:10.0f} {part[:, 6].mean():16.1%}"
            f"     {errors}   {ratios}"
        )


def order(seeds):
    rows = []
    for name, _, survey in surveys(seeds):
        left = [rms(survey.check_rmse(estimate(survey, order=n).correction)) for n in range(4)]
        orders = np.zeros(8)
        for alternative in estimate(survey).alternatives:
            orders[alternative.order] += alternative.probability
        rows.append((name, *left, left[min(int(orders.argmax()), 3)], int(orders.argmax())))
    print("scenario        order 0   order 1   order 2   order 3   most probable   its mean order")
    for name, part in by_scenario(rows, np.array):
        errors = "   ".join(f"{rms(column):.4f}" for column in part[:, :5].T)
        print(f"{name:14s} {errors}        {part[:, 5].mean():.2f}")


def tuned(seeds):
    grid = [(f, s, t) for f in FAMILIES for s in FACTORS for t in FACTORS]
    rows = []
    for name, _, survey in surveys(seeds):
        if name == "calibration":
            continue
        found = estimate(survey)
        epochs = np.flatnonzero(inside(survey, found))[::5]
        error = survey.true.position - survey.recorded.position
        chosen = found.parameters
        left = []
        for family, scale, time in grid:
            tried = replace(
                chosen,
                family=family,
                drift_scale=scale * chosen.drift_scale,
                bias_scale=scale * chosen.bias_scale,
                drift_time=time * chosen.drift_time,
                bias_time=time * chosen.bias_time,
            )
            pose, _ = predict_under(found.adjustment, tried, epochs)
            left.append(rms(error[epochs] - pose[:, :3]))
        alone = rms(survey.position_left(found.correction)[epochs])
        rows.append((name, alone, min(left), *left))
    print("scenario        control alone   tuned each   cost RMS   tuned together   cost RMS")
    for name, part in by_scenario(rows, np.array):
        alone = rms(part[:, 0])
        each = rms(part[:, 1])
        together = min(rms(column) for column in part[:, 2:].T)
        print(
            f"{name:14s} {alone:9.4f} {each:14.4f} {alone / each - 1:11.1%} {together:13.4f} "
            f"{alone / together - 1:13.1%}"
        )


def count(seeds, figure=None):
    base = scenarios()["tactical"]
    many = base.targets.model_copy(update={"control": max(COUNTS), "check": 12})
    scenario = base.model_copy(update={"targets": many})
    left = {n: [] for n in COUNTS}
    for seed in seeds:
        survey = feature_survey(scenario, seed)
        names = list(dict.fromkeys(survey.observations.name))
        for n in COUNTS:
            rows = np.linspace(0, len(names) - 1, min(n, len(names))).round().astype(int)
            part = survey.keep({names[i] for i in rows})
            curve = _polynomial(part, min(3, n - 2))
            raw = part.matched_check.misclosure
            consistent = part.check_rmse(estimate(part).correction)
            left[n].append((rms(raw), rms(raw - curve(part.checked.gps_time)), rms(consistent)))
    print("control   raw                     LS, order 3             consistent LSC")
    for n, values in left.items():
        print(f"{n:7d}   " + "   ".join(interval(column) for column in np.transpose(values)))
    if figure:
        _draw(left, figure)


def _polynomial(survey, degree):
    """Least squares trend of the misclosures: a function of gps_time."""
    time = survey.matched.gps_time
    misclosure = survey.matched.misclosure
    curves = [np.polynomial.Legendre.fit(time, column, degree) for column in misclosure.T]
    return lambda at: np.column_stack([curve(at) for curve in curves])


def _draw(left, path):
    import matplotlib.pyplot as plt

    for i, label in enumerate(("raw", "LS, order 3", "consistent LSC")):
        plt.loglog(
            list(left), [np.median([v[i] for v in left[n]]) for n in left], "o-", label=label
        )
    plt.xlabel("control points")
    plt.ylabel("RMS at check points (m)")
    plt.legend()
    plt.savefig(path, dpi=150)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    studies = (coverage, gross, order, tuned, count)
    names = [*(study.__name__ for study in studies), "adjacent", "windows"]
    parser.add_argument("study", choices=names)
    parser.add_argument("series", nargs="?", help="of real POS errors, for windows")
    parser.add_argument("--seeds", type=int, default=25)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--figure", help="PNG to draw, for count")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.seeds)
    if given.study == "windows":
        if given.series is None:
            parser.error("windows needs a file of real POS errors, as OB_GINS writes (.err)")
        windows(given.series)
    elif given.study == "adjacent":
        gross(seeds, adjacent=True)
    elif given.study == "count":
        count(seeds, given.figure)
    else:
        globals()[given.study](seeds)


if __name__ == "__main__":
    main()
