"""Random scenarios of many kinds, small enough to make hundreds in seconds each."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.survey import SimulatedSurvey, simulate


@dataclass(frozen=True)
class Mix:
    """Distribution of scenarios, so that each is made in seconds.

    Parameters
    ----------
    rivers, spinning, two_passes, references : float
        Shares of river banks, of spinning scanners on streets, of surveys with two passes and with
        a reference surface.
    canyons, outages : float
        Shares with few satellites, and without GNSS, for some seconds.
    pulses : float
        Largest number in a survey of a street: about 1.6 million points.
    duration : tuple
        Shortest and longest pass. Units: s.
    lines : tuple
        Slowest and fastest scanner. Units: 1/s.
    spacing : float
        Smallest spacing of targets along the path. Units: m.
    heavy_tails, freedom : float
        Share of surveys whose targets err by Student's t, and its degrees of freedom.
    attempts : int
        Attempts at a scenario, because some paths have no room for targets.
    """

    rivers: float = 0.2
    spinning: float = 0.12
    two_passes: float = 0.5
    references: float = 2 / 3
    canyons: float = 0.3
    outages: float = 0.2
    pulses: float = 2.2e6
    duration: tuple[float, float] = (40.0, 70.0)
    lines: tuple[float, float] = (75.0, 150.0)
    spacing: float = 8.0
    heavy_tails: float = 0.25
    freedom: float = 5.0
    attempts: int = 20


MIX = Mix()


def random_survey(
    entropy: Sequence[int], name: str = "survey", effects: Sequence[dict] = ()
) -> SimulatedSurvey:
    """Make the SimulatedSurvey of a random scenario; the same entropy gives the same survey.

    Effects, each a dict of its name and parameters as in scenario.toml, change nothing else.

    Parameters
    ----------
    entropy : sequence of int
    name : str
    effects : sequence of dict
    """
    *streams, tails = np.random.SeedSequence(entropy).spawn(MIX.attempts + 1)
    for number, stream in enumerate(streams):
        choice, world = stream.spawn(2)
        seed = world.generate_state(4)  # a SeedSequence would continue after the first survey
        try:
            scenario = random_scenario(np.random.default_rng(choice), name)
            with warnings.catch_warnings(action="error"):
                made = simulate(scenario, np.random.default_rng(seed))
            break
        except (ValueError, UserWarning):  # no room for a target, or an interval beyond the path
            if number == MIX.attempts - 1:
                raise
    more = _heavier(made, np.random.default_rng(tails))
    if effects:
        scenario = Scenario(**{**scenario.model_dump(), "effects": list(effects)})
        made = simulate(scenario, np.random.default_rng(seed))
    return replace(made, targets=replace(made.targets, position=made.targets.position + more))


def random_scenario(rng: Generator, name: str = "survey") -> Scenario:
    """Draw a random scenario of a street or a river bank with one or two passes.

    Parameters
    ----------
    rng : Generator
    name : str
    """
    river = rng.random() < MIX.rivers
    two = rng.random() < MIX.two_passes
    budget = MIX.pulses / (1 + two)  # pulses of a pass
    if river:
        scanner = _river_scanner(rng)
    else:
        scanner = _street_scanner(rng, budget / MIX.duration[0])
    duration = rng.uniform(*MIX.duration)
    speed = rng.uniform(4.0, 6.0)
    rate = scanner["lines_per_second"] * scanner["points_per_line"]
    rate *= len(scanner.get("rings", (0.0,)))
    if not river:
        duration = min(duration, max(MIX.duration[0], budget / rate))
    room = int(duration * speed / MIX.spacing)
    check = int(np.clip(rng.integers(4, 9), 4, max(4, room - 12)))
    control = int(np.clip(rng.integers(12, 25), 12, max(12, room - check)))
    end = 2 * duration + 30.0 if two else duration
    kind = "street"
    bends = 5.0, 40.0
    if river:
        kind = "river"
        bends = 3.0, 8.0
    place = rng.uniform([400e3, 3.2e6], [600e3, 3.5e6])
    parts = {
        "name": name,
        "origin": (*place.round(), round(rng.uniform(5, 300))),
        "start_time": round(rng.uniform(2e4, 5.8e5)),
        "scene": {
            "kind": kind,
            "reference": bool(rng.random() < MIX.references),
            "gaps": rng.uniform(0.2, 0.6),
            "trees": rng.uniform(0.0, 6.0),
            "cars": rng.uniform(0.0, 6.0),
        },
        "targets": _targets(rng, river, control, check),
        "drive": {
            "duration": duration,
            "speed": speed,
            "turns": rng.uniform(*bends),
            "passes": _passes(rng, river, two),
        },
        "scanner": [scanner],
        "pos": {
            "canyons": _spans(rng, MIX.canyons, end, 10.0, 30.0),
            "outages": _spans(rng, MIX.outages, end, 5.0, 20.0),
        },
    }
    return Scenario.model_validate(parts)


def _targets(rng, river, control, check):
    sigma = rng.choice([0.002, 0.003, 0.005])
    if river:
        more = {"size": 0.9, "supports": ("post", "wall"), "kinds": ("circle",)}
    else:
        more = {}
    return {"control": control, "check": check, "survey_sigma": (sigma, sigma), **more}


def _passes(rng, river, two):
    """Draw one pass, or a second one: back on the other lane, or again along the bank by boat."""
    if not two:
        return ({},)
    lateral = rng.uniform(0.9, 1.4)
    pause = rng.uniform(20.0, 60.0)
    direction = "forward" if river else "back"
    return ({"lateral": lateral}, {"direction": direction, "lateral": -lateral, "pause": pause})


def _mounting(rng, boresight):
    """Draw lever arm and boresight as in a drawing, different for each vehicle."""
    lever_arm = np.array([0.1, -0.6, 0.4]) + rng.uniform(-0.3, 0.3, 3)
    turned = np.array(boresight) + rng.uniform(-3.0, 3.0, 3)
    return {"lever_arm": tuple(lever_arm.round(4)), "boresight": tuple(turned.round(3))}


def _noises(rng):
    return {"range_noise": rng.uniform(0.003, 0.006), "angle_noise": rng.uniform(0.001, 0.003)}


def _street_scanner(rng, fastest):
    """Draw an oblique line scanner, or sometimes a spinning one with a few rings, up to a given
    number of pulses per second.
    """
    pulses = int(rng.integers(300, 501))
    common = {"points_per_line": pulses, **_noises(rng)}
    common |= _mounting(rng, (90.0, 0.0, rng.choice([-1, 1]) * rng.uniform(20.0, 45.0)))
    if rng.random() < MIX.spinning:
        rings = np.arange(4) * 4.0 - 6.0
        turns = rng.uniform(18.0, 20.0)
        return {**common, "kind": "spinning", "rings": tuple(rings), "lines_per_second": turns}
    fast = np.clip(fastest / pulses, *MIX.lines)
    return {**common, "lines_per_second": rng.uniform(MIX.lines[0], fast)}


def _river_scanner(rng):
    """Draw a line scanner that covers only the bank, with the same number of pulses per line."""
    around = 360.0 / 150.0
    return {
        "points_per_line": int(rng.integers(400, 501) * around),
        "lines_per_second": rng.uniform(MIX.lines[0], 100.0),
        "field_of_view": (-60.0, 90.0),
        **_noises(rng),
        **_mounting(rng, (90.0, 0.0, rng.uniform(0.0, 20.0))),
    }


def _spans(rng, share, end, shortest, longest):
    """Draw one interval (start, duration) within a drive, or none. Units: s."""
    happens = rng.random() < share
    start = rng.random()
    length = rng.uniform(shortest, longest)
    if happens:
        return (((end - length) * start, length),)
    return ()


def _heavier(survey, rng):
    """Additions (n, 3) to the surveyed targets that give errors a Student's t distribution with
    the same variance, for a survey without effects. Units: m.
    """
    happens = rng.random() < MIX.heavy_tails
    n = len(survey.targets)
    factor = np.sqrt((MIX.freedom - 2.0) / rng.chisquare(MIX.freedom, (n, 1)))
    return happens * (factor - 1.0) * (survey.targets.position - survey.true_centre)
