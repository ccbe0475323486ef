"""Rates of sampled states."""
import numpy as np

from . import _whirl
from ._base import BaseEstimator


class FiniteDifference(BaseEstimator):
    """Central differences of `order` 2, 4 or 6; for records without noise."""

    def __init__(self, order=4):
        self.order = order

    def differentiate(self, x, dt):
        """(states, rates, rows): what is left of x when the ends are cut."""
        cut = self.order // 2
        rates = np.column_stack([_whirl.finite_difference(column, dt, self.order) for column in x.T])
        return x[cut:-cut], rates, slice(cut, len(x) - cut)


class SmoothingSpline(BaseEstimator):
    """The spline that leaves just the noise of each channel; its rates."""

    def differentiate(self, x, dt):
        pairs = [_whirl.smooth(column, dt) for column in x.T]
        return np.column_stack([p[0] for p in pairs]), np.column_stack([p[1] for p in pairs]), slice(0, len(x))
