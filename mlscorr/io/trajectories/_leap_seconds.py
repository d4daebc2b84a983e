"""How far GPS time is ahead of UTC."""

from datetime import date, datetime
from importlib.resources import files

EPOCH = date(1980, 1, 6)  # when both were the same


def leap_seconds(day: date) -> int:
    """GPS time minus UTC on a day, by the table of the IANA time zone database. Units: s.

    Parameters
    ----------
    day : date

    Examples
    --------
    >>> leap_seconds(date(2016, 12, 31)), leap_seconds(date(2017, 1, 1))
    (17, 18)
    """
    table = (files("tzdata.zoneinfo") / "leapseconds").read_text(encoding="utf-8")
    rows = [line.split() for line in table.splitlines() if line.startswith("Leap")]
    ends = [datetime.strptime(" ".join(row[1:4]), "%Y %b %d").date() for row in rows]
    return sum(EPOCH <= end < day for end in ends)
