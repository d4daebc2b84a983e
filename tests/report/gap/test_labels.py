"""Parameters of a diagnosis find the effects that they belong to."""

from mlscorr.effects import effect_class
from mlscorr.report.gap._labels import parameters_of
from tests.beds.gap_documents import parameter


def test_parameters_of_pairs_go_to_their_effects():
    "Names with and without the effect before them, and an event's time, find their owner"
    several = [
        parameter("position_step easting", "m", 0.1, 0.01),
        parameter("vertical_datum magnitude", "m", 0.2, 0.01),
        parameter("time", "s", 12.0, None),
    ]
    found = parameters_of("position_step+vertical_datum", several)
    assert found["position_step"].keys() == {"easting", "time"}
    assert found["vertical_datum"]["magnitude"].estimate == 0.2
    plain = [parameter("magnitude", "s", 1e-3, 1e-4), parameter("magnitude", "m", 5e-3, 1e-4)]
    found = parameters_of("time_offset+range_noise", plain)
    assert [found[name]["magnitude"].unit for name in found] == ["s", "m"]
    events = [
        parameter("position_step time", "s", 3.0, None),
        parameter("position_bump time", "s", 5.0, None),
    ]
    found = parameters_of("position_step+position_bump", events)
    assert found["position_step"]["time"].estimate == 3.0
    assert found["position_bump"]["time"].estimate == 5.0


def test_windows_of_a_worse_pos_are_told_with_their_times():
    "Numbered windows of a pair go to the noise class; after two the others are counted"
    kinds = ("start", "length", "largest sigma over the stated")
    several = [parameter("magnitude", "s", 1e-3, 1e-4)]
    for row, values in enumerate([(413205, 20, 9), (413300, 40, 12), (413400, 10, 4)], start=1):
        several += [
            parameter(f"{n} {row}", "s", v, None) for n, v in zip(kinds, values, strict=True)
        ]
    found = parameters_of("time_offset+position_noise", several)
    assert list(found["time_offset"]) == ["magnitude"] and len(found["position_noise"]) == 9
    assert effect_class("position_noise").describe(found["position_noise"]) == (
        "The positions of the POS are less accurate than the simulator assumes: errors up to 12 "
        "times as large between gps_time 413205 s and 413225 s, between gps_time 413300 s and "
        "413340 s and once more."
    )
