"""Additions to a survey."""

from dataclasses import replace

import gap_study

from mlscorr.gap.plan.additions import additions


def test_every_addition_can_be_made_where_pulses_spread_about_their_targets():
    "Five additions, though the first pulse is earlier than the first target; each has more rows"
    g = gap_study.geometry(6, targets=24, patches=0)
    time = g.rows.pulses.gps_time
    early = replace(g.rows.pulses, gps_time=time - 0.2 * (time == time.min()))
    made = additions(replace(g.rows, pulses=early), g.survey)
    assert len(made) == 5
    assert all(len(rows) > len(g.rows) for rows, _ in made.values())


def test_one_target_seen_by_two_passes_can_have_a_neighbour():
    "No visit moves into the pause between the passes: additions are made of one target, too"
    g = gap_study.geometry(6, targets=1, patches=0)
    first, last = g.survey.trajectory.passes[0]
    made = additions(g.rows, g.survey)
    assert last > first
    assert all(len(rows) > len(g.rows) for rows, _ in made.values())
