from functools import lru_cache

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.simulate import SETTINGS, Scenario, SceneScenario
from mlscorr.simulate.drive import drive
from mlscorr.simulate.recording import spread_checks
from mlscorr.simulate.scenario import DriveScenario, PassScenario, TargetScenario
from mlscorr.simulate.scene import (
    UP,
    CentreLine,
    Mesh,
    build_scene,
    line_along,
    read_mesh,
    section,
    sky_elevation,
)
from mlscorr.simulate.scene._river import Bank
from mlscorr.simulate.scene._street import Street, StreetSection
from mlscorr.simulate.scene._things import leaves
from mlscorr.simulate.scene.shapes import ray_caster
from mlscorr.survey import Trajectory

ORIGIN = np.array(Scenario().origin)
OPPOSITE = (PassScenario(lateral=1.6), PassScenario(direction="back", lateral=-1.6))
BOAT = DriveScenario(duration=151.0, speed=3.0)
EAST = np.array([1.0, 0.0, 0.0])
PLANE = np.radians(35.0)  # turn of the scan plane of Scenario's scanner against the cross-section


def street(**parts):
    return Scenario(drive=DriveScenario(passes=OPPOSITE, turns=25.0), **parts)


SCENARIOS = {
    "street": street(targets=TargetScenario(hidden=0.3)),
    "dense": street(targets=TargetScenario(control=10, check=54, size=0.4)),
    "steep": Scenario(
        drive=DriveScenario(turns=90.0, u_turn=True), targets=TargetScenario(size=1.0, check=2)
    ),
    "river": Scenario(
        scene=SceneScenario(kind="river"),
        drive=BOAT,
        targets=TargetScenario(control=9, check=15, hidden=0.3),
    ),
}


@lru_cache
def built(name, seed=1):
    "Line, length, trajectories and scene of a scenario"
    line, length, trajectories = drive(SCENARIOS[name], np.random.default_rng(seed))
    scene = build_scene(SCENARIOS[name], line, length, np.random.default_rng(seed + 100))
    return line, length, trajectories, scene


def height_below(scene, points):
    "Height (n,) of the first surface below points (n, 3)"
    down = np.broadcast_to(-UP, points.shape)
    rays = np.hstack([points, down]).astype(np.float32)
    return points[:, 2] - ray_caster(scene.mesh.triangles).cast_rays(rays)["t_hit"].numpy()


def eyes(trajectory, step=0.05):
    "Places (n, 3) of a scanner 0.4 m above the POS, every few hundredths of a second, local"
    times = np.arange(trajectory.gps_time[0], trajectory.gps_time[-1], step)
    pose = trajectory.at(times)
    return pose.position - ORIGIN + pose.attitude.apply([0.0, 0.0, 0.4]), pose.attitude


def in_scan_plane(trajectory, place):
    "Places (n, 3) of the scanner when its oblique plane passes a place (3,)"
    start, attitude = eyes(trajectory)
    across = attitude.apply([np.sin(PLANE), -np.cos(PLANE), 0.0])
    offset = np.einsum("ij,ij->i", place - start, across)
    near = np.linalg.norm((place - start)[:, :2], axis=1) < 60.0
    return start[near & (np.abs(offset) < 0.6)]


def free(scene, start, end):
    "Flags of pairs of points (n, 3) with nothing of the scene between them, to 3 cm"
    rays = np.hstack([start, end - start]).astype(np.float32)
    reach = ray_caster(scene.mesh.triangles).cast_rays(rays)["t_hit"].numpy()
    return reach * np.linalg.norm(end - start, axis=1) > np.linalg.norm(end - start, axis=1) - 0.03


def in_plane(normal):
    "Two unit vectors (3,) that span a target's plane"
    u = np.cross(UP if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0], normal)
    u /= np.linalg.norm(u)
    return u, np.cross(normal, u)


