"""Control lists as total stations, GNSS receivers and surveying offices write them."""

import datetime

import numpy as np
import openpyxl
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.io.store import OpenQuestion, read_toml
from mlscorr.io.tables import (
    CONTROL_NAMES,
    TRAJECTORY_NAMES,
    ControlSection,
    ListError,
    find_meanings,
    holds_points,
    plain,
    read_control,
)
from mlscorr.io.tables.column_names import WORDS
from mlscorr.io.tables.control import COLUMNS
from mlscorr.survey import KINDS, Trajectory

ALL = {"kind": "circle", "size": 0.6, "sigma": [0.003, 0.004]}
LETTERS = ("utf-8", "cp1252")
PLACES = [[532012.49, 3373991.48, 44.48], [532030.0, 3373978.17, 44.5]]


@pytest.fixture(scope="module")
def drive():
    "Ten seconds to the east, past the points"
    gps_time = 413200.0 + 0.5 * np.arange(20)
    east = 532_000.0 + 5.0 * (gps_time - gps_time[0])
    position = np.column_stack([east, np.full(20, 3_374_000.0), np.full(20, 42.0)])
    return Trajectory(gps_time, position, attitude_from_angles(np.zeros(20), 0.0, np.pi / 2))


def read(folder, content, drive=None, encoding="utf-8", **section):
    path = folder / "list.txt"
    path.write_text(content, encoding=encoding)
    return read_control(path, ControlSection(file="", **{**ALL, **section}), drive)


LISTS = {  # what writes such a file: content, its letters, and what is understood
    "total station, blanks, no header": (
        "P1   532012.49  3373991.48  44.48\nP2   532030.00  3373978.17  44.50\n",
        "utf-8",
        "easting = column 2, northing = column 3, height = column 4 (blanks",
    ),
    "name, northing, easting, height, code": (
        "P1,3373991.48,532012.49,44.48,GCP\nP2,3373978.17,532030.0,44.5,\n",
        "utf-8",
        "easting = column 3, height = column 4 (commas, decimal point), easting and northing "
        "identified by the trajectory",
    ),
    "Leica, header behind a comment mark": (
        "# Infinity 4.1\n# Point Id\tEasting\tNorthing\tOrthometric Height\n"
        "P1\t532012.49\t3373991.48\t44.48\n# P9\t1\t2\t3\n\nP2\t532030.0\t3373978.17\t44.5\n",
        "utf-8",
        "name = Point Id, height = Orthometric Height, easting, northing by name (tabs",
    ),
    "Trimble, northing first": (
        "\ufeffPoint ID,Northing,Easting,Elevation,Code\n"
        "P1,3373991.48,532012.49,44.48,\nP2,3373978.17,532030.0,44.5,x\n",
        "utf-8",
        "height = Elevation, northing, easting by name (commas",
    ),
    "German office, letters of Windows": (
        "Punktnr.;Rechtswert;Hochwert;Höhe\nP1;532012,49;3373991,48;44,48\n"
        "P2;532030;3373978,17;44,5\n",
        "cp1252",
        "height = Höhe (semicolons, decimal comma, letters of Windows-1252)",
    ),
    "Gauss-Krueger habit, units in brackets": (
        "Pkt X[m] Y[m] Z[m]\nP1 3373991,48 532012,49 44,48\nP2 3373978,17 532030,00 44,50\n",
        "utf-8",
        "northing = X[m], easting = Y[m], height = Z[m] (blanks, decimal comma)",
    ),
    "French, units in a row": (
        "N°;Est;Nord;Altitude\n;(m);(m);(m)\nP1;532012,49;3373991,48;44,48\n"
        "P2;532030;3373978,17;44,5\n",
        "utf-8",
        "name = N°, easting = Est, northing = Nord, height = Altitude",
    ),
    "English, abbreviated heights, codes and dates": (
        "Point Id,Easting,Northing,Ortho Ht,Code,Date/Time\n"
        "P1,532012.49,3373991.48,44.48,TGT,05/12/2026 10:11:12\n"
        "P2,532030.0,3373978.17,44.5,TGT,05/12/2026 10:14:02\n",
        "utf-8",
        "name = Point Id, height = Ortho Ht",
    ),
    "Spanish, Excel's Unicode text": (
        "Punto\tEste\tNorte\tCota\nP1\t532012,49\t3373991,48\t44,48\n"
        "P2\t532030\t3373978,17\t44,5\n",
        "utf-16",
        "height = Cota (tabs, decimal comma, letters of UTF-16)",
    ),
    "Swiss, letters in names alone, remarks in brackets": (
        "Nr. Ostwert(LV95/LN02) Nordwert(LV95/LN02) Höhe Bemerkung\n"
        "----------------------------------------\n"
        "P1  532012.490  3373991.480  44.480 Tafel\nP2  532030.000  3373978.170  44.500 Säule\n",
        "cp1252",
        "easting = Ostwert(LV95/LN02)",
    ),
    "Chinese": (
        "点号,东坐标(m),北坐标(m),高程(m)\nP1,532012.49,3373991.48,44.48\n"
        "P2,532030,3373978.17,44.5\n",
        "gb18030",
        "name = 点号, easting = 东坐标(m), northing = 北坐标(m)",
    ),
}


