"""Files become nouns, and results become files; a room each, from the ground up.

- store: paths and URLs, bytes, text and TOML, results written whole or not at all
- tables: tables and control lists of others
- trajectories: the POS's path, in whatever format
- clouds: points by chunks, and corrected copies of them
- surveys: survey.toml and project.toml with all that they name
"""

from mlscorr.io.settings import SETTINGS
