"""A shape is fitted where its beams are, or not at all."""

from dataclasses import replace

import numpy as np
import pytest
from target_rays import SCANNER

from mlscorr.targets import SETTINGS
from mlscorr.targets._seeds import bright_seeds, hole_seeds, plate_seeds
from mlscorr.targets._shape_fit import exact_fit, rough_fit
from mlscorr.targets.shapes import BRIGHT, DARK, MISS
from tests.targets.target_views import KINDS, SIZE, centre_of, echoes_of, views, wall


def seeds_of(echoes, kind):
    rng = np.random.default_rng(1)
    if kind == "hole":
        return list(hole_seeds(echoes, SIZE, rng))
    if kind == "board":
        return list(plate_seeds(echoes, kind, SIZE, rng))
    return list(bright_seeds(echoes, kind, SIZE))


def best_rough(echoes, kind, size=SIZE):
    "The best rough fit of all seeds"
    fits = [rough_fit(echoes, seed, kind, size) for seed in seeds_of(echoes, kind)]
    return max((fit for fit in fits if fit is not None), key=lambda fit: fit.assessment.rank)


@pytest.mark.parametrize("look", ["disc", "ring", "plate", "checkerboard", "hole", "board"])
def test_rough_is_near_and_exact_is_nearer(look):
    "In the median over three views within 3 cm, and then within 8 mm, of the true centre"
    rough = []
    exact = []
    for seen in views(look):
        echoes = echoes_of(seen)
        fit = best_rough(echoes, KINDS[look])
        rough.append(np.linalg.norm(fit.position - centre_of(seen)))
        fit = exact_fit(echoes, fit, SCANNER)
        exact.append(np.linalg.norm(fit.position - centre_of(seen)))
        assert fit.assessment.accepted and fit.kind == KINDS[look]
    assert np.median(rough) < 0.03 and np.median(exact) < 0.008  # m


def test_a_ring_is_told_from_a_disc():
    "Its dark middle gives an inner radius of about a half; a disc has none"
    for look, low, high in (("ring", 0.35, 0.65), ("disc", 0.0, 0.0)):
        for seen in views(look):
            inner = exact_fit(echoes_of(seen), best_rough(echoes_of(seen), "circle"), SCANNER)
            assert low <= inner.outline.inner <= high


@pytest.mark.parametrize("look, kind", [("disc", "square"), ("plate", "checkerboard")])
def test_another_shape_does_not_fit(look, kind):
    "A disc is no square and a plate no checkerboard: none is accepted with a larger overlap"
    for seen in views(look)[:2]:
        echoes = echoes_of(seen)
        own = exact_fit(echoes, best_rough(echoes, KINDS[look]), SCANNER)
        fits = [rough_fit(echoes, seed, kind, SIZE) for seed in seeds_of(echoes, kind)]
        fits = [exact_fit(echoes, fit, SCANNER) for fit in fits if fit is not None]
        others = [fit.outline.overlap for fit in fits if fit is not None]
        assert max(others, default=0.0) < own.outline.overlap


def test_a_seed_off_the_target_is_no_fit():
    "Moved by its size along the wall, where nothing is bright, a seed dies in the rough fit"
    echoes = wall(lambda u, v: np.hypot(u + 0.3, v) < 0.2, np.random.default_rng(1))
    seed = next(iter(bright_seeds(echoes, "circle", 0.4)))
    assert rough_fit(echoes, seed, "circle", 0.4) is not None
    away = replace(seed, middle=seed.middle + np.array([0.5, 0.0]))
    other = replace(seed, middle=seed.middle - [0.5, 0.0])
    fits = [rough_fit(echoes, moved, "circle", 0.4) for moved in (away, other)]
    centre = np.array([6.0, -0.3, 0.0])
    assert all(fit is None or np.linalg.norm(fit.position - centre) > 0.1 for fit in fits)


