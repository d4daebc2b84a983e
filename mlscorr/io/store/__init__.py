"""Files on a disk or in a store (fsspec): paths, reading of ranges, atomic writing.

- storage: a path or a URL, patterns of them, and the bytes behind them
- text_files, toml_file: encodings, TOML read into pydantic models, open values in it
- inputs: identity of files, and detection of changes
- output, publishing: results written atomically, and the lock of a run
- task_store, spool: results of tasks, arrays longer than memory
- preparation: number of points of a cloud that are read first, and their location
"""

from mlscorr.io.store.inputs import FileIdentity, check_unchanged, input_file
from mlscorr.io.store.output import (
    PART,
    check_output,
    document,
    output_file,
    output_folder,
    write_json,
)
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
from mlscorr.io.store.spool import NpzWriter, Spool, check_space, telling_space
from mlscorr.io.store.storage import (
    as_path,
    file_state,
    files_like,
    folders_below,
    is_folder,
    is_remote,
    is_there,
    is_url,
    open_file,
    read_bytes,
    read_doubles,
    resolved,
    sibling,
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
    MARK,
    PLACE_OF_CRS,
    Column,
    Coordinate,
    Degrees,
    Meters,
    OpenPlace,
    OpenQuestion,
    PointSource,
    Positive,
    Share,
    Six,
    Three,
    TomlSection,
    places_of,
    read_toml,
    validate,
)
