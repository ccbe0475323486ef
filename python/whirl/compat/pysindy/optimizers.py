"""Optimizers under the names of PySINDy."""
from ..._base import clone
from ...optimizers import FROLS, SR3, SSR, STLSQ, EnsembleOptimizer, Optimizer, regress  # noqa: F401
from ._missing import missing as _missing

BaseOptimizer = Optimizer


class WrappedOptimizer(Optimizer):
    """A linear regressor of scikit-learn; an intercept has to be part of the library instead."""

    def __init__(self, optimizer):
        self.optimizer = optimizer

    def fit(self, x, y):
        import numpy as np

        y = np.asarray(y, dtype=float)
        self.coef_ = regress(clone(self.optimizer), np.asarray(x, dtype=float), y[:, None] if y.ndim == 1 else y)
        self.ind_ = self.coef_ != 0
        self.history_ = [self.coef_]
        self.intercept_ = 0.0
        return self


__getattr__ = _missing(__name__)
