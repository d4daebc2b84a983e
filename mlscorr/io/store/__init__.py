"""Files of a disk or of a store (fsspec): paths, reading by ranges, writing whole or not at all.

- storage, opening, patterns: a path or a URL, and the bytes behind it
- text_files, toml_file, open_places: encodings, TOML read into pydantic models, what is left open
- identity, inputs: which file this is, and whether it is still the one that was read
- publishing, output, folders: results that appear whole or not at all, and the lock of a run
- task_store, spool, npz: results of tasks, points parted on disk, arrays longer than memory
"""

from mlscorr.io.store.identity import FileIdentity
from mlscorr.io.store.inputs import check_unchanged, input_file
from mlscorr.io.store.npz import NpzWriter
from mlscorr.io.store.open_places import MARK, PLACE_OF_CRS, OpenPlace, OpenQuestion, places_of
from mlscorr.io.store.opening import open_file, read_bytes, read_doubles
from mlscorr.io.store.output import (
    PART,
    check_output,
    document,
    output_file,
    output_folder,
    write_json,
)
from mlscorr.io.store.patterns import folders_below
from mlscorr.io.store.preparation import (
    announced,
    glance,
    looked_points,
    progress_of,
    temporary_folder,
)
from mlscorr.io.store.publishing import (
    appended,
    check_store_output,
    make_folder,
    publish,
    remove_files,
)
from mlscorr.io.store.spool import Spool, check_space, telling_space
from mlscorr.io.store.storage import (
    as_path,
    beside,
    file_state,
    files_like,
    is_folder,
    is_remote,
    is_there,
    is_url,
    resolved,
)
from mlscorr.io.store.task_store import TaskStore, digest
from mlscorr.io.store.text_files import (
    ENCODING,
    ENCODINGS,
    encoding_of,
    listed,
    nearest,
    shown,
    warn_of_cut,
)
from mlscorr.io.store.toml_file import (
    Column,
    Coordinate,
    Degrees,
    Meters,
    PointSource,
    Positive,
    Share,
    Six,
    Three,
    TomlSection,
    read_toml,
    validate,
)
