"""Fit, predict, score, simulate, look at the model."""
import io

import numpy as np

from .common import chaos, driven, DT, finds, idiom, lorenz, push, pushed, PUSHED, saddle, T, words

# -- fit


@idiom
def readme_example(ps):
    t, x = saddle()
    model = ps.SINDy()
    model.fit(x, t=t, feature_names=["x", "y"])
    out = io.StringIO()
    model.print(file=out)
    assert words(out.getvalue()) == "(x)' = -2.000 x (y)' = 1.000 y"


@idiom
def fit_with_a_sample_time(ps):
    finds(ps.SINDy().fit(lorenz(), t=DT))


@idiom
def fit_with_positional_times(ps):
    finds(ps.SINDy().fit(lorenz(), T))


@idiom
def fit_several_trajectories(ps):
    finds(ps.SINDy().fit([lorenz(), lorenz((5, -5, 20))[:1500]], t=DT))


@idiom
def fit_several_trajectories_with_their_times(ps):
    second = lorenz((5, -5, 20))[::2]
    finds(ps.SINDy().fit([lorenz(), second], t=[T, T[::2]]), tolerance=0.05)


@idiom
def fit_with_uneven_times(ps):
    kept = np.sort(np.random.default_rng(1).choice(len(T), 1500, replace=False))
    finds(ps.SINDy().fit(lorenz()[kept], t=T[kept]), tolerance=0.05)


@idiom
def fit_with_given_rates(ps):
    rates = np.array([chaos(0, z) for z in lorenz()])
    finds(ps.SINDy().fit(lorenz(), t=DT, x_dot=rates), tolerance=1e-6)


@idiom
def fit_several_trajectories_with_given_rates(ps):
    runs = [lorenz(), lorenz((5, -5, 20))]
    finds(ps.SINDy().fit(runs, t=DT, x_dot=[np.array([chaos(0, z) for z in x]) for x in runs]), tolerance=1e-6)


@idiom
def fit_with_an_input(ps):
    model = ps.SINDy(feature_library=ps.PolynomialLibrary(degree=1)).fit(driven(), t=DT, u=push(T))
    finds(model, PUSHED)


@idiom
def fit_several_trajectories_with_inputs(ps):
    model = ps.SINDy(feature_library=ps.PolynomialLibrary(degree=1))
    model.fit([driven(), driven()[500:]], t=DT, u=[push(T)[:, None], push(T)[500:, None]])
    finds(model, PUSHED)


@idiom
def feature_names_of_states_and_inputs(ps):
    model = ps.SINDy(feature_library=ps.PolynomialLibrary(degree=1))
    model.fit(driven(), t=DT, u=push(T), feature_names=["q", "v", "f"])
    assert model.get_feature_names() == ["1", "q", "v", "f"] and model.feature_names == ["q", "v", "f"]

# -- predict and score


@idiom
def predict(ps):
    model = ps.SINDy().fit(lorenz(), t=DT)
    assert np.allclose(model.predict(lorenz()), [chaos(0, z) for z in lorenz()], atol=0.3)


@idiom
def predict_a_list(ps):
    model = ps.SINDy().fit(lorenz(), t=DT)
    first, second = model.predict([lorenz(), lorenz()[:10]])
    assert first.shape == lorenz().shape and np.allclose(first[:10], second)


@idiom
def predict_with_inputs(ps):
    model = ps.SINDy().fit(driven(), t=DT, u=push(T))
    assert np.allclose(model.predict(driven(), u=push(T)), [pushed(t, z) for t, z in zip(T, driven())], atol=0.02)


@idiom
def score(ps):
    assert ps.SINDy().fit(lorenz(), t=DT).score(lorenz((5, -5, 20)), t=DT) > 0.999


@idiom
def score_with_a_metric(ps):
    from sklearn.metrics import mean_squared_error

    assert ps.SINDy().fit(lorenz(), t=DT).score(lorenz(), t=DT, metric=mean_squared_error) < 1


@idiom
def score_with_rates_and_settings_of_the_metric(ps):
    from sklearn.metrics import r2_score

    rates = np.array([chaos(0, z) for z in lorenz()])
    model = ps.SINDy().fit(lorenz(), t=DT)
    each = model.score(lorenz(), t=DT, x_dot=rates, metric=r2_score, multioutput="raw_values")
    assert each.shape == (3,) and (each > 0.999).all()


@idiom
def score_several_trajectories_with_inputs(ps):
    model = ps.SINDy().fit(driven(), t=DT, u=push(T))
    assert model.score([driven(), driven()], t=DT, u=[push(T)[:, None]] * 2) > 0.999

# -- simulate


@idiom
def simulate(ps):
    t, x = saddle()
    assert np.abs(ps.SINDy().fit(x, t=t).simulate(x[0], t) - x).max() < 1e-3


@idiom
def simulate_with_a_function_as_input(ps):
    model = ps.SINDy(feature_library=ps.PolynomialLibrary(degree=1)).fit(driven(), t=DT, u=push(T))
    assert np.abs(model.simulate(driven()[0], T, u=push) - driven()).max() < 1e-2


@idiom
def simulate_with_a_sampled_input(ps):
    model = ps.SINDy(feature_library=ps.PolynomialLibrary(degree=1)).fit(driven(), t=DT, u=push(T))
    free = model.simulate(driven()[0], T, u=push(T)[:, None])
    assert np.abs(free - driven()[: len(free)]).max() < 1e-2 and len(free) >= len(T) - 1


@idiom
def simulate_with_odeint(ps):
    t, x = saddle()
    assert np.abs(ps.SINDy().fit(x, t=t).simulate(x[0], t, integrator="odeint") - x).max() < 1e-3


@idiom
def simulate_with_settings_of_the_integrator(ps):
    t, x = saddle()
    free = ps.SINDy().fit(x, t=t).simulate(x[0], t, integrator_kws={"method": "RK45", "rtol": 1e-8, "atol": 1e-8})
    assert np.abs(free - x).max() < 1e-3

# -- look at the model


@idiom
def coefficients(ps):
    assert ps.SINDy().fit(lorenz(), t=DT).coefficients().shape == (3, 10)


@idiom
def equations(ps):
    t, x = saddle()
    assert [words(text) for text in ps.SINDy().fit(x, t=t).equations(precision=2)] == ["-2.00 x0", "1.00 x1"]


@idiom
def print_with_other_left_sides(ps):
    t, x = saddle()
    out = io.StringIO()
    ps.SINDy().fit(x, t=t).print(lhs=["dx/dt", "dy/dt"], precision=2, file=out)
    assert words(out.getvalue()) == "dx/dt = -2.00 x0 dy/dt = 1.00 x1"


@idiom
def get_feature_names(ps):
    names = ps.SINDy().fit(lorenz(), t=DT).get_feature_names()
    assert names == ["1", "x0", "x1", "x2", "x0^2", "x0 x1", "x0 x2", "x1^2", "x1 x2", "x2^2"]


@idiom
def complexity(ps):
    assert ps.SINDy().fit(lorenz(), t=DT).complexity == 7


@idiom
def coef_of_the_optimizer(ps):
    model = ps.SINDy(optimizer=ps.STLSQ(threshold=0.1)).fit(lorenz(), t=DT)
    assert np.array_equal(model.optimizer.coef_, model.coefficients())


@idiom
def other_coefficients_in_the_optimizer(ps):
    optimizer = ps.STLSQ()
    model = ps.SINDy(optimizer=optimizer).fit(lorenz(), t=DT)
    optimizer.coef_ = np.zeros((3, 10))
    assert not model.predict(lorenz()).any()
