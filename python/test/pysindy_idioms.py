"""Sixty idioms of a PySINDy 2.1 notebook, written from its public documentation; `ps` is the package under that name.

Each is a function of ps whose assertions hold for PySINDy. As a program it counts those that run:

    python3 pysindy_idioms.py whirl.compat.pysindy
"""
import functools
import io
import pickle
import warnings

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


# -- optimizers


@idiom
def stlsq_that_prints_its_steps(ps):
    finds(ps.SINDy(optimizer=ps.STLSQ(threshold=0.2, alpha=0.5, max_iter=30, verbose=True)).fit(lorenz(), t=DT))


@idiom
def stlsq_on_normalized_columns(ps):
    finds(ps.SINDy(optimizer=ps.STLSQ(threshold=1.0, normalize_columns=True)).fit(lorenz(), t=DT), exactly=False)


@idiom
def history_of_an_optimizer(ps):
    optimizer = ps.STLSQ(threshold=0.1)
    ps.SINDy(optimizer=optimizer).fit(lorenz(), t=DT)
    assert np.asarray(optimizer.history_).ndim == 3 and np.asarray(optimizer.history_).shape[1:] == (3, 10)


@idiom
def sr3_with_the_weight_of_a_threshold(ps):
    weight = ps.SR3.calculate_l0_weight(0.1, 1)
    finds(ps.SINDy(optimizer=ps.SR3(reg_weight_lam=weight, regularizer="l0")).fit(lorenz(), t=DT))


@idiom
def sr3_with_l1(ps):
    finds(ps.SINDy(optimizer=ps.SR3(reg_weight_lam=0.01, regularizer="l1", relax_coeff_nu=1, max_iter=100)).fit(lorenz(), t=DT),
          exactly=False)


@idiom
def sr3_with_a_weight_for_each_coefficient(ps):
    weight = np.full((3, 10), ps.SR3.calculate_l0_weight(0.1, 1))
    weight[:, 0] = 1e3
    model = ps.SINDy(optimizer=ps.SR3(reg_weight_lam=weight, regularizer="weighted_l0")).fit(lorenz(), t=DT)
    finds(model)
    assert not model.coefficients()[:, 0].any()


@idiom
def sr3_that_trims_outliers(ps):
    rng = np.random.default_rng(3)
    spoiled, rates = lorenz().copy(), np.array([chaos(0, z) for z in lorenz()])
    spoiled[rng.choice(len(T), 20, replace=False)] += 30 * rng.normal(size=(20, 3))
    model = ps.SINDy(optimizer=ps.SR3(trimming_fraction=0.1)).fit(spoiled, t=DT, x_dot=rates)
    finds(model, tolerance=0.1, exactly=False)


@idiom
def stepwise_regression(ps):
    finds(ps.SINDy(optimizer=ps.SSR(alpha=0.05, criteria="model_residual", kappa=1e-3)).fit(lorenz(), t=DT), exactly=False)


@idiom
def forward_regression(ps):
    finds(ps.SINDy(optimizer=ps.FROLS(alpha=0.05, kappa=1e-7)).fit(lorenz(), t=DT), exactly=False)


@idiom
def lasso_of_scikit_learn(ps):
    from sklearn.linear_model import Lasso

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = ps.SINDy(optimizer=Lasso(alpha=0.1, max_iter=20000, fit_intercept=False)).fit(lorenz(), t=DT)
    assert model.score(lorenz(), t=DT) > 0.9 and np.array_equal(model.coefficients(), model.optimizer.coef_)


@idiom
def matching_pursuit_of_scikit_learn(ps):
    from sklearn.linear_model import OrthogonalMatchingPursuit

    model = ps.SINDy(optimizer=OrthogonalMatchingPursuit(n_nonzero_coefs=3, fit_intercept=False)).fit(lorenz(), t=DT)
    assert model.score(lorenz(), t=DT) > 0.8
    assert (np.count_nonzero(model.coefficients(), axis=1) == 3).all()


@idiom
def ensemble_of_samples(ps):
    np.random.seed(1)
    optimizer = ps.EnsembleOptimizer(ps.STLSQ(threshold=0.1), bagging=True, n_subset=1000, n_models=10)
    finds(ps.SINDy(optimizer=optimizer).fit(lorenz(), t=DT))
    assert np.std(optimizer.coef_list, axis=0).shape == (3, 10)


