"""Sheets of .xlsx workbooks, as cells of text."""

import warnings
from pathlib import Path

SUFFIX = ".xlsx"


def read_sheets(path: str | Path) -> list[tuple[str, list[tuple[int, list[str]]]]]:
    """Name and rows of each sheet, a row with its number from 1; rows without a value are left out.

    Parameters
    ----------
    path : path

    Returns
    -------
    list of (str, list of (int, list of str))
        Numbers with a decimal point and all their digits, dates as ISO 8601.

    Raises
    ------
    ValueError
        For a file that is no workbook.
    """
    import zipfile
    from xml.etree.ElementTree import ParseError

    from openpyxl import load_workbook
    from openpyxl.utils.exceptions import InvalidFileException

    with warnings.catch_warnings(action="ignore"):  # of styles and rules, which are not read
        try:
            book = load_workbook(path, read_only=True, data_only=True)
        except (zipfile.BadZipFile, InvalidFileException, ParseError, KeyError, ValueError):
            raise ValueError(
                f"{path} is no workbook of Excel, or it is damaged: save it anew as .xlsx or as "
                "comma-separated values."
            ) from None
        sheets = []
        try:
            for sheet in book.worksheets:
                rows = []
                for number, values in enumerate(sheet.iter_rows(values_only=True), start=1):
                    cells = [_text(value) for value in values]
                    if any(cells):
                        rows.append((number, cells))
                sheets.append((sheet.title, rows))
        finally:
            book.close()
    return sheets


def _text(value):
    if value is None:
        return ""
    if hasattr(value, "isoformat"):
        return value.isoformat(" ")
    return str(value).strip()