@pytest.mark.parametrize("kind", LISTS)
def test_lists_of_others_are_read_and_said(kind, drive, tmp_path):
    "Two points to the last digit from each kind of list, and the sentence on what was understood"
    content, encoding, sentence = LISTS[kind]
    points = read(tmp_path, content, drive, encoding)
    assert points.control.name == ("P1", "P2") and len(points.check) == 0
    assert points.control.position.tolist() == PLACES
    assert points.control.sigma.tolist() == [[0.003, 0.003, 0.004]] * 2
    assert sentence in points.layout
    assert "kind circle, size 0.6 m, role control" in points.layout
    assert holds_points(tmp_path / "list.txt")


@pytest.mark.parametrize(("name", "encoding"), [("Brücke", "cp1252"), ("桥", "gb18030")])
def test_letters_of_names_are_told_apart(name, encoding, drive, tmp_path):
    "Chinese letters take two bytes, umlauts stand alone"
    points = read(tmp_path, f"PtID;E;N;H\n{name};532012,49;3373991,48;44,48\n", drive, encoding)
    assert points.control.name == (name,)


@pytest.mark.parametrize("rows", [1, 180], ids=["at first", "behind the first block"])
def test_our_own_columns_in_other_letters_are_read_and_said_alike(rows, drive, tmp_path):
    "control.csv of an office whose letters are Windows-1252 is read as in UTF-8, and that is said"
    points = [
        f"{532000 + i % 40},{3374000 + i},44.5,0.003,0.004,circle,0.6,control" for i in range(rows)
    ]
    names = [f"P{i}" for i in range(rows - 1)] + ["Brücke"]
    lines = [",".join(COLUMNS), *map(",".join, zip(names, points, strict=True)), ""]
    lists = {letters: read(tmp_path, "\n".join(lines), drive, letters) for letters in LETTERS}
    assert lists["cp1252"].control.name == lists["utf-8"].control.name == tuple(names)
    assert np.array_equal(lists["cp1252"].control.position, lists["utf-8"].control.position)
    assert lists["utf-8"].layout is None
    assert "(commas, decimal point, letters of Windows-1252)" in lists["cp1252"].layout


def test_a_minus_sign_is_read_as_one(drive, tmp_path):
    "Spreadsheets write U+2212 before a height below zero; within a name it stays"
    points = read(tmp_path, "PtID;E;N;H\nP−1;532012,49;3373991,48;−4,48\n", drive).control
    assert points.name == ("P−1",) and points.position[0, 2] == -4.48


def test_columns_of_the_list_go_before_what_is_said_of_all(drive, tmp_path):
    "Kinds, sizes (mm), one sigma for all axes and roles that stand in the table are its own"
    header = "Name;Kind;Size (mm);E;N;H;σ;Role;Remark\n"
    content = header + "P1;square;500;532012,49;3373991,48;44,48;0,002;check;at the gate\n"
    points = read(tmp_path, content, drive)
    assert points.check.kind == ("square",) and points.check.size.tolist() == [0.5]
    assert points.check.sigma.tolist() == [[0.002] * 3]
    assert "of all points" not in points.layout


def test_german_columns_of_kind_size_and_role_are_known(drive, tmp_path):
    "Letters that fold, as ß does into ss, hide no column: sizes and roles are those of the table"
    header = "Punktnummer;Rechtswert;Hochwert;Höhe;Art;Größe;Rolle\n"
    content = header + "P1;532012,49;3373991,48;44,48;square;0,5;check\n"
    points = read(tmp_path, content, drive, kind=None, size=None)
    assert points.check.kind == ("square",) and points.check.size.tolist() == [0.5]


