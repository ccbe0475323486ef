"""What the estimators of the package share: data of trajectories, the classical chain, use of the fitted model."""
from types import SimpleNamespace

import numpy as np

from ._base import BaseEstimator, frame_names, not_fitted, require_fitted_names
from .optimizers import regress


class SparseModel(BaseEstimator):
    """x' = f(x, u), or maps x[k+1] = f(x, u), with right-hand sides linear in the terms of a library.

    Attributes after a fit: `coefficients_` (states x terms), `features_` (names of the terms), `state_names_`,
    `input_names_`, `feature_names_` (both), `library_`, `n_features_in_` (states).
    """

    _compiled = None
    _columns_only = False  # a vector is no trajectory of one state
    _hides_zeros = False  # terms whose coefficient rounds to 0 are not printed

    @property
    def _map(self):
        return getattr(self, "discrete_time", False)

    # -- data

    def _trajectories(self, x, t, x_dot, u, default_step=None):
        """Data of a fit, checked: lists of states, times, rates and inputs, one entry a trajectory."""
        several = _is_list(x)
        parts = list(x) if several else [x]
        first_input = u[0] if several and u is not None and len(u) else u
        columns, input_columns = [frame_names(part) for part in parts], frame_names(first_input)
        if any(names != columns[0] for names in columns):
            raise ValueError(f"trajectories have the columns {columns}: must be the same")
        count = len(parts)
        data = SimpleNamespace(columns=columns[0], input_columns=input_columns)
        data.states = [as_states(part, columns_only=self._columns_only) for part in parts]
        data.inputs = [None if part is None else as_states(part, "u") for part in _each(u, several, count)]
        data.rates = [None if part is None else as_states(part, "x_dot") for part in _each(x_dot, several, count)]
        times = _each(t, isinstance(t, (list, tuple)) and several, count)
        data.times = [self._time(part, len(states), default_step) for part, states in zip(times, data.states)]
        data.n, data.m = data.states[0].shape[1], 0 if data.inputs[0] is None else data.inputs[0].shape[1]
        for states, drive, rate in zip(data.states, data.inputs, data.rates):
            if states.shape[1] != data.n:
                raise ValueError(f"trajectories have {data.n} and {states.shape[1]} states: must be the same")
            if (drive is None) != (data.m == 0):
                raise ValueError("u: every trajectory needs its inputs, or none")
            if drive is not None and (len(drive) != len(states) or drive.shape[1] != data.m):
                raise ValueError(f"u has shape {drive.shape}: must be ({len(states)}, {data.m})")
            if (rate is None) != (data.rates[0] is None):
                raise ValueError("x_dot: every trajectory needs its rates, or none")
            if rate is not None and rate.shape != states.shape:
                raise ValueError(f"x_dot has shape {rate.shape}: must be {states.shape}")
        return data

    def _time(self, t, samples, default_step):
        """Sample time in s, or one time per sample where these are not in equal steps."""
        if t is None:
            if default_step is None:
                raise TypeError("t is missing: the sample time, or one time per sample")
            return float(default_step)
        if np.ndim(t) == 0:
            t = float(as_seconds(t))
            if not 0 < t < np.inf:
                raise ValueError(f"t = {t}: the sample time must be positive and finite")
            return t
        t = as_seconds(t)
        if t.shape != (samples,):
            raise ValueError(f"t has shape {t.shape}: must be ({samples},), one time per sample")
        if samples < 2:
            raise ValueError("t: at least two times are needed")
        steps = np.diff(t)
        if not (steps > 0).all() or not np.isfinite(t).all():
            raise ValueError("t: times must rise")
        return float(steps.mean()) if np.abs(steps - steps.mean()).max() <= 1e-6 * steps.mean() else t

    # -- the classical chain: derivative, candidate matrix, sparse regression

    def _targets(self, data, method):
        """(variables, what the model has to give there), all trajectories together."""
        rows, targets = [], []
        for states, times, rate, drive in zip(data.states, data.times, data.rates, data.inputs):
            if self._map and rate is None:
                states, rate, drive = states[:-1], states[1:], None if drive is None else drive[:-1]
            elif rate is None:
                rate = np.asarray(method(states, times), dtype=float)
                states = np.asarray(getattr(method, "smoothed_x_", states), dtype=float)
            kept = np.isfinite(rate).all(axis=1)
            rows.append((states if drive is None else np.hstack([states, drive]))[kept])
            targets.append(rate[kept])
        return np.vstack(rows), np.vstack(targets)

    def _fit_chain(self, data, method, optimizer):
        variables, targets = self._targets(data, method)
        if len(variables) == 0:
            raise ValueError("no sample has a rate: the trajectories are too short for the differentiation")
        theta = self.library_.evaluate(variables, self._variables)
        if theta.shape[1] == 0:
            raise ValueError("the feature library has no terms")
        if not np.isfinite(theta).all():
            raise ValueError("a term of the feature library is not finite at some sample of the data")
        constant = self.features_.index("1") if "1" in self.features_ else None
        self.coefficients_ = regress(optimizer, theta, targets, constant)

    # -- use

    def predict(self, x, u=None):
        """Rates (maps: next values) at the rows of x; of a list of trajectories the list of theirs."""
        self._check_fitted()
        if _is_list(x):
            return [self.predict(part, drive) for part, drive in zip(x, _each(u, True, len(x)))]
        require_fitted_names(self, x)
        return self._rates(as_states(x, columns_only=self._columns_only), u)

    def _rates(self, x, u=None):
        if x.shape[1] != self.n_features_in_:
            raise ValueError(f"X has {x.shape[1]} features, but {type(self).__name__} is expecting {self.n_features_in_} features as input")
        drive = None if u is None else as_states(u, "u")
        if self._compiled is not None:
            return self._compiled.predict(x, drive)
        if (drive is None) != (not self.input_names_):
            raise ValueError(f"u: the model has {len(self.input_names_)} inputs")
        variables = x if drive is None else np.hstack([x, drive])
        return self.library_.evaluate(variables, self._variables) @ np.asarray(self.coefficients_).T

    def _score(self, data, method, metric, settings):
        """`metric(true, predicted)` of the rates of all trajectories together; R^2, mean over states, without one."""
        variables, targets = self._targets(data, method)
        found = self._rates(np.ascontiguousarray(variables[:, : data.n]), variables[:, data.n:] if data.m else None)
        if metric is not None:
            return metric(targets, found, **settings)
        spread = ((targets - targets.mean(axis=0)) ** 2).sum(axis=0)
        return float(np.mean(1 - ((targets - found) ** 2).sum(axis=0) / np.where(spread > 0, spread, 1)))

    def _start(self, x0):
        start = np.asarray(x0, dtype=float).ravel()
        if not np.isfinite(start).all():
            raise ValueError("x0 contains NaN or infinity")
        if start.shape != (self.n_features_in_,):
            raise ValueError(f"x0 has {start.size} values: the model has {self.n_features_in_} states")
        return start

    def _iterate(self, start, steps, drive):
        """A map from its start, `steps` samples."""
        out = np.empty((steps, start.size))
        out[0] = start
        for k in range(steps - 1):
            out[k + 1] = self._rates(out[k:k + 1], None if drive is None else drive[k:k + 1])[0]
        return out

    def _check_fitted(self):
        if not hasattr(self, "library_"):
            raise not_fitted(self)

    def coefficients(self):
        """states x features."""
        self._check_fitted()
        return self.coefficients_

    def get_feature_names(self):
        self._check_fitted()
        return self.features_

    def equations(self, precision=3):
        """Right-hand sides as text, one per state."""
        names, out = self._printed_features(), []
        for row in self.coefficients():
            shown = [(c, name) for c, name in zip(row, names) if (round(c, precision) if self._hides_zeros else c) != 0]
            out.append(" + ".join(f"{c:.{precision}f} {name}" for c, name in shown) or f"{0:.{precision}f}")
        return out

    def to_pandas(self):
        """Coefficients: one row per term, one column per equation."""
        import pandas

        return pandas.DataFrame(self.coefficients().T, index=pandas.Index(self.get_feature_names(), name="term"),
                                columns=[f"({name})[k+1]" if self._map else f"{name}'" for name in self.state_names_])

    def _printed_features(self):
        self._check_fitted()
        return self.features_

    def print(self, lhs=None, precision=3, **kwargs):
        """Prints the equations; `lhs`: the left-hand sides; further arguments are those of Python's print."""
        equations = self.equations(precision)
        left = list(lhs) if lhs is not None else [f"({name})[k+1]" if self._map else f"({name})'" for name in self.state_names_]
        if len(left) != len(equations):
            raise ValueError(f"lhs has {len(left)} entries: the model has {len(equations)} equations")
        for name, right in zip(left, equations):
            print(f"{name} = {right}", **kwargs)

    @property
    def complexity(self):
        """Number of terms."""
        return int(np.count_nonzero(self.coefficients()))


