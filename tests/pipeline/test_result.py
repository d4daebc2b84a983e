"""Results are written as clouds, tables, document and pages, in this order, or not at all."""

import json
from dataclasses import dataclass

import pytest

from mlscorr.pipeline._result import KnownResult, Reported, ResultFiles


def table(path):
    "A table of one line, and the name of its file"
    path.write_text("easting\n")
    return [path.name]


def test_a_document_names_what_was_written_before_it_and_a_page_shows_the_document(tmp_path):
    "A cloud of 5 points and a table are in the document, the document with its schema on a page"

    def clouds(folder):
        (folder / "pass-1.laz").write_bytes(b"points")
        return {"points": 5}

    def report(written):
        assert sorted(path.name for path in written.folder.iterdir()) == ["pass-1.laz", "rows.csv"]
        return Reported(written.clouds | {"tables": written.tables["rows.csv"]}, {"page": page})

    def page(path, content):
        path.write_text(content["schema"])

    files = ResultFiles("sizes", (), report, {"rows.csv": table})
    content = files.write(tmp_path / "out", clouds=clouds)
    assert content == {"schema": "mlscorr.sizes/1", "points": 5, "tables": ["rows.csv"]}
    assert json.loads((tmp_path / "out" / "sizes.json").read_text()) == content
    assert (tmp_path / "out" / "page").read_text() == "mlscorr.sizes/1"


def test_nothing_is_left_of_a_result_whose_page_fails(tmp_path):
    "The page comes last: tables and document before it are gone with it"

    def page(path, content):
        raise OSError("no space left")

    files = ResultFiles.of("sizes", (), {}, {"rows.csv": table}, {"page.html": page})
    with pytest.raises(OSError, match="no space left"):
        files.write(tmp_path / "out")
    assert not list(tmp_path.iterdir())


@dataclass(frozen=True, repr=False)
class Count(KnownResult):
    "A result that counts how often its document is made"

    _name = "count"
    made: list

    def _content(self):
        self.made.append(1)
        return {"made": len(self.made)}

    def _files(self):
        return ResultFiles.of("count", (), self.document, {}, {})


def test_a_known_document_is_made_once(tmp_path):
    "Read twice and written, it is the same value"
    result = Count([])
    assert result.document is result.document
    assert result.write(tmp_path / "out") == {"schema": "mlscorr.count/1", "made": 1}
