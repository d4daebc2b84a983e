"""Tables of others: encoding, separator, header, columns, units, and control lists in them.

- layouts, layout_search, column_names: what the columns of a table mean
- table_rows, tables, sheets: its rows as numbers, and what is wrong in them; workbooks
- control, control_lists, control_faults, nearness: surveyed points, and whether they are plausible
- result_tables: results as CSV
"""

from mlscorr.io.tables.column_names import (
    ANGLES,
    CONTROL_NAMES,
    TRAJECTORY_NAMES,
    UNITS,
    find_meanings,
    listed,
    plain,
)
from mlscorr.io.tables.control import NOTHING_SURVEYED, ControlList, holds_points, read_control
from mlscorr.io.tables.control_faults import ListError
from mlscorr.io.tables.control_lists import AxesError, lacking, unnamed_columns
from mlscorr.io.tables.layout_search import NUMBER, find_layout, likely_header
from mlscorr.io.tables.layouts import TableLayout
from mlscorr.io.tables.nearness import check_together, far_cloud, nearest_epochs
from mlscorr.io.tables.result_tables import (
    write_csv,
    write_extracted_csv,
    write_targets_csv,
    write_ties_csv,
)
from mlscorr.io.tables.table_rows import read_numbers
from mlscorr.io.tables.table_sections import ControlSection, PlaceColumns
from mlscorr.io.tables.tables import check_finite, check_increasing, read_header, read_layout
from mlscorr.survey import AXES
