"""A scikit-learn estimator for sparse identification of dynamics, and its parts: libraries, regressions, derivatives."""
from itertools import combinations, combinations_with_replacement

import numpy as np

from . import _whirl

try:  # scikit-learn is optional: with it the estimator can be cloned, searched over and put into pipelines
    from sklearn.base import BaseEstimator
except ImportError:  # pragma: no cover

    class BaseEstimator:
        """The two methods that scikit-learn asks of an estimator."""

        def get_params(self, deep=True):
            import inspect

            return {name: getattr(self, name) for name in inspect.signature(type(self).__init__).parameters if name != "self"}

        def set_params(self, **params):
            for name, value in params.items():
                setattr(self, name, value)
            return self


# ---------------------------------------------------------------------------------------------------------- libraries


class Library:
    """Candidate terms. `a + b`: the terms of both, each once; `a * b`: every product."""

    def terms(self, names):
        """The terms as text in the variables `names`; None where a term is a Python function."""
        raise NotImplementedError

    def names(self, names):
        """Feature names."""
        return self.terms(names)

    def evaluate(self, x, names):
        """Columns of all terms at the rows of x."""
        return _whirl._Terms(self.terms(names), list(names))(np.ascontiguousarray(x, dtype=float))

    def __add__(self, other):
        return _Sum(self, other)

    def __mul__(self, other):
        return _Product(self, other)


class PolynomialLibrary(Library, BaseEstimator):
    """All monomials up to `degree`; with `include_bias` the constant, with `include_interaction` mixed products."""

    def __init__(self, degree=2, include_bias=True, include_interaction=True):
        self.degree = degree
        self.include_bias = include_bias
        self.include_interaction = include_interaction

    def _powers(self, n):
        for degree in range(0 if self.include_bias else 1, self.degree + 1):
            for factors in combinations_with_replacement(range(n), degree):
                if self.include_interaction or len(set(factors)) <= 1:
                    yield factors

    def terms(self, names):
        def text(factors):
            parts = [f"{names[i]}^{factors.count(i)}" if factors.count(i) > 1 else names[i] for i in sorted(set(factors))]
            return "*".join(parts) or "1"

        return [text(f) for f in self._powers(len(names))]

    def names(self, names):
        return [t.replace("*", " ") for t in self.terms(names)]


class FourierLibrary(Library, BaseEstimator):
    """sin(k x) and cos(k x) of every variable for k = 1 to `n_frequencies`."""

    def __init__(self, n_frequencies=1):
        self.n_frequencies = n_frequencies

    def terms(self, names):
        return [f"{f}({k}*{v})" for k in range(1, self.n_frequencies + 1) for v in names for f in ("sin", "cos")]


class TermLibrary(Library, BaseEstimator):
    """Terms written out, in the names of the variables: TermLibrary(["x0", "x0^3", "abs(x1)*x1"])."""

    def __init__(self, terms_=()):
        self.terms_ = terms_

    def terms(self, names):
        return list(self.terms_)


class CustomLibrary(Library, BaseEstimator):
    """Python functions of one or more variables, applied to every combination of variables.

    `function_names`: functions from the variables' names to a feature name; by default f0(x), f1(x, y), ...
    """

    def __init__(self, library_functions=(), function_names=None):
        self.library_functions = library_functions
        self.function_names = function_names

    def _calls(self, n):
        for k, function in enumerate(self.library_functions):
            for variables in combinations(range(n), function.__code__.co_argcount):
                yield k, function, variables

    def terms(self, names):
        return None

    def names(self, names):
        namers = self.function_names or [lambda *v, k=k: f"f{k}({', '.join(v)})" for k in range(len(self.library_functions))]
        return [namers[k](*(names[i] for i in variables)) for k, _, variables in self._calls(len(names))]

    def evaluate(self, x, names):
        columns = [np.broadcast_to(f(*(x[:, i] for i in v)), x.shape[:1]) for _, f, v in self._calls(x.shape[1])]
        return np.column_stack(columns).astype(float) if columns else np.empty((len(x), 0))


class _Sum(Library):
    def __init__(self, *parts):
        self.parts = parts

    def _kept(self, names):
        seen, kept = set(), []
        for i, part in enumerate(self.parts):
            for j, name in enumerate(part.names(names)):
                if name not in seen:
                    seen.add(name)
                    kept.append((i, j))
        return kept

    def terms(self, names):
        lists = [part.terms(names) for part in self.parts]
        return None if any(t is None for t in lists) else [lists[i][j] for i, j in self._kept(names)]

    def names(self, names):
        lists = [part.names(names) for part in self.parts]
        return [lists[i][j] for i, j in self._kept(names)]

    def evaluate(self, x, names):
        columns = [part.evaluate(x, names) for part in self.parts]
        return np.column_stack([columns[i][:, j] for i, j in self._kept(names)])


