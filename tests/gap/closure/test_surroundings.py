"""Points around targets are kept while the cloud is read once, and no others."""

import numpy as np
import pytest

from mlscorr.gap.closure import Surroundings
from mlscorr.gap.closure.surroundings import sightings_of
from mlscorr.io.clouds import read_chunks
from mlscorr.simulate.scan import recorded_platform


def pulses_about(surroundings, survey, rows, finding):
    "Number of pulses about each target, and the sum of their ranges that are known"
    origin = np.round(rows.position.mean(axis=0))
    platform = recorded_platform(survey, origin)
    about = [surroundings.about(platform, s, origin) for s in sightings_of(rows, finding)]
    return [
        (sum(len(part[0]) for part in parts), sum(np.nansum(part[0].range) for part in parts))
        for parts in about
    ]


def all_near(survey, size=1_000_000, sky=np.inf):
    "Surroundings with all that was ever near, in pieces of so many points; none is farther (m)"
    everything = Surroundings(survey)
    for file in survey.clouds:
        for chunk in read_chunks(file):
            place = survey.trajectory.at(chunk.gps_time).position
            met = chunk[np.linalg.norm(chunk.xyz - place, axis=1) < sky]
            for first in range(0, len(met), size):
                everything.add(met[first : first + size])
    return everything


def test_what_is_let_go_is_about_no_target(case):
    "Narrowed while reading, the surroundings give the same pulses as all that was ever near"
    survey, read, rows, _ = case
    everything = all_near(survey)
    kept = pulses_about(read.surroundings, survey, rows, read.finding)
    assert len(kept) >= 6 and min(number for number, _ in kept) > 100
    np.testing.assert_allclose(kept, pulses_about(everything, survey, rows, read.finding))


@pytest.mark.parametrize("size", [499, 20_000])
def test_pulses_do_not_depend_on_where_chunks_end(case, size):
    "In pieces of any size, as many pulses are about targets before the sky, lost ones among them"
    survey, read, rows, _ = case
    whole = all_near(survey, sky=9.0)
    cut = all_near(survey, size, sky=9.0)
    whole, cut = (pulses_about(near, survey, rows, read.finding) for near in (whole, cut))
    np.testing.assert_allclose(cut, whole)


def test_little_is_kept_once_targets_are_fitted(case):
    "Of points near surveyed places only those stay that pass a fitted target within a second"
    survey, read, _, _ = case
    assert 0 < len(read.surroundings) < 0.8 * len(all_near(survey))