def test_a_column_of_sizes_in_letters_of_windows_goes_before_what_is_said_of_all(drive, tmp_path):
    "Its two letters beyond ASCII are one in Chinese, by which the column was lost"
    content = "Punkt;E;N;H;Größe\n" + P1.replace("\n", ";0,5\n")
    assert read(tmp_path, content, drive, "cp1252").control.size.tolist() == [0.5]


def test_words_of_the_field_are_roles_and_kinds(drive, tmp_path):
    "GCP and Passpunkt are control, Kontrollpunkt and ICP are check, Kreis and Quadrat kinds"
    words = [
        "GCP;Kreis",
        "Check Point;Quadrat",
        "Kontrollpunkt;Disc",
        "Passpunkt;Loch",
        "icp;kreis",
    ]
    rows = [f"P{i};532012;{3373978 + 3 * i};44;{word}\n" for i, word in enumerate(words)]
    points = read(tmp_path, "Name;E;N;H;Role;Kind\n" + "".join(rows), drive)
    assert points.control.name == ("P0", "P3") and points.check.name == ("P1", "P2", "P4")
    assert points.control.kind == ("circle", "hole")
    assert points.check.kind == ("square", "circle", "circle")
    assert read(tmp_path, "P1 532012.5 3373991 44.5\n", drive, kind="Kreis").control.kind == (
        "circle",
    )
    assert tuple(WORDS["kind"]) == KINDS


@pytest.mark.parametrize(
    ("role", "message"),
    [
        (
            "Kontrolpunkt",
            "unknown role 'kontrolpunkt'; known are control",
        ),
        (
            "CP",
            "role 'cp'; .* may mean control point or check point: write gcp or check",
        ),
    ],
)
def test_no_role_is_suggested_by_its_spelling(role, message, drive, tmp_path):
    "A role that isn't known is never said to be control, which would end the independent check"
    with pytest.raises(ValueError, match=message) as error:
        read(tmp_path, f"Name,E,N,H,Role\nP1,532012.5,3373991,44.5,{role}\n", drive)
    assert "meant" not in str(error.value)


def test_roles_under_another_name_are_never_dropped_in_silence(drive, tmp_path):
    "Words of roles are refused until named, other words warned of, and what is not used is named"
    rows = [f"P{i};532012;{3373978 + 3 * i};44;{{{i % 2}}};Nr {i}\n" for i in range(4)]
    text = "Name;E;N;H;use;Bemerkung\n" + "".join(rows)
    with pytest.raises(ValueError, match=r"chk, gcp.*role = 'use'"):
        read(tmp_path, text.format("GCP", "CHK"), drive)
    points = read(tmp_path, text.format("GCP", "CHK"), drive, columns={"role": "use"})
    assert points.check.name == ("P1", "P3") and points.layout.endswith("; not used: Bemerkung.")
    message = (
        r"column use .* contains Neu, Pass and may identify check points\. .* columns.role = "
        "'use'"
    )
    with pytest.warns(UserWarning, match=message):
        points = read(tmp_path, text.format("Pass", "Neu"), drive)
    assert len(points.control) == 4 and points.layout.endswith("; not used: use, Bemerkung.")
    with pytest.warns(UserWarning, match="use .* contains CHK and may identify check points"):
        read(tmp_path, text.format("", "CHK"), drive)
    points = read(tmp_path, text.format("Pass", "Neu"), drive, check=["P1"])  # that tells
    assert points.check.name == ("P1",)
    assert len(read(tmp_path, text.format("GCP", "GCP"), drive).control) == 4  # as without it


@pytest.mark.parametrize("names", [CONTROL_NAMES, TRAJECTORY_NAMES])
def test_a_known_name_stands_for_one_column(names):
    "Each is found by its own words alone, so that columns.toml guesses nothing in silence"
    for name, others in names.items():
        for word in {name, *others}:
            assert find_meanings([word], names) == {name: [0]}, word


def test_words_of_columns_toml_may_be_written_as_they_stand_in_tables():
    "Case, blanks and marks of the file's own words don't count, as those of a header don't"
    assert "pointid" in CONTROL_NAMES["name"] and "prsrx" in TRAJECTORY_NAMES["x"]
    assert "grösse" in CONTROL_NAMES["size"]
    assert all(plain(word) == word for names in CONTROL_NAMES.values() for word in names)


