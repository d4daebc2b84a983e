"""Settings of reading and writing, each with unit, reason and source."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits of file contents, and sizes for reading and writing.

    A wrongly refused file cannot be used at all, so limits are beyond any possible survey.
    """

    # ---- clouds
    chunk_points: int = 500_000  # at a time: 50 MB with decoding, 10 LAZ chunks for threads; guard
    sampled_points: int = 65  # times per file, including both ends, for its time system; guard
    close_places: int = 50_000  # points, LASzip's chunk: decoded to find a point in it; guard
    largest_chunk: int = 10_000_000  # points; lazrs allocates whole LAZ chunks or aborts; guard
    sigma_step: float = 1e-4  # m, of a point's sigma in 16 bits: up to 6.5 m
    copied_bytes: int = 1 << 20  # at a time, when bytes are copied unchanged; guard
    uploaded_bytes: int = 1 << 24  # at a time, into a store: 10 000 parts, memory for two; guard
    beat: float = 10.0  # s between two heartbeats of a run that works in a store; guard
    identified_bytes: int = 1 << 16  # of head and tail: header, points, table of chunks; guard

    glanced_points: int = 5_000_000  # of a cloud that is not LAS, by check and init: 3 s; guard
    single_step: float = 1e-3  # m, of coordinates in single precision, within 8 km of zero; guard
    single_time_step: float = 1e-4  # s, of times in single precision: 1 mm at 10 m/s; guard

    # ---- control
    target_size: tuple[float, float] = (0.02, 10.0)  # m: a beam's width; surely mm; guard
    largest_coordinate: float = 1e8  # m: twice the Earth's girth, and zones prefixed to E; guard
    coarse_sigma: float = 0.5  # m, beyond which a surveyed point corrects nothing; guard
    near: float = 1e3  # m, distance of control and points from the trajectory; guard
    far: float = 5e3  # m, beyond which control and trajectory do not belong together; guard

    named_faults: int = 8  # of a file in a message; more would hide their common cause; guard
    same_place: float = 0.1  # m; realizations of one datum differ by this after a few years

    # ---- folders
    folder_depth: int = 3  # of folders within that of a survey: deliveries have two; guard

    # ---- tables
    longest_line: int = 10_000  # characters; no table has columns for that; guard
    named_columns: int = 32  # of a header in a message: as many as in columns.toml; guard
    sampled_lines: int = 200  # in which a header is searched, below a program's preamble; guard

    # ---- trajectories
    moving: float = 1.0  # m/s, below which course over ground does not give the heading
    baseline: float = 0.5  # s, to derive the course, long against the noise of positions
    course_tolerance: float = 30.0  # deg, beyond the drift of a boat or the crab of an aircraft
    course_offset: float = 3.0  # deg, by which a POS mounted by eye may deviate
    crab: float = 15.0  # deg, of an aircraft of 60 m/s in a wind of 15 m/s, on one course
    course_epochs: int = 10  # of a moving vehicle, for a meaningful median
    forward_share: float = 0.1  # of the path; with more forward motion, the rest is reversing
    fastest: float = 340.0  # m/s, the speed of sound: no vehicle with a scanner; guard
    same_export: float = 1e-3  # m, to which text files write coordinates
    microseconds: float = 1e13  # larger times are microseconds: as seconds, 300 000 years; guard

    # ---- times
    covered_share: float = 0.5  # of the times inside the trajectory, from which a constant fits
    earliest_time: float = 6.3e8  # s, GPS seconds of 2000; no vehicle scanned before; guard


SETTINGS = Settings()
