"""The catalogue of the sentences of an evaluation, with values as a survey has them."""

import numpy as np
import pytest

from mlscorr.evaluate.wording import ACCURACY, BEAMS, DATUM, GATES, REASONS, reason_in_words
from mlscorr.io.trajectories import map_factors
from mlscorr.matching import REASONS as MATCHING
from mlscorr.survey import Statement

GROUND = map_factors("EPSG:32650", np.array([522_700.0, 3_374_000.0, 42.0]))
NET = {"length": 0.04, "extent": 100.0, "observations": 12, "log_evidence": np.log(5e7)}
SHIFT = {"observations": 12, "log_evidence": np.log(25.0), "assumed_sigma": None}
SCALE = {"size": [4e-4], "sigma": [1e-5], "ground": GROUND, "is_ground": True}
EVIDENCE = "12 observations, Bayes factor 1e8 against an error of the POS"
FOLLOWS = "The corrected cloud follows the control; find out which of the two is right."
ASSUMED = (
    " Nobody stated the sigma of the POS: 0.02 m is assumed, and a worse POS could differ as much. "
    "State it under [pos] in survey.toml."
)
CLOCK = {"file": "a.laz", "beside": 90.2, "shifted": 8.1, "samples": 600}
CLASS = {"axis": "vertical", "size": 3, "rmse": 0.025, "fit": 0.02, "survey": 0.015}