def test_the_carriageway_has_its_crown_and_kerbs():
    "The road falls 2.5 % from its middle to the kerb, the pavement lies 12 cm above the edge"
    line, _, _, scene = built("steep", 3)
    width = section(SCENARIOS["steep"].drive, 0.0).road
    s = np.arange(20.3, 60.0, 3.0)

    def height(lateral):
        points = line.place(s, lateral, 1.3)  # below crowns and lamps, and beside cars
        return height_below(scene, points) - points[:, 2] + 1.3

    assert width == StreetSection.road
    for lateral in (-1.0, 0.0, 1.0):
        crown = StreetSection.cross_fall * (StreetSection.road - abs(lateral))
        np.testing.assert_allclose(np.median(height(lateral)), crown, atol=1e-3)  # m
    kerb = np.median(height(StreetSection.road + 0.4))
    np.testing.assert_allclose(kerb, StreetSection.kerb, atol=1e-3)


def test_a_street_goes_up_and_down():
    "Along the way the street has grades, none steeper than 7 %"
    line, length, *_ = built("street")
    _, forward, _ = line.frame(np.arange(0.0, length))
    grade = forward[:, 2] / np.hypot(forward[:, 0], forward[:, 1])
    assert 0.01 < np.abs(grade).max() < 0.07


def test_the_carriageway_is_wide_enough_for_the_lanes_and_parked_cars():
    "No car's body stands within 0.9 m of a vehicle's middle"
    _, _, trajectories, scene = built("street")
    caster = ray_caster(scene.mesh.triangles)
    for trajectory in trajectories:
        start, attitude = eyes(trajectory, 0.2)
        for side in (-1.0, 1.0):
            across = attitude.apply([side, 0.0, 0.0])
            low = start - 1.4 * UP  # 0.8 m above the road: the height of a car's body
            rays = np.hstack([low, across]).astype(np.float32)
            assert caster.cast_rays(rays)["t_hit"].numpy().min() > 0.9  # m


@pytest.mark.parametrize("name", SCENARIOS)
def test_there_are_as_many_targets_as_asked_and_all_along_the_way(name):
    "Control and check points stand in order along the way, no stretch without them"
    line, length, _, scene = built(name)
    asked = SCENARIOS[name].targets
    count = asked.control + asked.check
    assert len(scene.targets) == count
    assert scene.targets.kind[:2] == ("circle", "square")
    assert scene.targets.hidden.sum() == round(asked.hidden * count)
    lengths = np.arange(0.0, length, 0.5)
    distance = np.linalg.norm(
        scene.targets.centre[:, None, :2] - line.curve(lengths)[None, :, :2], axis=2
    )
    s = np.sort(lengths[distance.argmin(axis=1)])
    assert np.diff(np.concatenate([[0.0], s, [length]])).max() < 2.6 * length / count + 6.0  # m


@pytest.mark.parametrize("name", SCENARIOS)
def test_targets_are_flat_about_their_centres_and_of_the_stated_size(name):
    "The bright part is centred on the centre, lies in the plane of the normal and has the size"
    _, _, _, scene = built(name)
    size = SCENARIOS[name].targets.size
    for i, (centre, normal) in enumerate(
        zip(scene.targets.centre, scene.targets.normal, strict=True)
    ):
        bright = (scene.target == i) & (scene.mesh.reflectance == SETTINGS.white)
        corners = scene.mesh.triangles[bright].reshape(-1, 3) - centre
        assert abs(np.linalg.norm(normal) - 1.0) < 1e-12
        assert np.abs(corners @ normal).max() < 1e-9  # m
        area = np.linalg.norm(
            np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3]), axis=1
        )
        full = np.pi / 4 if scene.targets.kind[i] == "circle" else 1.0
        assert area.sum() / 2 == pytest.approx(full * size**2, rel=3e-3)
        middle = (area[:, None] * (corners[::3] + corners[1::3] + corners[2::3])).sum(axis=0)
        assert np.linalg.norm(middle) < 1e-9


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", SCENARIOS)
def test_nothing_of_the_scene_cuts_a_target(name, seed):
    "1 mm before its plane, every target is free from its centre to the edge of its board"
    _, _, _, scene = built(name, seed)
    others = without_targets(scene)
    angle = np.linspace(0.0, 2 * np.pi, 180, endpoint=False)[:, None]
    for i, (centre, normal) in enumerate(
        zip(scene.targets.centre, scene.targets.normal, strict=True)
    ):
        corners = scene.mesh.triangles[scene.target == i].reshape(-1, 3) - centre
        u, v = in_plane(normal)
        reach = np.linalg.norm(corners, axis=1).max() / np.sqrt(2)
        rim = np.cos(angle) * u + np.sin(angle) * v
        start = np.broadcast_to(centre + 0.001 * normal, rim.shape)
        hit = others.cast_rays(np.hstack([start, rim]).astype(np.float32))["t_hit"].numpy()
        assert hit.min() > reach, (scene.targets.support[i], i)


