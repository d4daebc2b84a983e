"""Scenarios of all sorts, small enough to be made by the hundred in seconds each."""

from dataclasses import replace

import numpy as np

from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.survey import simulate

RIVERS, SPINNING, TWO_PASSES, REFERENCES = 0.2, 0.12, 0.5, 2 / 3  # shares of the surveys
CANYONS, OUTAGES = 0.3, 0.2  # shares with few satellites, and with none, for some seconds
MOST = 2.2e6  # pulses on a street: some 1.6 million points
LONG, SHORT = 70.0, 40.0  # s, of a pass
SPACING = 8.0  # m of the way that each target needs, at least
SLOW, FAST = 75.0, 150.0  # lines a second
TRIES = 20  # scenarios: along some ways targets find no place
HEAVY, FREEDOM = 0.25, 5  # share of surveys with heavier tails, and the degrees of freedom of t


def varied_survey(entropy, name="survey", effects=()):
    """SimulatedSurvey of a random scenario; the same entropy gives the same survey.

    Effects, each a dict of its name and parameters as in scenario.toml, change nothing else.

    Parameters
    ----------
    entropy : sequence of int
    name : str
    effects : sequence of dict
    """
    *tries, tails = np.random.SeedSequence(entropy).spawn(TRIES + 1)
    for number, stream in enumerate(tries):
        choice, world = stream.spawn(2)
        scenario = varied_scenario(np.random.default_rng(choice), name)
        seed = world.generate_state(4)  # a SeedSequence would go on where the first survey stopped
        try:
            made = simulate(scenario, np.random.default_rng(seed))
            break
        except ValueError:  # targets that find no place beside this way
            if number == TRIES - 1:
                raise
    more = _heavier(made, np.random.default_rng(tails))
    if effects:
        scenario = Scenario(**{**scenario.model_dump(), "effects": list(effects)})
        made = simulate(scenario, np.random.default_rng(seed))
    targets = replace(made.targets, position=made.targets.position + more)
    return replace(made, targets=targets)


def varied_scenario(rng, name="survey"):
    """Scenario of a street or a river bank with one or two passes, no two alike."""
    river, two = rng.random() < RIVERS, rng.random() < TWO_PASSES
    budget = MOST / (1 + two)  # pulses of a pass
    scanner = _river_scanner(rng) if river else _street_scanner(rng, budget / SHORT)
    duration, speed = rng.uniform(SHORT, LONG), rng.uniform(4.0, 6.0)
    rate = scanner["lines_per_second"] * scanner["points_per_line"]
    rate *= len(scanner.get("rings", (0.0,)))
    if not river:
        duration = min(duration, max(SHORT, budget / rate))
    most = int(duration * speed / SPACING)
    check = int(np.clip(rng.integers(4, 9), 4, max(4, most - 12)))
    control = int(np.clip(rng.integers(12, 25), 12, max(12, most - check)))
    end = 2 * duration + 30.0 if two else duration
    return Scenario(
        name=name,
        origin=(*rng.uniform([400e3, 3.2e6], [600e3, 3.5e6]).round(), round(rng.uniform(5, 300))),
        start_time=round(rng.uniform(2e4, 5.8e5)),
        scene={
            "kind": "river" if river else "street",
            "reference": bool(rng.random() < REFERENCES),
            "gaps": rng.uniform(0.2, 0.6),
            "trees": rng.uniform(0.0, 6.0),
            "cars": rng.uniform(0.0, 6.0),
        },
        targets=_targets(rng, river, control, check),
        drive={
            "duration": duration,
            "speed": speed,
            "turns": rng.uniform(3.0, 8.0) if river else rng.uniform(5.0, 40.0),
            "passes": _passes(rng, river, two),
        },
        scanner=[scanner],
        pos={
            "canyons": _spans(rng, CANYONS, end, 10.0, 30.0),
            "outages": _spans(rng, OUTAGES, end, 5.0, 20.0),
        },
    )


def _targets(rng, river, control, check):
    sigma = rng.choice([0.002, 0.003, 0.005])
    more = {"size": 0.9, "supports": ("post", "wall"), "kinds": ("circle",)} if river else {}
    return {"control": control, "check": check, "survey_sigma": (sigma, sigma), **more}


def _passes(rng, river, two):
    """One pass, or a second one: back on the other lane, or a boat's along the same bank."""
    if not two:
        return ({},)
    aside, pause = rng.uniform(0.9, 1.4), rng.uniform(20.0, 60.0)
    way = "forward" if river else "back"
    return ({"lateral": aside}, {"direction": way, "lateral": -aside, "pause": pause})


def _mounting(rng, boresight):
    """Lever arm and boresight as a drawing has them: no two vehicles are built alike."""
    lever_arm = np.array([0.1, -0.6, 0.4]) + rng.uniform(-0.3, 0.3, 3)
    turned = np.array(boresight) + rng.uniform(-3.0, 3.0, 3)
    return {"lever_arm": tuple(lever_arm.round(4)), "boresight": tuple(turned.round(3))}


def _noises(rng):
    return {"range_noise": rng.uniform(0.003, 0.006), "angle_noise": rng.uniform(0.001, 0.003)}


def _street_scanner(rng, most):
    """A line scanner askew, or now and then a spinning one with a few rings, of so many pulses a
    second at most."""
    pulses = int(rng.integers(300, 501))
    common = {"points_per_line": pulses, **_noises(rng)}
    common |= _mounting(rng, (90.0, 0.0, rng.choice([-1, 1]) * rng.uniform(20.0, 45.0)))
    if rng.random() < SPINNING:
        rings = np.arange(4) * 4.0 - 6.0
        turns = rng.uniform(18.0, 20.0)
        return {**common, "kind": "spinning", "rings": tuple(rings), "lines_per_second": turns}
    fast = np.clip(most / pulses, SLOW, FAST)
    return {**common, "lines_per_second": rng.uniform(SLOW, fast)}


def _river_scanner(rng):
    """A line scanner that looks to the bank alone, by as many pulses a line."""
    around = 360.0 / 150.0
    return {
        "points_per_line": int(rng.integers(400, 501) * around),
        "lines_per_second": rng.uniform(SLOW, 100.0),
        "field_of_view": (-60.0, 90.0),
        **_noises(rng),
        **_mounting(rng, (90.0, 0.0, rng.uniform(0.0, 20.0))),
    }


def _spans(rng, share, end, shortest, longest):
    """One span (start, duration) within a drive, or none. Units: s."""
    happens, start, length = rng.random() < share, rng.random(), rng.uniform(shortest, longest)
    return (((end - length) * start, length),) if happens else ()


def _heavier(survey, rng):
    """What is to be added to the surveyed targets (n, 3) of a survey without effects, so that
    their errors have the tails of Student's t and the same variance. Units: m."""
    happens, n = rng.random() < HEAVY, len(survey.targets)
    stretch = np.sqrt((FREEDOM - 2.0) / rng.chisquare(FREEDOM, (n, 1)))
    error = survey.targets.position - survey.true_centre
    return happens * (stretch - 1.0) * error
