"""Sparse regression on a candidate matrix. The regressions themselves run in the C++ library."""
import warnings

import numpy as np

from . import _whirl
from ._base import BaseEstimator, clone, refuses

# Arguments of PySINDy 1.x, and what took their place.
_EARLIER = {
    "fit_intercept": "a constant is a term of the library, PolynomialLibrary(include_bias=True)",
    "normalize": "use normalize_columns",
}
_EARLIER_SR3 = _EARLIER | {
    "threshold": "use the weight lambda; with \"l0\" that is reg_weight_lam=SR3.calculate_l0_weight(threshold, relax_coeff_nu)",
    "thresholds": "give the array to reg_weight_lam, by SR3.calculate_l0_weight(thresholds, relax_coeff_nu) with \"weighted_l0\"",
    "thresholder": "use regularizer",
    "nu": "use relax_coeff_nu",
}


class Optimizer(BaseEstimator):
    """Base. `fit(theta, y)`: `coef_` (targets x terms), `ind_` (which are kept), `history_` (coef_ of every step)."""

    def _path(self, theta, y, target):
        """(models x terms, mean square of each, whether it came to its end) for one target."""
        raise NotImplementedError

    _starts = False  # the history begins with the coefficients that the steps start from

    def _choose(self, theta, errors):
        """The model of the path that is the result."""
        return len(errors) - 1

    def fit(self, x, y):
        theta, y = np.ascontiguousarray(x, dtype=float), np.asarray(y, dtype=float)
        if y.ndim == 1:
            y = y[:, None]
        scale = np.ones(theta.shape[1])
        if getattr(self, "normalize_columns", False):
            norm = np.linalg.norm(theta, axis=0)
            scale = np.where(norm > 0, norm, 1)
        paths, chosen = [], []
        for target, column in enumerate(y.T):
            models, errors, ended = self._path(theta / scale, np.ascontiguousarray(column), target)
            if not ended:
                warnings.warn(f"{type(self).__name__} did not converge after {self.max_iter} iterations", stacklevel=2)
            if getattr(self, "verbose", False):
                for step, (model, error) in enumerate(zip(models, errors)):
                    print(f"target {target}, step {step}: mean square {error:.4e}, {np.count_nonzero(model)} terms")
            paths.append((models / scale, np.asarray(errors)))
            chosen.append(models[self._choose(theta, np.asarray(errors))] / scale)
        steps = max(len(models) for models, _ in paths)
        self.history_ = [np.array([models[min(k, len(models) - 1)] for models, _ in paths]) for k in range(steps)]
        if self._starts:
            guess = [_guess(self.initial_guess, k, theta.shape[1]) for k in range(y.shape[1])]
            start = [g / scale if len(g) else _least_squares(theta, column) for g, column in zip(guess, y.T)]
            self.history_.insert(0, np.array(start))
        self.err_history_ = [float(sum(errors[min(k, len(errors) - 1)] for _, errors in paths)) for k in range(steps)]
        self.coef_ = np.array(chosen)
        self.ind_ = self.coef_ != 0
        if getattr(self, "unbias", False):
            for target, kept in enumerate(self.ind_):
                if kept.any():
                    self.coef_[target, kept] = _least_squares(theta[:, kept], y[:, target])
        self.intercept_ = 0.0
        return self

    def predict(self, x):
        return np.asarray(x, dtype=float) @ self.coef_.T

    def solve(self, theta, y):
        """Coefficients of one target; the object itself stays as it is."""
        return clone(self).fit(theta, y).coef_[0]

    @property
    def complexity(self):
        """Number of terms."""
        return int(np.count_nonzero(self.coef_))


def _least_squares(theta, y):
    return _whirl.sparse_regression(np.ascontiguousarray(theta), np.ascontiguousarray(y), method="ols")


def _guess(initial_guess, target, terms):
    if initial_guess is None:
        return np.empty(0)
    guess = np.atleast_2d(np.asarray(initial_guess, dtype=float))
    if guess.shape[1] != terms or target >= len(guess):
        raise ValueError(f"initial_guess has shape {np.shape(initial_guess)}: must be (targets, {terms})")
    return guess[target]


class STLSQ(Optimizer):
    """Sequentially thresholded least squares (Brunton, Proctor, Kutz 2016) with an absolute `threshold` and ridge `alpha`.

    `sparse_ind`: the terms that are thresholded and under the ridge (default: all); `normalize_columns`: threshold and
    ridge act on columns of norm 1; `unbias`: least squares on the terms that are kept, at the end.
    """

    _starts = True

    @refuses(_EARLIER)
    def __init__(self, threshold=0.1, alpha=0.05, max_iter=20, ridge_kw=None, normalize_columns=False, copy_X=True,
                 initial_guess=None, verbose=False, sparse_ind=None, unbias=True):
        self.threshold = threshold
        self.alpha = alpha
        self.max_iter = max_iter
        self.ridge_kw = ridge_kw
        self.normalize_columns = normalize_columns
        self.copy_X = copy_X
        self.initial_guess = initial_guess
        self.verbose = verbose
        self.sparse_ind = sparse_ind
        self.unbias = unbias

    def _path(self, theta, y, target):
        _no_ridge_settings(self)
        terms = theta.shape[1]
        keep = [] if self.sparse_ind is None else sorted(set(range(terms)) - set(self.sparse_ind))
        return _whirl._unscaled_path(theta, y, "stlsq", threshold=self.threshold, ridge=self.alpha, keep=keep,
                                     max_iterations=self.max_iter, start=_guess(self.initial_guess, target, terms))


