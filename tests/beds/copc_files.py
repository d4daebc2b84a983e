"""COPC files of LAS clouds, put together point by point without the writer that is tested."""

import struct

import laspy
import lazrs
import numpy as np

LEVELS = 4
HEADER = 375  # bytes
ENTRY = np.dtype([("key", "<i4", 4), ("start", "<u8"), ("size", "<i4"), ("points", "<i4")])


def vlr(user, record, data, is_long=False):
    "Bytes of a VLR, or of an EVLR"
    return (
        struct.pack("<2x16sHQ32s" if is_long else "<2x16sHH32s", user, record, len(data), b"")
        + data
    )


def drawn_nodes(xyz, cube, rng):
    "Key (n, 4) of a node for each point, on a level that is drawn, deeper ones more often"
    level = rng.choice(
        LEVELS, len(xyz), p=4.0 ** np.arange(LEVELS) / np.sum(4.0 ** np.arange(LEVELS))
    )
    corner, edge = cube
    place = np.floor((xyz - corner) / edge * 2.0 ** level[:, None]).astype(int)
    return np.column_stack([level, np.clip(place, 0, 2 ** level[:, None] - 1)])


def pages_of(entries, start):
    "A root page and a page for each node of level 2 with what is below it: (page, bytes of all)"
    low = entries[entries["key"][:, 0] < 2]
    high = entries[entries["key"][:, 0] >= 2]
    above = high["key"][:, 1:] >> (high["key"][:, 0] - 2)[:, None]
    root = [low]
    data = b""
    for place in np.unique(above, axis=0):
        page = high[(above == place).all(axis=1)]
        link = np.zeros(1, ENTRY)
        link["key"] = (2, *place)
        link["start"] = start + len(data)
        link["size"] = page.nbytes
        link["points"] = -1
        data += page.tobytes()
        root.append(link)
    root = np.concatenate(root)
    return root, data


def head_of(source, header):
    "Header and VLRs of a LAS file as those of a COPC, and the LASzip VLR"
    head = bytearray(source.read_bytes()[: header.offset_to_point_data])
    old = head[HEADER:]
    parts = []
    position = 0
    while len(parts) < len(header.vlrs):
        size = 54 + struct.unpack_from("<H", old, position + 20)[0]
        parts.append(bytes(old[position : position + size]))
        position += size
    point_format = header.point_format
    laszip = lazrs.LazVlr.new_for_compression(
        point_format.id, point_format.num_extra_bytes, use_variable_size_chunks=True
    )
    parts = [
        vlr(b"copc", 1, bytes(160)),
        vlr(b"laszip encoded", 22204, bytes(laszip.record_data())),
        *(part for part in parts if not part.startswith(b"laszip encoded", 2)),
    ]
    head = head[:HEADER] + b"".join(parts)
    head[104] |= 0x80
    struct.pack_into("<HII", head, 94, HEADER, len(head), len(parts))
    return head, laszip


def write_copc(source, target, seed=1, evlr=b""):
    """A COPC of a LAS file in a format from 6 to 8: in each node points are shuffled, nodes that
    hold none have an entry, the hierarchy lies on several pages
    """
    las = laspy.read(source)
    rng = np.random.default_rng(seed)
    records = las.points.array
    corner = las.header.mins
    edge = float(np.max(las.header.maxs - las.header.mins)) * 1.001 + 0.001
    keys = drawn_nodes(np.asarray(las.xyz), (corner, edge), rng)
    present = {tuple(key) for key in keys.tolist()}
    for key in sorted(present, reverse=True):
        for level in range(key[0]):
            present.add((level, *(place >> (key[0] - level) for place in key[1:])))
    head, laszip = head_of(source, las.header)
    order = sorted(present, key=lambda key: rng.random())
    entries = np.zeros(len(order), ENTRY)
    with target.open("w+b") as file:
        file.write(head)
        encoder = lazrs.LasZipCompressor(file, laszip)
        for entry, key in zip(entries, order, strict=True):
            rows = rng.permutation(np.flatnonzero((keys == key).all(axis=1)))
            entry["key"], entry["points"] = key, len(rows)
            if len(rows):
                encoder.compress_many(records[rows].tobytes())
                encoder.finish_current_chunk()
        encoder.done()
        file.seek(len(head))
        sizes = [size for points, size in lazrs.read_chunk_table(file, laszip) if points]
        held = entries["points"] > 0
        entries["size"][held] = sizes
        entries["start"][held] = len(head) + 8 + np.cumsum(sizes) - sizes
        file.seek(0, 2)
        first = file.tell()
        count = 1
        if evlr:
            file.write(vlr(b"somebody", 7, evlr, is_long=True))
            count = 2
        page, data = pages_of(entries, file.tell() + 60)
        file.write(vlr(b"copc", 1000, data + page.tobytes(), is_long=True))
        root = file.tell() - page.nbytes
        times = records["gps_time"]
        info = struct.pack(
            "<5d2Q2d88x",
            *(corner + edge / 2),
            edge / 2,
            edge / 128,
            root,
            page.nbytes,
            times.min(),
            times.max(),
        )
        struct.pack_into("<QI", head, 235, first, count)
        head[HEADER + 54 : HEADER + 54 + 160] = info
        file.seek(0)
        file.write(head)
    return target
