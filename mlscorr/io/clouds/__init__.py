"""Clouds: LAS, LAZ and COPC byte by byte; E57, PLY and NPZ through a LAZ.

- las, las_layout, time_order: points in chunks, all or within intervals of time
- las_checks, las_crs, copies: checks of a file before it is read
- las_copy, las_writer, copc_writer: corrected copies and new files
- conversion, cloud_sources, e57, ply: other formats, and meshes
"""

from mlscorr.io.clouds.conversion import (
    converted,
    is_foreign,
    read_in_part,
    recorded_points,
    written_name,
)
from mlscorr.io.clouds.copies import find_copies
from mlscorr.io.clouds.las import (
    count_sources,
    counted_noise,
    read_chunks,
    read_cloud,
    read_intervals,
    sample_gps_times,
    sha256,
    spread_records,
    timed_records,
)
from mlscorr.io.clouds.las_checks import read_layout
from mlscorr.io.clouds.las_copy import (
    NOTHING_ADDED,
    Additions,
    CorrectedPart,
    with_additions,
    write_parts,
)
from mlscorr.io.clouds.las_crs import cloud_box, crs_conflict, stated_crs
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.clouds.las_writer import cloud_writer
from mlscorr.io.clouds.ply import announced_faces, write_ply
