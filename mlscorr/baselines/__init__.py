"""Baselines for comparison with collocation: anything with apply(cloud) works.

The first kind moves the cloud as one body, independent of time: shift, transformation, rigid,
affine and, in ``mlscorr.baselines.registration``, ICP. The second kind varies with time: a
polynomial per axis, interpolation between control points, a Gaussian process, and the collocation
as printed by Mao et al. 2015.
"""

from mlscorr.baselines.interpolation import (
    fit_gaussian_process,
    fit_linear,
    fit_literal,
    fit_pchip,
    fit_polynomial,
)
from mlscorr.baselines.pairs import Undetermined
from mlscorr.baselines.registration import fit_icp
from mlscorr.baselines.transformation import (
    RAW,
    Transformation,
    fit_affine,
    fit_horizontal_and_height,
    fit_rigid,
    fit_shift,
)
