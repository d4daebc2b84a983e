"""The first screen of a diagnosis: what is wrong, how sure, how far the gap shrinks."""

import pytest

from mlscorr.report.gap._verdict import advice, facts, verdict
from tests.beds.gap_documents import CAUSES, KINDS, START, gap_document


def summary(document):
    "Statement of the first screen, in one row of words"
    told = [*verdict(document).sentences, *(text for one in facts(document) for text in one)]
    title, sentences = advice(document)
    return " ".join([verdict(document).kicker, *told, title, *sentences])


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("effect", ["The clock of the scanner is 4.5 ms ± 0.5 ms behind", "98 in 100"]),
        ("vector", ["the scanner is actually 93 mm ± 4 mm farther left."]),
        (
            "none",
            ["No error was detected that this survey could show", "97 in 100", "Of 100 surveys"],
        ),
        (
            "unknown",
            [
                "An error that no tested effect explains",
                "height error that grows with speed squared",
            ],
        ),
        ("unknown", ["91 in 100", "the nearest known effect, lever arm", "16.4 mm → 1.9 mm"]),
        ("pair", ["Two errors", "2.1 ms ± 0.4 ms ahead of", "93 mm ± 4 mm farther left"]),
        (
            "noise",
            ["Noisier than stated", "7.1 mm ± 0.4 mm of additional noise", "more than 99 in 100"],
        ),
        ("alike", ["One of two errors", "Either the recorded lever arm", "31 mm ± 7 mm above"]),
        ("alike", ["97 in 100"]),  # of the one or the other: 61 + 36
        (
            "bump",
            [
                "between gps_time 413215 s and 413225 s, by up to 17.2 cm ± 2.0 cm to the east",
                "88 in",
            ],
        ),
        ("bump", ["Not ruled out: something unknown (3 in 100)."]),
        ("too little", ["No verdict yet", "Only 2 targets were seen; 12 are needed."]),
    ],
)
def test_the_first_screen_says_what_is_wrong(kind, expected):
    "The verdict in words, its size with its sigma, and how sure it is, are the document's"
    text = summary(KINDS[kind]())
    assert [piece for piece in expected if piece not in text] == []


def test_a_jump_is_when_it_happens_not_as_long_as_it_lasts():
    "A jump has one time, although it stays to the end of its pass, 357 s later"
    window = {"effect": "position_step", "start": START + 15.0, "end": START + 372.0}
    document = gap_document("position_step", 0.9, windows=[window])
    parameters = CAUSES["position_bump"][:-1]  # but its width
    document["causes"][0] |= {"effect": "position_step", "parameters": parameters}
    text = summary(document)
    assert "about gps_time 413215 s" in text and "between gps_time" not in text


@pytest.mark.parametrize("kind", ["effect", "pair", "noise", "alike", "bump"])
def test_the_first_screen_says_how_far_the_gap_shrinks_and_what_to_do(kind):
    "Gap before and after on held-out data, its share and interval, the headline, the advice"
    document = KINDS[kind]()
    text = summary(document)
    assert "16.4 mm → 1.9 mm" in text
    assert "The squared gap decreased by 98.7 % (95 %: 93 % to 99.4 %)." in text
    assert document["headline"] in text
    assert f"What to do now {' '.join(document['advice'])}" in text


def test_without_advice_the_page_says_what_to_measure():
    "Nothing is made up where the document holds no advice"
    found = advice(gap_document(advice=[]))
    assert found == ("What to measure next", ["Measure the same road at twice the speed."])
    assert advice(gap_document(advice=[], next_data=[]))[1] == []


def test_no_cause_and_a_gap_beyond_chance_do_not_contradict_each_other():
    "6.0 mm where chance makes up to 4.5: no cause is named, and no word says that it is chance"
    gap = {"before": 6.0, "after": 6.0, "unit": "mm", "null_band": [-4.0, 4.5]}
    document = gap_document("none", 0.967, gap=gap)
    document["verdict"]["excess"] = "chance"
    assert verdict(document).tone == "open"
    assert "more than in 39 of 40 surveys without any error" in summary(document)
    assert "agree within chance" not in summary(document)
    assert "agree within chance" in summary(KINDS["none"]())


def test_errors_beyond_their_sigma_are_not_called_chance():
    "Seven sigmas without a cause: open, larger than stated, and nowhere nothing or chance"
    document = gap_document("none", 0.34)
    document["verdict"] |= {"excess": "stated", "set": ["position_bump", "none"]}
    assert verdict(document).tone == "open"
    assert (
        "No cause is identified, but survey and simulation differ by more than stated"
    ) in summary(document)
    assert "The errors are larger than stated" in summary(document)
    assert "chance" not in " ".join(verdict(document).sentences)


def test_a_pattern_within_chance_is_explained():
    "A cause named while the gap lies in the null band says that its pattern gives it away"
    gap = {"before": 2.4, "after": -1.5, "unit": "mm", "null_band": [1.2, 3.7]}
    said = "It was detected by its pattern, not by its size."
    assert said in summary(gap_document(gap=gap))
    assert said not in summary(gap_document())
