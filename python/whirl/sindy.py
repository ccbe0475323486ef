"""A scikit-learn estimator for sparse identification of dynamics."""
import warnings

import numpy as np

from . import _whirl
from ._base import clone, require_fitted_names
from ._model import SparseModel, as_seconds, drive_at
from .differentiation import FiniteDifference, SmoothingSpline
from .libraries import PolynomialLibrary
from .optimizers import STLSQ

# The weak form needs as many samples in one trajectory (libs/identify, fit_sindy).
_WEAK_SAMPLES = 25
# Time, constants and functions of the terms (libs/expr).
_TAKEN = {"t", "pi", "abs", "sgn", "exp", "log", "sqrt", "sin", "cos", "tan", "tanh", "min", "max"}


class SINDy(SparseModel):
    """Sparse identification of x' = f(x, u), or of maps x[k+1] = f(x, u); an estimator of scikit-learn.

    Without `optimizer`, `differentiation_method`, rates and Python functions, `fit` is whirl's own: weak form, then
    refinement by simulation; it needs no threshold and no derivative, and `model_` has intervals and a verdict. With any
    of these it is the classical chain: derivative, candidate matrix, sparse regression. `whirl.compat.pysindy` has the
    names and arguments of PySINDy.

    Parameters
    ----------
    optimizer : STLSQ, SR3, SSR, FROLS, EnsembleOptimizer or SparseRegression, a linear regressor of scikit-learn, or any
        object with solve(theta, y) -> coefficients
    feature_library : PolynomialLibrary, FourierLibrary, TermLibrary, CustomLibrary, ..., their sums and products
    differentiation_method : FiniteDifference, SmoothingSpline, ..., or a function of (x, t)
    feature_names : names of the states (and inputs); default: the columns of a pandas.DataFrame where they can be names
        of variables, else x0, x1, ..., u0, ...
    t_default : sample time where fit is given none, s
    discrete_time : True for maps

    Attributes after fit: coefficients_ (states x features), model_ (a whirl.Model, where the terms are text),
    n_features_in_, feature_names_, and feature_names_in_ (the columns, when fitted with a DataFrame).
    """

    _columns_only = True

    def __init__(self, optimizer=None, feature_library=None, differentiation_method=None, feature_names=None,
                 t_default=1.0, discrete_time=False):
        self.optimizer = optimizer
        self.feature_library = feature_library
        self.differentiation_method = differentiation_method
        self.feature_names = feature_names
        self.t_default = t_default
        self.discrete_time = discrete_time

    def fit(self, x, y=None, *, t=None, x_dot=None, u=None):
        """x: samples x states (array or pandas.DataFrame), or a list of such trajectories; t: sample time or times (one
        for all, or a list), in s or as dates; x_dot: measured rates; u: inputs.

        y is scikit-learn's target: the rates, like x_dot, where it has the shape of x; any other y is left out with a
        warning.
        """
        x_dot = _target(x, y, x_dot)
        data = self._trajectories(x, t, x_dot, u, self.t_default)
        shortest = min(map(len, data.states))
        if shortest < 5:
            raise ValueError(f"n_samples = {shortest}: a trajectory needs at least 5 samples")
        self._name(data)
        short = _is_short(data)
        classical = (self.optimizer is not None or self.differentiation_method is not None or data.rates[0] is not None
                     or self.library_.terms(self._variables) is None)
        if short and not classical:
            warnings.warn(f"no trajectory has {_WEAK_SAMPLES} samples, the least for the weak form: fitted by differences and "
                          "STLSQ(), without intervals and verdict")
        if classical or short:
            self.model_ = self._compiled = None
            self.optimizer_ = clone(self.optimizer) if self.optimizer is not None else STLSQ()
            self._fit_chain(data, self._method(data), self.optimizer_)
        else:
            self._fit_weak(data)
        return self

    def _name(self, data):
        n, m = data.n, data.m
        names = list(self.feature_names) if self.feature_names is not None else _usable_names(data.columns, data.input_columns if m else [])
        _check_has(self.optimizer, "optimizer", ("fit", "solve"), "STLSQ(), SparseRegression() or a linear regressor of scikit-learn")
        _check_has(self.differentiation_method, "differentiation_method", ("__call__",), "FiniteDifference() or SmoothingSpline()")
        _check_has(self.feature_library, "feature_library", ("evaluate",), "PolynomialLibrary() or another library")
        if names and len(names) not in (n, n + m):
            raise ValueError(f"{len(names)} feature names: must be {n} (states) or {n + m} (states and inputs)")
        names = names or [f"x{i}" for i in range(n)]
        library = self.feature_library if self.feature_library is not None else PolynomialLibrary(2)
        every = names[:n] + (names[n:] or [f"u{i}" for i in range(m)])
        _check_names(every, library)
        if data.columns is not None:
            self.feature_names_in_ = np.asarray(data.columns, dtype=object)
        elif hasattr(self, "feature_names_in_"):
            del self.feature_names_in_
        self.n_features_in_ = n
        self.state_names_, self.input_names_ = every[:n], every[n:]
        self.feature_names_ = self._variables = every
        self.library_ = library
        self.features_ = library.names(every)

    def _method(self, data):
        if self.differentiation_method is not None:
            return clone(self.differentiation_method)
        return FiniteDifference(order=2) if _is_short(data) else SmoothingSpline()

    def _fit_weak(self, data):
        records = []
        for i, (states, dt, drive) in enumerate(zip(data.states, data.times, data.inputs)):
            columns = dict(zip(self.state_names_, states.T))
            if drive is not None:
                columns.update(zip(self.input_names_, drive.T))
            when = {"t": dt} if np.ndim(dt) else {"dt": dt}
            try:
                records.append(_whirl.Recording(columns, source=f"trajectory {i + 1}", **when))
            except _whirl.Error as error:
                raise ValueError(f"{error}; differentiation_method=FiniteDifference() takes uneven times") from None
        terms = self.library_.terms(self._variables)
        self.model_ = _whirl._fit_sindy(records, self.state_names_, self.input_names_, terms, self.discrete_time)
        self.coefficients_ = np.zeros((len(self.state_names_), len(terms)))
        place = {_whirl._canonical(term): j for j, term in enumerate(terms)}
        for equation in self.model_.equations:
            i = self.state_names_.index(equation.lhs.rstrip("'").split("[")[0])
            for term in equation.terms:
                self.coefficients_[i, place[_whirl._canonical(term.function)]] = term.coefficient.value
        self._compiled = _whirl._Compiled(self.model_) if self.model_.equations else None

    def simulate(self, x0, t, u=None):
        """Simulation from x0 over the times t (maps: number of steps); u: one row per time, or a function of time."""
        self._check_fitted()
        samples = int(t) if np.ndim(t) == 0 else len(t)
        if samples < 1:
            raise ValueError(f"t = {t}: at least one sample is needed")
        step = 1.0 if np.ndim(t) == 0 else self._time(t, samples, None)
        times = np.arange(samples) * 1.0 if np.ndim(t) == 0 else as_seconds(t)
        drive, start = drive_at(u, times), self._start(x0)
        if self._compiled is not None and np.ndim(step) == 0:
            return self._compiled.simulate(start, step, samples, drive)
        if self.discrete_time:
            return self._iterate(start, samples, drive)
        out = np.empty((samples, start.size))
        out[0] = start
        for k, h in enumerate(np.diff(times)):
            a = None if drive is None else drive[k:k + 1]
            b = None if drive is None else drive[k + 1:k + 2]
            middle = None if drive is None else 0.5 * (a + b)
            state = out[k:k + 1]
            r1 = self._rates(state, a)
            r2 = self._rates(state + h / 2 * r1, middle)
            r3 = self._rates(state + h / 2 * r2, middle)
            r4 = self._rates(state + h * r3, b)
            out[k + 1] = (state + h / 6 * (r1 + 2 * r2 + 2 * r3 + r4))[0]
        return out

    def score(self, x, y=None, *, t=None, x_dot=None, u=None, metric=None, **metric_kws):
        """R^2 of the predicted rates (maps: next values), mean over states; 1 is perfect. `metric(true, predicted)`:
        another one, e.g. of sklearn.metrics. y as in fit."""
        self._check_fitted()
        x_dot = _target(x, y, x_dot)
        require_fitted_names(self, x)
        data = self._trajectories(x, t, x_dot, u, self.t_default)
        return self._score(data, self._method(data), metric, metric_kws)

    def __getstate__(self):
        return {k: v for k, v in self.__dict__.items() if k != "_compiled"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        model = state.get("model_")
        self._compiled = _whirl._Compiled(model) if model is not None and model.equations else None


def _is_short(data):
    return max(map(len, data.states)) < _WEAK_SAMPLES


def _target(x, y, x_dot):
    """The rates, from the two ways to give them."""
    if y is None:
        return x_dot
    listed = isinstance(y, (list, tuple)) and len(y) > 0
    if listed and np.ndim(y[0]) > 1 or not listed and np.ndim(y) == 2 and np.shape(y) == np.shape(x):
        if x_dot is not None:
            raise ValueError("y and x_dot: give one of them")
        return y
    parts = y if listed and np.ndim(y[0]) == 1 else [y]
    if all(_is_time(part) for part in parts):
        raise TypeError("the second argument is scikit-learn's target; the sample time or times go in t=...")
    shapes = ", ".join(str(np.shape(part)) for part in parts)
    warnings.warn(f"y of shape {shapes} is left out: it is taken as the rates where it has the shape of x")
    return x_dot


def _is_time(y):
    """A sample time, or times in equal steps."""
    values = np.asarray(y)
    if values.ndim != 1 or len(values) < 3 or values.dtype.kind not in "fiumM":
        return values.ndim == 0
    steps = np.diff(as_seconds(values))
    return steps[0] > 0 and np.abs(steps - steps[0]).max() <= 1e-3 * steps[0]


def _check_names(names, library):
    for name in names:
        if not isinstance(name, str) or names.count(name) > 1:
            raise ValueError(f"feature name {name!r}: must be text, used once")
        if (name in _TAKEN or not name.isidentifier()) and library.terms(names) is not None:
            raise ValueError(f"feature name {name!r}: must be a word of letters, digits and underscores, and none of "
                             f"{', '.join(sorted(_TAKEN))}")


def _usable_names(columns, inputs):
    """Names for the variables from the columns of frames; none where one cannot be used in a formula."""
    if columns is None or inputs is None:
        return []
    names = columns + inputs
    usable = all(name.isidentifier() and name not in _TAKEN for name in names) and len(set(names)) == len(names)
    return names if usable else []


def _check_has(part, name, methods, example):
    if part is not None and not any(hasattr(part, method) for method in methods):
        raise ValueError(f"{name} = {part!r}: must be {example}")