def test_a_workbook_is_read_from_the_sheet_that_holds_the_table(drive, tmp_path):
    "Title rows above, numbers as names, an empty sheet beside it; two tables are refused"
    book = openpyxl.Workbook()
    rows = [["Projekt"], [], ["Pkt-Nr", "Ostwert", "Nordwert", "Höhe"]]
    for row in [*rows, [101, *PLACES[0]], ["P2", *PLACES[1]]]:
        book.active.append(row)
    book.create_sheet("leer").append([datetime.datetime(2026, 5, 1), None])
    book.save(tmp_path / "list.xlsx")
    section = ControlSection(file="", **ALL, check=["P*"])
    points = read_control(tmp_path / "list.xlsx", section, drive)
    assert points.control.name == ("101",) and points.check.name == ("P2",)
    assert points.control.position.tolist() == PLACES[:1]
    assert "(sheet Sheet, decimal point); " in points.layout
    assert points.layout.endswith("role control, except check for P*.")
    book.copy_worksheet(book.active)
    book.save(tmp_path / "list.xlsx")
    with pytest.raises(ValueError, match=r"in 2 sheets \(Sheet, Sheet Copy\)"):
        read_control(tmp_path / "list.xlsx", section, drive)
    (tmp_path / "list.xlsx").write_text("no zip")
    with pytest.raises(ValueError, match="not an Excel workbook"):
        read_control(tmp_path / "list.xlsx", section, drive)


@pytest.mark.parametrize(
    "columns",
    [
        {"height": "Elevation"},
        {
            "name": 1,
            "easting": 2,
            "northing": 3,
            "height": 4,
        },
    ],
)
def test_survey_toml_chooses_columns(columns, drive, tmp_path):
    "By their names where two may be meant, or by their numbers"
    content = (
        "Name,Easting,Northing,Elevation,Ellipsoidal height\nP1,532012.49,3373991.48,44.48,20\n"
    )
    with pytest.raises(ValueError, match=r"may be the height \(Elevation, Ellipsoidal height\)"):
        read(tmp_path, content, drive)
    points = read(tmp_path, content, drive, columns=columns)
    assert points.control.position.tolist() == PLACES[:1]
    for name in ("height", "size"):
        with pytest.raises(ValueError, match=f"no column 'Elevatoin', .* the {name}"):
            read(tmp_path, content, drive, columns={"height": "Elevation", name: "Elevatoin"})


P1 = "P1;532012,49;3373991,48;44,48\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("Punkt;X;Y;Z\nP1;1001;1002;3\n", "X and Y is easting.*neither order.*within 1 km"),
        ("P1 1001 1002 3\n", "column 2 and column 3 is easting"),
        ("P1,532012,49,3373991,48,44,48\n", "neither order is"),
        ("Punkt;E;N;H\nP1;532.012,49;3.373.991,48;44,48\n", "commas .*'532.012,49'.* and .*points"),
        ("Punkt;E;N;H\nP1;532'012,49;3'373'991,48;44,48\n", "'532'012,49'"),
        ("name,easting,northing,elev (ft)\n" + P1.replace(";", ","), "height in 'ft'"),
        (
            "time,temperature\n1,2\n",
            "no column name, .* has no coordinates; it may be the wrong file",
        ),
        ("name,lat,lon,h\nP1,30.4,114.4,20\n", "Project latitude and longitude first"),
        ("P1 532012.49 3373991.48\n", "no column name, .* to be a plan without heights"),
        ("X;Y;Z\n1;2;3\n", "no column name; it has X, Y, Z"),
        ("Punkt;Est;Nord;Quota\n" + P1, r"no column height;.*columns\.height = 'Quota'"),
        ("Punkt;E;N;H\nP1;532012,49;3373991,48\n", "Line 2.*3 columns where 4"),
        ("Punkt,E,N,H\nP1,532012,49,3373991,48,44,48\n", "7 columns .* decimal points"),
        ("Gate 1 532012,49 3373991,48 44,48\n" + P1.replace(";", " "), "Line 2"),
        ("Punkt;E;N;H;Was\n" + P1.replace("\n", ";check\n"), "Was of .* seems to be the role"),
        ("Punkt;E;N;H\n" + P1.replace("44,48", "hoch"), "height 'hoch', which is not a number"),
        ("Punkt;E;N;H\n" + P1 + P1, "P1 more than once"),
        ("Punkt;E;N;H\n", "header but no points"),
        ("P1;GCP;532012,49;3373991,48;44,48\n", "no header: number .*control.columns. in .* as"),
    ],
)
def test_what_may_mean_two_things_or_nothing_is_refused(content, message, drive, tmp_path):
    "Axes, decimals, units, shifted columns, roles under another name: named, with the way out"
    with pytest.raises(ValueError, match=message):
        read(tmp_path, content, drive)


