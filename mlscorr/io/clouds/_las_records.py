"""Point records of a LAS or LAZ file, read chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager

import numpy as np

from mlscorr.io.clouds._las_points import decoding
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.store import open_file


def decoding_points(layout: LasLayout, first: int, end: int) -> AbstractContextManager:
    """Where lazrs reads some points of a file."""
    if end - first > 1:
        points = f"Points {first} to {end - 1}"
    else:
        points = f"Point {first}"
    return decoding(f"{points} of {layout.points} in {layout.path} cannot be decoded")


def read_records(
    layout: LasLayout,
    chunk_size: int,
    first: int = 0,
    end: int | None = None,
    is_brief: bool = False,
) -> Iterator[np.ndarray]:
    """Records chunk by chunk, each in the memory of the one before.

    Parameters
    ----------
    layout : LasLayout
    chunk_size : int
        Points at a time.
    first, end : int
        As of read_chunks.
    is_brief : bool
        Whether gps_time and point_source_id do.

    Yields
    ------
    (n,) structured array

    Raises
    ------
    ValueError
        For points that cannot be decoded.
    """
    length = layout.record_length
    last = layout.points if end is None else end
    buffer = np.empty(min(chunk_size, last - first) * length, np.uint8)
    with open_file(layout.path) as file:
        decoder = layout.decoder(file, is_brief=is_brief)
        if first:
            decoder.seek(first)
        for start in range(first, last, chunk_size):
            stop = min(start + chunk_size, last)
            raw = buffer[: (stop - start) * length]
            with decoding_points(layout, start, stop):
                decoder.decompress_many(raw)
            yield raw.view(layout.record)
