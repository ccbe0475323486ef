# # Inputs
#
# A nonlinear spring driven by a measured force: x'' = -4 x - 0.3 v - 2 x^3 + f. The input is known, its coefficient is not.

# %%
import numpy as np
import whirl

t = np.arange(3000) * 5e-3
h = t[1]
force = np.sin(1.3 * t) + 0.6 * np.sin(2.9 * t + 1)


def response(force, start):
    x = np.empty((len(t), 2))
    x[0] = start
    for k in range(len(t) - 1):
        def rate(s, share):
            f = (1 - share) * force[k] + share * force[k + 1]
            return np.array([s[1], -4 * s[0] - 0.3 * s[1] - 2 * s[0] ** 3 + f])
        a = rate(x[k], 0)
        b = rate(x[k] + h / 2 * a, 0.5)
        c = rate(x[k] + h / 2 * b, 0.5)
        x[k + 1] = x[k] + h / 6 * (a + 2 * b + 2 * c + rate(x[k] + h * c, 1))
    return x


record = response(force, [0.5, 0]) + 0.01 * np.random.default_rng(5).normal(size=(len(t), 2))

# %%
model = whirl.SINDy(feature_library=whirl.PolynomialLibrary(3), feature_names=["x", "v", "f"])
model.fit(record, t=t, u=force)
model.print(precision=2)

# %%
# The test of a model is a record that it has not seen: another force, another start. `u` holds one row per time.
other = 0.8 * np.sin(0.9 * t) + 0.5 * np.cos(2.1 * t)
measured = response(other, [-0.3, 0.2])
free = model.simulate(measured[0], t, u=other)
error = np.sqrt(np.mean((free - measured) ** 2) / np.mean(measured**2))
print(f"free run of {t[-1]:.0f} s: relative rms error {100 * error:.2f} %")
assert error < 0.02

# %%
from matplotlib import pyplot as plt

figure, axis = plt.subplots(figsize=(7, 2.6), layout="constrained")
axis.plot(t, measured[:, 0], color="0.6", linewidth=2, label="measured")
axis.plot(t, free[:, 0], linewidth=1, label="free run")
axis.set_xlabel("time [s]")
axis.set_ylabel("x")
axis.legend()
