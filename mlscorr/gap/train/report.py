"""Figures of several operating points, side by side."""

from mlscorr.gap.infer.decision import Costs

OPERATING_POINTS = {  # what a false alarm, a miss, unknown cost beside a wrong name
    "sensitive": Costs(false_alarm=1.0, miss=1.0, unknown=1.0),
    "default": Costs(),
    "careful": Costs(false_alarm=10.0),
}


def print_figures(figures: dict[str, dict[str, tuple[float, int]]]) -> None:
    """Print a row each rate, a column each operating point.

    Parameters
    ----------
    figures : dict of dict of (value, cases)
        By operating point and rate.
    """
    print(f"{'':46}{'cases':>6}" + "".join(f"{title:>11}" for title in figures))
    for name, (_, number) in next(iter(figures.values())).items():
        values = "".join(f"{each[name][0]:11.3f}" for each in figures.values())
        print(f"{name:46}{number:6}{values}")
