"""Trajectories: from SBET, TRJ, POF, POQ, CSV and tables of others, and back to CSV, SBET and TUM.

- trajectory, trajectory_sessions: one file, and several that are joined in time
- sbet, pof, trj, trajectory_tables, positions, poses, pos_error_series: the formats
- conventions, course, projection: attitudes and positions brought into the map
- time_systems, leap_seconds: the constant between the times of cloud and trajectory
"""
