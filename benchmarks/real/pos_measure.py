"""The gap of each window: diagnosed, measured before and after, and summarized."""

import numpy as np
from pos_drive import (
    BELIEF,
    CHOICE,
    DRAWS,
    LEAD,
    OUTAGE,
    simulate_pos,
    window_rows,
    with_sigmas,
)
from scipy.stats import binomtest

from mlscorr.gap.evidence import SETTINGS, Observations, infer_causes, signed_root
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import signatures
from mlscorr.simulate.pos import record

REPLICAS = 200  # for null bands
RESAMPLED = 2000  # for bootstrap intervals


def diagnosed(rows, survey, rng, replicas=REPLICAS):
    """Inference of a window, without any knowledge of the outages."""
    signs, _ = signatures(rows, survey)
    return infer_causes(rows, background(rows, survey), survey, signs, rng, replicas)


def terms(rows, survey, rng=None, replicas=REPLICAS):
    """Unpredicted parts of a survey's n residuals: time, sigma^2 (u^2 - 1) of the
    innovations, square of the residual less its variance, log likelihood, and with rng the means
    of the second of replicas in which the assumptions are correct. Units: m^2."""
    observed = Observations.of(rows, background(rows, survey))
    whitener = observed.whitener()
    residual = observed.columns(rows.residual[:, None])
    if rng is None:
        columns = residual
    else:
        columns = np.hstack([residual, whitener.draw(rng, replicas)])
    u, sigma = whitener.innovations(columns)
    square = sigma[:, None] ** 2 * (u**2 - 1)
    errors = observed.errors
    signal = (errors.position**2 + errors.attitude**2).sum(axis=1)
    plain = residual[:, 0] ** 2 - signal - errors.own
    likelihood = float(whitener.log_likelihood(residual)[0])
    return errors.gps_time, square[:, 0], plain, likelihood, square[:, 1:].mean(axis=0)


def measure(cycles, rows, one, models, rng, replicas=REPLICAS):
    """Gap of each cycle before and after; the settings are chosen on all other cycles."""
    score = np.array(
        [
            [terms(rows[span][0], with_sigmas(one, rows[span][1], model))[3] for model in models]
            for span in cycles
        ]
    )
    found = []
    for number, span in enumerate(cycles):
        data, survey = rows[span]
        if len(cycles) > 1:
            others = np.delete(score, number, axis=0).sum(axis=0)
        else:
            others = score[0]
        chosen = int(np.argmax(others))
        model = with_sigmas(one, survey, models[chosen])
        time, before, plain, old, band = terms(data, survey, rng, replicas)
        _, after, left, new, later = terms(data, model, rng, replicas)
        found.append(
            {
                "time": time,
                "before": before,
                "after": after,
                "plain": plain,
                "left": left,
                "chosen": chosen,
                "lost": one.lost(time),
                "gain": new - old,
                "band": signed_root(np.percentile(band, SETTINGS.band)),
                "later": signed_root(np.percentile(later, SETTINGS.band)),
            }
        )
    return found


def simulated_gaps(one, cycles, believed, seed):
    """Gap (d, c), in mm, of simulated drives with outages, by the same assumption."""
    found = []
    for number in range(DRAWS):
        error = simulate_pos(one, BELIEF, [seed, 100 + number], one.outages)
        recorded = record(one.true, error)
        rng = np.random.default_rng([seed, 200 + number])
        several = [window_rows(one, span, recorded, believed, rng) for span in cycles]
        found.append([signed_root(terms(*each)[1].mean()) for each in several])
    return np.array(found)


def verdict_of(one, span, inference):
    """Plain summary of one window's diagnosis."""
    cause = inference.causes[0]
    told = inference.verdict
    bursts = [[b[0], b[0] + b[1], b[2]] for b in cause.model.windows]
    time = np.arange(*span, 0.5)
    found = np.any([(time >= a) & (time < b) for a, b, _ in bursts], axis=0)
    found = np.broadcast_to(found, time.shape)
    lost = one.lost(time)
    return {
        "span": list(span),
        "verdict": told.label,
        "probability": told.probability,
        "p_value": told.p_value,
        "windows": bursts,
        "gap": inference.where.before,
        "null_band": list(inference.where.null_band),
        "outage_found": float(found[lost].mean()) if lost.any() else None,
        "found_in_outage": float(lost[found].mean()) if found.any() else None,
    }


