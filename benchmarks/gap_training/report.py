"""Arguments of studies of decisions, and their figures at several operating points."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from gap_training.fit import figures
from gap_training.records import Record
from mlscorr.gap.evidence import OPERATING_POINTS


def study_arguments(about: str | None, first: int, worlds: int) -> argparse.ArgumentParser:
    """Arguments of a study: the folder of its records, and its worlds.

    Parameters
    ----------
    about : str
        Description of the study.
    first, worlds : int
        Defaults of the first world's seed, and of their number.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("folder", type=Path, help="Where records are kept.")
    parser.add_argument("--first", type=int, default=first, help="Seed of the first world.")
    parser.add_argument("--worlds", type=int, default=worlds)
    parser.add_argument("--cases", type=int, default=24, help="In each world.")
    parser.add_argument("--replicas", type=int, default=50, help="Of clean surveys.")
    return parser


def print_figures(records: Sequence[Record], probabilities: Sequence[dict[str, float]]) -> None:
    """Print a row for each rate, with a column for each operating point.

    Parameters
    ----------
    records : sequence of Record
    probabilities : sequence of dict
        Of each record.
    """
    columns = {
        title: figures(records, probabilities, costs) for title, costs in OPERATING_POINTS.items()
    }
    print(f"{'':46}{'cases':>6}" + "".join(f"{title:>11}" for title in columns))
    for name, (_, number) in next(iter(columns.values())).items():
        values = "".join(f"{each[name][0]:11.3f}" for each in columns.values())
        print(f"{name:46}{number:6}{values}")
