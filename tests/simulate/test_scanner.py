"""Scanners alone, in rooms of a few triangles, at UTM coordinates and GPS times."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles, georeference
from mlscorr.simulate import SETTINGS
from mlscorr.simulate.scan import (
    MeasuredPulses,
    Platform,
    Surfaces,
    noise_streams,
    pulses_of_a_pass,
    shoot,
)
from mlscorr.simulate.scan.echoes import POWER, SUB_RAYS
from mlscorr.simulate.scenario import ScannerScenario
from mlscorr.simulate.scene import Mesh
from mlscorr.simulate.scene.shapes import box, quads
from mlscorr.survey import Mounting, Trajectory

ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m
START = 357_700.0  # s of week
MOUNTING = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90.0, 0.0, 35.0], degrees=True)
)
LEVEL = Mounting(np.zeros(3), Rotation.identity())  # zero beam to the right, plane horizontal
QUIET = {"range_noise": 0.0, "angle_noise": 0.0}
LINE = ScannerScenario(lines_per_second=40.0, points_per_line=500)
SPINNING = ScannerScenario(
    kind="spinning",
    boresight=(0.0, 0.0, 0.0),
    lines_per_second=10.0,
    points_per_line=360,
    rings=tuple(np.linspace(-15.0, 15.0, 16)),
)
ROOM = box(np.array([-30.0, -20.0, -2.0]), *np.diag([60.0, 60.0, 9.0]), 0.4)


def with_(scanner, **changes):
    return scanner.model_copy(update=changes)


def drive(seconds=2.0, rate=100.0, swing=1.0, speed=5.0):
    "A drive through the room's middle that rolls, pitches and turns"
    elapsed = np.arange(round((seconds + 2 * SETTINGS.trajectory_margin) * rate) + 1) / rate
    wave = swing * np.sin(elapsed[:, None] / [0.7, 1.1, 1.3])
    position = ORIGIN + np.column_stack([wave[:, 0], speed * elapsed, 0.1 * wave[:, 1]])
    return Trajectory(START + elapsed, position, attitude_from_angles(*(0.2 * wave).T))


def still(seconds=1.0):
    "A vehicle that stands at the origin, level, looking north"
    return drive(seconds, swing=0.0, speed=0.0)


def scan(mesh, trajectory, mounting, scanner, seed=1, **options):
    streams = noise_streams(np.random.default_rng(seed))
    setting = Surfaces(mesh), ORIGIN, trajectory, mounting, scanner, streams
    return MeasuredPulses.concatenate([shots.pulses() for shots in shoot(*setting, **options)])


def same(one, other, but=()):
    "Check that two Pulses are bit-equal except in some fields, which differ"
    for field in fields(MeasuredPulses):
        a = getattr(one, field.name)
        b = getattr(other, field.name)
        assert np.array_equal(a, b) == (field.name not in but), field.name


@pytest.mark.parametrize("scanner", [LINE, SPINNING], ids=["line", "spinning"])
@pytest.mark.parametrize("rate", [100.0, 2.0])
@pytest.mark.parametrize("divergence", [0.0, 0.5])
def test_pulses_without_noise_return_the_points_they_hit(scanner, rate, divergence):
    "Eq. 1 with the true trajectory gives the true points to 1e-6 m, at any rate of poses"
    trajectory = drive(4.0, rate)
    quiet = with_(scanner, beam_divergence=divergence, **QUIET)
    pulses = scan(ROOM, trajectory, MOUNTING, quiet)
    xyz = georeference(trajectory, MOUNTING, pulses.scanner_xyz, pulses.gps_time)
    assert np.abs(xyz - pulses.point).max() < 1e-6  # m
    assert len(pulses) == pulses_of_a_pass(trajectory, quiet)  # a room has no way out


def test_points_lie_on_the_triangles_they_hit():
    "float32 ray casting costs nothing on the plane, and 0.1 mm at most along a triangle's edge"
    pulses = scan(ROOM, drive(), MOUNTING, with_(LINE, **QUIET))
    points = pulses.point - ORIGIN
    corners = ROOM.triangles[pulses.triangle]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = np.einsum("ij,ij->i", points - corners[:, 0], normal)
    assert np.abs(height).max() < 1e-8  # m
    for i in range(3):
        edge = corners[:, (i + 1) % 3] - corners[:, i]
        inward = np.cross(normal, edge / np.linalg.norm(edge, axis=1, keepdims=True))
        assert np.einsum("ij,ij->i", points - corners[:, i], inward).min() > -1e-4  # m


def test_the_fast_georeferencing_is_the_plain_one():
    "Compiled Eq. 1 equals scipy's Slerp to the last digits, in any order of times"
    rng = np.random.default_rng(1)
    trajectory = drive(20.0, rate=5.0)
    n = 60_000
    gps_time = rng.uniform(*trajectory.gps_time[[0, -1]], n)
    angle, elevation, away = rng.uniform([-9, -1, 0], [9, 1, 100], (n, 3)).T
    beam = [np.cos(elevation) * np.cos(angle), np.cos(elevation) * np.sin(angle), np.sin(elevation)]
    plain = georeference(trajectory, MOUNTING, away[:, None] * np.column_stack(beam), gps_time)
    fast = Platform.of(trajectory, MOUNTING, ORIGIN).place(gps_time, angle, elevation, away, ORIGIN)
    assert np.abs(fast - plain).max() < 2e-9  # m: four steps of float64 at UTM size


@pytest.mark.parametrize("scanner", [LINE, SPINNING], ids=["line", "spinning"])
def test_blocks_of_any_size_give_the_same_pulses(scanner):
    "Memory is one block of pulses, and its size leaves no trace, whatever is random"
    scanner = with_(scanner, beam_divergence=1.0, loss=0.3)
    mesh = Mesh.concatenate([ROOM, _fence()])
    whole = scan(mesh, drive(), MOUNTING, scanner)
    assert whole.number_of_returns.max() > 1
    for block in (1_000, 33_333):
        same(scan(mesh, drive(), MOUNTING, scanner, block=block), whole)


def test_noise_is_as_stated():
    "Ranges scatter by the stated sigma about the planes they hit, angles about the encoder's"
    pulses = scan(ROOM, still(5.0), MOUNTING, LINE)
    quiet = scan(ROOM, still(5.0), MOUNTING, with_(LINE, **QUIET))
    n = len(pulses)
    for name, sigma in (("range", 0.004), ("angle", np.radians(0.002))):  # m, rad
        noise = getattr(pulses, name) - getattr(quiet, name)
        assert noise.std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * n))  # 4 sigma
        assert abs(noise.mean()) < 4 * sigma / np.sqrt(n)
        assert np.abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4 / np.sqrt(n)


def test_one_noise_switched_off_leaves_all_others():
    "Every source of noise has its own random stream, and so have later echoes"
    mesh = Mesh.concatenate([ROOM, _fence()])
    setting = mesh, drive(), MOUNTING
    scanner = with_(LINE, beam_divergence=1.0)
    full = scan(*setting, scanner)
    same(scan(*setting, with_(scanner, range_noise=0.0)), full, but=("range",))
    same(scan(*setting, with_(scanner, angle_noise=0.0)), full, but=("angle",))
    lossy = scan(*setting, with_(scanner, loss=0.2))
    # what is left, is what it was: a pulse's time and its true point tell which
    key = {(t, *p): i for i, (t, p) in enumerate(zip(full.gps_time, full.point, strict=True))}
    rows = [key[(t, *p)] for t, p in zip(lossy.gps_time, lossy.point, strict=True)]
    assert len(rows) < len(full)
    for name in ("range", "angle", "intensity"):
        np.testing.assert_array_equal(getattr(lossy, name), getattr(full, name)[rows])
    thin = scan(*setting, with_(LINE, beam_divergence=0.0))
    np.testing.assert_array_equal(thin.angle, full.angle[full.return_number == 1])


@pytest.mark.parametrize(("low", "high"), [(-50.0, 70.0), (100.0, 260.0), (170.0, 190.0)])
def test_only_the_field_of_view_is_measured(low, high):
    "A mask lets pass what lies in the field of view, at the times of a full turn"
    full = scan(ROOM, still(), MOUNTING, with_(LINE, **QUIET))
    part = scan(ROOM, still(), MOUNTING, with_(LINE, field_of_view=(low, high), **QUIET))
    inside = np.mod(full.scan_angle - low, 360.0) <= high - low + 1e-9
    np.testing.assert_allclose(part.gps_time, full.gps_time[inside], atol=1e-9)
    np.testing.assert_allclose(part.range, full.range[inside], atol=1e-9)


def test_a_spinning_scanner_has_its_rings_at_their_elevations():
    "Each step fires all rings in turn; back in the scanner's frame, elevations are as stated"
    pulses = scan(ROOM, drive(), MOUNTING, with_(SPINNING, **QUIET))
    x, y, z = georeference_back(drive(), pulses)
    elevation = np.degrees(np.arctan2(z, np.hypot(x, y)))
    step = np.diff(pulses.gps_time)
    np.testing.assert_allclose(step, 1 / (10.0 * 360 * 16), atol=1e-9)  # s
    np.testing.assert_allclose(elevation.reshape(-1, 16), [SPINNING.rings] * (2 * 3600), atol=1e-6)
    turned = np.mod(np.diff(np.unwrap(np.arctan2(y, x))), 2 * np.pi)
    np.testing.assert_allclose(turned, 2 * np.pi / (360 * 16), atol=1e-7)  # it turns all the time


def georeference_back(trajectory, pulses):
    from mlscorr.frames import to_scanner

    return to_scanner(trajectory, MOUNTING, pulses.point, pulses.gps_time).T


def test_pulses_are_timed_one_by_one_while_the_vehicle_moves():
    "At 20 m/s, points on a wall beside the way advance by 20 m/s times the pulse's own time"
    wall = quads(np.array([5.0, -5.0, -3.0]), [0.0, 60.0, 0.0], [0.0, 0.0, 9.0], 0.5)
    across = Mounting(np.zeros(3), Rotation.from_euler("x", 90, degrees=True))  # plane across
    pulses = scan(wall, drive(swing=0.0, speed=20.0), across, with_(LINE, **QUIET))
    along = pulses.point[:, 1] - ORIGIN[1] - 20.0 * (pulses.gps_time - START)
    assert np.abs(along).max() < 1e-6  # m
    assert np.unique(pulses.gps_time).size == len(pulses)


def test_intensity_follows_reflectance_range_and_incidence():
    "White paint near and square on is full scale; it falls by the laws that the module states"
    wall = np.array([-50.0, 8.0, -50.0]), [100.0, 0.0, 0.0], [0.0, 0.0, 100.0]
    pulses = {r: scan(quads(*wall, r), still(5.0), LEVEL, LINE) for r in (0.2, 0.8)}
    for reflectance, p in pulses.items():
        model = 65535 * reflectance * p.incidence / (1 + (p.range / SETTINGS.fading) ** 2)
        ratio = (p.intensity + 0.5)[p.incidence > 0.3] / model[p.incidence > 0.3]
        assert ratio.mean() == pytest.approx(1.0, abs=0.003)
        assert ratio.std() == pytest.approx(SETTINGS.speckle, rel=0.03)
    ray = pulses[0.8].point - ORIGIN
    square_on = ray[:, 1] / np.linalg.norm(ray, axis=1)
    np.testing.assert_allclose(pulses[0.8].incidence, square_on, atol=1e-9)


def test_no_loss_loses_nothing_and_loss_takes_the_weak():
    "At a hundredth of full strength the stated share is lost, of stronger returns in proportion"
    wall = quads(np.array([-90.0, 5.0, -50.0]), [180.0, 0.0, 0.0], [0.0, 0.0, 100.0], 0.3)
    scanner = with_(LINE, field_of_view=(8.0, 172.0), max_range=50.0, **QUIET)
    full = scan(wall, still(10.0), LEVEL, scanner)
    lossy = scan(wall, still(10.0), LEVEL, with_(scanner, loss=0.5))
    strength = 0.3 * full.incidence / (1 + (full.range / SETTINGS.fading) ** 2)
    left = np.isin(full.gps_time, lossy.gps_time)
    assert len(lossy) == left.sum()
    for low, high in ((0.01, 0.02), (0.02, 0.05), (0.05, 0.3)):
        group = (strength > low) & (strength < high)
        expected = np.mean(0.5 * SETTINGS.weak / strength[group])
        spread = np.sqrt(expected / group.sum())
        assert 1 - left[group].mean() == pytest.approx(expected, abs=4 * spread)


def test_the_sub_rays_make_a_gaussian_beam():
    "Their moments up to the fifth are those of a Gaussian that is 1/e^2 at the stated angle"
    x, y = SUB_RAYS.T  # of half the divergence, which is two sigma
    sigma = 0.5
    assert POWER.sum() == pytest.approx(1.0)
    for i, j, moment in (
        (2, 0, 1),
        (0, 2, 1),
        (4, 0, 3),
        (2, 2, 1),
        (0, 4, 3),
        (1, 0, 0),
        (3, 2, 0),
    ):
        expected = moment * sigma ** (i + j)
        assert POWER @ (x**i * y**j) == pytest.approx(expected, abs=1e-12)
    assert len(SUB_RAYS[1:]) == 6


def test_a_divergence_of_nothing_changes_no_bit():
    "Zero is one ray; a hundredth of a milliradian is all but one"
    plain = scan(ROOM, drive(), MOUNTING, LINE)
    same(scan(ROOM, drive(), MOUNTING, LINE, divergence=0.0), plain)
    almost = scan(ROOM, drive(), MOUNTING, LINE, divergence=1e-8)
    assert np.abs(almost.range - plain.range).max() < 1e-6  # m
    assert np.abs(almost.intensity.astype(int) - plain.intensity).max() <= 1


def test_a_wide_beam_sees_a_plane_as_a_thin_one_does():
    "On planes there is one echo, and its range differs by less than noise even at 70 deg"
    wall = quads(np.array([-20.0, 5.0, -50.0]), [40.0, 0.0, 0.0], [0.0, 0.0, 100.0], 0.3)
    scanner = with_(LINE, field_of_view=(20.0, 160.0), **QUIET)
    thin = scan(wall, still(), LEVEL, scanner)
    wide = scan(wall, still(), LEVEL, scanner, divergence=1e-3)
    inner = np.abs(thin.point[:, 0] - ORIGIN[0]) < 19.5
    assert wide.number_of_returns.max() == 1
    assert np.abs(wide.range - thin.range)[inner].max() < 1e-4  # m


def _step(depth):
    "A wall that steps back by a depth (m) at x = 0, seen at 8 m, and its range"
    near = quads(np.array([-20.0, 8.0, -5.0]), [20.0, 0.0, 0.0], [0.0, 0.0, 10.0], 0.5)
    far = quads(np.array([-20.0, 8.0 + depth, -5.0]), [40.0, 0.0, 0.0], [0.0, 0.0, 10.0], 0.5)
    return Mesh.concatenate([near, far])


def test_mixed_points_lie_at_edges_between_the_surfaces():
    "A step of less than the pulse's length gives points between, within the footprint of the edge"
    fine = with_(LINE, points_per_line=20_000, field_of_view=(60.0, 120.0), **QUIET)
    divergence = 2e-3
    pulses = scan(_step(0.4), still(0.1), LEVEL, fine, divergence=divergence)
    x, y = (pulses.point - ORIGIN)[:, :2].T
    between = (y > 8.001) & (y < 8.399)
    assert 10 < between.sum() < 0.02 * len(pulses)
    assert np.abs(x[between]).max() < divergence / 2 * 8.5
    assert pulses.number_of_returns.max() == 1
    assert (y > 8.0 - 1e-5).all()  # m; the rim of a footprint lies a few um further
    assert (y < 8.4 + 1e-5).all()
    thin = scan(_step(0.4), still(0.1), LEVEL, fine)
    y = thin.point[:, 1] - ORIGIN[1]
    assert not ((y > 8.001) & (y < 8.399)).any()


def test_surfaces_further_apart_than_the_pulse_give_two_returns():
    "At a step of 2 m the beam's halves come back one after the other, each on its surface"
    fine = with_(LINE, points_per_line=20_000, field_of_view=(60.0, 120.0), **QUIET)
    pulses = scan(_step(2.0), still(0.1), LEVEL, fine, divergence=2e-3)
    y = pulses.point[:, 1] - ORIGIN[1]
    assert (np.minimum(np.abs(y - 8.0), np.abs(y - 10.0)) < 1e-3).all()  # m: none between
    twice = pulses.number_of_returns == 2
    assert twice.sum() > 10
    np.testing.assert_allclose(y[twice & (pulses.return_number == 1)], 8.0, atol=1e-3)
    np.testing.assert_allclose(y[twice & (pulses.return_number == 2)], 10.0, atol=1e-3)


def _fence(bars=300, reflectance=0.4):
    "Bars of 8 mm beside the way, before the room's wall"
    foot = np.linspace(-15.0, 35.0, bars)[:, None] * [0.0, 1.0, 0.0] + [12.0, 0.0, -2.0]
    return quads(foot, [0.0, 0.008, 0.0], [0.0, 0.0, 6.0], reflectance)


def test_returns_are_numbered_within_their_pulse():
    "Numbers run from 1 to the count, with range; echoes are a pulse length apart; loss keeps this"
    for loss in (0.0, 0.5):
        scanner = with_(LINE, points_per_line=4000, beam_divergence=3.0, loss=loss, **QUIET)
        pulses = scan(Mesh.concatenate([ROOM, _fence()]), drive(), MOUNTING, scanner)
        first = np.unique(pulses.gps_time, return_index=True)[1]
        assert (np.diff(pulses.gps_time) >= 0).all()
        count = np.diff(np.append(first, len(pulses)))
        assert count.max() >= 2
        np.testing.assert_array_equal(pulses.number_of_returns, np.repeat(count, count))
        expected = np.arange(len(pulses)) - np.repeat(first, count) + 1
        np.testing.assert_array_equal(pulses.return_number, expected)
        later = pulses.return_number > 1
        apart = pulses.range[later] - pulses.range[np.flatnonzero(later) - 1]
        assert apart.min() > SETTINGS.pulse_length - 1e-9
        np.testing.assert_array_equal(pulses.angle[later], pulses.angle[np.flatnonzero(later) - 1])


def test_a_tree_gives_first_and_last_returns():
    "Part of a beam is caught by leaves, the rest goes on to what stands behind them"
    from mlscorr.simulate.scene._things import leaves

    rng = np.random.default_rng(3)
    crown = leaves(np.array([7.0, 9.0, 1.0]), np.full(3, 2.0), np.array([0.0, 1.0, 0.0]), 400, rng)
    scanner = with_(LINE, points_per_line=4000, beam_divergence=1.0, **QUIET)
    pulses = scan(Mesh.concatenate([ROOM, crown]), drive(), MOUNTING, scanner)
    several = pulses.number_of_returns > 1
    assert several.sum() > 100
    in_crown = pulses.triangle >= len(ROOM)
    assert in_crown[several & (pulses.return_number == 1)].mean() > 0.95
    last = several & (pulses.return_number == pulses.number_of_returns)
    assert (~in_crown)[last].mean() > 0.5


def test_what_is_too_far_or_grazing_does_not_return():
    "Nothing is measured beyond the range, nor from surfaces seen edge on"
    wall = quads(np.array([-90.0, 5.0, -50.0]), [180.0, 0.0, 0.0], [0.0, 0.0, 100.0], 0.3)
    pulses = scan(wall, still(), LEVEL, with_(LINE, max_range=20.0, **QUIET))
    assert pulses.range.max() < 20.0
    assert pulses.range.max() > 19.0
    edge_on = quads(np.array([-5.0, 1.0, 0.0]), [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], 0.3)
    assert len(scan(edge_on, still(), LEVEL, with_(LINE, **QUIET))) == 0
