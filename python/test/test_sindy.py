"""The estimator on systems with known equations, and the rules of scikit-learn."""
import pickle
import time

import numpy as np
import pytest
import whirl


def runge_kutta(f, start, dt, n):
    x = np.empty((n, len(start)))
    x[0] = start
    for k in range(n - 1):
        a = f(x[k])
        b = f(x[k] + dt / 2 * a)
        c = f(x[k] + dt / 2 * b)
        d = f(x[k] + dt * c)
        x[k + 1] = x[k] + dt / 6 * (a + 2 * b + 2 * c + d)
    return x


def lorenz(z):
    return np.array([10 * (z[1] - z[0]), z[0] * (28 - z[2]) - z[1], z[0] * z[1] - 8 / 3 * z[2]])


DT = 2e-3
RATES = {"x0": {"x0": -10, "x1": 10}, "x1": {"x0": 28, "x1": -1, "x0 x2": -1}, "x2": {"x2": -8 / 3, "x0 x1": 1}}


@pytest.fixture(scope="module")
def attractor():
    return runge_kutta(lorenz, [-8, 8, 27.0], DT, 5000)


def assert_lorenz(model, tolerance):
    features = model.get_feature_names()
    for row, truth in zip(model.coefficients(), RATES.values()):
        found = {name: c for name, c in zip(features, row) if c != 0}
        assert found.keys() == truth.keys()
        for name, value in truth.items():
            assert found[name] == pytest.approx(value, rel=tolerance)


def test_lorenz_without_a_threshold(attractor):
    assert_lorenz(whirl.SINDy().fit(attractor, t=DT), 1e-6)
    noisy = attractor + 0.08 * np.random.default_rng(5).normal(size=attractor.shape)  # 1 % of the motion
    model = whirl.SINDy().fit(noisy, t=DT)
    assert_lorenz(model, 0.01)
    for equation, truth in zip(model.model_.equations, RATES.values()):
        for term in equation.terms:
            value = truth[term.function.replace("*", " ")]
            assert abs(term.coefficient.value - value) < 4.5 * term.coefficient.sd


def test_the_classical_chain(attractor):
    model = whirl.SINDy(optimizer=whirl.STLSQ(threshold=0.1), differentiation_method=whirl.FiniteDifference())
    model.fit(attractor, t=np.arange(len(attractor)) * DT)
    assert_lorenz(model, 1e-4)
    assert model.score(attractor, t=DT) > 0.9999
    rates = np.array([lorenz(z) for z in attractor])
    assert_lorenz(whirl.SINDy().fit(attractor, t=DT, x_dot=rates), 1e-9)


@pytest.mark.parametrize("method", whirl.regression_methods())
def test_regressions_are_exchangeable(attractor, method):
    rates = np.array([lorenz(z) for z in attractor]) + np.random.default_rng(6).normal(size=attractor.shape)
    model = whirl.SINDy(optimizer=whirl.SparseRegression(method)).fit(attractor, t=DT, x_dot=rates)
    if method in ("best_subset", "stlsq", "backward", "ensemble"):
        assert_lorenz(model, 2e-2)
    else:  # may keep a small term that is not there, or shrink
        assert model.score(attractor, x_dot=[lorenz(z) for z in attractor]) > 0.999


def test_several_trajectories_inputs_and_names():
    rng = np.random.default_rng(2)
    t = np.arange(2000) * 5e-3
    runs, drives = [], []
    for k in range(3):
        u = np.sin((1 + k) * t) + 0.5 * np.cos(2.3 * t + k)
        x = np.zeros((len(t), 2))
        x[0] = rng.normal(size=2)
        for i in range(len(t) - 1):
            def f(z, s):
                drive = (1 - s) * u[i] + s * u[i + 1]
                return np.array([z[1], -4 * z[0] - 0.3 * z[1] - 2 * z[0] ** 3 + drive])
            h = t[1]
            a = f(x[i], 0); b = f(x[i] + h / 2 * a, 0.5); c = f(x[i] + h / 2 * b, 0.5); d = f(x[i] + h * c, 1)
            x[i + 1] = x[i] + h / 6 * (a + 2 * b + 2 * c + d)
        runs.append(x)
        drives.append(u)
    model = whirl.SINDy(feature_library=whirl.PolynomialLibrary(3), feature_names=["q", "v", "f"])
    model.fit(runs, t=t, u=drives)
    assert model.equations(1) == ["1.0 v", "-4.0 q + -0.3 v + 1.0 f + -2.0 q^3"]
    free = model.simulate(runs[0][0], t, u=drives[0])
    assert np.abs(free - runs[0]).max() < 1e-3 * np.abs(runs[0]).max()


