"""Settings of the blind check: shares, sizes and limits, with the reason of each number."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Sizes are in minimal detectable biases (MDB) of each survey's own geometry."""

    shares: tuple[tuple[str, float], ...] = (
        ("clean", 0.20),
        ("noise", 0.08),
        ("single", 0.37),
        ("pair", 0.08),
        ("withheld", 0.17),  # a single effect that the library lacks
        ("outside", 0.10),  # a mechanism that no library knows
    )
    # of the cases: surveys without effects are frequent in practice, so a false alarm there costs
    # most
    single_sizes: tuple[tuple[float, float], ...] = (
        *((0.75, 0.08), (1.5, 0.08), (2.0, 0.27), (3.0, 0.27), (4.0, 0.1), (5.0, 0.1), (8.0, 0.1)),
    )
    # MDB of single effects, and their shares: goals are set at 2 and at 3
    clear_sizes: tuple[float, float] = (3.0, 6.0)
    # MDB, of pairs, withheld ones and mechanisms: sizes that a diagnosis should find
    noise_mdb: tuple[float, float] = (2.0, 8.0)
    # MDB of noise, whose information grows with the square of its size
    unlikeness: float = 0.5
    # squared correlation below which naming another effect is wrong


SETTINGS = Settings()
