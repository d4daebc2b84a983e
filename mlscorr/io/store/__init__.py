"""Files of a disk or of a store (fsspec): paths, reading by ranges, writing whole or not at all.

- storage, opening, patterns: a path or a URL, and the bytes behind it
- text_files, toml_file, open_places: encodings, TOML read into pydantic models, what is left open
- identity, inputs: which file this is, and whether it is still the one that was read
- publishing, output, folders: results that appear whole or not at all, and the lock of a run
- task_store, spool, npz: results of tasks, points parted on disk, arrays longer than memory
"""