def test_maps_and_python_functions():
    x = np.empty(400)
    x[0] = 0.3
    for k in range(399):
        x[k + 1] = 3.8 * x[k] * (1 - x[k])
    model = whirl.SINDy(discrete_time=True).fit(x[:, None])
    assert model.coefficients()[0] == pytest.approx([0, 3.8, -3.8], abs=1e-9)
    assert model.simulate([0.3], 20)[:, 0] == pytest.approx(x[:20], abs=1e-6)
    own = whirl.CustomLibrary([lambda a: a, lambda a: np.sin(3 * a)], [lambda a: a, lambda a: f"sin(3 {a})"])
    t = np.arange(4000) * 1e-3
    y = runge_kutta(lambda z: np.array([-z[0] + 0.7 * np.sin(3 * z[0])]), [2.0], 1e-3, len(t))
    model = whirl.SINDy(feature_library=own, optimizer=whirl.STLSQ(0.1), differentiation_method=whirl.FiniteDifference())
    model.fit(y, t=t)
    assert model.coefficients()[0] == pytest.approx([-1, 0.7], rel=1e-3)
    assert model.get_feature_names() == ["x0", "sin(3 x0)"]
    assert model.simulate(y[0], t) == pytest.approx(y, abs=1e-3)


def test_libraries_add_and_multiply():
    polynomial, fourier = whirl.PolynomialLibrary(1, include_bias=False), whirl.FourierLibrary(1)
    assert (polynomial + fourier + polynomial).names(["x"]) == ["x", "sin(1 x)", "cos(1 x)"]
    x = np.linspace(0, 1, 7)[:, None]
    assert (polynomial * fourier).evaluate(x, ["x"]) == pytest.approx(np.hstack([x * np.sin(x), x * np.cos(x)]))
    assert whirl.PolynomialLibrary(2, include_interaction=False).names(["x", "y"]) == ["1", "x", "y", "x^2", "y^2"]


def test_results_travel_and_are_quick(attractor):
    model = whirl.SINDy().fit(attractor, t=DT)
    again = pickle.loads(pickle.dumps(model))
    x = np.ascontiguousarray(attractor[:10])
    assert (again.predict(x) == model.predict(x)).all()
    # Times are measured, not judged: `pytest -s` prints them.
    begin = time.process_time()
    for _ in range(2000):
        model.predict(x)
    print(f"\npredict, 10 samples: {(time.process_time() - begin) / 2000 * 1e6:.1f} us")
    begin = time.process_time()
    model.simulate(attractor[0], np.arange(15000) * 1e-3)
    print(f"free run, 15000 samples: {(time.process_time() - begin) * 1e3:.1f} ms")


@pytest.mark.parametrize("arguments, message", [
    (dict(x=np.zeros((3, 2))), "at least 5 samples"),
    (dict(x=np.full((60, 2), np.nan)), "NaN"),
    (dict(x=np.random.rand(60, 2), t=np.zeros(60)), "times must rise"),
    (dict(x=np.random.rand(60, 2), t=np.arange(59)), "one time per sample"),
    (dict(x=np.random.rand(60, 2), t=-1), "positive"),
    (dict(x=[np.random.rand(60, 2), np.random.rand(60, 3)], t=0.1), "states"),
    (dict(x=np.random.rand(60, 2), t=0.1, u=np.zeros(50)), "u has shape"),
    (dict(x=np.random.rand(60, 2), t=np.inf), "finite"),
    (dict(x=[np.random.rand(60, 2)] * 2, t=[0.1]), "list of 2"),
    (dict(x=[np.random.rand(60, 2)] * 2, t=0.1, u=[np.ones(60)]), "list of 2"),
    (dict(x=[np.random.rand(60, 2)] * 2, t=0.1, u=[np.ones(60), None]), "every trajectory"),
    (dict(x=np.random.rand(60, 2), t=0.1, x_dot=np.ones((59, 2))), "x_dot has shape"),
    (dict(x=np.random.rand(60, 2), t=0.1, x_dot=np.ones((60, 1))), "x_dot has shape"),
])
def test_bad_input_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        whirl.SINDy(optimizer=whirl.STLSQ()).fit(**arguments)


