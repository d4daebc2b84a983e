"""Channels beside geometry on page and first screen."""

import pytest

from mlscorr.report.gap import diagnosis_page
from mlscorr.report.gap._channels import channel_rows, channel_statements, distance_rows
from tests.beds.gap_documents import gap_document


def test_the_first_sentence_stands_first():
    "Amber with the sentence where a channel differs; green where none does; none without figures"
    document = gap_document()
    (statement,) = channel_statements(document)
    assert statement.rating == "amber" and "beyond 10 m" in statement.sentence
    document["contrasts"][0]["sentences"] = []
    (statement,) = channel_statements(document)
    assert (statement.rating, statement.sentence) == (
        "green",
        "No significant difference in intensity. Not compared: edge width.",
    )
    assert not list(channel_statements(gap_document(contrasts=[])))


def test_each_bin_has_a_row():
    "Figures to three places, a dash where nothing is known, and which differ"
    rows = channel_rows(gap_document())
    assert [row.bin for row in rows] == ["0 to 10.0", "10.0 to 20.0", "20.0 to 40.0"]
    assert rows[1].texts == ["8102", "11342.000", "0.714", "0.00520", "17.3"]
    assert rows[2].texts[:4] == ["–"] * 4
    assert [row.differs for row in rows] == [False, True, False]


def test_a_distance_stands_beside_its_floor():
    "Distances beyond 95 % of the floor are highlighted; a missing run is a dash"
    first, second = distance_rows(gap_document())
    assert first.sample == "Places of points" and "innovations" in second.sample
    assert first.stands_out and first.after == "–"
    assert "95 % below 0.0114" in first.floor


@pytest.mark.long
def test_the_page_shows_all_of_it():
    "Sentence, silence with its reason, figure and both tables; without them no section"
    page = diagnosis_page(gap_document(), "street").html()
    for text in ("1.40 ± 0.01 times weaker", "Too few depth edges.", "Chamfer distance"):
        assert text in page
    assert 'id="channels"' in page and 'id="distances"' in page
    bare = diagnosis_page(gap_document(contrasts=[], distances=[]), "street").html()
    assert 'id="channels"' not in bare and 'id="distances"' not in bare
