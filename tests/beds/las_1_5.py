"""LAS 1.5 of a LAS 1.4 file, made byte by byte by ASPRS LAS 1.5 R00, table 3."""

import struct

# bytes of the header
OLD = 375
NEW = 393
OFFSET_FLAG = 64  # bit 6 of the global encoding


def as_las_1_5(source, target, times, offset=0, flags=OFFSET_FLAG | 1):
    "The same VLRs, points and EVLRs behind a header with a range of times (s), an offset (1e6 s)"
    data = bytearray(source.read_bytes())
    more = NEW - OLD
    (start,) = struct.unpack_from("<I", data, 96)
    data[25] = 5
    data[6] = data[6] & ~(OFFSET_FLAG | 1) | flags
    struct.pack_into("<HI", data, 94, NEW, start + more)
    for position in (227, 235):
        (value,) = struct.unpack_from("<Q", data, position)
        struct.pack_into("<Q", data, position, value + more if value else 0)
    if data[104] & 0x80:
        (table,) = struct.unpack_from("<Q", data, start)
        struct.pack_into("<Q", data, start, table + more)
    header = struct.pack("<2dH", max(times), min(times), offset)
    target.write_bytes(data[:OLD] + header + data[OLD:])
    return target


def from_las_1_5(source, target):
    "Back to LAS 1.4; returns what 1.5 adds: latest and earliest time, offset"
    data = bytearray(source.read_bytes())
    assert data[25] == 5
    added = struct.unpack_from("<2dH", data, OLD)
    del data[OLD:NEW]
    (start,) = struct.unpack_from("<I", data, 96)
    start -= NEW - OLD
    data[25] = 4
    data[6] &= ~OFFSET_FLAG
    struct.pack_into("<HI", data, 94, OLD, start)
    for position in (227, 235):
        (value,) = struct.unpack_from("<Q", data, position)
        struct.pack_into("<Q", data, position, value - (NEW - OLD) if value else 0)
    if data[104] & 0x80:
        (table,) = struct.unpack_from("<Q", data, start)
        struct.pack_into("<Q", data, start, table - (NEW - OLD))
    target.write_bytes(data)
    return added