@pytest.mark.parametrize("arguments, message", [
    (dict(optimizer="stlsq"), "optimizer = 'stlsq': must be STLSQ"),
    (dict(feature_library="poly"), "feature_library = 'poly': must be"),
    (dict(differentiation_method="fd"), "differentiation_method = 'fd'"),
    (dict(feature_names=["a", "a"]), "used once"),
    (dict(feature_names=["t", "x"]), "none of"),
    (dict(feature_names=["a b", "x"]), "letters"),
    (dict(feature_names=["a", 5]), "text"),
])
def test_bad_settings_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        whirl.SINDy(**arguments).fit(np.random.default_rng(1).normal(size=(60, 2)), t=0.1)


def test_bad_starts_of_a_free_run_are_refused(attractor):
    model = whirl.SINDy().fit(attractor, t=DT)
    for x0, t in (([np.nan, 1, 1], np.arange(5.0)), ([1, 1], np.arange(5.0)), ([1, 1, 1], [0.0]), ([1, 1, 1], 0)):
        with pytest.raises(ValueError):
            model.simulate(x0, t)


def test_search_over_settings_and_clones(attractor):
    sklearn = pytest.importorskip("sklearn")
    from sklearn.base import clone
    from sklearn.model_selection import GridSearchCV, TimeSeriesSplit

    model = whirl.SINDy(optimizer=whirl.STLSQ(), differentiation_method=whirl.FiniteDifference(), t_default=DT)
    assert clone(model).get_params()["optimizer__threshold"] == 0.1
    search = GridSearchCV(model, {"optimizer__threshold": [0.01, 0.3, 20]}, cv=TimeSeriesSplit(3))
    search.fit(attractor)
    assert search.best_params_["optimizer__threshold"] in (0.01, 0.3)
    assert_lorenz(search.best_estimator_.set_params(optimizer__threshold=0.3).fit(attractor), 1e-4)


@pytest.mark.filterwarnings("ignore")
def test_the_rules_of_scikit_learn():
    """Every check, on the class itself with its defaults. Their data are tiny and their targets no rates."""
    pytest.importorskip("sklearn")
    from sklearn.utils.estimator_checks import check_estimator

    failed, checks = {}, 0
    for one, check in check_estimator(whirl.SINDy(), generate_only=True):
        checks += 1
        try:
            check(one)
        except Exception as error:
            failed[check.func.__name__] = error
    assert checks > 20 and not failed, failed


def test_the_target_of_scikit_learn_is_the_rates(attractor):
    rates = np.array([lorenz(z) for z in attractor])
    by_target = whirl.SINDy(optimizer=whirl.STLSQ()).fit(attractor, rates)
    assert (by_target.coefficients_ == whirl.SINDy(optimizer=whirl.STLSQ()).fit(attractor, x_dot=rates).coefficients_).all()
    assert by_target.score(attractor, rates) > 1 - 1e-9
    for times in (DT, DT * np.arange(len(attractor))):
        with pytest.raises(TypeError, match="t="):
            whirl.SINDy().fit(attractor, times)
    with pytest.raises(TypeError, match="t="):
        whirl.SINDy().fit([attractor, attractor[:2000]], [DT * np.arange(5000), DT * np.arange(2000)])
    with pytest.warns(UserWarning, match="left out"):
        whirl.SINDy(optimizer=whirl.STLSQ()).fit(attractor, attractor[:, 0], t=DT)
    with pytest.raises(ValueError, match="Reshape"):
        whirl.SINDy().fit(attractor[:, 0], t=DT)


