"""The list of idioms, the data they use, and what counts as found."""
import functools

import numpy as np

IDIOMS = []


def idiom(function):
    IDIOMS.append(function)
    return function


def runge_kutta(rate, start, times):
    x = np.empty((len(times), len(start)))
    x[0] = start
    for k, h in enumerate(np.diff(times)):
        a = np.array(rate(times[k], x[k]))
        b = np.array(rate(times[k] + h / 2, x[k] + h / 2 * a))
        c = np.array(rate(times[k] + h / 2, x[k] + h / 2 * b))
        d = np.array(rate(times[k] + h, x[k] + h * c))
        x[k + 1] = x[k] + h / 6 * (a + 2 * b + 2 * c + d)
    return x


def chaos(t, z):
    return [10 * (z[1] - z[0]), z[0] * (28 - z[2]) - z[1], z[0] * z[1] - 8 / 3 * z[2]]


def push(t):
    return np.sin(3 * t) + 0.5 * np.cos(1.3 * t)


def pushed(t, z):
    return [z[1], -4 * z[0] - 0.3 * z[1] + push(t)]


DT = 2e-3
T = np.arange(0, 4, DT)
TRUTH = [{"x0": -10, "x1": 10}, {"x0": 28, "x1": -1, "x0 x2": -1}, {"x2": -8 / 3, "x0 x1": 1}]
PUSHED = [{"x1": 1}, {"x0": -4, "x1": -0.3, "u0": 1}]


@functools.lru_cache(None)
def lorenz(start=(-8, 8, 27)):
    return runge_kutta(chaos, start, T)


@functools.lru_cache(None)
def driven():
    return runge_kutta(pushed, [0.5, 0], T)


@functools.lru_cache(None)
def logistic():
    x = np.empty((400, 1))
    x[0] = 0.3
    for k in range(399):
        x[k + 1] = 3.8 * x[k] * (1 - x[k])
    return x


def saddle():
    t = np.linspace(0, 1, 100)
    return t, np.stack((3 * np.exp(-2 * t), 0.5 * np.exp(t)), axis=-1)


def words(text):
    return " ".join(text.split())


def finds(model, truth=TRUTH, tolerance=0.02, exactly=True):
    names = model.get_feature_names()
    for row, wanted in zip(model.coefficients(), truth):
        found = {name: c for name, c in zip(names, row) if abs(c) > 1e-10}
        assert not exactly or found.keys() == wanted.keys(), found
        for name, value in wanted.items():
            assert abs(found[name] - value) < tolerance * abs(value), (name, found[name])
