"""Right-hand sides that examples use: f(t, state) -> list of rates."""
import numpy as np


def lorenz(t, x, sigma=10, beta=2.66667, rho=28):
    """Lorenz 1963."""
    return [sigma * (x[1] - x[0]), x[0] * (rho - x[2]) - x[1], x[0] * x[1] - beta * x[2]]


def lorenz_u(t):
    """Two inputs for lorenz_control."""
    return np.column_stack([np.sin(2 * t) ** 2, np.sin(8 * t) ** 2]) if np.ndim(t) else np.array([[np.sin(2 * t) ** 2, np.sin(8 * t) ** 2]])


def lorenz_control(t, x, u_fun, sigma=10, beta=2.66667, rho=28):
    """Lorenz with an input that adds to the first rate and one that is taken off the second."""
    u = np.ravel(u_fun(t))
    first, second, third = lorenz(t, x, sigma, beta, rho)
    return [first + u[0], second - u[1], third]


def linear_damped_SHO(t, x):
    """A linear damped oscillator."""
    return [-0.1 * x[0] + 2 * x[1], -2 * x[0] - 0.1 * x[1]]


def cubic_damped_SHO(t, x):
    """The same with cubes."""
    return [-0.1 * x[0] ** 3 + 2 * x[1] ** 3, -2 * x[0] ** 3 - 0.1 * x[1] ** 3]


def linear_3D(t, x):
    """A linear damped oscillator and a decay."""
    return [-0.1 * x[0] + 2 * x[1], -2 * x[0] - 0.1 * x[1], -0.3 * x[2]]


def van_der_pol(t, x, p=(0.5,)):
    """van der Pol."""
    return [x[1], p[0] * (1 - x[0] ** 2) * x[1] - x[0]]


def duffing(t, x, p=(0.2, 0.05, 1)):
    """Duffing without a force."""
    return [x[1], -p[0] * x[1] - p[1] * x[0] - p[2] * x[0] ** 3]


def lotka(t, x, p=(1, 10)):
    """Lotka and Volterra."""
    return [p[0] * x[0] - p[1] * x[0] * x[1], p[1] * x[0] * x[1] - 2 * p[0] * x[1]]


def rossler(t, x, p=(0.2, 0.2, 5.7)):
    """Rossler 1976."""
    return [-x[1] - x[2], x[0] + p[0] * x[1], p[1] + (x[0] - p[2]) * x[2]]


def logistic_map(x, mu):
    """The logistic map."""
    return mu * x * (1 - x)
