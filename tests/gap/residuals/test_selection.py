"""Selection of rows that agree with others of their time, of all kinds."""

import numpy as np

from mlscorr.gap.residuals._surfaces import consistent, spread


def test_odd_surfaces_are_left_out_but_no_shift():
    "A shift of half a metre along any normal stays; a car 10 cm before its wall goes"
    rng = np.random.default_rng(0)
    normal = rng.standard_normal((60, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    time = 413_200.0 + rng.uniform(0, 4, 60)
    residual = normal @ [0.5, -0.3, 0.2] + rng.normal(0, 0.003, 60)
    residual[:6] += 0.10
    agree = consistent(time, normal, residual)
    assert not agree[:6].any() and agree[6:].all()


def test_a_choice_is_spread_over_each_covariate():
    "Of 1000 things of which 20 are rare, 100 chosen hold at least ten of the rare ones"
    rng = np.random.default_rng(0)
    rare = np.zeros(1000)
    rare[:20] = 1.0
    chosen = spread([rng.random(1000), rare], 100, rng)
    assert len(chosen) == 100 and (chosen < 20).sum() >= 10
