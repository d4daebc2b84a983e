"""The catalogue of the sentences of effects, with sizes as a diagnosis finds them."""

import pytest

from mlscorr.effects import SizeEstimate as Size
from mlscorr.effects import effect_class, effects_by_name

SIGMAS = {"start": 413205.0, "length": 20.0, "largest sigma over the stated": 12.0}
CATALOGUE = [
    (
        "time_offset",
        {"magnitude": Size(-0.0045, 0.0005, "s")},
        "",
        "The clock of the scanner is 4.5 ms ± 0.5 ms behind the clock of the POS.",
    ),
    (
        "clock_drift",
        {"magnitude": Size(2e-5, 2e-6, "s per s")},
        "",
        "The clock of the scanner runs fast by 20.0 ppm ± 2.0 ppm.",
    ),
    (
        "time_jitter",
        {"magnitude": Size(1e-4, 1e-5, "s")},
        "",
        "The time stamps of the scanner have noise of 100 µs ± 10 µs that the simulator does "
        "not include.",
    ),
    (
        "boresight",
        {"forward": Size(-0.21, 0.01, "deg")},
        "",
        "The recorded boresight is wrong: the scanner is actually rotated 0.210° ± 0.010° left "
        "side down.",
    ),
    (
        "lever_arm",
        {"right": Size(-0.093, 0.004, "m")},
        "",
        "The recorded lever arm is wrong: the scanner is actually 93 mm ± 4 mm farther left.",
    ),
    (
        "range_bias",
        {"magnitude": Size(0.01, 0.001, "m")},
        "",
        "All ranges of the scanner are 10.0 mm ± 1.0 mm too long.",
    ),
    (
        "range_scale",
        {"magnitude": Size(3e-4, 2e-5, "ratio")},
        "",
        "The ranges of the scanner are too long by 300 ppm ± 20 ppm of their length.",
    ),
    (
        "range_walk",
        {"magnitude": Size(-0.005, 0.001, "m per decade")},
        "",
        "Bright surfaces are measured nearer than dark ones: 5.0 mm ± 1.0 mm for ten times the "
        "intensity.",
    ),
    (
        "incidence_bias",
        {"magnitude": Size(0.003, 0.001, "m")},
        "",
        "At oblique incidence, ranges are too long: by 3.0 mm ± 1.0 mm at 60°.",
    ),
    (
        "range_noise",
        {"magnitude": Size(0.007, 0.001, "m")},
        "",
        "The ranges of the scanner are noisier than stated: 7.0 mm ± 1.0 mm of additional noise.",
    ),
    (
        "angle_scale",
        {"magnitude": Size(1e-3, 1e-4, "ratio")},
        "",
        "The scan angles of the encoder are too large by 1000 ppm ± 100 ppm.",
    ),
    (
        "angle_eccentricity",
        {
            "magnitude cos(phase)": Size(3e-4, 1e-5, "rad"),
            "magnitude sin(phase)": Size(4e-4, 1e-5, "rad"),
        },
        "",
        "The scanner's encoder is eccentric: scan angles are wrong by up to 0.500 mrad ± 0.010 "
        "mrad, once per turn.",
    ),
    (
        "angle_noise",
        {"magnitude": Size(0.002, 0.0002, "deg")},
        "",
        "The scan angles are noisier than stated: 0.00200° ± 0.00020° of additional noise.",
    ),
    (
        "heading_drift",
        {"magnitude": Size(0.03, 0.002, "deg")},
        "",
        "The heading of the POS drifts to the right by 0.0300° ± 0.0020° from start to end of "
        "each pass.",
    ),
    (
        "position_step",
        {"easting": Size(0.19, 0.02, "m"), "height": Size(-0.08, 0.02, "m")},
        " at gps_time 413215.2 s",
        "The recorded position jumps 19.0 cm ± 2.0 cm to the east and 80 mm ± 20 mm downward at "
        "gps_time 413215.2 s and stays offset until the end of the pass.",
    ),
    (
        "position_bump",
        {"easting": Size(0.172, 0.02, "m")},
        " between gps_time 413215 s and 413225 s",
        "The recorded position is temporarily wrong between gps_time 413215 s and 413225 s, by "
        "up to 17.2 cm ± 2.0 cm to the east.",
    ),
    (
        "position_noise",
        {"magnitude": Size(0.02, 0.002, "m")},
        "",
        "The positions of the POS are less accurate than the simulator assumes: 20.0 mm ± 2.0 "
        "mm of additional noise.",
    ),
    (
        "position_noise",
        {"factor on sigma": Size(2.4, 0.2, "")},
        "",
        "The positions of the POS are less accurate than the simulator assumes: errors 2.40 ± "
        "0.20 times as large.",
    ),
    (
        "position_noise",
        {key: Size(value, None, "") for key, value in SIGMAS.items()},
        "",
        "The positions of the POS are less accurate than the simulator assumes: errors up to 12 "
        "times as large between gps_time 413205 s and 413225 s.",
    ),
    (
        "vertical_datum",
        {"magnitude": Size(0.031, 0.007, "m")},
        "",
        "The surveyed heights of the targets are 31 mm ± 7 mm above those of the cloud: two "
        "height systems.",
    ),
    (
        "horizontal_datum",
        {"easting": Size(0.2, 0.01, "m")},
        "",
        "Surveyed targets and cloud are in different frames: the targets are shifted by 20.0 cm "
        "± 1.0 cm to the east.",
    ),
    (
        "map_rotation",
        {"magnitude": Size(1e-4, 1e-5, "rad")},
        "",
        "The frame of the surveyed targets is rotated counter-clockwise by 0.100 mrad ± 0.010 "
        "mrad relative to that of the cloud.",
    ),
    (
        "map_scale",
        {"magnitude": Size(4e-4, 1e-5, "ratio")},
        "",
        "The scale of the surveyed coordinates is too large by 400 ppm ± 10 ppm, compared with "
        "the cloud.",
    ),
    (
        "target_outlier",
        {"northing": Size(0.05, 0.005, "m")},
        "T07",
        "The surveyed coordinates of T07 are wrong by 50 mm ± 5 mm to the north.",
    ),
    (
        "beam_divergence",
        {"magnitude": Size(0.35, 0.02, "mrad")},
        "",
        "The laser beam is 0.350 mrad ± 0.020 mrad wider than stated.",
    ),
    (
        "dropout",
        {"magnitude": Size(0.05, 0.004, "ratio")},
        "",
        "5.0 % ± 0.4 % of the expected returns are missing.",
    ),
]


@pytest.mark.parametrize(("name", "sizes", "where", "sentence"), CATALOGUE)
def test_each_effect_has_its_sentence(name, sizes, where, sentence):
    "With its size, its direction and where it acts"
    assert effect_class(name).describe(sizes, where) == sentence


def test_no_effect_is_missing_from_the_catalogue():
    "Every built-in effect is read"
    own = {name for name, kind in effects_by_name().items() if kind.__module__[:7] == "mlscorr"}
    assert {name for name, *_ in CATALOGUE} == own
