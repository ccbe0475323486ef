"""Libraries of terms, differentiation, maps, scikit-learn."""
import io
import pickle

import numpy as np

from .common import chaos, DT, finds, idiom, logistic, lorenz, saddle, T, words

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
