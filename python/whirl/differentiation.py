"""Rates of sampled states: `method(x, t)`, t the sample time or one time per sample. Rows without a rate are NaN."""
import numpy as np

from . import _whirl
from ._base import BaseEstimator


class Differentiation(BaseEstimator):
    """Base: `method(x, t)` gives the rates of the samples x; where the states are smoothed too, they are `smoothed_x_`."""

    def __call__(self, x, t=1):
        return self._differentiate(x, t)

    def _differentiate(self, x, t=1):
        raise NotImplementedError


def _times(t, samples):
    """One time per sample, rising."""
    if np.ndim(t) == 0:
        return float(t) * np.arange(samples)
    t = np.asarray(t, dtype=float)
    if t.shape != (samples,):
        raise ValueError(f"t has shape {t.shape}: must be ({samples},), one time per sample")
    if not (np.diff(t) > 0).all():
        raise ValueError("t: times must rise")
    return t


def _step(t, samples, who):
    """The sample time of even times."""
    times = _times(t, samples)
    steps = np.diff(times)
    if len(steps) and np.abs(steps - steps.mean()).max() > 1e-3 * steps.mean():
        raise ValueError(f"{who} needs times in equal steps: take FiniteDifference, or resample")
    return steps.mean() if len(steps) else 1.0


def _weights(offsets, d):
    """Weights of the d-th derivative for rows of offsets from the point: exact for polynomials through all of them."""
    n, k = offsets.shape
    scale = np.abs(offsets).max(axis=1, keepdims=True)
    powers = (offsets / scale)[:, None, :] ** np.arange(k)[None, :, None]
    wanted = np.zeros((n, k, 1))
    wanted[:, d, 0] = np.prod(np.arange(1.0, d + 1)) / scale[:, 0] ** d
    return np.linalg.solve(powers, wanted)[:, :, 0]


class FiniteDifference(Differentiation):
    """The `d`-th derivative by differences of accuracy `order`, at even or uneven times; for records without noise.

    Centred inside; at the ends one-sided, or of the periodic signal (`periodic`), or NaN (`drop_endpoints`). `axis`: the
    one that t belongs to. Weights: Fornberg, Mathematics of Computation 51 (1988).
    """

    def __init__(self, order=4, d=1, axis=0, is_uniform=False, drop_endpoints=False, periodic=False):
        self.order = order
        self.d = d
        self.axis = axis
        self.is_uniform = is_uniform
        self.drop_endpoints = drop_endpoints
        self.periodic = periodic

    def _differentiate(self, x, t=1):
        for name in ("order", "d"):
            if int(getattr(self, name)) != getattr(self, name) or getattr(self, name) < 1:
                raise ValueError(f"{name} = {getattr(self, name)}: must be a whole number from 1")
        x = np.moveaxis(np.asarray(x, dtype=float), self.axis, 0)
        n, inner, outer = len(x), 2 * ((self.d + 1) // 2) - 1 + self.order, self.d + self.order
        times = _times(t, n)
        if n < max(inner, outer):
            raise ValueError(f"n_samples = {n}: differences of order {self.order} need at least {max(inner, outer)} samples")
        half = (inner - 1) // 2
        out = np.full(x.shape, np.nan)

        def apply(rows, stencil, offsets):
            out[rows] = np.einsum("nk,nk...->n...", _weights(offsets, self.d), x[stencil % n])

        rows = np.arange(half, n - (inner - 1 - half))
        stencil = rows[:, None] - half + np.arange(inner)
        apply(rows, stencil, times[stencil] - times[rows][:, None])
        ends = np.setdiff1d(np.arange(n), rows)
        if self.periodic and not self.drop_endpoints and len(ends):
            stencil = ends[:, None] - half + np.arange(inner)
            period = times[-1] - times[0] + (times[1] - times[0])
            apply(ends, stencil, times[stencil % n] + period * (stencil // n) - times[ends][:, None])
        elif not self.drop_endpoints and len(ends):
            stencil = np.where(ends < n // 2, 0, n - outer)[:, None] + np.arange(outer)
            apply(ends, stencil, times[stencil] - times[ends][:, None])
        return np.moveaxis(out, 0, self.axis)


class SmoothedFiniteDifference(FiniteDifference):
    """Differences of smoothed states. `smoother(x, **smoother_kws)`, by default scipy.signal.savgol_filter with a window
    of 11 samples and cubics; `save_smooth`: the smoothed states are used for the candidates too."""

    def __init__(self, smoother=None, smoother_kws=None, save_smooth=True, order=4, d=1, axis=0, is_uniform=False,
                 drop_endpoints=False, periodic=False):
        super().__init__(order, d, axis, is_uniform, drop_endpoints, periodic)
        self.smoother = smoother
        self.smoother_kws = smoother_kws
        self.save_smooth = save_smooth

    def _differentiate(self, x, t=1):
        smoother, settings = self.smoother, dict(self.smoother_kws or {})
        if smoother is None or getattr(smoother, "__name__", "") == "savgol_filter":
            from scipy.signal import savgol_filter

            smoother = savgol_filter
            settings = {"window_length": 11, "polyorder": 3, "axis": 0, **settings}
        smooth = smoother(np.asarray(x, dtype=float), **settings)
        self.smoothed_x_ = smooth if self.save_smooth else np.asarray(x, dtype=float)
        return super()._differentiate(smooth, t)


class SmoothingSpline(Differentiation):
    """The spline that leaves just the noise of each channel; its rates."""

    def _differentiate(self, x, t=1):
        x = np.asarray(x, dtype=float)
        dt = _step(t, len(x), "SmoothingSpline")
        pairs = [_whirl.smooth(column, dt) for column in x.reshape(len(x), -1).T]
        self.smoothed_x_ = np.column_stack([p[0] for p in pairs]).reshape(x.shape)
        return np.column_stack([p[1] for p in pairs]).reshape(x.shape)


class SpectralDerivative(Differentiation):
    """The `d`-th derivative of a periodic signal by its Fourier series."""

    def __init__(self, d=1, axis=0):
        self.d = d
        self.axis = axis

    def _differentiate(self, x, t=1):
        x = np.moveaxis(np.asarray(x, dtype=float), self.axis, 0)
        omega = 2 * np.pi * np.fft.rfftfreq(len(x), _step(t, len(x), "SpectralDerivative"))
        factor = (1j * omega) ** self.d
        if len(x) % 2 == 0 and self.d % 2:
            factor[-1] = 0  # the sine of the last frequency is not in the samples
        spectrum = np.fft.rfft(x, axis=0) * factor.reshape(-1, *[1] * (x.ndim - 1))
        return np.moveaxis(np.fft.irfft(spectrum, len(x), axis=0), 0, self.axis)