def test_all_rows_that_are_wrong_are_named_at_once(drive, tmp_path):
    "Nobody mends a table a row a time: cells, names, kinds and sizes stand in the sentence"
    rows = [f"P{n};532012,49;3373991,48;44,48" for n in range(12)]
    rows[2] = "P2;532012,49;hoch;44,48"
    rows[5] = "P1;532012,49;tief;44,48"
    rows[8] = ";532012,49;1;2"
    with pytest.raises(ValueError, match="has 4 faults") as error:
        read(tmp_path, "\n".join(["Punkt;E;N;H", *rows]), drive)
    for part in ("Line 4", "'hoch'", "Line 7", "'tief'", "Line 10", "no name", "P1 more"):
        assert part in str(error.value)
    rows = [f"P{n};532012,49;3373991,48;44,48;ball;{20 + n}" for n in range(12)]
    with pytest.raises(ValueError, match=r"13 faults.*kind 'ball'.*Then give 0\.2") as error:
        read(tmp_path, "\n".join(["Punkt;E;N;H;kind;size", *rows]), drive)
    assert "P3 of" in str(error.value)
    assert str(error.value).endswith("And 5 more of this kind.")


def test_what_is_wrong_alike_in_many_rows_is_said_once(drive, tmp_path):
    "A size in millimetres in each of 12 rows is one fault with the first point, and so is a kind"
    row = "P{0};532012,49;337399{0},48;44,48;{1};600"
    rows = [row.format(n, "circle") for n in range(9)]
    with pytest.raises(ListError, match=r"^P0 of \S+ and 8 more have the size 600 m") as error:
        read(tmp_path, "\n".join(["Punkt;E;N;H;kind;size", *rows]), drive)
    assert str(error.value).count("Then give 0.6") == error.value.number == 1
    rows = [row.format(n, "ball" if n > 3 else "circle") for n in range(9)]
    with pytest.raises(
        ListError, match=r"has 2 faults\..* P4 of \S+ and 4 more have the .* 'ball'"
    ):
        read(tmp_path, "\n".join(["Punkt;E;N;H;kind;size", *rows]), drive)


def test_axes_that_both_lie_near_are_not_guessed(drive, tmp_path):
    "In a local grid with equal numbers X and Y stay open, and so they do without a trajectory"
    local = Trajectory(drive.gps_time, drive.position - [532e3, 3374e3, 0], drive.attitude)
    with pytest.raises(ValueError, match=r"both orders.*within 1 km"):
        read(tmp_path, "P1 20 30 44\n", local)
    with pytest.raises(ValueError, match="neither order is"):
        read(tmp_path, LISTS["name, northing, easting, height, code"][0])


def test_what_the_list_lacks_is_asked_for_by_its_key(drive, tmp_path):
    "Without columns and without a value in survey.toml: the sentence shows the lines to write"
    with pytest.raises(ValueError, match=r"no column size; .*\[control\] in .*size = 0\.6"):
        read(tmp_path, "Punkt;E;N;H\n" + P1, drive, size=None)
    with pytest.raises(ValueError, match=r"control\.check lists 'Q\*'"):
        read(tmp_path, "Punkt;E;N;H\n" + P1, drive, check=["Q*"])


def test_no_column_is_advised_that_is_not_like_the_one_that_is_missing(drive, tmp_path):
    "By its name or its words: Bemerkung is no sigma, Typ holds kinds; headers are shown whole"
    head = "Punktnummer;Rechtswert;Hochwert;Höhe;mE [mm];mH [mm];Zuletzt geändert am;Bemerkung"
    row = "P1;532012,49;3373991,48;44,48;3;4;gestern;Tafel"
    with pytest.raises(ValueError, match=r"geändert am, Bemerkung\. If .*sigma_h\S+ = '\.\.\.'"):
        read(tmp_path, f"{head}\n{row}\n", drive, sigma=None)
    message = r"Typ\. 'Typ' may be the kind: if so, set columns\.kind = 'Typ' under \[control\]"
    with pytest.raises(ValueError, match=message):
        read(tmp_path, f"{head};Typ\n{row};Kreis\n", drive, sigma=None, kind=None)
    with pytest.raises(ValueError, match=r"has no column height; .* and \d+ more\. .* \[control\]"):
        read(tmp_path, "Pt;E;N;" + ";".join(f"Q{n}" for n in range(40)) + "\nP1;1;2\n", drive)