def without_targets(scene):
    "Ray caster of all but the targets"
    return ray_caster(scene.mesh.triangles[scene.target < 0])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", SCENARIOS)
def test_targets_do_not_overlap_and_stand_above_ground(name, seed):
    "Any two targets are further apart than their boards reach; none is below its ground"
    line, _, _, scene = built(name, seed)
    centre = scene.targets.centre
    size = SCENARIOS[name].targets.size
    apart = np.linalg.norm(centre[:, None] - centre[None], axis=2) + 1e9 * np.eye(len(centre))
    assert apart.min() > 1.5 * np.sqrt(2) * size
    above = centre[:, 2] - line.height(centre)
    assert above.min() > 0.0  # m
    assert above.max() < 8.0


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_target_is_seen_by_every_pass(name, seed):
    "From each passing scanner a ray reaches the front of every target that is not hidden"
    _, _, trajectories, scene = built(name, seed)
    for i in np.flatnonzero(~scene.targets.hidden):
        centre = scene.targets.centre[i]
        normal = scene.targets.normal[i]
        for trajectory in trajectories:
            start = in_scan_plane(trajectory, centre)
            front = (start - centre) @ normal > 0.2 * np.linalg.norm(start - centre, axis=1)
            end = np.broadcast_to(centre + 0.001 * normal, start.shape)
            seen = free(scene, start, end) & front
            assert seen.any(), (scene.targets.support[i], i)


@pytest.mark.parametrize("name", ["street", "river"])
def test_hidden_targets_lose_a_fifth_to_two_fifths(name):
    "The post in front hides 20-40 % of a hidden target from the passing scanner, 30 % on average"
    shares = []
    for seed in (1, 2, 3):
        _, _, trajectories, scene = built(name, seed)
        for i in np.flatnonzero(scene.targets.hidden):
            centre = scene.targets.centre[i]
            normal = scene.targets.normal[i]
            mine = scene.mesh.triangles[
                (scene.target == i) & (scene.mesh.reflectance == SETTINGS.white)
            ]
            grid = np.stack(np.meshgrid(*[np.linspace(-0.3, 0.3, 41)] * 2), -1).reshape(-1, 2)
            if scene.targets.kind[i] == "circle":
                grid = grid[np.linalg.norm(grid, axis=1) < 0.3]
            assert len(mine)
            start = in_scan_plane(trajectories[0], centre)
            start = start[len(start) // 2]
            end = centre + 0.001 * normal + grid @ np.array(in_plane(normal))
            shares.append(1.0 - free(scene, np.broadcast_to(start, end.shape), end).mean())
    assert len(shares) >= 15
    assert min(shares) > 0.15
    assert max(shares) < 0.45
    assert 0.24 < np.mean(shares) < 0.36


def test_targets_alternate_sides_and_stand_on_all_supports():
    "Neighbours in a street stand on opposite sides; walls, posts and the road all carry some"
    line, _, _, scene = built("street")
    s = np.arange(0.0, 450.0, 0.5)
    position, _, right = line.frame(s)
    nearest = np.linalg.norm(scene.targets.centre[:, None] - position, axis=2).argmin(axis=1)
    offset = scene.targets.centre - position[nearest]
    side = np.sign(np.einsum("ij,ij->i", offset, right[nearest]))
    assert (side[1:] != side[:-1]).mean() > 0.8
    assert set(scene.targets.support) == {"post", "wall", "road"}


@pytest.mark.parametrize("what", ["trees", "cars", "poles"])
def test_densities_are_as_asked(what):
    "Doubling the density of trees, cars or lamps doubles their number, zero leaves none"
    none = SceneScenario(trees=0.0, cars=0.0, poles=0.0)
    size = {}
    for density in (0.0, 3.0, 6.0):
        scenario = street(
            scene=none.model_copy(update={what: density}),
            targets=TargetScenario(control=1, check=0, hidden=0.0),
        )
        line, length, _ = drive(scenario, np.random.default_rng(1))
        scene = build_scene(scenario, line, length, np.random.default_rng(2))
        size[density] = len(scene.mesh)
    each = {"trees": (12 + 300, 12 + 1500), "cars": (32, 32), "poles": (24, 24)}[what]
    for density in (3.0, 6.0):
        asked = density * (length + 80.0) / 100.0
        number = (size[density] - size[0.0]) / np.mean(each)
        tolerance = 0.12 if what != "trees" else 0.5
        assert number == pytest.approx(asked, rel=tolerance)


def test_leaves_scatter_returns_in_depth():
    "Rays through a crown return from all over its depth, and some pass"
    crown = leaves(np.zeros(3), np.array([1.7, 1.1, 1.6]), np.array([0.0, 1.0, 0.0]), 700, rng(1))
    aim = np.stack(np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 60)), -1).reshape(-1, 2)
    start = np.column_stack([np.full(len(aim), -5.0), aim])
    rays = np.hstack([start, np.tile([1.0, 0.0, 0.0], (len(aim), 1))]).astype(np.float32)
    depth = ray_caster(crown.triangles).cast_rays(rays)["t_hit"].numpy()
    hit = np.isfinite(depth)
    assert 0.3 < hit.mean() < 0.95
    assert depth[hit].std() > 0.3  # m


