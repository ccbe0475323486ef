# # Noise
#
# The classical chain differentiates the record and thresholds a regression. Noise enters by the derivative. The default of whirl has no
# derivative: it fits integrals of the record (weak form), then free runs to the record itself (output error).

# %%
import numpy as np
import whirl

t = np.arange(4000) * 5e-3
state = np.empty((len(t), 2))
state[0] = 2.0, 0.0


def oscillator(s):
    return np.array([s[1], (1 - s[0] ** 2) * s[1] - s[0]])  # van der Pol


h = t[1]
for k in range(len(t) - 1):
    a = oscillator(state[k])
    b = oscillator(state[k] + h / 2 * a)
    c = oscillator(state[k] + h / 2 * b)
    state[k + 1] = state[k] + h / 6 * (a + 2 * b + 2 * c + oscillator(state[k] + h * c))
truth = {"x": {"v": 1}, "v": {"x": -1, "v": 1, "x^2 v": -1}}

# %%
# The same record with more and more noise, three ways. The number is the largest error of a true coefficient; "+n" are terms too many,
# "-n" terms that are missing.


def errors(model):
    worst, extra, missing = 0.0, 0, 0
    for row, wanted in zip(model.coefficients(), truth.values()):
        found = {name: c for name, c in zip(model.get_feature_names(), row) if c != 0}
        extra += len(found.keys() - wanted.keys())
        missing += len(wanted.keys() - found.keys())
        worst = max([worst] + [abs(found.get(name, 0) - value) for name, value in wanted.items()])
    return f"{worst:.4f} +{extra} -{missing}"


ways = {
    "differences and STLSQ": dict(optimizer=whirl.STLSQ(0.2), differentiation_method=whirl.FiniteDifference()),
    "spline and STLSQ": dict(optimizer=whirl.STLSQ(0.2), differentiation_method=whirl.SmoothingSpline()),
    "default": dict(),
}
print(f"{'noise':>6}  " + "  ".join(f"{name:>22}" for name in ways))
for level in (0.001, 0.01, 0.05):
    record = state + level * np.random.default_rng(3).normal(size=state.shape)
    row = []
    for settings in ways.values():
        model = whirl.SINDy(feature_library=whirl.PolynomialLibrary(3), feature_names=["x", "v"], **settings)
        row.append(errors(model.fit(record, t=t)))
    print(f"{level:6.3f}  " + "  ".join(f"{text:>22}" for text in row))
assert row[-1].endswith("+0 -0")