def test_names_and_numbers_of_columns_are_not_mixed(tmp_path):
    "Numbers are for tables without names"
    (tmp_path / "a.toml").write_text('file = "x"\n[columns]\nname = 1\nheight = "H"\n')
    with pytest.raises(ValueError, match="give names or numbers of columns, not both"):
        read_toml(tmp_path / "a.toml", ControlSection, "it")
    with pytest.raises(ValueError, match="but none for name, northing, height: number all"):
        read(tmp_path, P1, columns={"easting": 2})


def test_no_name_is_suggested_that_is_not_alike(tmp_path):
    "A missing name is not said to be meant by 'use'; unknown keys are set beside the known ones"
    with pytest.raises(ValueError, match="has no column name") as error:
        read(tmp_path, "use,easting,northing,height\na,1,2,3\n")
    assert "may be the" not in str(error.value)
    (tmp_path / "a.toml").write_text('file = "x"\nqqq = 1\n')
    with pytest.raises(ValueError, match="qqq is an unknown key; known are file, kind, size, si"):
        read_toml(tmp_path / "a.toml", ControlSection, "it")


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "gb18030"])
def test_letters_that_come_late_are_read_too(encoding, tmp_path):
    "The only letter beyond ASCII stands in line 300 of 400"
    name = "\u95e8" if encoding == "gb18030" else "T\u00fcr"
    lines = [f"P{i},{532_000 + i}.49,3373991.48,44.48" for i in range(400)]
    lines[299] = lines[299].replace("P299", name)
    content = "\n".join(["name,easting,northing,height", *lines, ""])
    points = read(tmp_path, content, None, encoding)[0]
    assert len(points) == 400 and points.name[299] == name


# ---- words of an office

OFFICE = {"Scheibe 0,6": "circle 0.6", "Tafel": "square 0.5", "Kontr.": "check"}
PLACE = "532012.5;3373991;44.5"


def office(**given):
    "Settings of survey.toml for all points"
    return ControlSection(file="", sigma=[0.003, 0.004], words=OFFICE, **given)


def read_office(tmp_path, drive, text, **given):
    path = tmp_path / "office.csv"
    path.write_text(text)
    return read_control(path, office(**given), drive)


def test_words_of_an_office_give_kinds_sizes_and_roles(drive, tmp_path):
    "In any case, width and number of blanks; other words keep the meanings that they always have"
    rows = f"P1;{PLACE};SCHEIBE  0,6;GCP\nP2;{PLACE};tafel;kontr.\n"
    points = read_office(tmp_path, drive, f"Punkt;E;N;H;Art;Rolle\n{rows}")
    assert (points.control.kind, points.check.kind) == (("circle",), ("square",))
    assert (points.control.size, points.check.size) == ([0.6], [0.5])


def test_a_size_in_a_word_goes_before_that_of_all_points(drive, tmp_path):
    "And a column of sizes that says another one is a fault with both numbers"
    points = read_office(tmp_path, drive, f"Punkt;E;N;H;Art\nP1;{PLACE};Tafel\n", size=0.4)
    assert points.control.size == [0.5]
    with pytest.raises(ValueError, match=r"size 0\.6 m, but its kind implies 0\.5 m"):
        read_office(tmp_path, drive, f"Punkt;E;N;H;Art;size\nP1;{PLACE};Tafel;0.6\n")


@pytest.mark.parametrize("meaning", ["ball 0.6", "circle big", "check 0.6", ""])
def test_a_meaning_that_is_none_is_refused(meaning):
    "A kind with its size or a role; all of them are named"
    with pytest.raises(ValueError, match=r"is not a valid meaning: give a kind \(circle"):
        ControlSection(file="", words={"Ball": meaning})


def test_an_unknown_word_is_a_question_with_its_place(drive, tmp_path):
    "The key under [control] words, with a likely meaning by what stands in the word"
    with pytest.raises(OpenQuestion, match="unknown kind 'kreuz 0,3'") as error:
        text = f"Punkt;E;N;H;Art\nP1;{PLACE};Tafel\nP2;{PLACE};Kreuz 0,3\n"
        read_office(tmp_path, drive, text, size=0.4)
    (place,) = error.value.places
    assert place.key == 'control.words."Kreuz 0,3"' and place.examples[0] == "circle 0.3"
