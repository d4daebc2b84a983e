"""Fields added to the points of a LAS file, and the VLR that describes them."""

from dataclasses import replace

import numpy as np
from laspy.vlrs.known import ExtraBytesStruct, ExtraBytesVlr

from mlscorr.io.clouds.las_checks import variable_records
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.settings import SETTINGS

NAMES = ("sigma_easting", "sigma_northing", "sigma_height")
UINT16 = 3  # number of the type, ASPRS LAS 1.4 R15, table 24
UNKNOWN = np.iinfo(np.uint16).max  # of a point without a pose


def add_sigma_fields(layout: LasLayout) -> LasLayout:
    """The LasLayout with one sigma of E, N and H behind each point, as uint16.

    Extra bytes that nobody described get a descriptor, as the new ones follow them.

    Parameters
    ----------
    layout : LasLayout

    Returns
    -------
    LasLayout

    Raises
    ------
    ValueError
        When the points have these fields already, or fewer bytes than described.
    """
    owner = (ExtraBytesVlr.official_user_id().encode(), ExtraBytesVlr.official_record_ids()[0])
    described = b"".join(variable_records(layout, *owner))
    size = ExtraBytesStruct.size()
    described = described[: len(described) // size * size]
    fields = [
        ExtraBytesStruct.from_buffer_copy(described, start)
        for start in range(0, len(described), size)
    ]
    if twice := sorted({field.name.decode(errors="replace") for field in fields} & set(NAMES)):
        raise ValueError(
            f"The points of {layout.path} have the field {twice[0]} already. Correct the file as "
            "it was recorded, or do so without sigmas."
        )
    nameless = layout.extra_bytes - sum(field.dtype().itemsize for field in fields)
    if nameless < 0:
        raise ValueError(
            f"{layout.path} is damaged: it describes {layout.extra_bytes - nameless} extra bytes "
            f"a point, and its points have {layout.extra_bytes}."
        )
    longest = np.iinfo(np.uint8).max  # bytes that a descriptor of raw bytes can cover
    for number, start in enumerate(range(0, nameless, longest)):
        size = min(longest, nameless - start)
        described += _descriptor(b"undescribed_%d" % number, data_type=0, options=size)
    for name in NAMES:
        scaled = {"scale": [SETTINGS.sigma_step], "no_data": [UNKNOWN]}
        described += _descriptor(name.encode(), b"one sigma, m", data_type=UINT16, **scaled)
    head = layout.head_with(*owner, described)
    length = layout.record_length + len(NAMES) * np.dtype(np.uint16).itemsize
    return replace(layout, head=head).with_record_length(length)


def with_sigmas(records: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Bytes of point records with their sigmas behind each.

    Parameters
    ----------
    records : (n,) structured array
    sigma : (n, 3) array
        NaN where unknown; what exceeds 6.5534 m is given as that. Units: m.

    Returns
    -------
    (k,) array of uint8
    """
    steps = np.minimum(np.rint(sigma / SETTINGS.sigma_step), UNKNOWN - 1)
    steps = np.where(np.isnan(steps), UNKNOWN, steps).astype("<u2")
    raw = records.view(np.uint8).reshape(len(records), -1)
    return np.hstack([raw, steps.view(np.uint8)]).ravel()


def _descriptor(name, description=b"", scale=None, no_data=None, **fields):
    """Bytes that describe one field; laspy's own start states a range that nobody measured."""
    field = ExtraBytesStruct.from_buffer_copy(bytes(ExtraBytesStruct.size()))
    for key, value in {"name": name, "description": description, **fields}.items():
        setattr(field, key, value)
    if scale is not None:
        field.scale = scale
        field.no_data = no_data
    return bytes(field)
