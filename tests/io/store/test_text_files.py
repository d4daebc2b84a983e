"""Letters of text files: UTF-8, UTF-16, GB 18030 and Windows-1252 are told apart by their bytes."""

import codecs

import pytest

from mlscorr.io.store import ENCODING, encoding_of

HEADER = "name,easting,northing,height"
ROWS = [f"P{i},{532_000 + i}.49,3373991.48,44.48" for i in range(400)]


def written(folder, text, encoding):
    path = folder / "list.txt"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("Punktnr.;Rechtswert;Hochwert;Höhe", "cp1252"),  # charset-normalizer 3.5: GB 18030
        ("PtID;E;N;H\nTür;532012,49;3373991,48;44,48", "cp1252"),  # GB 18030 there, too
        ("PtID;E;N;H\nBrücke;532012,49;3373991,48;44,48", "cp1252"),
        ("Punkt;E;N;H;Größe\nP1;532012,49;3373991,48;44,48;0,6", "cp1252"),  # two bytes, as 鲞
        ("Punkt;E;N;H;Größe\nStraße 1;532012,49;3373991,48;44,48;0,6\nTür;1;2;3;4", "cp1252"),
        ("N°;Est;Nord;Altitude\nClé;532012,49;3373991,48;44,48", "cp1252"),
        ("Punto;Este;Norte;Elevación;Tamaño", "cp1252"),
        ("PtID;E;N;H\n桥;532012,49;3373991,48;44,48", "gb18030"),
        ("点号,东坐标(m),北坐标(m),高程(m)\n堉镕,532012.49,3373991.48,44.48", "gb18030"),
        ("name（m）\n隧1,路2", "gb18030"),
        ("点号,高程", "utf-8"),
        ("Höhe", "utf-8"),
        ("H", "ascii"),
        ("", "ascii"),
    ],
)
def test_the_letters_of_a_table_are_known(text, encoding, tmp_path):
    "Umlauts join to rare Chinese letters, and names in Chinese hold common ones beside rare ones"
    expected = encoding if encoding in ("cp1252", "gb18030") else ENCODING
    assert encoding_of(written(tmp_path, text, encoding)) == expected


@pytest.mark.parametrize(
    ("name", "encoding"),
    [("Tür", "cp1252"), ("门", "gb18030")],  # charset-normalizer 3.5: Windows-1252 for both
)
def test_one_letter_among_numbers_is_enough(name, encoding, tmp_path):
    "The only letter beyond ASCII stands in line 300 of 400"
    lines = [HEADER, *ROWS[:299], f"{name},532299.49,3373991.48,44.48", *ROWS[300:]]
    assert encoding_of(written(tmp_path, "\n".join(lines), encoding)) == encoding


@pytest.mark.parametrize("mark", [codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE])
def test_utf_16_has_a_mark(mark, tmp_path):
    "In either order of bytes; half a letter at the end is no text"
    path = tmp_path / "list.txt"
    order = "utf-16-le" if mark == codecs.BOM_UTF16_LE else "utf-16-be"
    path.write_bytes(mark + "Punto\tCota\n".encode(order))
    assert encoding_of(path) == "utf-16"
    path.write_bytes(path.read_bytes() + b"\0")
    assert encoding_of(path) is None


def test_what_is_no_text_has_no_encoding(tmp_path):
    "Bytes that neither of them has"
    path = tmp_path / "list.txt"
    path.write_bytes(bytes(range(256)))
    assert encoding_of(path) is None
