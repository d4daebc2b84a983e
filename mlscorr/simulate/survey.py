"""A whole survey, simulated: what was recorded, and the truth behind it."""

import json
from dataclasses import asdict, dataclass
from datetime import date
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.georeference import georeference
from mlscorr.simulate.drive import distance_along, drive
from mlscorr.simulate.pos_error import ATTITUDE_ERROR, pos_error, record
from mlscorr.simulate.scanner import Pulses, scan
from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.scene import Scene, build_scene, centre_line
from mlscorr.survey import ControlPoints, Mounting, PointCloud, Trajectory, angles_from_attitude

CLOUD_FILE = "pass-1.laz"
CREATED = date(2015, 1, 1)  # in the LAS header, so that a seed gives the same bytes on any day


@dataclass(frozen=True)
class SimulatedSurvey:
    """One simulated drive.

    Parameters
    ----------
    scenario : Scenario
    scene : Scene
    pulses : Pulses
        As measured, with their true points.
    true_trajectory, trajectory : Trajectory
        Where the vehicle was, and what the POS recorded.
    mounting : Mounting
    targets : ControlPoints
        All targets as surveyed, with noise, in the order of the scene's targets.
    is_check : (n,) bool array
        Which of them are check points.
    true_centre : (n, 3) array
        Map coordinates of the targets. Units: m.
    """

    scenario: Scenario
    scene: Scene
    pulses: Pulses
    true_trajectory: Trajectory
    trajectory: Trajectory
    mounting: Mounting
    targets: ControlPoints
    is_check: np.ndarray
    true_centre: np.ndarray

    @cached_property
    def cloud(self):
        """PointCloud of the measured pulses, georeferenced with the recorded trajectory."""
        xyz = georeference(
            self.trajectory, self.mounting, self.pulses.scanner_xyz, self.pulses.gps_time
        )
        return PointCloud(xyz, self.pulses.gps_time, self.pulses.intensity)

    @property
    def target(self):
        """Which target each point truly lies on, board included; -1 for none: (n,) int."""
        return self.scene.target[self.pulses.triangle]

    def write(self, folder):
        """Write the survey folder with survey.toml, cloud, trajectory, control and truth."""
        from mlscorr.io.las_writer import write_cloud
        from mlscorr.io.trajectory import write_trajectory_csv

        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        write_cloud(
            folder / CLOUD_FILE,
            self.cloud,
            scan_angle=self.pulses.scan_angle,
            crs=self.scenario.crs,
            created=CREATED,
        )
        write_trajectory_csv(folder / "trajectory.csv", self.trajectory)
        (folder / "control.csv").write_text(self._control_csv())
        (folder / "survey.toml").write_text(_survey_toml(self.scenario))
        np.savez(folder / "truth.npz", **self._truth())
        truth = {"effect": "none", "params": {}, "scenario": asdict(self.scenario)}
        (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")

    def _control_csv(self):
        rows = [
            "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role",
        ]
        t = self.targets
        for i, name in enumerate(t.name):
            place = ",".join(f"{v:.4f}" for v in t.position[i])
            role = "check" if self.is_check[i] else "control"
            sigma = f"{t.sigma[i, 0]},{t.sigma[i, 2]}"
            rows.append(f"{name},{place},{sigma},{t.kind[i]},{t.size[i]},{role}")
        return "\n".join(rows) + "\n"

    def _truth(self):
        """Arrays of truth.npz: points in file order, trajectory (deg), targets."""
        angles = np.column_stack(angles_from_attitude(self.true_trajectory.attitude))
        return {
            "point_xyz": self.pulses.point,
            "point_target": self.target.astype(np.int16),
            "trajectory_gps_time": self.true_trajectory.gps_time,
            "trajectory_position": self.true_trajectory.position,
            "trajectory_roll_pitch_heading": np.degrees(angles),
            "control_name": np.array(self.targets.name),
            "control_position": self.true_centre,
            "control_normal": self.scene.targets.normal,
        }


def simulate(scenario, rng):
    """SimulatedSurvey of a scenario; every stage has its own random stream.

    >>> short = Scenario(duration=2.0, control=2, check=1, points_per_line=50)
    >>> survey = simulate(short, np.random.default_rng(1))
    >>> len(survey.trajectory), survey.targets.name
    (201, ('T01', 'T02', 'T03'))
    """
    speed_rng, line_rng, scene_rng, drive_rng, scan_rng, pos_rng, control_rng = rng.spawn(7)
    origin = np.array(scenario.origin)
    mounting = Mounting(
        np.array(scenario.lever_arm),
        Rotation.from_euler("xyz", scenario.boresight, degrees=True),
    )

    # The street is as long as the drive.
    elapsed = np.arange(round(scenario.duration * scenario.pose_rate) + 1) / scenario.pose_rate
    distance = distance_along(elapsed, scenario.speed, speed_rng)
    line = centre_line(distance[-1], line_rng)
    count = scenario.control + scenario.check
    scene = build_scene(line, distance[-1], count, scenario.target_size, scene_rng)

    # The vehicle drives and scans.
    true = drive(line, distance, scenario.start_time + elapsed, origin, drive_rng)
    pulses = scan(scene, origin, true, mounting, scenario, scan_rng)

    # The POS and the surveyor record what they can.
    recorded = record(true, pos_error(elapsed, scenario, pos_rng))
    centre = origin + scene.targets.centre
    targets = _survey_targets(scene.targets, centre, scenario, control_rng)
    is_check = _spread(count, scenario.check)
    return SimulatedSurvey(
        scenario, scene, pulses, true, recorded, mounting, targets, is_check, centre
    )


def _survey_targets(targets, centre, scenario, rng):
    """ControlPoints of all targets, with the noise of the survey."""
    n = len(targets)
    return ControlPoints(
        tuple(f"T{i + 1:02d}" for i in range(n)),
        centre + scenario.survey_noise * rng.standard_normal((n, 3)),
        np.full((n, 3), scenario.survey_noise),
        targets.kind,
        np.full(n, scenario.target_size),
        targets.normal,
    )


def _spread(count, check):
    """Which of the targets are check points: evenly among them, not at the ends, (count,) bool."""
    is_check = np.zeros(count, dtype=bool)
    is_check[((np.arange(check) + 0.5) * count / max(check, 1)).astype(int)] = True
    return is_check


def _survey_toml(scenario):
    """survey.toml of the folder, with what is believed of scanner and POS."""
    roll, pitch, heading = np.degrees(ATTITUDE_ERROR).round(6).tolist()
    return f"""\
name = {json.dumps(scenario.name)}
crs = {json.dumps(scenario.crs)}

[cloud]
files = ["{CLOUD_FILE}"]
gps_time = "week"

[trajectory]
file = "trajectory.csv"

[mounting]
lever_arm = {list(scenario.lever_arm)}
boresight = {list(scenario.boresight)}

[control]
file = "control.csv"

[scanner]
range_noise = {scenario.range_noise}
angle_noise = {scenario.angle_noise}
lines_per_second = {scenario.lines_per_second}

[pos]
position_sigma = 0.02
attitude_sigma = {[roll, pitch, heading]}
correlation_time = 30.0
"""
