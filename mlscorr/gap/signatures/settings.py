"""Settings of the signatures, with their reasons."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Differentiation of effects, and times and widths of trial events."""

    epoch_step: float = 0.1  # s: no POS error changes faster, and events are seconds long
    random_replicas: int = 200  # of a random effect: a variance to 10 %, with 12 pulses to 3 %
    derivative_step: float = 0.1  # of the usual size: small enough to be linear, far above rounding
    loss: float = 0.5  # share lost at which a count of few pulses is most accurate (binomial)
    widths: tuple[float, ...] = (2.0, 5.0, 15.0, 45.0)  # s: a lost fix to a street of high houses
    largest_shift: float = 100.0  # m everywhere at the usual size: an implausible unit
    events: int = 80  # largest number for one width

    @property
    def step_spacing(self) -> float:
        """Time between events without a width: as between the narrowest ones. Units: s."""
        return self.widths[0]


SETTINGS = Settings()