class _Product(Library):
    def __init__(self, a, b):
        self.a, self.b = a, b

    def terms(self, names):
        a, b = self.a.terms(names), self.b.terms(names)
        return None if a is None or b is None else [f"({p})*({q})" for p in a for q in b]

    def names(self, names):
        return [f"{p} {q}" for p in self.a.names(names) for q in self.b.names(names)]

    def evaluate(self, x, names):
        a, b = self.a.evaluate(x, names), self.b.evaluate(x, names)
        return (a[:, :, None] * b[:, None, :]).reshape(len(x), -1)


# --------------------------------------------------------------------------------------------------------- optimizers


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


# -------------------------------------------------------------------------------------------------------- derivatives


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


# ---------------------------------------------------------------------------------------------------------- estimator


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
    feature_names : names of the states (and inputs); default x0, x1, ..., u0, ...
    t_default : sample time where fit is given none, s
    discrete_time : True for maps

    Attributes after fit: coefficients_ (states x features), model_ (a whirl.Model, where the terms are text),
    n_features_in_, feature_names_.
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
        """x: samples x states, or a list of such trajectories; t: sample time or times (one for all, or a list)."""
        several = isinstance(x, (list, tuple)) and len(x) > 0 and np.ndim(x[0]) > 0 and not np.isscalar(x[0][0])
        trajectories = [_states(part) for part in (x if several else [x])]
        k = len(trajectories)
        inputs = [None if part is None else _states(part, "u") for part in _each(u, several, k)]
        rates = [None if part is None else _states(part, "x_dot") for part in _each(x_dot, several, k)]
        steps = [self._step(part, len(data)) for part, data in zip(_each(t, isinstance(t, (list, tuple)) and several, k), trajectories)]
        n, m = trajectories[0].shape[1], 0 if inputs[0] is None else inputs[0].shape[1]
        if min(map(len, trajectories)) < 5:
            raise ValueError(f"n_samples = {min(map(len, trajectories))}: a trajectory needs at least 5 samples")
        for data, drive in zip(trajectories, inputs):
            if data.shape[1] != n:
                raise ValueError(f"trajectories have {n} and {data.shape[1]} states: must be the same")
            if drive is not None and (len(drive) != len(data) or drive.shape[1] != m):
                raise ValueError(f"u has shape {drive.shape}: must be ({len(data)}, {m})")
        names = list(self.feature_names) if self.feature_names is not None else []
        if names and len(names) not in (n, n + m):
            raise ValueError(f"{len(names)} feature names: must be {n} (states) or {n + m} (states and inputs)")
        names = names or [f"x{i}" for i in range(n)]
        self.n_features_in_ = n
        self.state_names_ = names[:n]
        self.input_names_ = names[n:] or [f"u{i}" for i in range(m)]
        self.feature_names_ = self.state_names_ + self.input_names_
        self.library_ = self.feature_library if self.feature_library is not None else PolynomialLibrary(2)
        classical = (self.optimizer is not None or self.differentiation_method is not None or rates[0] is not None
                     or self.library_.terms(self.feature_names_) is None)
        if classical:
            self._fit_classical(trajectories, steps, rates, inputs)
        else:
            self._fit_weak(trajectories, steps, inputs)
        return self

    def _step(self, t, samples):
        if t is None:
            return float(self.t_default)
        if np.ndim(t) == 0:
            if not t > 0:
                raise ValueError(f"t = {t}: the sample time must be positive")
            return float(t)
        t = np.asarray(t, dtype=float)
        if t.shape != (samples,):
            raise ValueError(f"t has shape {t.shape}: must be ({samples},), one time per sample")
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
        times = np.arange(samples) * dt if np.ndim(t) == 0 else np.asarray(t, dtype=float)
        if callable(u):
            u = np.array([np.atleast_1d(u(time)) for time in times])
        drive = None if u is None else _states(u, "u")
        start = np.asarray(x0, dtype=float).ravel()
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
                out[k + 1] = self.predict(state, a)[0]
                continue
            r1 = self.predict(state, a)
            r2 = self.predict(state + dt / 2 * r1, middle)
            r3 = self.predict(state + dt / 2 * r2, middle)
            r4 = self.predict(state + dt * r3, b)
            out[k + 1] = (state + dt / 6 * (r1 + 2 * r2 + 2 * r3 + r4))[0]
        return out

    def score(self, x, t=None, x_dot=None, u=None):
        """R^2 of the predicted rates (maps: next values), mean over states; 1 is perfect."""
        self._check_fitted()
        data = _states(x)
        drive = None if u is None else _states(u, "u")
        if self.discrete_time:
            data, target, rows = data[:-1], data[1:], slice(0, len(data) - 1)
        elif x_dot is not None:
            target, rows = _states(x_dot, "x_dot"), slice(0, len(data))
        else:
            method = self.differentiation_method if self.differentiation_method is not None else SmoothingSpline()
            data, target, rows = method.differentiate(data, self._step(t, len(data)))
        error = target - self.predict(np.ascontiguousarray(data), None if drive is None else drive[rows])
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


def _each(value, several, count):
    return list(value) if several and value is not None else [value] * count


def _canonical(term):
    """One spelling of a term."""
    return _whirl._canonical(term)