def rng(seed):
    return np.random.default_rng(seed)


def test_gaps_show_cross_walls():
    "With gaps, rays at a slant hit walls that stand across the street; without, none are seen"
    found = {}
    for gaps in (0.0, 1.0):
        scenario = street(scene=SceneScenario(gaps=gaps, trees=0, cars=0, poles=0))
        line, length, _ = drive(scenario, rng(1))
        site = Street(scenario, line, length, rng(2))
        found[gaps] = len(site.houses)
    assert found[1.0] < 0.85 * found[0.0]


def test_low_walls_have_no_windows():
    "house_height below 5 m gives plain walls: noise barriers along a motorway"
    scenario = street(scene=SceneScenario(house_height=(3.0, 3.5), trees=0, cars=0, poles=0))
    line, length, _ = drive(scenario, rng(1))
    scene = build_scene(scenario, line, length, rng(2))
    assert scene.mesh.triangles[..., 2].max() < line.curve(np.arange(length))[:, 2].max() + 6.0


def test_a_river_returns_nothing_from_the_water():
    "Below the boat there is nothing; the bank lies 10 m or more to its right, up to 3 m high"
    line, length, _, scene = built("river")
    s = np.arange(0.0, length, 5.0)
    assert not np.isfinite(height_below(scene, line.place(s, 0.0, 2.0))).any()
    assert not np.isfinite(height_below(scene, line.place(s, -20.0, 2.0))).any()
    promenade = height_below(scene, line.place(s, 22.5, 4.0))
    assert np.abs(np.median(promenade) - Bank.top) < 0.15  # m
    distance = line.distance(scene.targets.centre)
    assert distance.min() > 10.0
    assert distance.max() < 40.0


def test_the_sky_is_hidden_by_high_houses_and_open_between():
    "The elevation of the walls is what trigonometry says of their height and distance"
    wall = np.array([[[6.0, -500, 0], [6.0, 500, 0], [6.0, 500, 8.0]]])
    wall = np.concatenate([wall, [[[6.0, -500, 0], [6.0, 500, 8.0], [6.0, -500, 8.0]]]])
    scene = built("street")[3]
    alone = type(scene)(Mesh(wall, np.full(2, 0.3)), np.full(2, -1), scene.targets, None, 2)
    times = 357_700.0 + np.arange(0.0, 10.0, 0.01)
    place = ORIGIN + np.column_stack([0 * times, times - times[0], 2.0 + 0 * times])
    north = Trajectory(times, place, attitude_from_angles(0 * times, 0.0, 0.0))
    sky = sky_elevation(alone, north, ORIGIN)
    expected = np.arctan(6.0 / 6.0 * np.cos(np.radians(20.0)))  # median over the fan
    assert sky.shape == (1000, 2)
    assert np.abs(sky[:, 0]).max() == 0.0
    assert np.abs(sky[:, 1] - expected).max() < np.radians(1.5)
    in_street = sky_elevation(scene, built("street")[2][0], ORIGIN)
    assert np.degrees(np.median(in_street)) > 30.0


