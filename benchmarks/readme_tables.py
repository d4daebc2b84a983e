"""Update the tables of README.md and docs by the commands that measure them.

    python benchmarks/readme_tables.py [NAME ...] [--check FOLDER]

A table is between <!-- table: NAME --> and <!-- end of table -->. By default all are measured (an
hour or two); one without available data is left unchanged, with a note on stderr.
"""

import argparse
import json
import os
import re
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
TABLE = r"(<!-- table: {} -->\n).*?(<!-- end of table -->)"
SCENARIOS = {
    "car": "the paper's car: 186 s in a simulated canyon, 21 control points",
    "boat": "the paper's boat: 151 s along a river bank, multipath",
    "calibration": "10 + 54 points in good GNSS, with a wrong mounting",
    "canyon": "two opposite passes in an urban canyon",
    "motorway": "a fast drive under open sky",
}
CORRECTED = {
    "wuhan_drive": "real drive with real POS error (two GNSS outages of 60 s, up to 2.9 m), "
    "simulated street",
    "practice_none": "good survey with a quiet POS, from another simulator",
    "practice_lever_arm": "survey with a wrong lever arm, from another simulator: corrected",
}


def markdown(header, rows):
    """A table of cells as lines of markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)


def place(text, name, table):
    """Put a table between its marks in a text. Raises ValueError if there are no such marks."""
    text, count = re.subn(
        TABLE.format(re.escape(name)), lambda match: match[1] + table + match[2], text, flags=re.S
    )
    if count != 1:
        raise ValueError(f"The page has {count} tables named '{name}', where one belongs.")
    return text


def names_in(text):
    """Names of the tables of a text, in order."""
    return re.findall(r"<!-- table: (\S+) -->", text)


def axes(values, digits=2):
    """Format east, north and height in m, or nothing."""
    if values is None:
        return ""
    return " / ".join(f"{value:.{digits}f}" for value in values)


def scenarios(_):
    """Simulate each scenario with seed 1 and correct it."""
    from mlscorr import correct, read_survey
    from mlscorr.pipeline import simulate_survey

    rows = []
    for name, what in SCENARIOS.items():
        with tempfile.TemporaryDirectory() as folder:
            scenario = ROOT / "examples" / "scenarios" / f"{name}.toml"
            made = simulate_survey(scenario, Path(folder) / name, 1, False)
            check = correct(read_survey(Path(folder) / name)).check
        points = sum(file["points"] for file in made["files"]) / 1e6
        before, after = (f"{axes(check[state]['rmse'])} m" for state in ("before", "after"))
        rows.append([f"`{name}.toml`", what, f"{points:.1f} M", before, after])
    return markdown(["scenario", "what it is", "points", "check points before", "after"], rows)


def results(_):
    """Correct, compare and calibrate the surveys next to the project, and simulated drives."""
    from seeds import drive

    from mlscorr import calibrate, compare, correct, read_survey

    surveys = Path(os.environ["MLSCORR_SHARED"]) / "surveys"
    rows = []
    for name, what in CORRECTED.items():
        check = correct(read_survey(surveys / name)).check
        digits = 2 if max(check["before"]["rmse"]) > 0.1 else 3
        before, after = (axes(check[state]["rmse"], digits) for state in ("before", "after"))
        rows.append([what, before, after, f"`mlscorr correct {name} -o OUT`"])
    compared = compare(read_survey(surveys / "wuhan_drive")).document
    after = {row["name"]: row["check"]["rmse"] for row in compared["methods"]}
    command = "`mlscorr compare wuhan_drive -o OUT`"
    best = "the same, corrected by one affine transformation"
    rows.insert(1, [best, "", axes(after["affine"]), command])
    rows.insert(2, ["the same, corrected by polynomials of order 4", "", axes(after["ls-4"]), ""])
    with tempfile.TemporaryDirectory() as folder:
        calibrated = calibrate(read_survey(surveys / "practice_lever_arm"))
        check = calibrated.write(Path(folder) / "calibrated")["lsc"]["check"]
    command = "`mlscorr calibrate practice_lever_arm -o OUT`"
    rows.append(["the same, calibrated", "", axes(check["after"]["rmse"], 3), command])
    drives = np.array([drive(seed)[:6] for seed in range(20)])
    for title, function, command in (
        ("20 simulated drives, outage of 25 s, median", np.median, "`python benchmarks/seeds.py`"),
        ("the same, worst drive of each axis", np.max, ""),
    ):
        numbers = function(drives, axis=0)
        rows.append([title, axes(numbers[:3]), axes(numbers[3:], 3), command])
    return markdown(["survey", "before", "after", "command"], rows)


def blind(check):
    """Rates of the blind check that `mlscorr blind score` has written."""
    if check is None:
        raise FileNotFoundError("--check names no folder of mlscorr blind")
    score = json.loads((Path(check) / "score.json").read_text())
    rows = []
    for row in score["rows"]:
        value, (low, high), (least, largest) = row["value"], row["interval"], row["goal"]
        is_share = high <= 1 and "error of the stated" not in row["name"]
        form = (lambda v: f"{100 * v:.0f}") if is_share else (lambda v: f"{v:.2f}")
        unit = " %" if is_share else ""
        goals = [f"{sign} {form(v)}{unit}" for sign, v in ((">=", least), ("<=", largest)) if v]
        reached = f"{form(value)}{unit} [{form(low)}, {form(high)}]"
        rows.append([row["name"], row["cases"], reached, " and ".join(goals)])
    return markdown(["", "cases", "reached, with 95 % interval", "goal"], rows)


TABLES = {"results": results, "blind": blind, "scenarios": scenarios}  # as pages have them


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", choices=[[], *TABLES])
    parser.add_argument("--check", type=Path, help="folder of mlscorr blind")
    arguments = parser.parse_args()
    pages = {name: page for page in PAGES for name in names_in(page.read_text())}
    for name in arguments.names or pages:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                table = TABLES[name](arguments.check)
        except (FileNotFoundError, KeyError) as error:
            print(f"{name} stays as it is: {error} is not at hand.", file=sys.stderr)
            continue
        pages[name].write_text(place(pages[name].read_text(), name, table))
        print(table)


if __name__ == "__main__":
    main()
