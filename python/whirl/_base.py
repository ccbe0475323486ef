"""What the modules share: the rules of scikit-learn for an estimator, with or without scikit-learn, and types."""
import copy
import functools
import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Trajectories = ArrayLike  # samples x states, or a list of such
Frame = Any  # pandas.DataFrame, where pandas is installed
Axes = Any  # of matplotlib

try:  # scikit-learn is optional: with it the estimator can be cloned, searched over and put into pipelines
    from sklearn.base import BaseEstimator
    from sklearn.base import clone as _clone
except ImportError:  # pragma: no cover

    class BaseEstimator:
        """The two methods that scikit-learn needs of an estimator."""

        def get_params(self, deep=True):
            import inspect

            return {name: getattr(self, name) for name in inspect.signature(type(self).__init__).parameters if name != "self"}

        def set_params(self, **params):
            for name, value in params.items():
                setattr(self, name, value)
            return self

    def _clone(estimator, safe=True):
        return copy.deepcopy(estimator)


def clone(estimator):
    """The same settings, not fitted; of an object that is no estimator a copy."""
    return _clone(estimator, safe=False)


def frame_names(x):
    """The column names of a pandas.DataFrame, as scikit-learn takes them: all text, or none; None without names."""
    columns = getattr(x, "columns", None)
    if columns is None:
        return None
    names = list(columns)
    if all(isinstance(name, str) for name in names):
        return names
    if any(isinstance(name, str) for name in names):
        raise TypeError(f"column names {names}: must be all text, or none of them")
    return None


def require_fitted_names(estimator, x):
    """The columns of x are those of fit, in its order. scikit-learn's words."""
    fitted, names = getattr(estimator, "feature_names_in_", None), frame_names(x)
    kind = type(estimator).__name__
    if fitted is None and names is not None:
        warnings.warn(f"X has feature names, but {kind} was fitted without feature names")
    elif fitted is not None and names is None:
        warnings.warn(f"X does not have valid feature names, but {kind} was fitted with feature names")
    elif fitted is not None and names != list(fitted):
        unseen, missing = sorted(set(names) - set(fitted)), sorted(set(fitted) - set(names))
        text = "The feature names should match those that were passed during fit.\n"
        for title, some in (("Feature names unseen at fit time:", unseen), ("Feature names seen at fit time, yet now missing:", missing)):
            if some:
                text += title + "\n" + "".join(f"- {name}\n" for name in some)
        if not unseen and not missing:
            text += "Feature names must be in the same order as they were in fit.\n"
        raise ValueError(text)


def not_fitted(estimator):
    """The error of a call that needs fit first; scikit-learn's own where it is installed."""
    try:
        from sklearn.exceptions import NotFittedError as kind
    except ImportError:  # pragma: no cover
        kind = ValueError
    return kind(f"this {type(estimator).__name__} is not fitted yet: call fit first")


def refuses(instead):
    """Wraps a method: arguments of PySINDy 1.x among `instead` are refused, with what to write now."""

    def wrap(method):
        @functools.wraps(method)
        def call(self, *values, **named):
            for name in named:
                if name in instead:
                    raise TypeError(f"{name} is of PySINDy 1.x: {instead[name]}")
            return method(self, *values, **named)

        return call

    return wrap
