import numpy as np
import pytest

from mlscorr.targets._outline import Size, fit_outline
from mlscorr.targets.shapes import FORMS, WHITE, distance_inside

ORIGIN = np.array([523_000.0, 3_378_000.0, 42.0])  # m, UTM
START = 413_200.0  # s of the GPS week
SIZE = 0.6  # m
BLUR = 0.001  # m
KNOWN = Size(SIZE, 0.001, 0.595, 0.605)
UNKNOWN = Size(0.65, np.inf, 0.4, 0.8)


def beams(kind, seed, half=False, inner=0.0):
    "Scan lines 3 cm apart, their states, and the truth; four times as dense on one side"
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-0.05, 0.05, 2)
    turn = rng.uniform(0, np.pi)
    lines = np.arange(-0.6, 0.6, 0.03) + rng.uniform(0, 0.03)
    along = np.arange(-0.6, 0.6, 0.008)
    points = np.concatenate(
        [np.column_stack([np.full(len(along), u), along + rng.uniform(0, 0.008)]) for u in lines]
    )
    points = points[(points[:, 1] > 0) | (rng.random(len(points)) < 0.25)]
    points = points[points[:, 0] > (-0.05 if half else -1.0)]
    noisy = points + BLUR * rng.standard_normal(points.shape)
    row = np.array([*centre, turn, SIZE, inner])
    inside = distance_inside(noisy, row, FORMS[kind]) > 0
    state = np.where(inside, 1, 0)
    if kind == "checkerboard":
        state = np.where(inside, np.where(distance_inside(noisy, row, WHITE) > 0, 1, 0), -1)
    elif kind == "hole":
        state = np.where(inside, -1, 0)
    elif kind == "board":
        state = np.where(inside, 0, -1)
    return points, state, row


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("kind", ["circle", "square", "hole", "checkerboard", "board"])
def test_outline_is_unbiased_by_density_and_its_covariance_honest(kind, half):
    "Errors are as large as stated, whatever the density and also where a side is unseen"
    squares = []
    errors = []
    for seed in range(10):
        points, state, truth = beams(kind, seed, half)
        start = truth[:2] + np.array([0.05, -0.02])  # m, as a seed's middle errs
        by_edges = kind in ("hole", "board")
        outline = fit_outline(points, state, kind, KNOWN, BLUR, start, by_edges)
        error = outline.centre - truth[:2]
        errors.append(error)
        squares.append(error @ np.linalg.solve(outline.covariance, error) / 2)
    assert 0.28 < np.mean(squares) < 2.3  # 99.9 % of chi-squared of 20 over 20
    assert np.linalg.norm(errors, axis=1).max() < 0.006  # m


@pytest.mark.parametrize("kind", ["circle", "square"])
def test_an_unknown_size_is_estimated(kind):
    "To 2 mm, and within four of its sigmas"
    for seed in range(6):
        points, state, truth = beams(kind, seed)
        outline = fit_outline(points, state, kind, UNKNOWN, BLUR, truth[:2])
        assert abs(outline.size - SIZE) < min(0.004, 4 * outline.size_sigma)


def test_a_ring_has_a_dark_inner_disc():
    "Centre to 2 mm and the inner disc's share of the diameter to 2 %"
    points, state, truth = beams("circle", 3, inner=0.5)
    outline = fit_outline(points, state, "circle", KNOWN, BLUR, truth[:2], ring=True)
    assert np.linalg.norm(outline.centre - truth[:2]) < 0.002  # m
    assert outline.inner == pytest.approx(0.5, abs=0.02)
