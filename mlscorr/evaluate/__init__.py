"""What a correction is worth.

- rows: typed rows of report.json: statistics, scores, targets
- scores: misclosures before and after a correction, and the accuracy that follows
- target_rows: one row for every surveyed point and pass
- model: what the estimate says of itself
- datum, beams: sentences on control and clouds that belong to something else
- accuracy: the ASPRS standard
- quality: gates that make a command fail
"""