CATALOGUE = [
    (REASONS, "check point", {}, "check point"),
    (
        REASONS,
        "outlier",
        {"statistic": 41.26, "critical": 16.27},
        "outlier: statistic 41.3, critical value 16.3",
    ),
    (
        REASONS,
        "no pose",
        {"points": 25, "start": 413_241.0, "end": 413_243.5},
        "25 points near it, at 413241.0 to 413243.5 s, were measured outside the trajectory or "
        "in one of its gaps, where nothing is interpolated.",
    ),
    (REASONS, "seen by others", {}, "Another scanner scanned it, this one did not."),
    (
        DATUM,
        "shift",
        {"size": [0.8, 0.4], "length": 0.894, **SHIFT},
        "The control points are offset from the cloud by 0.89 m (E +0.80, N +0.40 m; 12 "
        "observations, Bayes factor 25 against an error of the POS). Likely cause: another "
        "horizontal datum, realization or epoch. The corrected cloud follows the control; find "
        "out which of the two is right.",
    ),
    (
        DATUM,
        "height",
        {"size": [-0.3], **SHIFT, "assumed_sigma": 0.02},
        "The control points are 0.30 m below the cloud (12 observations, Bayes factor 25 "
        "against an error of the POS). Likely cause: another vertical datum or geoid, or a "
        "wrong height of an antenna, instrument or prism pole. The corrected cloud follows the "
        "control; find out which of the two is right. The sigma of the POS is not given: 0.02 m "
        "is assumed, and a less accurate POS could explain the difference. Set it under [pos] "
        "in survey.toml.",
    ),
    (
        DATUM,
        "height",
        {"size": [0.3], **SHIFT},
        "The control points are 0.30 m above the cloud (12 observations, Bayes factor 25 "
        "against an error of the POS). Likely cause: another vertical datum or geoid, or a "
        "wrong height of an antenna, instrument or prism pole. The corrected cloud follows the "
        "control; find out which of the two is right.",
    ),
    (
        DATUM,
        "scale",
        SCALE | NET,
        "The control network is larger than the cloud by +400 +/- 10 ppm (0.040 m at 100 m from "
        "its center; 12 observations, Bayes factor 1e8 against an error of the POS). Ground "
        "distances would be larger by +394 ppm there (scale factor of the projection 0.999606), "
        'which fits. If the control is in ground distances, set scale_factor = "ground" under '
        "[control], or scale_factor = 0.999600. The corrected cloud follows the control; find "
        "out which of the two is right.",
    ),
    (
        DATUM,
        "scale",
        SCALE | NET | {"size": [5e-3], "is_ground": False},
        "The control network is larger than the cloud by +5000 +/- 10 ppm (0.040 m at 100 m "
        "from its center; 12 observations, Bayes factor 1e8 against an error of the POS). "
        "Ground distances would be larger by +394 ppm there (scale factor of the projection "
        "0.999606), which does not fit. Look for another projection or a wrong unit; if the "
        "control has this scale, set scale_factor = 0.995025 under [control]. The corrected "
        "cloud follows the control; find out which of the two is right.",
    ),
    (
        DATUM,
        "scale",
        SCALE | NET | {"ground": None, "is_ground": False},
        "The control network is larger than the cloud by +400 +/- 10 ppm (0.040 m at 100 m from "
        "its center; 12 observations, Bayes factor 1e8 against an error of the POS). Likely "
        "cause: ground distances without the map scale. If so, set scale_factor = 0.999600 "
        "under [control]. The corrected cloud follows the control; find out which of the two is "
        "right.",
    ),
    (
        DATUM,
        "turn",
        {"size": [np.radians(0.03)], "sigma": [1e-5], "ground": GROUND, **NET},
        "The control network is rotated counter-clockwise relative to the cloud by +0.0300 +/- "
        "0.0006 deg (0.040 m at 100 m from its center; 12 observations, Bayes factor 1e8 "
        "against an error of the POS). Likely cause: another projection or zone, or a local "
        "network with another orientation (true north would give -0.1201 deg). Export the "
        "control in the CRS of the cloud. The corrected cloud follows the control; find out "
        "which of the two is right.",
    ),
    (
        DATUM,
        "tilt",
        {"size": np.array([4e-4, -1e-4]), "sigma": np.full(2, 1e-5), **NET},
        "The control network is tilted relative to the cloud: it rises by +0.40 +/- 0.01 mm/m "
        "toward east and -0.10 +/- 0.01 mm/m toward north (0.040 m at 100 m from its center; 12 "
        "observations, Bayes factor 1e8 against an error of the POS). Likely cause: another "
        "geoid model, or a network that was never leveled. Export the control with the geoid of "
        "the cloud. The corrected cloud follows the control; find out which of the two is right.",
    ),
    (
        BEAMS,
        "no time",
        {"file": "a.laz", "count": 9, "samples": 900, "values": "-1"},
        "9 of 900 points sampled from a.laz have gps_time -1, which means no time. They stay "
        "uncorrected (exit code 4). Export them with gps_time, or remove them.",
    ),
    (
        BEAMS,
        "outside",
        {
            "file": "a.laz",
            "count": 9,
            "samples": 900,
            "start": 413_200.0,
            "end": 413_209.9,
            "gaps": 2,
            "away": 3.25,
        },
        "9 of 900 points sampled from a.laz are outside the trajectory [413200.000, 413209.900] "
        "s or in its gaps (2), by up to 3.250 s. They stay uncorrected (exit code 4). Export "
        "the whole trajectory.",
    ),
    (
        BEAMS,
        "backwards",
        {"file": "a.laz", "steps": 899},
        "The times of a.laz run backward: none of 899 sampled points is later than the one "
        "before. Unless the file was sorted this way, its gps_time is wrong, and the points "
        "would get the correction of another time.",
    ),
    (
        BEAMS,
        "other survey",
        {
            "file": "a.laz",
            "beside": 3000.4,
            "off": 71.0,
            "samples": 900,
            "near": 200.0,
            "off_plane": 20.0,
        },
        "The points of a.laz are 3000 m from the trajectory and 71 deg off the scan plane "
        "(median of 900 samples; limits 200 m and 20 deg). The file may belong to another "
        "survey, its gps_time may be wrong (UTC is 18 s late), or [mounting] may be wrong or in "
        "wrong units.",
    ),
    (
        BEAMS,
        "other clock",
        {"lag": 18, "later": -18, **CLOCK},
        "The times of a.laz are 18 s later than the trajectory's: its points are 90 m from the "
        "vehicle, and 8 m from its position 18 s before (horizontal medians of 600 samples). "
        "The trajectory seems to be in UTC, the cloud in GPS time: export both in GPS time, or "
        "add 18 to trajectory.time_constant (s) in survey.toml.",
    ),
    (
        BEAMS,
        "other clock",
        {"lag": 17, "later": 17, **CLOCK},
        "The times of a.laz are 17 s earlier than the trajectory's: its points are 90 m from "
        "the vehicle, and 8 m from its position 17 s after (horizontal medians of 600 samples). "
        "The cloud seems to be in UTC, the trajectory in GPS time: export both in GPS time, or "
        "add -17 to trajectory.time_constant (s) in survey.toml.",
    ),
    (
        ACCURACY,
        "not determined",
        {},
        "Not determined: no check point was used, and there are too few control points for "
        "leave-one-out.",
    ),
    (
        ACCURACY,
        "left out",
        {"points": 12},
        "No check point was used. 12 control points were predicted from the others "
        "(leave-one-out). This estimates the accuracy but is not a conformant test, because "
        "these points were used in the correction.",
    ),
    (
        ACCURACY,
        "too few",
        {"points": 1, "least": 30},
        "The standard requires at least 30 check points; 1 point was used. The test is not "
        "conformant.",
    ),
    (
        ACCURACY,
        "tested",
        {"points": 30},
        "This data set was tested with 30 independent check points.",
    ),
    (
        ACCURACY,
        "class",
        CLASS | {"is_conformant": True},
        "It meets the 3-cm vertical accuracy class: RMSE_V is 2.5 cm (2.0 cm fit to the points, "
        "1.5 cm survey of the points).",
    ),
    (
        ACCURACY,
        "class",
        CLASS | {"is_conformant": False},
        "It would meet the 3-cm vertical accuracy class: RMSE_V is 2.5 cm (2.0 cm fit to the "
        "points, 1.5 cm survey of the points).",
    ),
    (
        ACCURACY,
        "inaccurate points",
        {"axis": "vertical", "survey": 0.015},
        "The vertical survey error of the points, 1.5 cm, is more than half of the RMSE found. "
        "Test points should be twice as accurate as the product.",
    ),
    (
        GATES,
        "not determined",
        {"quantity": "check.rmse_h", "what": "rmse of check points in height (m)"},
        "check.rmse_h: rmse of check points in height (m) is not determined.",
    ),
    (
        GATES,
        "exceeded",
        {
            "quantity": "check.rmse_h",
            "what": "rmse of check points in height (m)",
            "value": 0.05,
            "operator": ">",
            "limit": 0.03,
        },
        "check.rmse_h: rmse of check points in height (m) is 0.05 > 0.03.",
    ),
]


@pytest.mark.parametrize(("wordings", "key", "values", "sentence"), CATALOGUE)
def test_each_statement_has_its_sentence(wordings, key, values, sentence):
    "Each sentence gives name, number, units, likely cause and remedy"
    assert Statement(key, values=values).sentence(wordings) == sentence


@pytest.mark.parametrize("wordings", [REASONS, DATUM, BEAMS, ACCURACY, GATES])
def test_no_sentence_is_missing_from_the_catalogue(wordings):
    "Sentences of the matching are in the catalogue of that room"
    listed = {key for known, key, _, _ in CATALOGUE if known is wordings}
    assert listed == wordings.keys() - MATCHING.keys()


def test_a_point_without_a_reason_has_no_words():
    "As documents have it: an empty text"
    assert reason_in_words(None) == ""
