"""Figures of several operating points, side by side."""


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
