"""simulator.toml in and out: beliefs and effects, to the last bit; what is refused and how."""

from dataclasses import asdict

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.effects import EFFECTS, in_order, make_effect
from mlscorr.io.surveys import PosSection, ScannerSection, read_survey
from mlscorr.simulate import Simulator, beliefs_of, read_simulator, write_simulator
from mlscorr.survey import Mounting, Pos, Scanner


def assert_same(one, other):
    "Two simulators agree in every bit"
    assert (one.mounting is None) == (other.mounting is None)
    if one.mounting is not None:
        np.testing.assert_array_equal(one.mounting.lever_arm, other.mounting.lever_arm)
        np.testing.assert_array_equal(
            one.mounting.boresight.as_quat(), other.mounting.boresight.as_quat()
        )
    assert asdict(one.scanner) == asdict(other.scanner)
    assert one.pos.position_sigma == other.pos.position_sigma
    assert one.pos.correlation_time == other.pos.correlation_time
    np.testing.assert_array_equal(one.pos.attitude_sigma, other.pos.attitude_sigma)
    assert one.effects == other.effects


def an_effect(kind, rng):
    "An effect of a class with odd parameters of its usual size"
    values = {}
    for name, quantity in kind.quantities().items():
        usual = quantity.typical or (quantity.largest or 1.0) / 1e3
        numbers = usual * rng.uniform(0.5, 1.5, quantity.count)
        values[name] = float(numbers[0]) if quantity.count == 1 else numbers.tolist()
    if kind.name == "target_outlier":
        values["target"] = 'T "7" \\ Süd'
    return make_effect(kind.name, **values)


def test_what_is_written_is_read_to_the_last_bit(tmp_path):
    "Every effect of the library, mountings and sigmas of 12 decimals; a copy has the same text"
    rng = np.random.default_rng(5)
    for number in range(20):
        angles = (rng.uniform(-180, 180, 3) * [1.0, 0.49, 1.0]).round(rng.integers(13))
        simulator = Simulator(
            Mounting(rng.normal(0, 1, 3), Rotation.from_euler("xyz", angles, degrees=True)),
            Scanner(rng.uniform(0, 0.01), np.radians(round(rng.uniform(0, 0.01), 9)), 150.0),
            Pos(
                rng.uniform(0, 0.1),
                np.radians(rng.uniform(0, 0.1, 3).round(12)),
                1e-5 + rng.uniform(),
            ),
            in_order(an_effect(kind, rng) for kind in EFFECTS),
        )
        path = tmp_path / f"{number}.toml"
        copy = tmp_path / "copy.toml"
        write_simulator(simulator, path)
        again = read_simulator(path)
        assert_same(again, simulator)
        write_simulator(again, copy)
        assert copy.read_text() == path.read_text()
    assert len(again.effects) == len(EFFECTS)


def test_a_boresight_of_any_digits_comes_back(tmp_path):
    "Rotations that no short angles give are read as the same to 1e-12 deg of each angle"
    rng = np.random.default_rng(6)
    path = tmp_path / "simulator.toml"
    for boresight in Rotation.random(50, random_state=rng):
        write_simulator(Simulator(Mounting(np.zeros(3), boresight), Scanner(), Pos()), path)
        turn = read_simulator(path).mounting.boresight * boresight.inv()
        assert turn.magnitude() < np.radians(1e-12)


def test_the_beliefs_of_a_survey_are_its_file(street, tmp_path):
    "Mounting, scanner and POS as in survey.toml, in the same words, without effects"
    survey = read_survey(street)
    beliefs = beliefs_of(survey)
    assert beliefs.effects == ()
    write_simulator(beliefs, tmp_path / "simulator.toml")
    assert_same(read_simulator(tmp_path / "simulator.toml"), beliefs)
    text = (tmp_path / "simulator.toml").read_text()
    for line in ("lever_arm = [0.1, -0.6, 0.4]", "boresight = [90.0, 0.0, 35.0]"):
        assert line in text and line in (street / "survey.toml").read_text()


