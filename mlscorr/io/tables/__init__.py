"""Tables of others, read as numbers in m, deg and s, and results written as CSV.

A table goes through this room from its words to its numbers:

- columns.toml, column_names: words of others for columns, units, roles and kinds, by language
- layout_search: which row is the header, which column is what, and which is missing
- table_rows: the rows below, of text or of a workbook, and what is wrong in them
- control, control_lists, nearness: surveyed points, and whether they are plausible
- result_tables: results as CSV
"""

from mlscorr.io.tables.column_names import (
    ANGLES,
    CONTROL_NAMES,
    TRAJECTORY_NAMES,
    UNITS,
    ControlSection,
    PlaceColumns,
    find_meanings,
    plain,
)
from mlscorr.io.tables.control import (
    NOTHING_SURVEYED,
    ControlList,
    ListError,
    holds_points,
    read_control,
)
from mlscorr.io.tables.control_lists import AxesError, lacking, unnamed_columns
from mlscorr.io.tables.layout_search import find_layout, likely_header, read_header, read_layout
from mlscorr.io.tables.nearness import check_together, far_cloud, nearest_epochs
from mlscorr.io.tables.result_tables import (
    write_csv,
    write_extracted_csv,
    write_targets_csv,
    write_ties_csv,
)
from mlscorr.io.tables.table_rows import (
    NUMBER,
    TableLayout,
    check_finite,
    check_increasing,
    read_numbers,
)
from mlscorr.survey import AXES
