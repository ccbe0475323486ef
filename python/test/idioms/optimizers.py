"""Optimizers, those of scikit-learn among them."""
import warnings

import numpy as np

from .common import chaos, DT, finds, idiom, lorenz, T

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
