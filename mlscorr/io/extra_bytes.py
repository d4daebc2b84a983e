"""Fields added to the points of a LAS file, and the VLR that describes them.

Byte positions are those of the ASPRS LAS 1.4 R15 specification, tables 24 and 25.
"""

import struct
from dataclasses import replace

import numpy as np

from mlscorr.io.las_layout import RECORD_LENGTHS, VLR_HEADER

STEP = 1e-4  # m
UNKNOWN = 65535  # of a point without a pose
NAMES = ("sigma_easting", "sigma_northing", "sigma_height")

USER, RECORD = b"LASF_Spec", 4
DESCRIPTOR = "<2xBB32s4xQ64xd40x32s"  # type, options, name, no_data, scale, description
SIZES = (0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8)  # bytes of the types, by number; 0: as options say
UINT16 = 3
NO_DATA, SCALE = 1, 8  # bits of the options
LARGEST = 255  # bytes that one descriptor of type 0 can cover


def add_sigma_fields(layout):
    """The Layout with one sigma of E, N and H behind each point, as uint16.

    Extra bytes that nobody described get a descriptor, as the new ones follow them. Raises
    ValueError when the points have these fields already, or fewer bytes than described.
    """
    found = [(a, b) for a, b in layout.vlrs if _is_description(layout, a)]
    known = b"".join(layout.head[a + VLR_HEADER : b] for a, b in found)
    size = struct.calcsize(DESCRIPTOR)
    fields = [
        struct.unpack_from(DESCRIPTOR, known, k) for k in range(0, len(known) - size + 1, size)
    ]
    present = {field[2].split(b"\0")[0].decode(errors="replace") for field in fields}
    if twice := sorted(present & set(NAMES)):
        raise ValueError(
            f"The points of {layout.path} have the field {twice[0]} already. Correct the file as "
            "it was recorded, or do so without sigmas."
        )
    extra = layout.record_length - RECORD_LENGTHS[layout.point_format]
    nameless = extra - sum(_bytes_of(kind, options) for kind, options, *_ in fields)
    if nameless < 0:
        raise ValueError(
            f"{layout.path} is damaged: it describes {extra - nameless} extra bytes a point, and "
            f"its points have {extra}."
        )
    data = known[: len(fields) * size]
    for number, start in enumerate(range(0, nameless, LARGEST)):
        part = min(LARGEST, nameless - start)
        data += struct.pack(DESCRIPTOR, 0, part, b"undescribed_%d" % number, 0, 0.0, b"")
    for name in NAMES:
        text = name.encode(), UNKNOWN, STEP, b"one sigma, m"
        data += struct.pack(DESCRIPTOR, UINT16, NO_DATA | SCALE, *text)
    return _with_description(layout, found, data, 2 * len(NAMES))


def with_sigmas(records, sigma):
    """Bytes of point records with their sigmas (n, 3) behind each; NaN where unknown. Units: m.

    What exceeds 6.5534 m is given as that.
    """
    steps = np.minimum(np.rint(sigma / STEP), UNKNOWN - 1)
    steps = np.where(np.isnan(steps), UNKNOWN, steps).astype("<u2")
    raw = records.view(np.uint8).reshape(len(records), -1)
    return np.hstack([raw, steps.view(np.uint8)]).ravel()


def _is_description(layout, start):
    return layout.user_id(start) == USER and layout.field("H", start + 18)[0] == RECORD


def _bytes_of(kind, options):
    """Bytes of a field; the types above 10 are arrays of two or three, no longer in use."""
    if kind == 0:
        return options
    return SIZES[(kind - 1) % 10 + 1] * ((kind - 1) // 10 + 1)


def _with_description(layout, found, data, more):
    """The Layout with this description instead of those found, and records longer by some bytes."""
    header_size = layout.field("H", 94)[0]
    kept = [layout.head[a:b] for a, b in layout.vlrs if (a, b) not in found]
    kept.append(struct.pack("<2x16sHH32s", USER, RECORD, len(data), b"") + data)
    between = layout.head[layout.vlrs[-1][1] if layout.vlrs else header_size :]
    head = bytearray(layout.head[:header_size] + b"".join(kept) + between)
    struct.pack_into("<II", head, 96, len(head), len(kept))
    struct.pack_into("<H", head, 105, layout.record_length + more)
    return replace(layout, head=bytes(head))
