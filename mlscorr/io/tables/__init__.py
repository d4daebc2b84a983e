"""Foreign tables, read as numbers in m, deg and s, and results written as CSV.

The modules follow a table from words to numbers:

- columns.toml, column_names: foreign names of columns, units, roles and kinds, by language
- layout_search: header row, meaning of columns, and missing columns
- table_rows: the rows below, from text or a workbook, and faults in them
- control, control_lists, nearness: surveyed points, and checks of their plausibility
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
