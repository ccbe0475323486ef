from typing import Any, Callable, Sequence

from numpy.typing import ArrayLike, NDArray
import numpy as np

from ._base import Array

class Optimizer:
    coef_: Array
    ind_: NDArray[np.bool_]
    history_: list[Array]
    err_history_: list[float]
    intercept_: float
    def fit(self, x: ArrayLike, y: ArrayLike) -> Optimizer: ...
    def predict(self, x: ArrayLike) -> Array: ...
    def solve(self, theta: ArrayLike, y: ArrayLike) -> Array: ...
    def get_params(self, deep: bool = ...) -> dict[str, Any]: ...
    def set_params(self, **params: Any) -> Optimizer: ...
    @property
    def complexity(self) -> int: ...

class STLSQ(Optimizer):
    def __init__(self, threshold: float = ..., alpha: float = ..., max_iter: int = ..., ridge_kw: dict[str, Any] | None = ...,
                 normalize_columns: bool = ..., copy_X: bool = ..., initial_guess: ArrayLike | None = ..., verbose: bool = ...,
                 sparse_ind: Sequence[int] | None = ..., unbias: bool = ...) -> None: ...

class SR3(Optimizer):
    def __init__(self, reg_weight_lam: float | Array = ..., regularizer: str = ..., relax_coeff_nu: float = ..., tol: float = ...,
                 trimming_fraction: float = ..., trimming_step_size: float = ..., max_iter: int = ..., copy_X: bool = ...,
                 initial_guess: ArrayLike | None = ..., normalize_columns: bool = ..., verbose: bool = ..., unbias: bool = ...) -> None: ...
    @staticmethod
    def calculate_l0_weight(threshold: Any, relax_coeff_nu: float) -> Any: ...

class SSR(Optimizer):
    def __init__(self, alpha: float = ..., max_iter: int = ..., ridge_kw: dict[str, Any] | None = ..., normalize_columns: bool = ...,
                 copy_X: bool = ..., criteria: str = ..., kappa: float | None = ..., verbose: bool = ..., unbias: bool = ...) -> None: ...

class FROLS(Optimizer):
    def __init__(self, normalize_columns: bool = ..., copy_X: bool = ..., kappa: float | None = ..., max_iter: int = ..., alpha: float = ...,
                 ridge_kw: dict[str, Any] | None = ..., verbose: bool = ..., unbias: bool = ...) -> None: ...

class SparseRegression(Optimizer):
    def __init__(self, method: str = ..., threshold: float = ..., max_terms: int = ..., seed: int = ...) -> None: ...

class EnsembleOptimizer(Optimizer):
    coef_list: list[Array]
    def __init__(self, opt: Any, bagging: bool = ..., library_ensemble: bool = ..., n_models: int = ..., n_subset: int | None = ...,
                 n_candidates_to_drop: int = ..., replace: bool = ..., ensemble_aggregator: Callable[[list[Array]], Array] | None = ...) -> None: ...

def regress(optimizer: Any, theta: Array, y: Array, constant: int | None = ...) -> Array: ...