def test_the_same_seed_builds_the_same_scene():
    "Every triangle follows from the seed"
    scenario = SCENARIOS["street"]
    line, length, _ = drive(scenario, rng(1))
    first, again = (build_scene(scenario, line, length, rng(2)) for _ in range(2))
    np.testing.assert_array_equal(first.mesh.triangles, again.mesh.triangles)
    np.testing.assert_array_equal(first.targets.centre, again.targets.centre)


def test_targets_that_do_not_fit_are_refused():
    "Too many or too large targets: one sentence with the numbers and the way out"
    line, length, _ = drive(Scenario(drive=DriveScenario(duration=8.0)), rng(1))
    with pytest.raises(ValueError, match=r"400 targets of 0.6 m do not fit along .* room for \d+"):
        build_scene(Scenario(targets=TargetScenario(control=400, check=0)), line, length, rng(2))
    with pytest.raises(ValueError, match=r"Targets of 3.0 m are too large"):
        build_scene(Scenario(targets=TargetScenario(size=3.0)), line, length, rng(2))


def test_a_street_that_crosses_itself_is_free_to_drive():
    "Along a figure of eight no house, car or pole stands in the other part of the way"
    angle = np.linspace(0.0, 2 * np.pi, 800)
    path = np.column_stack([120 * np.sin(angle), 90 * np.sin(2 * angle), 0 * angle])
    line, length = line_along(path)
    scene = build_scene(Scenario(), line, length, rng(2))
    s = np.arange(0.0, length, 0.5)
    start = line.place(s[:-1], 0.0, 1.2)
    end = line.place(s[1:], 0.0, 1.2)
    assert free(scene, start, end + 0.05 * (end - start)).all()


# The user's own mesh


def ground_mesh(length, width=30.0):
    "Vertices (n, 3) in map coordinates and triangles (m, 3) of a gentle valley along the drive"
    east = np.linspace(-length, length, 81)
    x, y = np.meshgrid(east, east)
    z = 1.5 * np.sin(x / 60.0) + 0.02 * y
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()]) + ORIGIN + 0.000123
    i = np.arange(80 * 81).reshape(80, 81)[:, :80].ravel()
    a = np.column_stack([i, i + 1, i + 82])
    b = np.column_stack([i, i + 82, i + 81])
    return vertices, np.vstack([a, b])


def write_ply(path, vertices, triangles):
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.zeros(len(triangles), dtype=[("n", "u1"), ("i", "<i4", 3)])
    rows["n"] = 3
    rows["i"] = triangles
    path.write_bytes(header.encode() + vertices.astype("<f8").tobytes() + rows.tobytes())
    return path


def write_obj(path, vertices, triangles):
    rows = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    rows += [f"f {a}/1 {b}/2 {c}/3" for a, b, c in triangles + 1]
    path.write_text("# a mesh\n" + "\n".join(rows) + "\n")
    return path


def on_mesh(path, **parts):
    drive = DriveScenario(duration=20.0, speed=8.0)
    return Scenario(scene=SceneScenario(kind="mesh", file=path), **{"drive": drive, **parts})


@pytest.mark.parametrize("write", [write_ply, write_obj])
def test_a_mesh_at_map_coordinates_keeps_its_micrometres(write, tmp_path):
    "PLY and OBJ vertices at UTM coordinates come back to 1e-6 m about the origin"
    vertices, triangles = ground_mesh(200.0)
    suffix = write.__name__[-3:]
    scenario = on_mesh(write(tmp_path / f"mesh.{suffix}", vertices, triangles))
    mesh = read_mesh(scenario.scene, scenario.origin)
    np.testing.assert_allclose(mesh.triangles + ORIGIN, vertices[triangles], rtol=0, atol=1e-6)