def within(one, believed, measured, models):
    """Share of the real errors (E, N, H) within 2 sigma: as assumed, and with outages."""
    before = []
    after = []
    for m in measured:
        rows = (one.true.gps_time >= m["time"].min()) & (one.true.gps_time <= m["time"].max())
        size = np.abs(one.error.position[rows])
        before.append(size < 2 * believed.position_sigma)
        after.append(size < 2 * models[m["chosen"]][0][rows])
    return [float(np.concatenate(each).mean()) for each in (before, after)]


def what_stays(one, measured, models):
    """Of each axis: RMS in outages of the error over the simulated sigma, how many outages end
    with an error of positive sign, and how probable so one-sided a count is by chance."""
    ratio = []
    ends = []
    for m in measured:
        time = one.true.gps_time
        rows = one.lost(time) & (time >= m["time"].min()) & (time <= m["time"].max())
        ratio.append(one.error.position[rows] / models[m["chosen"]][0][rows])
        ends.append(one.error.position[rows][-20:-10].mean(axis=0))  # GNSS is back by the last one
    up = (np.array(ends) > 0).sum(axis=0)
    n = len(ends)
    return {
        "over_sigma": np.sqrt(np.mean(np.concatenate(ratio) ** 2, axis=0)).tolist(),
        "positive": up.tolist(),
        "chance": [float(binomtest(int(k), n).pvalue) for k in up],
    }


def summary(cycles, told, measured, rng):
    """Numbers of each cycle and of all cycles."""
    rows = [_of_cycle(s, told[s].verdict, m) for s, m in zip(cycles, measured, strict=True)]
    kinds = ("before", "after", "plain", "left")
    total = {k: np.concatenate([m[k] for m in measured]) for k in (*kinds, "lost")}
    parts = {"whole": slice(None), "inside": total["lost"], "outside": ~total["lost"]}
    drawn = [1 - abs(a) / b for b, a in _resampled(measured, rng)]
    return {
        "cycles": rows,
        "all": {
            name: {k: float(signed_root(total[k][part].mean())) for k in kinds}
            for name, part in parts.items()
        },
        "medians": {
            k: median_with_interval([row[k] for row in rows], rng)
            for k in ("before", "after", "shrink", "plain_in_outage", "innovations_in_outage")
        },
        "shrink_all": shrunk(total["before"].mean(), total["after"].mean()),
        "shrink_interval": np.percentile(drawn, SETTINGS.band).tolist(),
        "plain_in_outages": float(total["plain"][total["lost"]].sum() / total["plain"].sum()),
        "rows_in_outages": float(total["lost"].mean()),
    }


def _of_cycle(span, answer, m):
    """Numbers of one cycle."""
    inside = m["lost"]
    squares = (m["before"], m["after"])
    before, after = (float(signed_root(square.mean())) for square in squares)
    return {
        "outage": [span[0] + LEAD, span[0] + LEAD + OUTAGE],
        "verdict": answer.label,
        "probability": answer.probability,
        "p_value": answer.p_value,
        "before": before,
        "after": after,
        "null_band": m["band"].tolist(),
        "null_band_after": m["later"].tolist(),
        "plain_in_outage": float(m["plain"][inside].sum() / m["plain"].sum()),
        "innovations_in_outage": float(m["before"][inside].sum() / m["before"].sum()),
        "rows_in_outage": float(inside.mean()),
        "inside": [float(signed_root(square[inside].mean())) for square in squares],
        "outside": [float(signed_root(square[~inside].mean())) for square in squares],
        "shrink": shrunk(m["before"].mean(), m["after"].mean()),
        "log_likelihood_gain": m["gain"],
        "settings": CHOICE[m["chosen"]],
    }


def _resampled(measured, rng):
    """Mean squares before and after of resampled cycles."""
    sums = np.array([[m["before"].sum(), m["after"].sum(), len(m["before"])] for m in measured])
    for rows in rng.integers(len(sums), size=(RESAMPLED, len(sums))):
        before, after, count = sums[rows].sum(axis=0)
        yield before / count, after / count


def median_with_interval(values, rng):
    """Median of values (n,) and its 95 % bootstrap interval."""
    values = np.asarray(values, dtype=float)
    rows = rng.integers(len(values), size=(RESAMPLED, len(values)))
    return float(np.median(values)), *np.percentile(
        np.median(values[rows], axis=1), SETTINGS.band
    ).tolist()


def shrunk(before, after):
    """Share of the squared gap that is removed; a gap below zero counts as remaining."""
    if before > 0:
        return float(1 - abs(after) / before)
    return float("nan")
