"""Differentiation under the names, arguments and defaults of PySINDy."""
import numpy as np

from ... import differentiation as _own
from ...differentiation import Differentiation, SpectralDerivative  # noqa: F401

BaseDifferentiation = Differentiation


class FiniteDifference(_own.FiniteDifference):
    __doc__ = _own.FiniteDifference.__doc__

    def __init__(self, order=2, d=1, axis=0, is_uniform=False, drop_endpoints=False, periodic=False):
        super().__init__(order, d, axis, is_uniform, drop_endpoints, periodic)


class SmoothedFiniteDifference(_own.SmoothedFiniteDifference):
    __doc__ = _own.SmoothedFiniteDifference.__doc__

    def __init__(self, smoother=None, smoother_kws=None, save_smooth=True, order=2, d=1, axis=0, is_uniform=False,
                 drop_endpoints=False, periodic=False):
        super().__init__(smoother, smoother_kws, save_smooth, order, d, axis, is_uniform, drop_endpoints, periodic)


class SINDyDerivative(Differentiation):
    """Derivatives by `kind`: "finite_difference" (k: half the width), "savitzky_golay" (left, right in s, order),
    "spline" (s: sum of squares left, order), "spectral". The other kinds of the package `derivative` are not here."""

    KINDS = {"finite_difference": {"k": 1, "periodic": False}, "savitzky_golay": {"left": None, "right": None, "order": 3},
             "spline": {"s": None, "order": 3, "periodic": False}, "spectral": {}}

    def __init__(self, axis=0, save_smooth=True, **kwargs):
        self.axis = axis
        self.save_smooth = save_smooth
        self.kwargs = kwargs

    def get_params(self, deep=True):
        return {"axis": self.axis, "save_smooth": self.save_smooth, **self.kwargs}

    def set_params(self, **params):
        for name, value in params.items():
            if name in ("axis", "save_smooth"):
                setattr(self, name, value)
            else:
                self.kwargs[name] = value
        return self

    def _differentiate(self, x, t=1):
        settings = dict(self.kwargs)
        kind = settings.pop("kind", None)
        if kind not in self.KINDS:
            raise NotImplementedError(f"kind = {kind!r}: must be one of {', '.join(self.KINDS)}; whirl.SmoothingSpline() finds "
                                      "its smoothing by the noise")
        unknown = set(settings) - set(self.KINDS[kind])
        if unknown:
            raise TypeError(f"{', '.join(sorted(unknown))}: no setting of kind {kind!r}, which has {list(self.KINDS[kind])}")
        settings = {**self.KINDS[kind], **settings}
        x = np.moveaxis(np.asarray(x, dtype=float), self.axis, 0)
        times = _own._times(t, len(x))
        flat, out = x.reshape(len(x), -1), np.empty((len(x), x[0].size))
        smooth = flat.copy()
        for j, column in enumerate(flat.T):
            smooth[:, j], out[:, j] = getattr(self, "_" + kind)(column, times, settings)
        self.smoothed_x_ = np.moveaxis(smooth.reshape(x.shape) if self.save_smooth else x, 0, self.axis)
        return np.moveaxis(out.reshape(x.shape), 0, self.axis)

    @staticmethod
    def _finite_difference(x, t, s):
        return x, FiniteDifference(order=2 * s["k"], periodic=s["periodic"])(x, t)

    @staticmethod
    def _spectral(x, t, s):
        return x, SpectralDerivative()(x, t)

    @staticmethod
    def _spline(x, t, s):
        from scipy.interpolate import splev, splrep

        spline = splrep(t, x, k=s["order"], s=s["s"], per=s["periodic"])
        return splev(t, spline), splev(t, spline, der=1)

    @staticmethod
    def _savitzky_golay(x, t, s):
        if s["left"] is None or s["right"] is None:
            raise TypeError("savitzky_golay needs left and right, the widths of the window in s")
        value, rate = np.empty_like(x), np.empty_like(x)
        for i, now in enumerate(t):
            first, last = np.searchsorted(t, [now - s["left"], now + s["right"]], side="left")
            last = min(last + (last < len(t) and t[last] <= now + s["right"]), len(t))
            if last - first <= s["order"]:
                raise ValueError(f"savitzky_golay: {last - first} samples in the window about t = {now:g} s, "
                                 f"{s['order'] + 1} are needed: widen left and right")
            fit = np.polynomial.Polynomial.fit(t[first:last], x[first:last], s["order"])
            value[i], rate[i] = fit(now), fit.deriv()(now)
        return value, rate
