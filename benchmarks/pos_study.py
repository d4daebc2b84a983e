"""Rate of drives on which collocation is worse than interpolation between control points.

python benchmarks/pos_study.py [FILE of real POS errors (.err)] [--seeds 2] [--every 1]
    [--first-seed 0] [--control 3] [--only TEXT]

RMS in 3D of the whole trajectory over many drives: windows of a real error series with and without
its sigma(t); clones of the paper's car and boat; MEMS and tactical units, filtered and smoothed,
with their stated sigmas, without any, and with sigmas ten times too small and too large; a POS
whose GNSS loses its fixed solution at times; one that drifts for seconds, three to eight times in a
window, and states 2 cm throughout; and a tactical unit without outages that states a seventh of its
error. The peers use the same control points: linear and monotone interpolation, the former cut at
the steps of the path, and a Gaussian process of scikit-learn. With
--every 4 each fourth control point along the drive takes part, with its passes; with --control 6
six of them, spread evenly. A table at the end has a line for each kind of POS.
"""

import argparse
import warnings
from dataclasses import replace

import numpy as np
from feature_surveys import feature_survey, scenarios
from real_windows import WINDOW, cases, window
from scipy.signal import lfilter

from mlscorr.baselines import fit_gaussian_process, fit_linear, fit_pchip
from mlscorr.estimate import estimate_correction
from mlscorr.survey import Pos

PEERS = {
    "linear": fit_linear,
    "pchip": fit_pchip,
    "linear-steps": lambda trajectory, matched: fit_linear(trajectory, matched, cut=True),
    "gp": fit_gaussian_process,
}
UNSTATED = Pos(position_sigma=0.5)  # m, a constant that says nothing of the drift
# m, m, s: fixed, not fixed, and duration of its errors
HELD = 0.02
FLOAT = 0.4
MEMORY = 60.0
WORSE = 1.1  # times the best peer: beyond it a survey counts as worse
# A tactical unit without outages, like a series of precise point positioning
UNDERSTATED = 7.0  # true error over stated sigma
SIZES = (0.1, 1.0)  # m, one sigma of an axis
DECORRELATED = (40.0, 200.0)  # s, after which correlation is 1 / e
ROUGH = 0.01  # m, one sigma of what changes within seconds
TONES = 40  # sines whose sum is normal to a percent


def surveys(series, seeds):
    """Rows of name, recorded trajectory, matched control, true - recorded position, beliefs."""
    if series is not None:
        for name, trajectory, matched, error in cases(series):
            yield f"real {name}", trajectory, matched, error, None
            hidden = replace(trajectory, position_sigma=None)
            yield f"real {name} no sigma", hidden, matched, error, UNSTATED
    for name, scenario in drives().items():
        for seed in seeds:
            survey = feature_survey(scenario, seed)
            error = survey.true.position - survey.recorded.position
            for title, factor in (("", 1.0), (" no sigma", None), (" / 10", 0.1), (" x 10", 10.0)):
                if factor not in (1.0, None) and "filtered" not in name:
                    continue
                if factor is None:
                    sigma = None
                else:
                    sigma = factor * survey.recorded.position_sigma
                recorded = replace(survey.recorded, position_sigma=sigma)
                pos = UNSTATED if factor is None else None
                yield f"{name}{title}", recorded, survey.matched, error, pos
    for seed in seeds:
        yield "not fixed at times", *unfixed(seed), None
        yield "drifting for seconds", *bumped(seed), None
        yield "tactical, understated", *understated(seed), None