@pytest.mark.parametrize("size, sigma", [(SIZE, 0.01), (None, 0.03)])
def test_the_outline_has_the_size_of_the_disc(size, sigma):
    "Known to 1 cm, and found to 3 cm where it isn't known"
    echoes = wall(lambda u, v: np.hypot(u, v) < SIZE / 2, np.random.default_rng(2))
    fit = exact_fit(echoes, best_rough(echoes, "circle", size), SCANNER)
    assert fit.outline.size == pytest.approx(SIZE, abs=sigma)
    assert fit.size == size
    np.testing.assert_allclose(fit.position, [6.0, 0.0, 0.0], atol=0.003)


def test_points_on_the_target_are_bright_and_inside():
    "Of a disc on a wall those within its radius, of a hole the board within a radius more"
    echoes = wall(lambda u, v: np.hypot(u, v) < SIZE / 2, np.random.default_rng(3))
    fit = exact_fit(echoes, best_rough(echoes, "circle"), SCANNER)
    _, state, rows = fit.beams
    radius = np.linalg.norm(echoes.xyz[rows][:, 1:], axis=1)
    assert (state[fit.on_target] == BRIGHT).all()
    assert np.mean(fit.on_target == (radius < SIZE / 2)) > 0.99
    assert set(np.unique(state)) <= {BRIGHT, DARK, MISS}
    seen = views("hole")[0]
    hole = exact_fit(echoes_of(seen), best_rough(echoes_of(seen), "hole"), SCANNER)
    away = np.linalg.norm(hole.beams[0] - hole.outline.centre, axis=1)[hole.on_target]
    assert away.min() > 0.9 * SIZE / 2 and away.max() < 1.05 * SIZE


def test_the_threshold_lies_half_way_between_paint_and_wall():
    "12 000 on 2 000 counts: about 7 000, whatever level the seed came from"
    echoes = wall(lambda u, v: np.hypot(u, v) < SIZE / 2, np.random.default_rng(4))
    fits = [rough_fit(echoes, seed, "circle", SIZE) for seed in seeds_of(echoes, "circle")]
    fits = [fit for fit in fits if fit is not None]
    assert len({fit.seed.rows.size for fit in fits}) >= 2
    for fit in fits:
        assert fit.seed.threshold == pytest.approx(7_000.0, rel=0.05)


def test_too_few_points_are_not_fitted_exactly():
    "Of a disc thinned to a handful of points a rough fit stays without an exact one"
    rng = np.random.default_rng(5)
    echoes = wall(lambda u, v: np.hypot(u, v) < SIZE / 2, rng)
    fit = best_rough(echoes, "circle")
    number = np.flatnonzero(fit.on_target)
    few = number[: SETTINGS.smallest_count // 2 - 1]
    kept = np.setdiff1d(np.arange(len(fit.beams[1])), np.setdiff1d(number, few))
    thin = replace(fit, beams=tuple(values[kept] for values in fit.beams))
    assert exact_fit(echoes, fit, SCANNER) is not None
    assert exact_fit(echoes, thin, SCANNER) is None


def test_intensity_counts_by_its_ratios_alone():
    "Counts of 8 bits or of 16: the same outline to 1 um"
    echoes = wall(lambda u, v: np.hypot(u, v) < SIZE / 2, np.random.default_rng(6))
    dim = replace(echoes, intensity=echoes.intensity / 256.0)
    fits = [exact_fit(e, best_rough(e, "circle"), SCANNER) for e in (echoes, dim)]
    np.testing.assert_allclose(fits[0].position, fits[1].position, atol=1e-6)


def test_points_of_one_line_are_no_target():
    "Bright points of a single scan line hold no plane that beams cross: nothing is fitted"
    echoes = wall(lambda u, v: np.hypot(u, v) < 0.3, np.random.default_rng(3))
    fit = best_rough(echoes, "circle")
    points, state, rows = fit.beams
    level = np.where(rows < 0, np.inf, np.abs(echoes.xyz[rows, 2]))
    lost = (state == BRIGHT) & (level > level.min() + 1e-9)
    line = replace(fit, beams=(points, np.where(lost, DARK, state), rows))
    assert line.on_target.sum() > SETTINGS.smallest_count / 2
    assert exact_fit(echoes, line, SCANNER) is None
