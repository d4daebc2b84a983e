"""Tables of others: encoding, separator, header, columns, units, and control lists in them.

- layouts, layout_search, column_names: what the columns of a table mean
- table_rows, tables, sheets: its rows as numbers, and what is wrong in them; workbooks
- control, control_lists, control_faults, nearness: surveyed points, and whether they are plausible
- result_tables: results as CSV
"""
