"""A short survey some of whose points have no time, but a value in its place."""

import laspy
import numpy as np

from tests.beds.foreign_clouds import write_ply

# s of week; UTM
START = 413_200.0
CORNER = [532_000.0, 3_374_000.0, 40.0]
POINTS = 2_000
TOML = """[cloud]
files = ["{}"]

[trajectory]
file = "trajectory.csv"
"""


def write_survey(folder, value, cloud="pass.las", step=100):
    "A drive of 20 s whose every so many points have no time, but a value; the times of its points"
    times = START + np.linspace(2.0, 18.0, POINTS)
    times[::step] = value
    xyz = np.array(CORNER) + np.outer(np.arange(POINTS), [0.01, 0.001, 0.0])
    if cloud.endswith(".las"):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales = [0.001] * 3
        header.offsets = CORNER
        las = laspy.LasData(header)
        las.xyz = xyz
        las.gps_time = times
        las.write(folder / cloud)
    else:
        fields = dict(zip("xyz", xyz.T, strict=True)) | {"gps_time": times}
        write_ply(folder / cloud, fields)
    epochs = START + np.arange(0.0, 20.0, 0.1)
    rows = (f"{t:.3f},{532_000.0 + t - START:.3f},3374000,42,0,0,90\n" for t in epochs)
    header = "gps_time,easting,northing,height,roll,pitch,heading\n"
    (folder / "trajectory.csv").write_text(header + "".join(rows))
    (folder / "survey.toml").write_text(TOML.format(cloud))
    return times