def _is_list(x):
    """A list of trajectories, not one trajectory as nested lists."""
    return isinstance(x, (list, tuple)) and len(x) > 0 and (
        np.ndim(x[0]) > 1 or any(hasattr(x[0], name) for name in ("toarray", "columns")))


def as_states(x, name="x", columns_only=False):
    """x as an array of samples x states; ValueError for anything else."""
    if hasattr(x, "toarray"):
        raise TypeError(f"sparse data is not supported: {name} must be dense")
    x = np.asarray(x)
    if x.dtype.kind == "c":
        raise ValueError(f"Complex data not supported: {name} has complex values")
    x = np.asarray(x, dtype=float)
    if x.ndim == 1 and columns_only:
        raise ValueError(f"{name} has shape {x.shape}: must be samples x states. Reshape your data with {name}.reshape(-1, 1) "
                         f"if it has one state, or {name}.reshape(1, -1) if it is one sample")
    if x.ndim == 1:
        x = x[:, None]
    if x.ndim != 2:
        raise ValueError(f"{name} has shape {x.shape}: must be samples x states")
    if x.shape[1] == 0:
        raise ValueError(f"{name} has 0 feature(s) (shape={x.shape}) while a minimum of 1 is required.")
    if not np.isfinite(x).all():
        raise ValueError(f"{name} contains NaN or infinity")
    return np.ascontiguousarray(x)


def as_seconds(t):
    """Times as numbers in s; dates count from the first one, which a cast would take for nanoseconds."""
    t = np.asarray(t)
    if t.dtype.kind == "M":
        t = t - t.flat[0]
    return t / np.timedelta64(1, "s") if t.dtype.kind == "m" else np.asarray(t, dtype=float)


def _each(value, several, count):
    """One value for each trajectory: of a list, or the same for all."""
    if not several or value is None:
        return [value] * count
    if isinstance(value, np.ndarray) and value.ndim < 3 or len(value) != count:
        raise ValueError(f"a list of {count} trajectories needs a list of {count} of each of t, u and x_dot, not {len(value)}")
    return list(value)


def drive_at(u, times):
    """Inputs at times: of a function of time, or one row per time; None without."""
    if callable(u):
        u = np.array([np.atleast_1d(np.squeeze(u(time))) for time in times])
    return None if u is None else as_states(u, "u")
