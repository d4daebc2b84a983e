"""Twins: one drive along one scene, with another POS error and other noise of the scanner."""

from dataclasses import replace

import numpy as np

import mlscorr
from mlscorr.gap.contrast import SampleCollector
from mlscorr.gap.residuals import PatchCollector, scanner_origin
from mlscorr.io.clouds import read_chunks
from mlscorr.io.surveys import simulated_survey
from mlscorr.simulate import Scenario, simulate
from mlscorr.simulate.recording import (
    recorded_passes,
    split_passes,
    streams_by_file,
)
from mlscorr.survey import Trajectory


def write_twin(folder, seed, other=None, duration=18.0, **scanner):
    "A survey of a seed, or its twin by another seed"
    scanner = {"lines_per_second": 75, "points_per_line": 400} | scanner
    scenario = Scenario(
        drive={"duration": duration}, targets={"control": 4, "check": 1}, scanner=[scanner]
    )
    made = simulate(scenario, np.random.default_rng(seed))
    if other is not None:
        scan, pos, effects = np.random.default_rng(other).spawn(3)
        recorded = Trajectory.concatenate(
            recorded_passes(scenario, made.scene, made.true_passes, pos)
        )
        passes = split_passes(recorded, map(len, made.true_passes))
        streams = streams_by_file(len(passes), 1, scan, effects)
        made = replace(made, passes=passes, streams=streams)
    made.write(folder)
    return folder


def range_of(survey, cloud):
    "Ranges (n,) of points, m"
    return np.linalg.norm(cloud.xyz - scanner_origin(survey, cloud.gps_time), axis=1)


def sampled(survey, change=None):
    "ChannelSample of a survey's clouds, each chunk of which something may change"
    patches = PatchCollector(survey)
    sampler = SampleCollector(survey)
    for file in survey.clouds:
        for recorded in read_chunks(file):
            chunk = recorded if change is None else change(survey, recorded)
            patches.add(file, chunk)
            sampler.add(chunk)
    return sampler.sample(patches.patches())


def twins(folder, seed, **scanner):
    "A survey, and its twin as its simulator's clouds"
    survey = mlscorr.read_survey(write_twin(folder / "real", seed, **scanner))
    other = write_twin(folder / "simulated", seed, seed + 1000, **scanner)
    return survey, simulated_survey(other, survey)
