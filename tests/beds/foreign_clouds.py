"""E57 and PLY files of a LAS cloud, and of bare points."""

import uuid

import laspy
import numpy as np

DTYPES = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int"}


def points_of(path):
    "Fields of a LAS file: x, y, z (m), gps_time (s), intensity"
    las = laspy.read(path)
    fields = {name: np.asarray(getattr(las, name), float) for name in "xyz"}
    return fields | {name: np.asarray(las[name], float) for name in ("gps_time", "intensity")}


def write_ply(path, fields, kinds=None, form="binary_little_endian", comments=(), faces=0):
    "A PLY of fields, each a double unless kinds say otherwise"
    order = ">" if "big" in form else "<"
    types = {name: (kinds or {}).get(name, "f8") for name in fields}
    size = len(next(iter(fields.values())))
    header = ["ply", f"format {form} 1.0", *(f"comment {text}" for text in comments)]
    header += [f"element vertex {size}"]
    header += [f"property {DTYPES[kind]} {name}" for name, kind in types.items()]
    header += ["element face 0", "property list uchar int vertex_indices"] * bool(faces == 0)
    header += ["end_header", ""]
    table = np.empty(size, [(name, order + kind) for name, kind in types.items()])
    for name, values in fields.items():
        table[name] = values
    with path.open("wb") as file:
        file.write("\n".join(header).encode())
        if form == "ascii":
            rows = (" ".join(repr(value.item()) for value in row) for row in table)
            file.write("\n".join([*rows, ""]).encode())
        else:
            file.write(table.tobytes())
    return path


def write_e57(path, scans):
    """An E57 of scans: dicts of ``fields`` (name to values), and optionally ``single`` (names),
    ``pose`` (quaternion w x y z, translation), ``start`` and ``end`` (GPS seconds)
    """
    import pye57
    from pye57 import libe57

    file = pye57.E57(str(path), mode="w")
    image = file.image_file

    def struct(parent, name, **values):
        node = libe57.StructureNode(image)
        parent.set(name, node)
        for key, value in values.items():
            node.set(key, libe57.FloatNode(image, float(value)))
        return node

    for scan in scans:
        node = libe57.StructureNode(image)
        node.set("guid", libe57.StringNode(image, f"{{{uuid.uuid4()}}}"))
        file.data3d.append(node)
        if "pose" in scan:
            quaternion, shift = scan["pose"]
            pose = struct(node, "pose")
            struct(pose, "rotation", **dict(zip("wxyz", quaternion, strict=True)))
            struct(pose, "translation", **dict(zip("xyz", shift, strict=True)))
        for name, key in (("acquisitionStart", "start"), ("acquisitionEnd", "end")):
            if key in scan:
                struct(node, name, dateTimeValue=scan[key])
        prototype = libe57.StructureNode(image)
        buffers = libe57.VectorSourceDestBuffer()
        kept = []
        for name, column in scan["fields"].items():
            values = np.ascontiguousarray(column)
            if values.dtype.kind in "iu":
                low = int(values.min())
                high = max(int(values.max()), 1)
                prototype.set(name, libe57.IntegerNode(image, low, low, high))
            else:
                single = name in scan.get("single", ())
                precision = libe57.E57_SINGLE if single else libe57.E57_DOUBLE
                prototype.set(name, libe57.FloatNode(image, 0.0, precision))
            kept.append(values.astype(float))
            buffers.append(libe57.SourceDestBuffer(image, name, kept[-1], len(values), True, True))
        vector = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
        node.set("points", vector)
        writer = vector.writer(buffers)
        writer.write(len(kept[0]))
        writer.close()
    file.close()
    return path
