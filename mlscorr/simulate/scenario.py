"""What a simulated survey should be, as one frozen value."""

from dataclasses import dataclass

LEAD = 0.05  # s of trajectory before the first and after the last pulse


@dataclass(frozen=True)
class Scenario:
    """One drive past surveyed targets; times count from its start.

    Raises ValueError when a quantity is not positive, or when an outage or a canyon does not lie
    within the drive.
    """

    name: str = "street"
    crs: str = "EPSG:32650"
    origin: tuple = (532_000.0, 3_374_000.0, 42.0)  # m: E, N, H at the start, in Wuhan's UTM zone
    start_time: float = 357_700.0  # s of the GPS week
    duration: float = 60.0  # s
    speed: float = 8.0  # m/s, usual of mobile mapping in towns
    pose_rate: float = 100.0  # Hz, usual of exported trajectories
    control: int = 16  # surveyed targets that a correction may use
    check: int = 8  # surveyed targets that it may not
    target_size: float = 0.6  # m, disc diameter or plate edge, as in the shared surveys
    survey_noise: float = 0.003  # m, one sigma an axis: total station and levelling
    lines_per_second: float = 150.0  # the shared surveys' scanner
    points_per_line: int = 1000  # a quarter to a third of what such scanners measure
    max_range: float = 100.0  # m
    range_noise: float = 0.004  # m, one sigma, the shared surveys' scanner
    angle_noise: float = 0.002  # deg, one sigma, the paper's class of scanner
    lever_arm: tuple = (0.10, -0.60, 0.40)  # m: right, forward, up
    boresight: tuple = (90.0, 0.0, 35.0)  # deg, R_L^P = Rz(c) Ry(b) Rx(a)
    outages: tuple = ()  # (start, duration) of each, s: no GNSS
    canyons: tuple = ()  # (start, duration) of each, s: GNSS with multipath
    accelerometer_bias: float = 0.006  # m/s^2, not yet calibrated; tactical to MEMS class, 0.6 mg

    def __post_init__(self):
        for name in ("duration", "speed", "pose_rate", "control", "target_size"):
            if getattr(self, name) <= 0:
                raise ValueError(f"Invalid {name} '{getattr(self, name)}'. Should be positive.")
        for name in ("outages", "canyons"):
            for start, length in getattr(self, name):
                if start < 0 or length <= 0 or start + length > self.duration:
                    raise ValueError(
                        f"Invalid {name} of {length} s from {start} s. "
                        f"Should lie within the drive of {self.duration} s."
                    )


DEMO = Scenario(  # slow and coarse, so that a million points are enough
    name="demo",
    speed=4.2,
    lines_per_second=75.0,
    points_per_line=400,
    outages=((18.0, 25.0),),
    canyons=((4.0, 12.0),),
    accelerometer_bias=0.015,  # a cheap MEMS sensor, so that the drift is easy to see
)