class SR3(Optimizer):
    """Sparse relaxed regularized regression (Zheng et al. 2019): 1/2 |y - X w|^2 + lambda R(u) + |w - u|^2 / (2 nu).

    `regularizer` R: "l0", "l1" or "l2" (the square); `reg_weight_lam`: lambda, one number or (targets, terms). The
    coefficients are u.
    """

    _starts = True

    @refuses(_EARLIER_SR3)
    def __init__(self, reg_weight_lam=0.005, regularizer="L0", relax_coeff_nu=1.0, tol=1e-5, trimming_fraction=0.0,
                 trimming_step_size=1.0, max_iter=30, copy_X=True, initial_guess=None, normalize_columns=False,
                 verbose=False, unbias=False):
        self.reg_weight_lam = reg_weight_lam
        self.regularizer = regularizer
        self.relax_coeff_nu = relax_coeff_nu
        self.tol = tol
        self.trimming_fraction = trimming_fraction
        self.trimming_step_size = trimming_step_size
        self.max_iter = max_iter
        self.copy_X = copy_X
        self.initial_guess = initial_guess
        self.normalize_columns = normalize_columns
        self.verbose = verbose
        self.unbias = unbias

    @staticmethod
    def calculate_l0_weight(threshold, relax_coeff_nu):
        """The lambda at which "l0" drops coefficients below `threshold`."""
        return np.asarray(threshold) ** 2 / (2 * relax_coeff_nu) if np.ndim(threshold) else threshold**2 / (2 * relax_coeff_nu)

    def _path(self, theta, y, target):
        if self.trimming_fraction:
            raise NotImplementedError("trimming_fraction is not supported: remove outliers before the fit (whirl.check finds them)")
        penalty = str(self.regularizer).lower()
        weight = np.asarray(self.reg_weight_lam, dtype=float)
        if weight.ndim == 2:
            if target >= len(weight):
                raise ValueError(f"reg_weight_lam has shape {weight.shape}: must be (targets, {theta.shape[1]})")
            weight = weight[target]
        return _whirl._unscaled_path(theta, y, "sr3", penalty=penalty.removeprefix("weighted_"), nu=self.relax_coeff_nu,
                                     weight=np.broadcast_to(weight, theta.shape[1:]), tolerance=self.tol,
                                     max_iterations=self.max_iter, start=_guess(self.initial_guess, target, theta.shape[1]))


class _Greedy(Optimizer):
    """A path of models of every size; `kappa`: the one with the smallest mean square + kappa cond(theta) (number of terms)."""

    def _penalised(self, theta, errors, terms):
        return int(np.argmin(errors + self.kappa * np.linalg.cond(theta) * np.asarray(terms)))


class SSR(_Greedy):
    """Stepwise sparse regression (Boninsegna et al. 2018): from all terms to one.

    `criteria`: "coefficient_value" drops the smallest coefficient, "model_residual" the term whose absence costs least.
    Without `kappa` the result is the last model before the mean square jumps by the largest factor, target by target.
    """

    def __init__(self, alpha=0.05, max_iter=20, ridge_kw=None, normalize_columns=False, copy_X=True,
                 criteria="coefficient_value", kappa=None, verbose=False, unbias=True):
        self.alpha = alpha
        self.max_iter = max_iter
        self.ridge_kw = ridge_kw
        self.normalize_columns = normalize_columns
        self.copy_X = copy_X
        self.criteria = criteria
        self.kappa = kappa
        self.verbose = verbose
        self.unbias = unbias

    def _path(self, theta, y, target):
        _no_ridge_settings(self)
        if self.criteria not in ("coefficient_value", "model_residual"):
            raise ValueError(f"criteria = {self.criteria!r}: must be 'coefficient_value' or 'model_residual'")
        self._floor = 1e-14 * float(np.mean(y**2)) + 1e-300  # rounding of the sums: no model is better than that
        return _whirl._unscaled_path(theta, y, "ssr", ridge=self.alpha, max_iterations=self.max_iter,
                                     by_residual=self.criteria == "model_residual")

    def _choose(self, theta, errors):
        if self.kappa is not None:
            return self._penalised(theta, errors, theta.shape[1] - np.arange(len(errors)))
        if len(errors) < 2:
            return 0
        return int(np.argmax(np.diff(np.log(np.maximum(errors, self._floor)))))


