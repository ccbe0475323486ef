"""Sparse regression on a candidate matrix."""
import numpy as np

from . import _whirl
from ._base import BaseEstimator


class STLSQ(BaseEstimator):
    """Sequentially thresholded least squares (Brunton, Proctor, Kutz 2016) with an absolute `threshold` and ridge `alpha`."""

    def __init__(self, threshold=0.1, alpha=0.05, max_iter=20):
        self.threshold = threshold
        self.alpha = alpha
        self.max_iter = max_iter

    def solve(self, theta, y):
        gram, moment = theta.T @ theta, theta.T @ y
        support = np.ones(theta.shape[1], dtype=bool)
        xi = np.zeros(theta.shape[1])
        for _ in range(self.max_iter):
            xi[:] = 0
            inside = np.ix_(support, support)
            ridge = self.alpha * np.eye(support.sum())
            xi[support] = np.linalg.lstsq(gram[inside] + ridge, moment[support], rcond=None)[0]
            kept = np.abs(xi) >= self.threshold
            if (kept == support).all():
                break
            support = kept
        xi[~support] = 0
        if support.any():  # without the ridge's bias
            xi[support] = np.linalg.lstsq(theta[:, support], y, rcond=None)[0]
        return xi


class SparseRegression(BaseEstimator):
    """One of whirl.regression_methods(), e.g. "best_subset", "lasso", "frols", "ensemble"; thresholds are shares."""

    def __init__(self, method="best_subset", threshold=0.02, max_terms=0, seed=1):
        self.method = method
        self.threshold = threshold
        self.max_terms = max_terms
        self.seed = seed

    def solve(self, theta, y):
        return _whirl.sparse_regression(theta, y, **self.get_params())
