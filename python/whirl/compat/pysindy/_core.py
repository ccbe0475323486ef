"""SINDy and DiscreteSINDy with the arguments of PySINDy 2.1."""
import warnings

import numpy as np

from ..._model import SparseModel, as_seconds, as_states, drive_at
from ...libraries import PolynomialLibrary
from ...optimizers import STLSQ
from ._earlier import FIT, MODEL, refuses
from .differentiation import FiniteDifference


class _Common(SparseModel):
    _hides_zeros = True

    def _begin(self, data, feature_names):
        n, m = data.n, data.m
        internal = [f"x{i}" for i in range(n)] + [f"u{i}" for i in range(m)]
        if feature_names is not None and len(feature_names) != n + m:
            raise ValueError(f"{len(feature_names)} feature_names: must be {n + m}, of states and inputs")
        shown = list(feature_names) if feature_names is not None else internal
        self._variables = internal  # the names inside formulas; those shown may be any text
        self.feature_names = self.feature_names_ = shown
        self.state_names_, self.input_names_ = shown[:n], shown[n:]
        self.n_features_in_, self.n_control_features_ = n, m
        self.library_ = self.feature_library.fit(np.empty((1, n + m)))
        self.features_ = self.library_.names(shown)
        self.n_output_features_ = len(self.features_)

    @property
    def coefficients_(self):
        return self.optimizer.coef_  # as it is now: users set it to look at other models

    @coefficients_.setter
    def coefficients_(self, value):
        self.optimizer.coef_ = value

    def _inputs(self, u):
        if u is None and self.n_control_features_:
            raise TypeError("the model was fitted with inputs: u is needed")
        if u is not None and not self.n_control_features_:
            warnings.warn("u is left out: the model was fitted without inputs", stacklevel=3)
            return None
        return u

    def predict(self, x, u=None):
        """Rates (maps: next values) at the rows of x; of a list of trajectories the list of theirs."""
        self._check_fitted()
        return super().predict(x, self._inputs(u))


class SINDy(_Common):
    """Sparse identification of x' = f(x, u): differentiation, candidate matrix, sparse regression.

    Defaults: STLSQ(), PolynomialLibrary(), FiniteDifference(). `fit(x, t, x_dot=None, u=None, feature_names=None)`.
    """

    @refuses(MODEL)
    def __init__(self, optimizer=None, feature_library=None, differentiation_method=None):
        self.optimizer = optimizer if optimizer is not None else STLSQ()
        self.feature_library = feature_library if feature_library is not None else PolynomialLibrary()
        self.differentiation_method = differentiation_method if differentiation_method is not None else FiniteDifference()

    @refuses(FIT)
    def fit(self, x, t, x_dot=None, u=None, feature_names=None):
        """x: samples x states, or a list of trajectories; t: sample time, times (even or not), or a list of times;
        x_dot: measured rates; u: inputs, one row per sample; feature_names: of states and inputs."""
        data = self._trajectories(x, t, x_dot, u)
        self._begin(data, feature_names)
        self._fit_chain(data, self.differentiation_method, self.optimizer)
        return self

    def score(self, x, t, x_dot=None, u=None, metric=None, **metric_kws):
        """`metric(true, predicted, **metric_kws)` of the rates, by default R^2."""
        self._check_fitted()
        return self._score(self._trajectories(x, t, x_dot, self._inputs(u)), self.differentiation_method, metric, metric_kws)

    def differentiate(self, x, t=1):
        """Rates by the differentiation_method; of a list of trajectories the list of theirs."""
        if isinstance(x, (list, tuple)) and np.ndim(x[0]) > 1:
            times = t if isinstance(t, (list, tuple)) else [t] * len(x)
            return [self.differentiation_method(part, when) for part, when in zip(x, times)]
        return self.differentiation_method(as_states(x), t)

    def simulate(self, x0, t, u=None, integrator="solve_ivp", interpolator=None, integrator_kws=None, interpolator_kws=None):
        """Simulation from x0 at the times t by scipy's "solve_ivp" (default: LSODA, rtol = atol = 1e-12) or "odeint".

        u: a function of time, or one row per time, between which `interpolator` (default: scipy's interp1d) runs."""
        from scipy.integrate import odeint, solve_ivp

        self._check_fitted()
        times, start, u = as_seconds(t), self._start(x0), self._inputs(u)
        if times.ndim != 1 or len(times) < 2:
            raise ValueError("t: at least two times are needed")
        if u is None or callable(u):
            inputs = u
        else:
            inputs = _between(times, as_states(u, "u"), interpolator, interpolator_kws)

        def rate(when, state):
            return self._rates(np.asarray(state)[None, :], drive_at(inputs, [when]))[0]

        if integrator == "solve_ivp":
            settings = {"method": "LSODA", "rtol": 1e-12, "atol": 1e-12} if integrator_kws is None else integrator_kws
            return solve_ivp(rate, (times[0], times[-1]), start, t_eval=times, **settings).y.T
        if integrator == "odeint":
            settings = {"rtol": 1e-12, "atol": 1e-12} if integrator_kws is None or "method" in integrator_kws else integrator_kws
            return odeint(rate, start, times, tfirst=True, **settings)
        raise ValueError(f"integrator = {integrator!r}: must be 'solve_ivp' or 'odeint'")


class DiscreteSINDy(_Common):
    """Sparse identification of maps x[k+1] = f(x[k], u[k])."""

    _map = True

    @refuses(MODEL)
    def __init__(self, optimizer=None, feature_library=None):
        self.optimizer = optimizer if optimizer is not None else STLSQ()
        self.feature_library = feature_library if feature_library is not None else PolynomialLibrary()

    @refuses(FIT)
    def fit(self, x, t, x_next=None, u=None, feature_names=None):
        """x: samples x states, or a list of trajectories; x_next: the values one step later where x is in no order; t is
        not used."""
        data = self._trajectories(x, 1, x_next, u)
        self._begin(data, feature_names)
        self._fit_chain(data, None, self.optimizer)
        return self

    def score(self, x, t, u=None, x_next=None, metric=None, **metric_kws):
        """`metric(true, predicted, **metric_kws)` of the next values, by default R^2."""
        self._check_fitted()
        return self._score(self._trajectories(x, 1, x_next, self._inputs(u)), None, metric, metric_kws)

    def simulate(self, x0, t, u=None, stop_condition=None):
        """`t` samples from x0; u: one row per step, or a function of the step; ends early where stop_condition(x)."""
        self._check_fitted()
        if int(t) != t or t < 1:
            raise ValueError(f"t = {t}: must be a whole number of samples, at least 1")
        start = self._start(x0)
        path = self._iterate(start, int(t), drive_at(self._inputs(u), range(int(t))))
        if stop_condition is not None:
            ends = [k for k, x in enumerate(path) if k and stop_condition(x)]
            path = path[: ends[0] + 1] if ends else path
        return path

    def _printed_features(self):
        self._check_fitted()
        return self.library_.names([f"{name}[k]" for name in self.feature_names])


def _between(times, rows, interpolator, settings):
    if interpolator is not None:
        return interpolator(times, rows, **(settings or {}))
    from scipy.interpolate import interp1d

    return interp1d(times, rows, **{"axis": 0, "kind": "cubic", "fill_value": "extrapolate", **(settings or {})})