def unfixed(seed):
    """Recorded trajectory, matched control and error of a drive whose GNSS fix comes and goes."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, WINDOW, 0.1)
    turns = np.cumsum(rng.uniform(10.0, 60.0, 30))  # s
    size = np.where(np.searchsorted(turns, time) % 2, FLOAT, HELD)[:, None] * [1.0, 1.0, 1.5]
    kept = np.exp(-0.1 / MEMORY)
    series = lfilter([np.sqrt(1 - kept**2)], [1, -kept], rng.normal(size=(6, len(time) + 6000)))
    fixed, floated = series[:, -len(time) :].T.reshape(-1, 2, 3).swapaxes(0, 1)
    error = size * np.where(size > size.min(axis=0), floated, fixed)
    return window(345_600.0 + time, error, size, seed)


def bumped(seed):
    """Recorded trajectory, matched control and error of a drive with unstated drift of the POS."""
    rng = np.random.default_rng([seed, 1])
    time = np.arange(0.0, WINDOW, 0.1)
    error = HELD / 2 * rng.normal(size=3) + np.zeros((len(time), 3))
    for _ in range(rng.integers(3, 9)):
        # s
        begin = rng.uniform(0.0, WINDOW - 30.0)
        length = rng.uniform(10.0, 30.0)
        share = np.clip((time - begin) / length, 0.0, 1.0)[:, None]
        error += FLOAT * rng.normal(size=3) * np.sin(np.pi * share) ** 2
    return window(345_600.0 + time, error, np.full_like(error, HELD), seed)


def understated(seed):
    """Recorded trajectory, matched control and error of a drive with a sigma of a seventh of it."""
    rng = np.random.default_rng([seed, 2])
    time = np.arange(0.0, WINDOW, 0.1)
    size = np.exp(rng.uniform(*np.log(SIZES))) * np.array([1.0, 1.0, 1.5])
    highest = 0.35 / np.exp(rng.uniform(*np.log(DECORRELATED)))  # Hz: sinc(0.7) is 1 / e and more
    slow = _tones(rng, time, 0.0, highest)
    rough = _tones(rng, time, 0.02, 0.5)
    error = size * slow + ROUGH * rough
    return window(345_600.0 + time, error, np.tile(size / UNDERSTATED, (len(time), 1)), seed)


def _tones(rng, time, lowest, highest):
    """Sums (n, 3) of sines of random phase in a band (Hz), of variance one."""
    frequency = rng.uniform(lowest, highest, (TONES, 3))
    phase = rng.uniform(0.0, 2 * np.pi, (TONES, 3))
    angle = 2 * np.pi * time[:, None, None] * frequency + phase
    return np.sqrt(2 / TONES) * np.sin(angle).sum(axis=1)


def drives():
    """Scenarios by name."""
    known = scenarios()
    made = {name: known[name] for name in ("car", "boat")}
    for grade in ("mems", "tactical"):
        for processing in ("filtered", "smoothed"):
            pos = known[grade].pos.model_copy(update={"processing": processing})
            made[f"{grade} {processing}"] = known[grade].model_copy(update={"pos": pos})
    return made


def left(correction, error):
    """RMS in 3D (m) of the residual position error (n, 3) after a correction."""
    moved = correction.corrected.position - correction.recorded.position
    return float(np.sqrt(np.mean(np.sum((error - moved) ** 2, axis=1))))


def row(trajectory, matched, error, pos):
    """Raw RMS, those of each peer and of mlscorr, and the share within 1.96 sigma."""
    peers = [left(fit(trajectory, matched), error) for fit in PEERS.values()]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        correction = estimate_correction(trajectory, matched, pos).correction
    moved = correction.corrected.position - trajectory.position
    within = np.mean(np.abs(error - moved) < 1.96 * correction.corrected.position_sigma)
    raw = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
    return [raw, *peers, left(correction, error), float(within)]


def some(matched, every, number):
    """Subset of matched control: every n-th point, or a number of evenly spread ones."""
    names = list(dict.fromkeys(matched.name))
    if number is None:
        kept = names[::every]
    else:
        rows = np.linspace(0, len(names) - 1, number).round().astype(int)
        kept = [names[i] for i in np.unique(rows)]
    return matched[np.isin(matched.name, kept)]


def kind_of(name):
    """The kind of POS; windows of one series are one kind."""
    if name.startswith("real"):
        return " ".join(word for word in name.split() if not word.isdigit() and word != "s")
    return name


def by_kind(found):
    """Print a line for each kind of POS: geometric means, and shares within the sigmas."""
    print(f"{'kind':34s} surveys       linear      mlscorr   ratio   worst   within   least")
    for kind in dict.fromkeys(kind for kind, _ in found):
        table = np.array([row for other, row in found if other == kind])
        ratio = table[:, -2] / table[:, 1]
        linear, own, mean = np.exp(np.log([table[:, 1], table[:, -2], ratio]).mean(axis=1))
        print(
            f"{kind:34s}{len(table):8d}{linear:13.4f}{own:13.4f}{mean:8.2f}{ratio.max():8.2f}"
            f"{table[:, -1].mean():9.1%}{table[:, -1].min():8.0%}"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("series", nargs="?", help="of real POS errors, as OB_GINS writes (.err)")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="only each n-th control point")
    parser.add_argument("--control", type=int, help="number of control points instead")
    parser.add_argument("--only", default="", help="surveys whose names have this text in them")
    arguments = parser.parse_args()
    titles = ["raw", *PEERS, "mlscorr"]
    print(f"{'survey':34s}" + "".join(f"{title:>13s}" for title in titles) + "   within")
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    found = []
    for name, trajectory, matched, *truth in surveys(arguments.series, seeds):
        if arguments.only not in name:
            continue
        control = some(matched, arguments.every, arguments.control)
        found.append((kind_of(name), row(trajectory, control, *truth)))
        rows = [values for _, values in found]
        numbers = "".join(f"{value:13.3f}" for value in rows[-1][:-1])
        best = min(rows[-1][1:-2])
        mark = "  worse" if rows[-1][-2] > WORSE * best else ""
        print(f"{name:34s}{numbers}{rows[-1][-1]:9.0%}{mark}", flush=True)
    by_kind(found)
    table = np.array([values for _, values in found])
    ratio = table[:, 1:-2].min(axis=1) / table[:, -2]
    means = np.exp(np.log(table[:, :-1]).mean(axis=0))
    print(f"{'geometric mean':34s}" + "".join(f"{value:13.3f}" for value in means))
    print(
        f"{len(rows)} surveys: the best peer leaves {np.median(ratio):.2f} times as much in the "
        f"median; mlscorr leaves more than {WORSE} times as much in "
        f"{np.sum(ratio < 1 / WORSE)} of them, at worst {1 / ratio.min():.2f} times; "
        f"{table[:, -1].mean():.1%} within 1.96 sigma"
    )


if __name__ == "__main__":
    main()
