# # Maps
#
# With `discrete_time=True` the model is a map: the next sample from this one.

# %%
import numpy as np
import whirl

x = np.empty(500)
x[0] = 0.3
for k in range(499):
    x[k + 1] = 3.8 * x[k] * (1 - x[k])

model = whirl.SINDy(discrete_time=True, feature_names=["x"]).fit(x[:, None])
model.print(precision=4)

# %%
# Two states: the Henon map.
state = np.empty((800, 2))
state[0] = 0.1, 0.1
for k in range(799):
    state[k + 1] = 1 - 1.4 * state[k, 0] ** 2 + state[k, 1], 0.3 * state[k, 0]
henon = whirl.SINDy(discrete_time=True, feature_names=["a", "b"]).fit(state)
henon.print(precision=4)

# %%
# `predict` is one step, `simulate` a free run. The map is chaotic: an error of one rounding grows by half at
# every step.
one = np.abs(henon.predict(state[:-1]) - state[1:]).max()
run = henon.simulate(state[0], 300)
apart = np.argmax(np.abs(run - state[:300]).max(axis=1) > 0.1)
print(f"one step: error {one:.1e}; free run: apart by 0.1 after {apart} steps")
assert one < 1e-8 and apart > 40
