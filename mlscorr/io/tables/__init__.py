"""Tables of others, read as numbers in m, deg and s, and results written as CSV.

A table goes through this room from its words to its numbers:

- columns.toml, column_names: words of others for columns, units, roles and kinds, by language
- layouts, layout_search: which row is the header, which column is what; two meanings are refused
- missing_columns: columns that are needed and not there, and what to write in survey.toml
- table_rows, _sheets: the rows below, of text or of a workbook, and what is wrong in them
- control, control_lists, control_faults, nearness: surveyed points, and whether they are plausible
- table_sections, result_tables: what survey.toml states of tables; results as CSV
"""

from mlscorr.io.tables.column_names import (
    ANGLES,
    CONTROL_NAMES,
    TRAJECTORY_NAMES,
    UNITS,
    find_meanings,
    plain,
)
from mlscorr.io.tables.control import NOTHING_SURVEYED, ControlList, holds_points, read_control
from mlscorr.io.tables.control_faults import ListError
from mlscorr.io.tables.control_lists import AxesError, lacking, unnamed_columns
from mlscorr.io.tables.layout_search import find_layout, likely_header, read_header, read_layout
from mlscorr.io.tables.layouts import NUMBER, TableLayout
from mlscorr.io.tables.nearness import check_together, far_cloud, nearest_epochs
from mlscorr.io.tables.result_tables import (
    write_csv,
    write_extracted_csv,
    write_targets_csv,
    write_ties_csv,
)
from mlscorr.io.tables.table_rows import check_finite, check_increasing, read_numbers
from mlscorr.io.tables.table_sections import ControlSection, PlaceColumns
from mlscorr.survey import AXES