def test_drive_and_targets_stand_on_the_mesh(tmp_path):
    "The vehicle keeps 1.8 m above the mesh's ground; targets stand on posts on it, all seen"
    path = write_ply(tmp_path / "mesh.ply", *ground_mesh(250.0))
    scenario = on_mesh(path, targets=TargetScenario(control=5, check=3))
    line, length, (trajectory,) = drive(scenario, rng(1))
    scene = build_scene(scenario, line, length, rng(2))
    mesh = type(scene)(read_mesh(scenario.scene, scenario.origin), None, None, None, 0)
    local = trajectory.position - ORIGIN
    height = local[:, 2] - height_below(mesh, local)
    assert np.abs(height - 1.8).max() < 0.1  # m, vibration and the smoothing of the ground
    above = scene.targets.centre[:, 2] - height_below(mesh, scene.targets.centre)
    assert set(scene.targets.support) == {"post"}
    assert above.min() > 0.7
    assert above.max() < 2.6
    for centre, normal in zip(
        scene.targets.centre[~scene.targets.hidden],
        scene.targets.normal[~scene.targets.hidden],
        strict=True,
    ):
        start = in_scan_plane(trajectory, centre)
        assert free(scene, start, np.broadcast_to(centre + 0.001 * normal, start.shape)).any()


def test_a_roof_over_the_drive_is_not_its_ground(tmp_path):
    "A bridge across the mesh leaves the drive on the ground that it started on"
    vertices, triangles = ground_mesh(250.0)
    deck = vertices + 7.0 * UP
    path = write_ply(
        tmp_path / "mesh.ply",
        np.vstack([vertices, deck]),
        np.vstack([triangles, triangles[5000:6000] + len(vertices)]),
    )
    line, length, _ = drive(on_mesh(path), rng(1))
    alone = write_ply(tmp_path / "alone.ply", vertices, triangles)
    line_alone, *_ = drive(on_mesh(alone), rng(1))
    s = np.arange(0.0, length)
    np.testing.assert_allclose(line.curve(s), line_alone.curve(s), atol=1e-6)


def test_bad_meshes_are_refused(tmp_path):
    "NaN, no triangles, another format, a small mesh, one far away: each in one sentence"
    vertices, triangles = ground_mesh(250.0)

    def refused(scenario, match):
        with pytest.raises(ValueError, match=match) as caught:
            drive(scenario, rng(1))
        assert "\n" not in str(caught.value)

    broken = vertices.copy()
    broken[7, 2] = np.nan
    refused(on_mesh(write_ply(tmp_path / "nan.ply", broken, triangles)), "1 of 6561 vertices")
    refused(on_mesh(write_ply(tmp_path / "no.ply", vertices, triangles[:0])), "no triangles")
    (tmp_path / "text.ply").write_text("hello")
    refused(on_mesh(tmp_path / "text.ply"), "no triangles")
    (tmp_path / "bad.obj").write_text("v 1 2 3\nf 1 2 x\n")
    refused(on_mesh(tmp_path / "bad.obj"), "Line 2 of .*bad.obj is not a vertex or face")
    (tmp_path / "short.obj").write_text("v 1 2 3\nf 1 2 3\n")
    refused(on_mesh(tmp_path / "short.obj"), "vertices that do not exist")
    refused(on_mesh(tmp_path / "mesh.stl"), "unknown suffix")
    small = write_ply(tmp_path / "small.ply", *ground_mesh(40.0))
    refused(on_mesh(small), r"The drive leaves the mesh: \d+ of \d+ m have no ground")
    far = write_ply(tmp_path / "far.ply", vertices + 5000.0 * EAST, triangles)
    refused(on_mesh(far), r"The drive leaves the mesh: (\d+) of \1 m .*Set origin")
    with pytest.raises(FileNotFoundError, match="does not exist"):
        drive(on_mesh(tmp_path / "absent.ply"), rng(1))


