"""Clouds: LAS, LAZ and COPC byte by byte; E57, PLY and NPZ by way of a LAZ.

- las, las_layout, las_points, las_windows, noise: points by chunks, all or within spans of time
- las_checks, las_crs, copies: what is wrong with a file before it is read
- las_copy, las_output, las_writer, copc_writer, extra_bytes: corrected copies and new files
- conversion, cloud_sources, e57, ply_clouds, ply: other formats, and meshes
"""
