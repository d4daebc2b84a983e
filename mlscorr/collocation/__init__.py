"""Least squares collocation: l = A x + B s + n  (Mao et al. 2015, Eq. 6 and 13-15).

- model: trend, signals and noise, the least squares of the trend, and the result
- any_rows: of observations of every kind, by that of the next two which suits them
- markov: linear in observations and epochs, by recursion and interpolation between them
- dense: the same by the formula written out, with work that grows as the observations cubed
- linked: of rows that see two epochs and more, and errors that any number of them share
- whitening: V of scalar observations, factored once for thousands of columns
- literal: the paper's own predictor, whose covariances don't fit each other
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
