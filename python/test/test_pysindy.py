"""The door for users of PySINDy: sixty idioms, and what it says of the rest."""
import inspect

import numpy as np
import pytest

pytest.importorskip("sklearn")
pytest.importorskip("scipy")
import pysindy_idioms  # noqa: E402

import whirl.compat.pysindy as ps  # noqa: E402

#: Idioms that do not run, with what is said instead. docs/python-pysindy.md has a section for each.
MISSING = {
    "sr3_that_trims_outliers": (NotImplementedError, "whirl.check"),
    "equality_constraints": (AttributeError, "bounds="),
    "partial_differential_equation": (AttributeError, "ordinary"),
    "weak_form_of_a_partial_differential_equation": (AttributeError, "whirl.SINDy"),
}


@pytest.mark.parametrize("one", pysindy_idioms.IDIOMS, ids=lambda one: one.__name__)
@pytest.mark.filterwarnings("ignore")
def test_idiom(one):
    if one.__name__ not in MISSING:
        one(ps)
        return
    kind, instead = MISSING[one.__name__]
    with pytest.raises(kind, match=instead):
        one(ps)


def test_fifty_six_of_sixty_run():
    names = [one.__name__ for one in pysindy_idioms.IDIOMS]
    assert len(set(names)) == 60 and MISSING.keys() <= set(names)
    assert len(names) - len(MISSING) == 56
    print(f"\n{len(names) - len(MISSING)} of {len(names)} idioms run")


#: Names and positions of the arguments of PySINDy 2.1, from its API reference.
SIGNATURES = {
    "SINDy": "optimizer feature_library differentiation_method",
    "SINDy.fit": "x t x_dot u feature_names",
    "SINDy.predict": "x u",
    "SINDy.score": "x t x_dot u metric metric_kws",
    "SINDy.simulate": "x0 t u integrator interpolator integrator_kws interpolator_kws",
    "SINDy.equations": "precision",
    "SINDy.print": "lhs precision kwargs",
    "DiscreteSINDy": "optimizer feature_library",
    "DiscreteSINDy.fit": "x t x_next u feature_names",
    "DiscreteSINDy.score": "x t u x_next metric metric_kws",
    "DiscreteSINDy.simulate": "x0 t u stop_condition",
    "STLSQ": "threshold alpha max_iter ridge_kw normalize_columns copy_X initial_guess verbose sparse_ind unbias",
    "SR3": "reg_weight_lam regularizer relax_coeff_nu tol trimming_fraction trimming_step_size max_iter copy_X initial_guess "
           "normalize_columns verbose unbias",
    "SSR": "alpha max_iter ridge_kw normalize_columns copy_X criteria kappa verbose unbias",
    "FROLS": "normalize_columns copy_X kappa max_iter alpha ridge_kw verbose unbias",
    "EnsembleOptimizer": "opt bagging library_ensemble n_models n_subset n_candidates_to_drop replace ensemble_aggregator",
    "PolynomialLibrary": "degree include_interaction interaction_only include_bias order",
    "FourierLibrary": "n_frequencies include_sin include_cos",
    "CustomLibrary": "library_functions function_names interaction_only include_bias",
    "ConcatLibrary": "libraries",
    "TensoredLibrary": "libraries inputs_per_library",
    "GeneralizedLibrary": "libraries tensor_array inputs_per_library exclude_libraries",
    "ParameterizedLibrary": "parameter_library feature_library num_parameters num_features",
    "FiniteDifference": "order d axis is_uniform drop_endpoints periodic",
    "SpectralDerivative": "d axis",
    "SINDyDerivative": "axis save_smooth kwargs",
}


@pytest.mark.parametrize("name", SIGNATURES)
def test_arguments(name):
    found = ps
    for part in name.split("."):
        found = getattr(found, part)
    assert [p for p in inspect.signature(found).parameters if p != "self"] == SIGNATURES[name].split()


