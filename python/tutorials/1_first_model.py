# # A first model
#
# A record of the three states of the Lorenz system, sampled every 2 ms, and the equations that made it. Nothing is set: no threshold,
# no derivative, no smoothing.

# %%
import numpy as np
import whirl


def rk4(rate, start, t):
    """The states at times t of x' = rate(x)."""
    x = np.empty((len(t), len(start)))
    x[0], h = start, t[1] - t[0]
    for k in range(len(t) - 1):
        a = rate(x[k])
        b = rate(x[k] + h / 2 * a)
        c = rate(x[k] + h / 2 * b)
        x[k + 1] = x[k] + h / 6 * (a + 2 * b + 2 * c + rate(x[k] + h * c))
    return x


def lorenz(s):
    x, y, z = s
    return np.array([10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z])


t = np.arange(5000) * 2e-3
clean = rk4(lorenz, [-8, 8, 27.0], t)
record = clean + 0.1 * np.random.default_rng(1).normal(size=clean.shape)

# %%
# `fit` takes samples in rows and states in columns, and the sample time or the times.
model = whirl.SINDy(feature_names=["x", "y", "z"]).fit(record, t=t)
model.print()

# %%
# Every coefficient has a standard deviation; `low` and `high` are the ends of the 95 % interval.
for equation in model.model_.equations:
    for term in equation.terms:
        c = term.coefficient
        print(f"{equation.lhs:4} {term.function:4} {c.value:9.4f} +- {c.sd:.4f}   [{c.low:.4f}, {c.high:.4f}]")
print(model.model_.summary.trust)

# %%
# A free run from the first state. It follows for some seconds: the system is chaotic, the smallest error grows.
free = model.simulate(clean[0], t)
together = t[np.argmax(np.abs(free - clean).max(axis=1) > 1)]
print(f"apart by more than 1 after {together:.1f} s")
assert together > 2

# %%
from matplotlib import pyplot as plt

figure, axis = plt.subplots(figsize=(7, 2.6), layout="constrained")
axis.plot(t, record[:, 0], color="0.7", linewidth=1, label="record")
axis.plot(t, free[:, 0], linewidth=1, label="free run")
axis.set_xlabel("time [s]")
axis.set_ylabel("x")
axis.legend()