def test_optimizers_and_differentiation_of_ones_own(attractor):
    class Solver:
        def solve(self, theta, y):
            return np.linalg.lstsq(theta, y, rcond=None)[0]

    def differences(x, t):
        return np.gradient(x, t, axis=0)

    model = whirl.SINDy(optimizer=Solver(), differentiation_method=differences).fit(attractor, t=DT)
    assert model.score(attractor, t=DT) > 0.999 and model.complexity == 30


def test_short_trajectories_are_fitted_with_a_warning(attractor):
    with pytest.warns(UserWarning, match="25 samples"):
        model = whirl.SINDy(feature_library=whirl.PolynomialLibrary(1)).fit(attractor[:20], t=DT)
    assert model.model_ is None and model.coefficients().shape == (3, 4)


@pytest.mark.filterwarnings("ignore:Objective did not converge")
def test_optimizers_agree_with_scikit_learn(attractor):
    """Ridge regression on the support that is found, by another solver; the support is where the threshold says."""
    linear_model = pytest.importorskip("sklearn.linear_model")
    rng = np.random.default_rng(8)
    theta = rng.normal(size=(300, 7)) @ (np.eye(7) + 0.3)
    y = theta @ np.array([[2, 0, 0, -1.5, 0, 0, 0.6], [0, 1, 0, 0, 0, 0, 0]]).T + 0.1 * rng.normal(size=(300, 2))
    found = whirl.STLSQ(threshold=0.3, alpha=3.0, unbias=False).fit(theta, y)
    assert found.ind_.sum() == 4 and found.complexity == 4
    for row, kept, column in zip(found.coef_, found.ind_, y.T):
        ridge = linear_model.Ridge(alpha=3.0, fit_intercept=False).fit(theta[:, kept], column)
        assert row[kept] == pytest.approx(ridge.coef_, rel=1e-10) and (abs(row[kept]) >= 0.3).all()
    plain = whirl.STLSQ(threshold=0.3, alpha=3.0).fit(theta, y)
    assert plain.coef_[0][plain.ind_[0]] == pytest.approx(np.linalg.lstsq(theta[:, plain.ind_[0]], y[:, 0], rcond=None)[0])
    # Every row of the path has one term fewer; both ends of the relaxation: nothing is dropped, or all.
    assert [np.count_nonzero(m[0]) for m in whirl.SSR(max_iter=10).fit(theta, y).history_] == [7, 6, 5, 4, 3, 2, 1]
    assert whirl.SR3(reg_weight_lam=0, max_iter=500).fit(theta, y).complexity == 14
    assert whirl.SR3(reg_weight_lam=1e6).fit(theta, y).complexity == 0
    lasso = whirl.SINDy(optimizer=linear_model.Lasso(alpha=1e-3, max_iter=50000), feature_library=whirl.PolynomialLibrary(2))
    assert lasso.fit(attractor[:1000], t=DT).score(attractor[:1000], t=DT) > 0.99


@pytest.mark.parametrize("method, order", [(whirl.FiniteDifference(order=2), 2), (whirl.FiniteDifference(order=4), 4),
                                           (whirl.FiniteDifference(order=3), 3), (whirl.FiniteDifference(order=2, d=2), 2)])
def test_differences_have_their_order_at_uneven_times(method, order):
    """Halving every step divides the largest error by 2^order, ends included; polynomials of that degree are exact."""
    errors = []
    for n in (201, 401):
        s = np.linspace(0, 2, n)
        t = s + 0.1 * np.sin(3 * s)
        exact = np.cos(t) if method.d == 1 else -np.sin(t)
        errors.append(np.abs(method(np.sin(t)[:, None], t)[:, 0] - exact).max())
    assert errors[0] / errors[1] == pytest.approx(2**order, rel=0.2) or errors[0] / errors[1] > 2**order
    t = np.sort(np.random.default_rng(3).uniform(size=30))
    values = method(t[:, None] ** order, t)[:, 0]
    wanted = order * t ** (order - 1) if method.d == 1 else order * (order - 1) * t ** max(order - 2, 0)
    assert values == pytest.approx(wanted, abs=1e-6 * np.abs(values).max())