@idiom
def ensemble_of_libraries(ps):
    np.random.seed(1)
    optimizer = ps.EnsembleOptimizer(ps.STLSQ(threshold=0.1), library_ensemble=True, n_models=30,
                                     ensemble_aggregator=lambda models: np.median(models, axis=0))
    finds(ps.SINDy(optimizer=optimizer).fit(lorenz(), t=DT), exactly=False)


@idiom
def equality_constraints(ps):
    lhs, rhs = np.zeros((1, 30)), np.zeros(1)
    lhs[0, 1], lhs[0, 2] = 1, 1  # the first equation depends on x1 - x0 alone
    optimizer = ps.ConstrainedSR3(constraint_lhs=lhs, constraint_rhs=rhs, equality_constraints=True)
    row = ps.SINDy(optimizer=optimizer).fit(lorenz(), t=DT).coefficients()[0]
    assert abs(row[1] + row[2]) < 1e-6


# -- libraries


@idiom
def polynomials_without_mixed_products(ps):
    library = ps.PolynomialLibrary(degree=3, include_interaction=False, include_bias=False)
    model = ps.SINDy(feature_library=library).fit(lorenz(), t=DT)
    assert model.get_feature_names() == ["x0", "x1", "x2", "x0^2", "x1^2", "x2^2", "x0^3", "x1^3", "x2^3"]


@idiom
def fourier_terms(ps):
    model = ps.SINDy(feature_library=ps.FourierLibrary(n_frequencies=2, include_cos=False)).fit(lorenz(), t=DT)
    assert model.get_feature_names()[:2] == ["sin(1 x0)", "sin(1 x1)"] and model.coefficients().shape == (3, 6)


@idiom
def own_functions_with_names(ps):
    functions = [lambda x: x, lambda x, y: x * y]
    library = ps.CustomLibrary(library_functions=functions, function_names=[lambda x: x, lambda x, y: x + " " + y])
    finds(ps.SINDy(feature_library=library).fit(lorenz(), t=DT))


@idiom
def own_functions_without_names(ps):
    library = ps.CustomLibrary(library_functions=[lambda x: x, lambda x, y: x * y])
    model = ps.SINDy(feature_library=library).fit(lorenz(), t=DT, feature_names=["x", "y", "z"])
    assert model.get_feature_names() == ["f0(x)", "f0(y)", "f0(z)", "f1(x,y)", "f1(x,z)", "f1(y,z)"]


@idiom
def sum_of_libraries(ps):
    library = ps.IdentityLibrary() + ps.FourierLibrary()
    model = ps.SINDy(feature_library=library).fit(saddle()[1], t=saddle()[0], feature_names=["x", "y"])
    assert model.get_feature_names() == ["x", "y", "sin(1 x)", "cos(1 x)", "sin(1 y)", "cos(1 y)"]


@idiom
def product_of_libraries(ps):
    library = ps.IdentityLibrary() * ps.FourierLibrary(include_cos=False)
    model = ps.SINDy(feature_library=library).fit(saddle()[1], t=saddle()[0])
    assert model.get_feature_names() == ["x0 sin(1 x0)", "x0 sin(1 x1)", "x1 sin(1 x0)", "x1 sin(1 x1)"]


@idiom
def generalized_library(ps):
    library = ps.GeneralizedLibrary([ps.PolynomialLibrary(degree=2, include_bias=False), ps.FourierLibrary(include_cos=False)],
                                    tensor_array=[[1, 1]], inputs_per_library=[[0, 1], [2]])
    names = ps.SINDy(feature_library=library).fit(lorenz(), t=DT, feature_names=["x", "y", "z"]).get_feature_names()
    assert names[:6] == ["x", "y", "x^2", "x y", "y^2", "sin(1 z)"] and names[6] == "x sin(1 z)" and len(names) == 11


@idiom
def library_as_a_transformer(ps):
    library = ps.PolynomialLibrary(degree=2)
    theta = np.asarray(library.fit_transform(lorenz()))
    assert theta.shape == (len(T), 10) and np.allclose(theta[:, 5], lorenz()[:, 0] * lorenz()[:, 1])
    assert library.get_feature_names(["a", "b", "c"])[5] == "a b" and library.n_output_features_ == 10


