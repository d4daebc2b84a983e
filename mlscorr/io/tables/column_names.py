"""Names and units of columns as surveyors, total stations, GNSS receivers and POS software write
them, in English, German, French, Spanish and Chinese.

Sources: point exports of Leica Infinity, Trimble Access and Emlid Flow; coordinate files of German
surveying offices (Punkt, Rechtswert, Hochwert, Hoehe); text exports of NovAtel Inertial Explorer
(GPSTime, H-Ell, SDEast, HdngSD). X and Y are no easting and northing: in German, Chinese and many
other surveys X points north.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from mlscorr.io.store import shown

ANGLES = ("roll", "pitch", "heading")
PLACE_NAMES = {
    "easting": "e east ecoord ecoordinate rechtswert rechts ost ostwert este est "
    "东坐标 东 东向 东距 横坐标 e坐标",
    "northing": "n north ncoord ncoordinate hochwert hoch nord nordwert norte "
    "北坐标 北 北向 北距 纵坐标 n坐标",
    "x": "x xcoord xcoordinate coordx xkoordinate xwert coordenadax x坐标",
    "y": "y ycoord ycoordinate coordy ykoordinate ywert coordenaday y坐标",
    "latitude": "lat breite latitud 纬度",
    "longitude": "lon long lng länge longitud 经度",
    "height": "h z elev elevation alt altitude hell ellipsoidalheight ellipsoidheight hortho "
    "orthometricheight orthoheight orthoht ellht ellipht hmsl höhe hoehe hnn hnhn rl zcoord "
    "zcoordinate coordz zkoordinate zwert altura cota elevación elevacion coordenadaz "
    "高程 高度 高 大地高 正常高 海拔 h坐标 z坐标",
}
CONTROL_NAMES = PLACE_NAMES | {
    "name": "id no nr n° num number point pointid pointname pointno pointnr pointnumber pt ptid "
    "ptname ptno ptnr pnt punkt punktnr punktnummer punktname punktid pkt pktnr pktname "
    "pnr bezeichnung nummer nom numéro numero matricule punto nombre 点号 点名 点 编号 名称",
    "sigma": "σ std stdev sd accuracy genauigkeit standardabweichung écarttype ecarttype "
    "precision précision precisión 中误差 精度",
    "sigma_horizontal": "sigmahz sigmaxy sigmaen sigmalage cq2d 2dcq hrms hprec hacc lateralrms "
    "horizontalprecision horizontalaccuracy lagegenauigkeit 平面精度 平面中误差",
    "sigma_vertical": "sigmaz sigmahöhe cq1d 1dcq vrms vprec vacc elevationrms verticalprecision "
    "verticalaccuracy höhengenauigkeit 高程精度 高程中误差",
    "kind": "shape targetkind targettype art zielart forme forma 形状 标靶类型",
    "size": "diameter grösse groesse durchmesser kantenlänge taille diamètre tamaño diámetro "
    "尺寸 大小 直径 边长",
    "role": "rolle rôle rol 角色",
    **dict.fromkeys(("normal_e", "normal_n", "normal_h"), ""),
}
WORDS = {  # of the cells in a column of words: ours to those of others, plain
    "role": {
        "control": "controlpoint groundcontrolpoint gcp passpunkt 控制点",
        "check": "checkpoint independentcheckpoint icp chk kontrollpunkt prüfpunkt pruefpunkt "
        "检查点",
    },
    "kind": {
        "circle": "disc disk kreis kreisscheibe scheibe",
        "square": "quadrat",
        "hole": "loch",
        "checkerboard": "chessboard schachbrett",
        "board": "",
    },
}
ROBOTS_PLACES = ("p", "t", "pos", "position", "poseposition", "prsr")  # of TUM, ROS and EuRoC
ROBOTS_QUATERNIONS = ("quat", "quaternion", "orientation", "poseorientation", "qrs")
TRAJECTORY_NAMES = PLACE_NAMES | {
    **{
        name: " ".join([PLACE_NAMES[name], *(word + axis for word in ROBOTS_PLACES)])
        for name, axis in (("x", "x"), ("y", "y"), ("height", "z"))
    },
    **{f"q{axis}": " ".join(word + axis for word in ROBOTS_QUATERNIONS) for axis in "xyzw"},
    "gps_time": "time timestamp t sow tow gpssow gpstow secondsofweek gpsseconds zeit gpszeit "
    "temps tiempo 时间 gps时间 周秒",
    "roll": "rollwinkel roulis alabeo 横滚 横滚角 翻滚角",
    "pitch": "nick nickwinkel tangage cabeceo 俯仰 俯仰角",
    "heading": "hdg hdng azimuth azimut cap rumbo kurs 航向 航向角",
    "yaw": "gier gierwinkel lacet guiñada 偏航 偏航角",
    "sigma_easting": "sdeast eastsd sigmae sde stdeast",
    "sigma_northing": "sdnorth northsd sigman sdn stdnorth",
    "sigma_height": "sdheight heightsd sigmah sdh stdheight sdup",
    "sigma_roll": "rollsd sdroll stdroll",
    "sigma_pitch": "pitchsd sdpitch stdpitch",
    "sigma_heading": "hdngsd headingsd sdheading stdheading",
}
BRACKETS = re.compile(r"[\[(<]\s*([^\])>]*?)\s*[\])>]\s*$")
UNITS = {  # to m, deg and s
    **dict.fromkeys(("m", "meter", "metre", "meters", "metres", "mètres", "metros", "米"), 1.0),
    **dict.fromkeys(("s", "sec", "seconds", "秒", "deg", "degree", "degrees", "°", "度"), 1.0),
    **{"cm": 0.01, "mm": 0.001, "rad": 57.29577951308232, "gon": 0.9},
    **{"arcmin": 1 / 60, "arcsec": 1 / 3600},
    **{"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9},
}
FOREIGN_UNITS = re.compile(r"(us|s|us-)?(ft|feet|foot)(us)?|in|inch|inches|yd|km|dms|hms")


def plain(name: str) -> str:
    """A name without case, width, brackets at its end, blanks and punctuation.

    Parameters
    ----------
    name : str

    Examples
    --------
    >>> plain("Pkt.-Nr."), plain("Höhe [m]"), plain("H-Ell"), plain("Nordwert (ETRS89/UTM)")
    ('pktnr', 'höhe', 'hell', 'nordwert')
    """
    words = BRACKETS.sub("", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\s_.\-/:,'\"]+", "", words)


def section_of(names: Mapping[str, str]) -> str:
    """The section of survey.toml that is about a table with these names of columns.

    Parameters
    ----------
    names : mapping
        CONTROL_NAMES or TRAJECTORY_NAMES.
    """
    if "name" in names:
        return "control"
    return "trajectory"


def listed(cells: Sequence[str]) -> str:
    """The cells of a header, as a message can show them: as many as there are names that we know.

    Parameters
    ----------
    cells : sequence of str
    """
    limit = len(CONTROL_NAMES | TRAJECTORY_NAMES)
    if len(cells) > limit:
        more = [f"and {len(cells) - limit} more"]
    else:
        more = []
    return ", ".join([*map(shown, cells[:limit]), *more])


class OfficeWord(NamedTuple):
    """Meaning of an office's own word for its points.

    Parameters
    ----------
    column : str
        One of WORDS.
    value : str
        Our word.
    size : float or None
        Of a target. Units: m.
    """

    column: str
    value: str
    size: float | None = None

    @classmethod
    def of(cls, text: str) -> OfficeWord:
        """The meaning that survey.toml gives a word: a role, a kind, or a kind and its size.

        Parameters
        ----------
        text : str

        Raises
        ------
        ValueError
            For another text.

        Examples
        --------
        >>> OfficeWord.of("circle 0.6"), OfficeWord.of("check").column
        (OfficeWord(column='kind', value='circle', size=0.6), 'role')
        """
        word, _, size = text.strip().partition(" ")
        column = next((column for column in WORDS if meant(column, word) in WORDS[column]), None)
        try:
            number = float(size) if size else None
        except ValueError:
            column = None
        if column is None or (size and column != "kind"):
            kinds = ", ".join(WORDS["kind"])
            roles = " or ".join(WORDS["role"])
            raise ValueError(
                f"'{shown(text)}' is no meaning of a word: give a kind ({kinds}) and its size in "
                f'm, as "circle 0.6", or a role ({roles})'
            )
        return cls(column, meant(column, word), number)


def same_word(cell: str) -> str:
    """A word of an office without case, width and surplus blanks.

    Parameters
    ----------
    cell : str
    """
    return " ".join(unicodedata.normalize("NFKC", cell).casefold().split())


def meant(column: str, cell: str, words: Mapping[str, OfficeWord] | None = None) -> str:
    """Our word for the one in a cell of roles or kinds; the cell in small letters without one.

    Parameters
    ----------
    column : str
        One of WORDS.
    cell : str
    words : mapping, optional
        An office's own words, as same_word gives them, to their meanings.

    Examples
    --------
    >>> meant("role", "Check Point"), meant("role", "Kontrollpunkt"), meant("kind", "Kugel")
    ('check', 'check', 'kugel')
    """
    own = (words or {}).get(same_word(cell))
    if own is not None and own.column == column:
        return own.value
    known = (our for our, others in WORDS[column].items() if plain(cell) in (our, *others.split()))
    return next(known, cell.casefold())


def unit_of(name: str) -> str | None:
    """The unit in brackets at the end of a name, known or foreign; None without one.

    Parameters
    ----------
    name : str

    Examples
    --------
    >>> unit_of("东坐标(m)"), unit_of("Elev [US survey ft]"), unit_of("Height (ellipsoidal)")
    ('m', 'us survey ft', None)
    """
    match = BRACKETS.search(unicodedata.normalize("NFKC", name).casefold())
    unit = re.sub(r"^in\s+", "", match[1]) if match else ""  # as in: height (in m)
    if unit in UNITS or is_foreign(unit):
        return unit
    return None


def is_foreign(unit: str) -> bool:
    """Whether a unit is one that is not read.

    Parameters
    ----------
    unit : str
    """
    return any(map(FOREIGN_UNITS.fullmatch, unit.split()))


def find_meanings(
    cells: Sequence[str], names: Mapping[str, str], chosen: Mapping[str, str | int] | None = None
) -> dict[str, list[int]]:
    """Positions of the columns that each of our names may mean.

    A column under our own name goes before others, and one that the user chose before all.

    Parameters
    ----------
    cells : sequence of str
        A header.
    names : mapping
        Our name to the names of others, plain and separated by blanks.
    chosen : mapping, optional
        Our name to the one in the header.

    Returns
    -------
    dict
        Without those that no column may mean.

    Examples
    --------
    >>> find_meanings(["Pkt", "X", "Y", "Elev", "H-Ell"], CONTROL_NAMES)
    {'x': [1], 'y': [2], 'height': [3, 4], 'name': [0]}
    """
    known = [plain(cell) for cell in cells]
    exact = [cell.strip().casefold() for cell in cells]
    meanings = {}
    for name, others in names.items():
        column = (chosen or {}).get(name)
        among = known
        words = others.split()
        if column is not None:
            among = exact
            words = [str(column).strip().casefold()]
        elif plain(name) in known:
            words = [plain(name)]
        if positions := [i for i, cell in enumerate(among) if cell and cell in words]:
            meanings[name] = positions
    return meanings
