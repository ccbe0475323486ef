# # Regressions
#
# The regression of the classical chain is an argument. Every method of `whirl.regression_methods()` takes the same candidate matrix; so does
# any object of your own with `solve(theta, y)`.

# %%
import numpy as np
import whirl

rng = np.random.default_rng(4)
x = rng.uniform(-1, 1, size=(400, 3))
rates = np.column_stack([1.5 * x[:, 0] - x[:, 1] * x[:, 2], -2 * x[:, 1], 0.8 * x[:, 0] ** 2 - x[:, 2]])
measured = rates + 0.05 * rng.normal(size=rates.shape)

# %%
# With measured rates (`x_dot`) nothing is differentiated: this is the regression alone, on 10 candidates per equation, 5 of 30 true.
for method in whirl.regression_methods():
    model = whirl.SINDy(optimizer=whirl.SparseRegression(method)).fit(x, t=1e-3, x_dot=measured)
    print(f"{method:12} {model.complexity:3} terms, R2 of the true rates {model.score(x, x_dot=rates):.5f}")


# %%
# One of your own: the terms that survive in nine of ten bootstrap samples.
class Bootstrap:
    def solve(self, theta, y):
        draws = np.random.default_rng(0)
        kept = np.zeros(theta.shape[1])
        for _ in range(50):
            rows = draws.integers(len(y), size=len(y))
            kept += whirl.STLSQ(threshold=0.2).solve(theta[rows], y[rows]) != 0
        support = kept >= 45
        out = np.zeros(theta.shape[1])
        out[support] = np.linalg.lstsq(theta[:, support], y, rcond=None)[0]
        return out


model = whirl.SINDy(optimizer=Bootstrap()).fit(x, t=1e-3, x_dot=measured)
model.print()
assert model.complexity == 5
