"""What lies about targets is kept while the cloud is read once, and nothing else."""

import numpy as np

from mlscorr.gap.close.sightings import sightings_of
from mlscorr.gap.close.surroundings import Surroundings
from mlscorr.io.las import read_chunks
from mlscorr.simulate.scan.replay import recorded_platform


def pulses_about(surroundings, survey, rows, finding):
    "Number of pulses about each target, and the sum of their ranges that are known"
    origin = np.round(rows.position.mean(axis=0))
    platform = recorded_platform(survey, origin)
    about = [surroundings.about(platform, s, origin) for s in sightings_of(rows, finding)]
    return [
        (sum(len(part[0]) for part in parts), sum(np.nansum(part[0].range) for part in parts))
        for parts in about
    ]


def all_near(survey):
    "Surroundings with all that was ever near"
    everything = Surroundings(survey)
    for file in survey.clouds:
        for chunk in read_chunks(file):
            everything.add(chunk)
    return everything


def test_what_is_let_go_is_about_no_target(case):
    "Narrowed while reading, the surroundings give the same pulses as all that was ever near"
    survey, read, rows, _ = case
    everything = all_near(survey)
    kept = pulses_about(read.surroundings, survey, rows, read.finding)
    assert len(kept) >= 6 and min(number for number, _ in kept) > 100
    np.testing.assert_allclose(kept, pulses_about(everything, survey, rows, read.finding))


def test_little_is_kept_once_targets_are_fitted(case):
    "Of points near surveyed places only those stay that pass a fitted target within a second"
    survey, read, _, _ = case
    assert 0 < len(read.surroundings) < 0.8 * len(all_near(survey))