@idiom
def partial_differential_equation(ps):
    space = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    u = np.array([[np.exp(-0.5 * t) * np.sin(s) for t in T[::20]] for s in space])[:, :, None]
    library = ps.PDELibrary(function_library=ps.PolynomialLibrary(degree=1, include_bias=False), derivative_order=2,
                            spatial_grid=space)
    assert ps.SINDy(feature_library=library, optimizer=ps.STLSQ(threshold=0.1)).fit(u, t=T[20]).complexity > 0


@idiom
def weak_form_of_a_partial_differential_equation(ps):
    library = ps.WeakPDELibrary(function_library=ps.PolynomialLibrary(degree=2), spatiotemporal_grid=T, K=100)
    finds(ps.SINDy(feature_library=library).fit(lorenz(), t=DT), exactly=False, tolerance=0.05)


# -- differentiation


@idiom
def differences_of_higher_order_without_the_ends(ps):
    finds(ps.SINDy(differentiation_method=ps.FiniteDifference(order=4, drop_endpoints=True)).fit(lorenz(), t=DT), tolerance=1e-3)


@idiom
def smoothed_differences(ps):
    noisy = lorenz() + 0.01 * np.random.default_rng(5).normal(size=lorenz().shape)
    method = ps.SmoothedFiniteDifference(smoother_kws={"window_length": 15})
    finds(ps.SINDy(differentiation_method=method).fit(noisy, t=DT), exactly=False, tolerance=0.1)


@idiom
def differentiation_called_by_itself(ps):
    model = ps.SINDy().fit(lorenz(), t=DT)
    rates = np.array([chaos(0, z) for z in lorenz()])
    assert np.allclose(model.differentiation_method(lorenz(), t=DT), rates, atol=1)
    assert np.allclose(ps.FiniteDifference(order=4)._differentiate(lorenz(), T)[5:-5], rates[5:-5], atol=0.05)


# -- maps


@idiom
def discrete_time(ps):
    model = ps.DiscreteSINDy(optimizer=ps.STLSQ(threshold=0.1)).fit(logistic(), t=1, feature_names=["x"])
    assert np.allclose(model.coefficients(), [[0, 3.8, -3.8]], atol=1e-6)
    out = io.StringIO()
    model.print(precision=2, file=out)
    assert words(out.getvalue()) == "(x)[k+1] = 3.80 x[k] + -3.80 x[k]^2"
    assert np.allclose(model.simulate(logistic()[0], 20), logistic()[:20], atol=1e-4)


# -- scikit-learn


@idiom
def grid_search(ps):
    from sklearn.model_selection import GridSearchCV, TimeSeriesSplit

    search = GridSearchCV(ps.SINDy(optimizer=ps.STLSQ()), {"optimizer__threshold": [0.1, 12.0]}, cv=TimeSeriesSplit(3))
    search.fit(lorenz(), T)
    assert search.best_params_ == {"optimizer__threshold": 0.1}
    finds(search.best_estimator_)


@idiom
def clone_and_pickle(ps):
    from sklearn.base import clone

    model = ps.SINDy(optimizer=ps.STLSQ(threshold=0.2))
    again = clone(model).set_params(optimizer__alpha=0.1)
    assert again.get_params()["optimizer__threshold"] == 0.2 and model.get_params()["optimizer__alpha"] == 0.05
    fitted = pickle.loads(pickle.dumps(again.fit(lorenz(), t=DT)))
    assert np.allclose(fitted.predict(lorenz()), again.predict(lorenz()))


def outcomes(ps):
    """{name: None, or the error} of every idiom."""
    found = {}
    for one in IDIOMS:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                one(ps)
            found[one.__name__] = None
        except Exception as error:
            found[one.__name__] = error
    return found


if __name__ == "__main__":
    import contextlib
    import importlib
    import sys

    with contextlib.redirect_stdout(io.StringIO()):
        results = outcomes(importlib.import_module(sys.argv[1]))
    for name, error in results.items():
        if error is not None:
            print(f"{name}: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}")
    print(f"{sum(error is None for error in results.values())} of {len(results)} run")
