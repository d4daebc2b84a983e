"""How far a gap shrinks on rows that were not used to find its cause."""


def test_a_cause_closes_its_gap_where_it_was_not_looked_for(late):
    "Both halves name the clock, and nine tenths of the gap's square go"
    closure = late.close("time_offset")
    assert closure.labels == ("time_offset", "time_offset")
    assert closure.before > closure.null_band[1]
    assert closure.shrink > 0.9
    assert closure.interval[0] < closure.shrink < closure.interval[1]
    assert closure.gap.after < closure.gap.before
    assert "looks at check points were never used" in closure.held_out


def test_nothing_added_closes_nothing(late):
    "Without a cause the gap is the same before and after"
    closure = late.close("none")
    assert closure.shrink == 0.0
    assert closure.before == closure.after
    assert closure.held_out == "Nothing was added to the simulator."