def test_names_that_are_missing_say_what_to_use():
    for name in ("ConstrainedSR3", "TrappingSR3", "MIOSR", "SBR", "SINDyPI", "PDELibrary", "WeakPDELibrary", "BINDy", "AxesArray"):
        with pytest.raises(AttributeError, match=f"{name}: .*(whirl|support)"):
            getattr(ps, name)
    with pytest.raises(AttributeError, match="no attribute"):
        ps.nonsense


@pytest.mark.parametrize("settings, tolerance", [
    (dict(kind="finite_difference", k=2), 1e-6), (dict(kind="savitzky_golay", left=0.05, right=0.05, order=4), 1e-4),
    (dict(kind="spline", s=1e-12, order=5), 1e-3), (dict(kind="spectral"), 1e-9)])
def test_derivatives_of_a_sine(settings, tolerance):
    t = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    x = np.column_stack([np.sin(t), np.cos(2 * t)])
    method = ps.SINDyDerivative(**settings)
    assert np.abs(method(x, t) - np.column_stack([np.cos(t), -2 * np.sin(2 * t)]))[20:-20].max() < tolerance
    assert method.set_params(save_smooth=False).get_params() == {"axis": 0, "save_smooth": False, **settings}


@pytest.mark.parametrize("call, message", [
    (lambda: ps.SINDyDerivative(kind="kalman", alpha=0.5)(np.ones((9, 1)), 1), "SmoothingSpline"),
    (lambda: ps.SINDyDerivative(kind="spline", k=1)(np.ones((9, 1)), 1), "k: no setting"),
    (lambda: ps.SINDy().fit(np.ones((9, 2)), t=[0, 1]), "one time per sample"),
    (lambda: ps.SINDy().fit(np.ones((2, 2)), t=1), "at least 3 samples"),
    (lambda: ps.SINDy().fit(np.ones((9, 2)), t=1, feature_names=["a"]), "must be 2"),
    (lambda: ps.SINDy(optimizer=ps.EnsembleOptimizer(ps.STLSQ())).fit(np.eye(9), t=1), "one of them"),
    (lambda: ps.SINDy(optimizer=ps.STLSQ(ridge_kw={"tol": 1})).fit(np.eye(9), t=1), "ridge_kw"),
    (lambda: ps.SINDy(optimizer=ps.SR3(regularizer="l7")).fit(np.eye(9), t=1), "l0, l1 or l2"),
    (lambda: ps.SINDy(feature_library=ps.CustomLibrary([lambda x: 1 / x])).fit(np.eye(9), t=1), "not finite"),
    (lambda: ps.DiscreteSINDy().fit(np.eye(9), t=1).simulate(np.zeros(9), 2.5), "whole number"),
])
@pytest.mark.filterwarnings("ignore")
def test_bad_input_is_named(call, message):
    with pytest.raises((ValueError, TypeError, NotImplementedError), match=message):
        call()
    with pytest.raises(TypeError):
        ps.SINDy().fit(np.ones((9, 2)))  # t is needed


@pytest.mark.parametrize("make, instead", [
    (lambda: ps.SINDy(feature_names=["x"]), "fit\\(x, t, feature_names"),
    (lambda: ps.SINDy(discrete_time=True), "DiscreteSINDy"),
    (lambda: ps.SINDy(t_default=0.1), "give t to fit"),
    (lambda: ps.SINDy().fit([], 0.1, multiple_trajectories=True), "list of trajectories"),
    (lambda: ps.SINDy().fit([], 0.1, ensemble=True), "EnsembleOptimizer"),
    (lambda: ps.SINDy().fit([], 0.1, quiet=True), "leave it out"),
    (lambda: ps.SR3(threshold=0.1), "reg_weight_lam=SR3.calculate_l0_weight"),
    (lambda: ps.SR3(thresholder="l1"), "use regularizer"),
    (lambda: ps.SR3(nu=1), "use relax_coeff_nu"),
    (lambda: ps.STLSQ(fit_intercept=True), "include_bias"),
])
def test_arguments_of_earlier_versions_say_what_to_write(make, instead):
    with pytest.raises(TypeError, match=f"PySINDy 1.x: .*{instead}"):
        make()


def test_the_version_is_that_of_the_names():
    assert ps.__version__.startswith("2.1")
