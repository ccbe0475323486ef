"""A scikit-learn estimator for sparse identification of dynamics."""
import numpy as np

from . import _whirl
from ._base import BaseEstimator, frame_names, require_fitted_names
from .differentiation import SmoothingSpline
from .libraries import PolynomialLibrary
from .optimizers import STLSQ


# Time, constants and functions of the terms (libs/expr).
_TAKEN = {"t", "pi", "abs", "sgn", "exp", "log", "sqrt", "sin", "cos", "tan", "tanh", "min", "max"}


class SINDy(BaseEstimator):
    """Sparse identification of x' = f(x, u), or of maps x[k+1] = f(x, u).

    Without `optimizer`, `differentiation_method`, x_dot and Python functions, `fit` is whirl's own: weak form, then
    refinement on free runs; it needs no threshold and no derivative, and `model_` has intervals and a verdict. With any
    of these it is the classical chain: derivative, candidate matrix, sparse regression.

    Parameters
    ----------
    optimizer : STLSQ or SparseRegression, or any object with solve(theta, y) -> coefficients
    feature_library : PolynomialLibrary, FourierLibrary, TermLibrary, CustomLibrary, their sums and products
    differentiation_method : FiniteDifference or SmoothingSpline
    feature_names : names of the states (and inputs); default: the columns of a pandas.DataFrame where they can be names
        of variables, else x0, x1, ..., u0, ...
    t_default : sample time where fit is given none, s
    discrete_time : True for maps

    Attributes after fit: coefficients_ (states x features), model_ (a whirl.Model, where the terms are text),
    n_features_in_, feature_names_, and feature_names_in_ (the columns, when fitted with a DataFrame).
    """

    def __init__(self, optimizer=None, feature_library=None, differentiation_method=None, feature_names=None,
                 t_default=1.0, discrete_time=False):
        self.optimizer = optimizer
        self.feature_library = feature_library
        self.differentiation_method = differentiation_method
        self.feature_names = feature_names
        self.t_default = t_default
        self.discrete_time = discrete_time

    # -- fitting

    def fit(self, x, t=None, x_dot=None, u=None):
        """x: samples x states (array or pandas.DataFrame), or a list of such trajectories; t: sample time or times (one
        for all, or a list), in s or as dates."""
        several = isinstance(x, (list, tuple)) and len(x) > 0 and (np.ndim(x[0]) > 1 or hasattr(x[0], "toarray"))
        columns, input_columns = [frame_names(part) for part in (x if several else [x])], frame_names(u[0] if several and u is not None else u)
        if any(names != columns[0] for names in columns):
            raise ValueError(f"trajectories have the columns {columns}: must be the same")
        if columns and columns[0] is not None:
            self.feature_names_in_ = np.asarray(columns[0], dtype=object)
        elif hasattr(self, "feature_names_in_"):
            del self.feature_names_in_
        trajectories = [_states(part) for part in (x if several else [x])]
        k = len(trajectories)
        inputs = [None if part is None else _states(part, "u") for part in _each(u, several, k)]
        rates = [None if part is None else _states(part, "x_dot") for part in _each(x_dot, several, k)]
        steps = [self._step(part, len(data)) for part, data in zip(_each(t, isinstance(t, (list, tuple)) and several, k), trajectories)]
        n, m = trajectories[0].shape[1], 0 if inputs[0] is None else inputs[0].shape[1]
        if min(map(len, trajectories)) < 5:
            raise ValueError(f"n_samples = {min(map(len, trajectories))}: a trajectory needs at least 5 samples")
        for data, drive, rate in zip(trajectories, inputs, rates):
            if data.shape[1] != n:
                raise ValueError(f"trajectories have {n} and {data.shape[1]} states: must be the same")
            if (drive is None) != (m == 0):
                raise ValueError("u: every trajectory needs its inputs, or none")
            if drive is not None and (len(drive) != len(data) or drive.shape[1] != m):
                raise ValueError(f"u has shape {drive.shape}: must be ({len(data)}, {m})")
            if (rate is None) != (rates[0] is None):
                raise ValueError("x_dot: every trajectory needs its rates, or none")
            if rate is not None and rate.shape != data.shape:
                raise ValueError(f"x_dot has shape {rate.shape}: must be {data.shape}")
        names = list(self.feature_names) if self.feature_names is not None else _variables(columns[0], input_columns if m else [])
        _check_has(self.optimizer, "optimizer", "solve", "STLSQ() or SparseRegression()")
        _check_has(self.differentiation_method, "differentiation_method", "differentiate", "FiniteDifference() or SmoothingSpline()")
        _check_has(self.feature_library, "feature_library", "evaluate", "PolynomialLibrary() or another library")
        if names and len(names) not in (n, n + m):
            raise ValueError(f"{len(names)} feature names: must be {n} (states) or {n + m} (states and inputs)")
        names = names or [f"x{i}" for i in range(n)]
        self.n_features_in_ = n
        self.state_names_ = names[:n]
        self.input_names_ = names[n:] or [f"u{i}" for i in range(m)]
        self.feature_names_ = self.state_names_ + self.input_names_
        self.library_ = self.feature_library if self.feature_library is not None else PolynomialLibrary(2)
        self._check_names()
        classical = (self.optimizer is not None or self.differentiation_method is not None or rates[0] is not None
                     or self.library_.terms(self.feature_names_) is None)
        if classical:
            self._fit_classical(trajectories, steps, rates, inputs)
        else:
            self._fit_weak(trajectories, steps, inputs)
        return self

    def _check_names(self):
        names = self.feature_names_
        for name in names:
            if not isinstance(name, str) or names.count(name) > 1:
                raise ValueError(f"feature name {name!r}: must be text, used once")
            if (name in _TAKEN or not name.isidentifier()) and self.library_.terms(names) is not None:
                raise ValueError(f"feature name {name!r}: must be a word of letters, digits and underscores, and none of "
                                 f"{', '.join(sorted(_TAKEN))}")

    def _step(self, t, samples):
        if t is None:
            return float(self.t_default)
        if np.ndim(t) == 0:
            t = float(_seconds(t))
            if not 0 < t < np.inf:
                raise ValueError(f"t = {t}: the sample time must be positive and finite")
            return float(t)
        t = _seconds(t)
        if t.shape != (samples,):
            raise ValueError(f"t has shape {t.shape}: must be ({samples},), one time per sample")
        if samples < 2:
            raise ValueError("t: at least two times are needed")
        steps = np.diff(t)
        if not (steps > 0).all() or np.abs(steps - steps.mean()).max() > 0.05 * steps.mean():
            raise ValueError("t: times must rise in equal steps")
        return float(steps.mean())

    def _fit_weak(self, trajectories, steps, inputs):
        records = []
        for i, (data, dt, drive) in enumerate(zip(trajectories, steps, inputs)):
            columns = {name: column for name, column in zip(self.state_names_, data.T)}
            if drive is not None:
                columns.update(zip(self.input_names_, drive.T))
            records.append(_whirl.Recording(columns, dt=dt, source=f"trajectory {i + 1}"))
        terms = self.library_.terms(self.feature_names_)
        self.model_ = _whirl._fit_sindy(records, self.state_names_, self.input_names_, terms, self.discrete_time)
        self.features_ = self.library_.names(self.feature_names_)
        self.coefficients_ = np.zeros((len(self.state_names_), len(terms)))
        place = {_canonical(term): j for j, term in enumerate(terms)}
        for equation in self.model_.equations:
            i = self.state_names_.index(equation.lhs.rstrip("'").split("[")[0])
            for term in equation.terms:
                self.coefficients_[i, place[_canonical(term.function)]] = term.coefficient.value
        self._compiled = _whirl._Compiled(self.model_) if self.model_.equations else None

    def _fit_classical(self, trajectories, steps, rates, inputs):
        method = self.differentiation_method if self.differentiation_method is not None else SmoothingSpline()
        rows, targets = [], []
        for data, dt, rate, drive in zip(trajectories, steps, rates, inputs):
            if self.discrete_time:
                values, rate, part = data[:-1], data[1:], slice(0, len(data) - 1)
            elif rate is not None:
                values, part = data, slice(0, len(data))
            else:
                values, rate, part = method.differentiate(data, dt)
            rows.append(values if drive is None else np.hstack([values, drive[part]]))
            targets.append(rate)
        theta = self.library_.evaluate(np.vstack(rows), self.feature_names_)
        solver = self.optimizer if self.optimizer is not None else STLSQ()
        self.model_ = None
        self._compiled = None
        self.features_ = self.library_.names(self.feature_names_)
        self.coefficients_ = np.vstack([solver.solve(theta, y) for y in np.vstack(targets).T])

    # -- use

    def predict(self, x, u=None):
        """Rates (maps: next values) at the rows of x."""
        if hasattr(x, "columns") or "feature_names_in_" in self.__dict__:
            require_fitted_names(self, x)
        return self._rates(x, u)

    def _rates(self, x, u=None):
        if self.__dict__.get("_compiled") is not None:
            return self._compiled.predict(x, u)
        self._check_fitted()
        x = _states(x)
        if x.shape[1] != self.n_features_in_:
            raise ValueError(f"X has {x.shape[1]} features, but {type(self).__name__} is expecting {self.n_features_in_} features as input")
        variables = x if u is None else np.hstack([x, _states(u, "u")])
        return self.library_.evaluate(variables, self.feature_names_) @ self.coefficients_.T

    def simulate(self, x0, t, u=None):
        """Free run from x0 over the times t (maps: number of steps); u: one row per time, or a function of time."""
        self._check_fitted()
        samples = int(t) if np.ndim(t) == 0 else len(t)
        dt = 1.0 if np.ndim(t) == 0 else self._step(t, samples)
        times = np.arange(samples) * dt if np.ndim(t) == 0 else _seconds(t)
        if callable(u):
            u = np.array([np.atleast_1d(u(time)) for time in times])
        drive = None if u is None else _states(u, "u")
        if samples < 1:
            raise ValueError(f"t = {t}: at least one sample is needed")
        start = np.asarray(x0, dtype=float).ravel()
        if not np.isfinite(start).all():
            raise ValueError("x0 contains NaN or infinity")
        if start.shape != (self.n_features_in_,):
            raise ValueError(f"x0 has {start.size} values: the model has {self.n_features_in_} states")
        if self._compiled is not None:
            return self._compiled.simulate(start, dt, samples, drive)
        out = np.empty((samples, start.size))
        out[0] = start
        for k in range(samples - 1):
            a = None if drive is None else drive[k:k + 1]
            b = None if drive is None else drive[k + 1:k + 2]
            middle = None if drive is None else 0.5 * (a + b)
            state = out[k:k + 1]
            if self.discrete_time:
                out[k + 1] = self._rates(state, a)[0]
                continue
            r1 = self._rates(state, a)
            r2 = self._rates(state + dt / 2 * r1, middle)
            r3 = self._rates(state + dt / 2 * r2, middle)
            r4 = self._rates(state + dt * r3, b)
            out[k + 1] = (state + dt / 6 * (r1 + 2 * r2 + 2 * r3 + r4))[0]
        return out

    def score(self, x, t=None, x_dot=None, u=None):
        """R^2 of the predicted rates (maps: next values), mean over states; 1 is perfect."""
        self._check_fitted()
        require_fitted_names(self, x)
        data = _states(x)
        drive = None if u is None else _states(u, "u")
        if self.discrete_time:
            data, target, rows = data[:-1], data[1:], slice(0, len(data) - 1)
        elif x_dot is not None:
            target, rows = _states(x_dot, "x_dot"), slice(0, len(data))
        else:
            method = self.differentiation_method if self.differentiation_method is not None else SmoothingSpline()
            data, target, rows = method.differentiate(data, self._step(t, len(data)))
        error = target - self._rates(np.ascontiguousarray(data), None if drive is None else drive[rows])
        spread = ((target - target.mean(axis=0)) ** 2).sum(axis=0)
        return float(np.mean(1 - (error**2).sum(axis=0) / np.where(spread > 0, spread, 1)))

    def coefficients(self):
        """states x features."""
        self._check_fitted()
        return self.coefficients_

    def get_feature_names(self):
        self._check_fitted()
        return self.features_

    def equations(self, precision=3):
        """Right-hand sides as text, one per state."""
        self._check_fitted()
        out = []
        for row in self.coefficients_:
            terms = [f"{c:.{precision}f} {name}" for c, name in zip(row, self.features_) if c != 0]
            out.append(" + ".join(terms) or f"{0:.{precision}f}")
        return out

    def print(self, lhs=None, precision=3):
        """Prints the equations; with intervals where the fit has them, see `model_`."""
        for name, right in zip(lhs or self.state_names_, self.equations(precision)):
            left = f"({name})[k+1]" if self.discrete_time else f"({name})'"
            print(f"{left} = {right}")

    @property
    def complexity(self):
        """Number of terms."""
        return int(np.count_nonzero(self.coefficients()))

    def _check_fitted(self):
        if not hasattr(self, "coefficients_"):
            from sklearn.exceptions import NotFittedError

            raise NotFittedError("this SINDy is not fitted yet: call fit first")

    def __getstate__(self):
        return {k: v for k, v in self.__dict__.items() if k != "_compiled"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        model = state.get("model_")
        self._compiled = _whirl._Compiled(model) if model is not None and model.equations else None


def _states(x, name="x"):
    """x as an array of samples x states; ValueError for anything else."""
    if hasattr(x, "toarray"):
        raise TypeError(f"sparse data is not supported: {name} must be dense")
    x = np.asarray(x)
    if x.dtype.kind == "c":
        raise ValueError(f"Complex data not supported: {name} has complex values")
    x = np.asarray(x, dtype=float)
    if x.ndim == 1:
        x = x[:, None]
    if x.ndim != 2:
        raise ValueError(f"{name} has shape {x.shape}: must be samples x states")
    if x.shape[1] == 0:
        raise ValueError(f"{name} has 0 feature(s) (shape={x.shape}) while a minimum of 1 is required.")
    if not np.isfinite(x).all():
        raise ValueError(f"{name} contains NaN or infinity")
    return x


def _seconds(t):
    """Times as numbers in s; dates count from the first one, which a cast would take for nanoseconds."""
    t = np.asarray(t)
    if t.dtype.kind == "M":
        t = t - t.flat[0]
    return t / np.timedelta64(1, "s") if t.dtype.kind == "m" else np.asarray(t, dtype=float)


def _variables(columns, inputs):
    """Names for the variables from the columns of frames; none where one cannot stand in a formula."""
    if columns is None or inputs is None:
        return []
    names = columns + inputs
    usable = all(name.isidentifier() and name not in _TAKEN for name in names) and len(set(names)) == len(names)
    return names if usable else []


def _each(value, several, count):
    """One value for each trajectory: of a list, or the same for all."""
    if not several or value is None:
        return [value] * count
    if isinstance(value, np.ndarray) and value.ndim < 3 or len(value) != count:
        raise ValueError(f"a list of {count} trajectories needs a list of {count} of each of t, u and x_dot, not {len(value)}")
    return list(value)


def _check_has(part, name, method, example):
    if part is not None and not hasattr(part, method):
        raise ValueError(f"{name} = {part!r}: must be {example}")


def _canonical(term):
    """One spelling of a term."""
    return _whirl._canonical(term)