def test_what_is_left_out_is_as_in_survey_toml(tmp_path):
    "An empty file: no mounting, the usual scanner and POS; a mounting at 90 deg comes back"
    path = tmp_path / "simulator.toml"
    path.write_text("")
    assert_same(
        read_simulator(path), Simulator(None, ScannerSection().scanner(), PosSection().pos())
    )
    path.write_text("[mounting]\nlever_arm = [0, 0, 1]\nboresight = [10.0, 90.0, 20.0]\n")
    steep = read_simulator(path)
    write_simulator(steep, path)
    turn = read_simulator(path).mounting.boresight * steep.mounting.boresight.inv()
    assert turn.magnitude() < 1e-12


def test_what_nobody_stated_is_not_written_as_stated(tmp_path):
    "A default stays one from file to file; a number that was given is written"
    path = tmp_path / "simulator.toml"
    path.write_text("[pos]\nposition_sigma = 0.02\n[scanner]\nangle_noise = 0.002\n")
    simulator = read_simulator(path)
    assert simulator.pos.assumed == ("attitude_sigma", "correlation_time")
    assert simulator.scanner.assumed == ("range_noise",)
    write_simulator(simulator, path)
    text = path.read_text()
    assert "position_sigma = 0.02" in text and "angle_noise = 0.002" in text
    assert "attitude_sigma" not in text and "range_noise" not in text
    again = read_simulator(path)
    assert_same(again, simulator)
    assert again.pos.assumed == simulator.pos.assumed


def test_effects_act_in_their_order_however_they_are_listed(tmp_path):
    "As in scenario.toml"
    path = tmp_path / "simulator.toml"
    path.write_text(
        '[[effects]]\nname = "lever_arm"\nmagnitude = [0, 0, 0.1]\n'
        '[[effects]]\nname = "time_offset"\nmagnitude = 0.002\n'
    )
    assert [effect.name for effect in read_simulator(path).effects] == ["time_offset", "lever_arm"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[scaner]\n", r"scaner is an unknown key; the nearest known one is scanner\."),
        ("[scanner]\nrange_nose = 1", r"scanner\.range_nose is .* is scanner\.range_noise\."),
        (
            "[mounting]\nlever_arm = [0, 0, 0]\nboresight = [0, 0, 0]\nlever_arm_sigma = [1, 1, 1]",
            r"mounting\.lever_arm_sigma is an unknown key",
        ),
        ("[mounting]\nlever_arm = [0, 0, 0]", r"mounting\.boresight is missing\."),
        ("[pos]\ncorrelation_time = 0", r"pos\.correlation_time = 0 is invalid"),
        (
            "[[effects]]\nname = 'boresite'\nmagnitude = 1",
            r"effects\.0: 'boresite' is an unknown effect; the nearest known one is boresight\.",
        ),
        ("[[effects]]\nname = 'dropout'\nshare = 0.1", r"dropout has no parameter 'share'; its"),
        (
            2 * "[[effects]]\nname = 'range_noise'\nmagnitude = 0.01\n",
            "range_noise is listed 2 times",
        ),
        ("[effects]\nname = 'dropout'", r"write \[\[effects\]\]"),
        ("pos = ", "is not valid TOML"),
    ],
)
def test_what_can_not_be_is_refused_in_a_sentence(tmp_path, text, message):
    "File, key, and the nearest known one"
    path = tmp_path / "simulator.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as error:
        read_simulator(path)
    assert "\n" not in str(error.value) and "simulator.toml" in str(error.value)


def test_a_missing_simulator_is_named(tmp_path):
    "The path that was looked for"
    with pytest.raises(FileNotFoundError, match=r"none\.toml does not exist; a simulator is a"):
        read_simulator(tmp_path / "none.toml")
