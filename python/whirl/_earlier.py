"""Arguments of PySINDy 1.x: a TypeError that says what took their place."""
import functools

MODEL = {
    "feature_names": "give it to fit(x, t, feature_names=...)",
    "t_default": "give t to fit(x, t)",
    "discrete_time": "use DiscreteSINDy()",
}
FIT = {
    "multiple_trajectories": "leave it out: a list of trajectories is taken as such",
    "quiet": "leave it out",
    "unbias": "give it to the optimizer, STLSQ(unbias=...)",
    "ensemble": "use SINDy(optimizer=EnsembleOptimizer(STLSQ(), bagging=True))",
    "library_ensemble": "use SINDy(optimizer=EnsembleOptimizer(STLSQ(), library_ensemble=True))",
    "n_models": "give it to EnsembleOptimizer",
    "n_subset": "give it to EnsembleOptimizer",
    "replace": "give it to EnsembleOptimizer",
    "n_candidates_to_drop": "give it to EnsembleOptimizer",
}

REGRESSION = {
    "fit_intercept": "a constant is a term of the library, PolynomialLibrary(include_bias=True)",
    "normalize": "use normalize_columns",
}
SR3 = REGRESSION | {
    "threshold": "use the weight lambda; with \"l0\" that is reg_weight_lam=SR3.calculate_l0_weight(threshold, relax_coeff_nu)",
    "thresholds": "give the array to reg_weight_lam, by SR3.calculate_l0_weight(thresholds, relax_coeff_nu) with \"weighted_l0\"",
    "thresholder": "use regularizer",
    "nu": "use relax_coeff_nu",
}


def refuses(instead):
    """Wraps a method: arguments among `instead` are refused with what to write now."""

    def wrap(method):
        @functools.wraps(method)
        def call(self, *values, **named):
            for name in named:
                if name in instead:
                    raise TypeError(f"{name} is of PySINDy 1.x: {instead[name]}")
            return method(self, *values, **named)

        return call

    return wrap
