"""The numbers that this room goes by, each with its unit, reason and source."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What files may hold, and how they are read and written.

    A file that is refused wrongly can't be used at all, so limits are where no survey can be.
    """

    # ---- clouds
    chunk_points: int = 500_000  # at a time: 50 MB with decoding, 10 LAZ chunks for threads; guard
    sampled_points: int = 65  # times per file, both ends among them, for its time system; guard
    close_places: int = 50_000  # points, LASzip's chunk: decoded to find a point in it; guard
    largest_chunk: int = 10_000_000  # points; lazrs allocates LAZ chunks whole or aborts; guard
    sigma_step: float = 1e-4  # m, of a point's sigma in 16 bits: up to 6.5 m
    copied_bytes: int = 1 << 20  # at a time, where bytes are copied as they are; guard
    uploaded_bytes: int = 1 << 24  # at a time, into a store: 10 000 parts, memory for two; guard
    beat: float = 10.0  # s between two signs of life of a run that works in a store; guard
    identified_bytes: int = 1 << 16  # of head and tail: header, points, table of chunks; guard

    glanced_points: int = 5_000_000  # of a cloud that is no LAS, by check and init: 3 s; guard
    single_step: float = 1e-3  # m, of coordinates in single precision, within 8 km of zero; guard
    single_time_step: float = 1e-4  # s, of times in single precision: 1 mm at 10 m/s; guard

    # ---- control
    target_size: tuple[float, float] = (0.02, 10.0)  # m: the beam's width; surely in mm; guard
    largest_coordinate: float = 1e8  # m: twice the Earth's girth, and zones prefixed to E; guard
    coarse_sigma: float = 0.5  # m, beyond which a surveyed point corrects nothing; guard
    near: float = 1e3  # m, within which a survey's control and points lie of the trajectory; guard
    far: float = 5e3  # m, beyond which control and trajectory can't belong together; guard

    named_faults: int = 8  # of a file in a message; more would hide what they have in common; guard
    same_place: float = 0.1  # m; realisations of one datum put a place so far apart in a few years

    # ---- folders
    folder_depth: int = 3  # of folders within that of a survey: deliveries have two; guard

    # ---- tables
    longest_line: int = 10_000  # characters; no table has columns for that; guard
    named_columns: int = 32  # of a header in a message: as many as columns.toml has columns; guard
    sampled_lines: int = 200  # in which a header stands, below what a program says of itself; guard

    # ---- trajectories
    moving: float = 1.0  # m/s, below which the course over ground says nothing of the heading
    baseline: float = 0.5  # s, over which the course is taken, long against noise of positions
    course_tolerance: float = 30.0  # deg, beyond the drift of a boat or the crab of an aircraft
    course_offset: float = 3.0  # deg, to which a POS that is mounted by eye points ahead
    crab: float = 15.0  # deg, of an aircraft of 60 m/s in a wind of 15 m/s, on one course
    course_epochs: int = 10  # of a moving vehicle, from which a median says something
    forward_share: float = 0.1  # of the way; a vehicle that goes forward so much reverses the rest
    fastest: float = 340.0  # m/s, the speed of sound: no vehicle with a scanner; guard
    same_export: float = 1e-3  # m, to which text files write coordinates
    microseconds: float = 1e13  # a time beyond counts them: as seconds it were 300 000 years; guard

    # ---- times
    covered_share: float = 0.5  # of the times inside the trajectory, from which a constant fits
    earliest_time: float = 6.3e8  # s, GPS seconds of 2000; no vehicle was scanning before; guard


SETTINGS = Settings()