@pytest.mark.long
def test_targets_without_room_beside_the_drive_are_refused(tmp_path):
    "In a trench with walls at 2 m there is no place for a post, and the error says where"
    vertices, triangles = ground_mesh(250.0)
    scenario = on_mesh(write_ply(tmp_path / "mesh.ply", vertices, triangles))
    line, length, _ = drive(scenario, rng(1))
    s = np.arange(-20.0, length + 20.0, 2.0)
    walls = []
    for side in (-2.0, 2.0):
        foot = line.place(s, side, -1.0) + ORIGIN
        head = foot + 30.0 * UP
        walls += [foot[:-1], foot[1:], head[1:], foot[:-1], head[1:], head[:-1]]
    corners = np.stack(walls, axis=1).reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3) + len(vertices)
    path = write_ply(
        tmp_path / "trench.ply", np.vstack([vertices, corners]), np.vstack([triangles, faces])
    )
    with pytest.raises(ValueError, match=r"(\d+) of \1 targets find no free place along the drive"):
        build_scene(on_mesh(path), line, length, rng(2))


def test_targets_without_room_are_left_out_and_counted():
    "On a river where a boat turns round, some targets have no free sight; the others are placed"
    drive_ = DriveScenario(u_turn=True, speed=4.0)
    scenario = Scenario(scene={"kind": "river"}, drive=drive_)
    wanted = scenario.targets.control + scenario.targets.check
    drive_rng, scene_rng = rng(0).spawn(2)
    line, length, _ = drive(scenario, drive_rng)
    with pytest.warns(UserWarning, match=rf"\d of {wanted} targets find no free place.*without"):
        targets = build_scene(scenario, line, length, scene_rng).targets
    assert wanted / 2 < len(targets) < wanted
    is_check = spread_checks(len(targets), scenario.targets)
    assert abs(is_check.mean() - scenario.targets.check / wanted) < 0.5 / len(targets)


def test_the_line_along_positions_keeps_to_them():
    "A polyline with a stop becomes a smooth line of unit speed that stays within decimetres of it"
    t = np.concatenate(
        [np.linspace(0.0, 100.0, 300), np.full(50, 100.0), np.linspace(100, 200, 300)]
    )
    path = np.column_stack([t, 40.0 * np.sin(t / 30.0), 0.01 * t])
    line, length = line_along(path)
    assert isinstance(line, CentreLine)
    s = np.arange(0.0, length, 0.25)
    speed = np.linalg.norm(line.curve(s, 1)[:, :2], axis=1)
    assert np.abs(speed - 1.0).max() < 0.01
    assert line.distance(path).max() < 0.6  # m


def test_paint_lies_on_the_carriageway():
    "A dash of 3 m every 9 m on the crown, 1.5 mm thick, and lines along the kerbs, 3 mm; bright"
    scenario = street(scene=SceneScenario(markings=True, cars=0.0))
    line, length, _ = drive(scenario, np.random.default_rng(1))
    scenes = [
        build_scene(each, line, length, np.random.default_rng(101))
        for each in (street(scene=SceneScenario(cars=0.0)), scenario)
    ]
    part = section(scenario.drive, length)
    s = np.arange(20.25, 60.0, 0.5)
    middle = np.zeros_like(s)
    edge = part.half_width(s) - part.line_from_kerb
    painted = {"middle": middle, "right": edge, "left": -edge, "lane": edge / 2}
    for name, lateral in painted.items():
        above = line.place(s, lateral, part.height(s, lateral) + 1.0)
        rays = np.concatenate([above, np.broadcast_to(-UP, above.shape)], axis=1).astype(np.float32)
        bare, with_paint = (scene.mesh.caster.cast_rays(rays) for scene in scenes)
        lifted = bare["t_hit"].numpy() - with_paint["t_hit"].numpy()
        on = {"middle": s % 9.0 < 3.0, "lane": np.zeros(len(s), bool)}.get(name, s > 0)
        thick = part.paint / 2 if name == "middle" else part.paint
        assert np.allclose(lifted, np.where(on, thick, 0.0), atol=5e-4)  # m, single precision
        hit = with_paint["primitive_ids"].numpy()
        assert (scenes[1].mesh.reflectance[hit[on]] == 0.6).all()
