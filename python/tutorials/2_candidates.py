# # Candidate terms
#
# A library says which terms an equation may have. Libraries add (terms of both) and multiply (every product).

# %%
import numpy as np
import whirl

print(whirl.PolynomialLibrary(2).names(["x", "v"]))
print((whirl.PolynomialLibrary(1, include_bias=False) + whirl.FourierLibrary(1)).names(["angle"]))
print(whirl.TermLibrary(["v*abs(v)", "x^3"]).names(["x", "v"]))

# %%
# A pendulum with air drag: x'' = -9.81/0.5 sin(x) - 0.3 v |v|.
t = np.arange(4000) * 2.5e-3
state = np.empty((len(t), 2))
state[0] = 2.5, 0.0


def rate(s):
    return np.array([s[1], -19.62 * np.sin(s[0]) - 0.3 * s[1] * abs(s[1])])


h = t[1]
for k in range(len(t) - 1):
    a = rate(state[k])
    b = rate(state[k] + h / 2 * a)
    c = rate(state[k] + h / 2 * b)
    state[k + 1] = state[k] + h / 6 * (a + 2 * b + 2 * c + rate(state[k] + h * c))
record = state + np.random.default_rng(2).normal(size=state.shape) * [0.005, 0.02]

# %%
# Monomials up to the third degree find something that is no pendulum. The statement of trust says so, and so does the noise that is left.
names = ["x", "v"]
cubic = whirl.SINDy(feature_library=whirl.PolynomialLibrary(3), feature_names=names).fit(record, t=t)
cubic.print()
print("chi-square per sample:", round(cubic.model_.summary.chi_square, 1))

# %%
# With the right terms among the candidates the equation is found, and chi-square is 1.
library = whirl.TermLibrary(["x", "v", "x^3", "sin(x)", "cos(x)", "v*abs(v)", "v^3"])
model = whirl.SINDy(feature_library=library, feature_names=names).fit(record, t=t)
model.print(precision=2)
print("chi-square per sample:", round(model.model_.summary.chi_square, 2))
assert model.model_.summary.chi_square < 1.2

# %%
# A Python function is a candidate too. The fit is then the classical one: derivative, candidate matrix, sparse regression.
own = whirl.CustomLibrary([lambda a: np.sin(a), lambda a: a * np.abs(a)], [lambda a: f"sin({a})", lambda a: f"{a}|{a}|"])
chain = whirl.SINDy(feature_library=whirl.PolynomialLibrary(1, include_bias=False) + own, feature_names=names,
                    optimizer=whirl.STLSQ(threshold=0.1)).fit(record, t=t)
chain.print(precision=2)