class FROLS(_Greedy):
    """Forward regression orthogonal least squares (Billings 2013): `max_iter` terms, or fewer by `kappa`."""

    def __init__(self, normalize_columns=False, copy_X=True, kappa=None, max_iter=10, alpha=0.05, ridge_kw=None,
                 verbose=False, unbias=True):
        self.normalize_columns = normalize_columns
        self.copy_X = copy_X
        self.kappa = kappa
        self.max_iter = max_iter
        self.alpha = alpha
        self.ridge_kw = ridge_kw
        self.verbose = verbose
        self.unbias = unbias

    def _path(self, theta, y, target):
        _no_ridge_settings(self)
        return _whirl._unscaled_path(theta, y, "frols", ridge=self.alpha, max_iterations=self.max_iter)

    def _choose(self, theta, errors):
        return len(errors) - 1 if self.kappa is None else self._penalised(theta, errors, 1 + np.arange(len(errors)))


def _no_ridge_settings(optimizer):
    if optimizer.ridge_kw:
        raise NotImplementedError(f"ridge_kw = {optimizer.ridge_kw!r} is not supported: the ridge regression is whirl's own")


class SparseRegression(Optimizer):
    """One of whirl.regression_methods(), e.g. "best_subset", "lasso", "frols", "ensemble"; thresholds are shares."""

    def __init__(self, method="best_subset", threshold=0.02, max_terms=0, seed=1):
        self.method = method
        self.threshold = threshold
        self.max_terms = max_terms
        self.seed = seed

    def _path(self, theta, y, target):
        xi = _whirl.sparse_regression(theta, y, **self.get_params())
        return xi[None, :], [float(np.mean((y - theta @ xi) ** 2))], True


class EnsembleOptimizer(Optimizer):
    """`opt` on many samples of the rows (`bagging`) or of the terms (`library_ensemble`); `coef_list`: all models.

    `n_subset` rows (default: as many as there are), with or without `replace`; `n_candidates_to_drop` terms left out;
    `ensemble_aggregator`: from the list of models to one, default the median. Draws are those of numpy.random.
    """

    def __init__(self, opt, bagging=False, library_ensemble=False, n_models=20, n_subset=None, n_candidates_to_drop=1,
                 replace=True, ensemble_aggregator=None):
        self.opt = opt
        self.bagging = bagging
        self.library_ensemble = library_ensemble
        self.n_models = n_models
        self.n_subset = n_subset
        self.n_candidates_to_drop = n_candidates_to_drop
        self.replace = replace
        self.ensemble_aggregator = ensemble_aggregator

    def fit(self, x, y):
        if not (self.bagging or self.library_ensemble):
            raise ValueError("bagging and library_ensemble are both False: one of them must be True")
        if self.n_models < 1:
            raise ValueError(f"n_models = {self.n_models}: must be at least 1")
        theta, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        if y.ndim == 1:
            y = y[:, None]
        rows, terms = theta.shape
        if self.library_ensemble and not 0 < self.n_candidates_to_drop < terms:
            raise ValueError(f"n_candidates_to_drop = {self.n_candidates_to_drop}: must be from 1 to {terms - 1}")
        self.coef_list = []
        for _ in range(self.n_models):
            part, kept = slice(None), np.arange(terms)
            if self.bagging:
                part = np.random.choice(rows, self.n_subset or rows, replace=self.replace)
            if self.library_ensemble:
                kept = np.sort(np.random.choice(terms, terms - self.n_candidates_to_drop, replace=False))
            model = np.zeros((y.shape[1], terms))
            model[:, kept] = regress(clone(self.opt), theta[part][:, kept], y[part])
            self.coef_list.append(model)
        aggregate = self.ensemble_aggregator or (lambda models: np.median(models, axis=0))
        self.coef_ = np.asarray(aggregate(self.coef_list))
        self.ind_ = self.coef_ != 0
        self.history_ = [self.coef_]
        self.intercept_ = 0.0
        return self


def regress(optimizer, theta, y, constant=None):
    """Coefficients (targets x terms) of any optimizer, also kept as its `coef_`: one of this module, a regressor of
    scikit-learn, or an object with solve(theta, y). `constant`: index of the term 1, which takes up an intercept."""
    if isinstance(optimizer, Optimizer):
        return optimizer.fit(theta, y).coef_
    if not hasattr(optimizer, "fit"):
        return np.vstack([optimizer.solve(theta, column) for column in y.T])
    rows = []
    for column in y.T:
        one = clone(optimizer).fit(theta, column)
        row = np.array(one.coef_, dtype=float).reshape(-1)
        offset = float(np.ravel(getattr(one, "intercept_", 0.0))[0])
        if offset != 0:
            if constant is None:
                raise ValueError(f"{type(optimizer).__name__} found an intercept of {offset:.3g}, and the library has no "
                                 "constant term: give it fit_intercept=False, or the library a constant")
            row[constant] += offset
        rows.append(row)
    optimizer.coef_ = np.vstack(rows)
    return optimizer.coef_
