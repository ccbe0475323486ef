# # Several records, and the choice of settings
#
# A list of trajectories is fitted together. `whirl.SINDy` is a scikit-learn estimator: it clones, and the searches of scikit-learn work on it.

# %%
import numpy as np
import whirl

t = np.arange(2000) * 0.01


def rate(s):
    """Prey and predator."""
    return np.array([s[0] - s[0] * s[1], -s[1] + s[0] * s[1]])


def run(start, seed):
    x = np.empty((len(t), 2))
    x[0], h = start, t[1]
    for k in range(len(t) - 1):
        a = rate(x[k])
        b = rate(x[k] + h / 2 * a)
        c = rate(x[k] + h / 2 * b)
        x[k + 1] = x[k] + h / 6 * (a + 2 * b + 2 * c + rate(x[k] + h * c))
    return x + 0.02 * np.random.default_rng(seed).normal(size=x.shape)


runs = [run([1.5, 1], 61), run([0.4, 1], 62), run([2.5, 2], 63)]

# %%
# More records, narrower intervals.
for count in (1, 3):
    model = whirl.SINDy(feature_names=["x", "y"]).fit(runs[:count], t=t)
    print(f"{count} record(s):")
    for equation in model.model_.equations:
        print("   ", equation.lhs, "=", ", ".join(f"({e.coefficient}) {e.function}" for e in equation.terms))
assert model.complexity == 4

# %%
# The threshold of the classical chain, chosen by cross-validation over time.
from sklearn.model_selection import GridSearchCV, TimeSeriesSplit

chain = whirl.SINDy(optimizer=whirl.STLSQ(), differentiation_method=whirl.SmoothingSpline(), t_default=t[1])
search = GridSearchCV(chain, {"optimizer__threshold": [0.001, 0.2, 1.5]}, cv=TimeSeriesSplit(3))
search.fit(runs[2])
for settings, score in zip(search.cv_results_["params"], search.cv_results_["mean_test_score"]):
    print(f"threshold {settings['optimizer__threshold']:5.3f}: R2 {score:7.4f}")
search.best_estimator_.print()
assert search.best_params_["optimizer__threshold"] == 0.2
