"""Least squares collocation: l = A x + B s + n  (Mao et al. 2015, Eq. 6 and 13-15).

- model: trend, signals and noise, the least squares of the trend, and the result
- any_rows: observations of every kind, by whichever of the next two suits them
- markov: linear in observations and epochs, by recursion and interpolation between them
- dense: the same by the explicit formula, with work that grows as the cube of the observations
- linked: rows that depend on two or more epochs, and errors shared by any number of rows
- whitening: V of scalar observations, factored once for thousands of columns
- literal: the paper's own predictor, whose covariances are inconsistent
"""

from mlscorr.collocation.any_rows import collocate_rows
from mlscorr.collocation.covariance import FAMILIES, INTEGRATED, Covariance
from mlscorr.collocation.dense import collocate_rows_dense, covariance_given, likelihood_changes
from mlscorr.collocation.interpolation import CHUNK
from mlscorr.collocation.linked import collocate_by_knots, leave_each_out, reweight
from mlscorr.collocation.literal import LiteralSignal, collocate_literal
from mlscorr.collocation.markov import collocate
from mlscorr.collocation.model import Collocation, Noise, Signal, polynomial_design
from mlscorr.collocation.sparse_rows import SparseRows
from mlscorr.collocation.whitening import Whitener, factor
