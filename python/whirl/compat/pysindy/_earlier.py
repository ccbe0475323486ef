"""Arguments of PySINDy 1.x, and what took their place."""
from ..._base import refuses  # noqa: F401

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
