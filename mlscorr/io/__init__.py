"""Reading files into data types and writing results, in packages from the ground up.

- store: paths and URLs, bytes, text and TOML, results written atomically
- tables: foreign tables and control lists
- trajectories: the path of the POS, in many formats
- clouds: points in chunks, and their corrected copies
- surveys: survey.toml and project.toml, with the files they name
"""

from mlscorr.io.settings import SETTINGS
