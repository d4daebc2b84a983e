"""Points about the targets of a survey as fog, rain or a filter leaves them: flagged as noise."""

import laspy
import numpy as np

from mlscorr.io.tables import read_control

EACH = 800  # points about a target
SCATTER = 0.25  # m
BRIGHT = 65_535


def add_noise(folder, cloud="pass-1.laz", is_flagged=True):
    "Add bright points about each surveyed target of a cloud, in order of time; which they are (n,)"
    rng = np.random.default_rng(7)
    path = folder / cloud
    las = laspy.read(path)
    control, check, _ = read_control(folder / "control.csv")
    places = []
    times = []
    for place in (control + check).position:
        near = np.argsort(np.linalg.norm(las.xyz - place, axis=1))[:EACH]
        places.append(place + rng.normal(0.0, SCATTER, (EACH, 3)))
        times.append(np.sort(las.gps_time[near]))
    count = len(places) * EACH
    order = np.argsort(np.concatenate([las.gps_time, *times]), kind="stable")
    is_noise = order >= len(las.points)
    whole = laspy.LasData(las.header)
    whole.points = laspy.ScaleAwarePointRecord.zeros(len(order), header=las.header)
    whole.points.array[~is_noise] = las.points.array
    new = laspy.ScaleAwarePointRecord.zeros(count, header=las.header)
    new.x, new.y, new.z = np.concatenate(places).T
    new.gps_time = np.concatenate(times)
    new.intensity[:] = BRIGHT
    new.return_number[:] = 1
    new.number_of_returns[:] = 1
    if is_flagged:
        kinds = np.arange(count) % 3
        new.classification[:] = np.choose(kinds, [0, 7, 18])
        new.withheld[:] = kinds == 0
    whole.points.array[is_noise] = new.array[order[is_noise] - len(las.points)]
    whole.write(path)
    return is_noise
