from typing import Any, Callable, Sequence

from numpy.typing import ArrayLike

from ..._model import SparseModel
from ..._base import Array, Trajectories

class _Common(SparseModel):
    optimizer: Any
    feature_library: Any
    feature_names: list[str]
    n_control_features_: int
    n_output_features_: int

class SINDy(_Common):
    differentiation_method: Any
    def __init__(self, optimizer: Any = ..., feature_library: Any = ..., differentiation_method: Any = ...) -> None: ...
    def fit(self, x: Trajectories, t: Any, x_dot: Trajectories | None = ..., u: Trajectories | None = ...,
            feature_names: Sequence[str] | None = ...) -> SINDy: ...
    def score(self, x: Trajectories, t: Any, x_dot: Trajectories | None = ..., u: Trajectories | None = ...,
              metric: Callable[..., Any] | None = ..., **metric_kws: Any) -> Any: ...
    def differentiate(self, x: Trajectories, t: Any = ...) -> Any: ...
    def simulate(self, x0: ArrayLike, t: ArrayLike, u: ArrayLike | Callable[[float], ArrayLike] | None = ..., integrator: str = ...,
                 interpolator: Callable[..., Any] | None = ..., integrator_kws: dict[str, Any] | None = ...,
                 interpolator_kws: dict[str, Any] | None = ...) -> Array: ...

class DiscreteSINDy(_Common):
    def __init__(self, optimizer: Any = ..., feature_library: Any = ...) -> None: ...
    def fit(self, x: Trajectories, t: Any, x_next: Trajectories | None = ..., u: Trajectories | None = ...,
            feature_names: Sequence[str] | None = ...) -> DiscreteSINDy: ...
    def score(self, x: Trajectories, t: Any, u: Trajectories | None = ..., x_next: Trajectories | None = ...,
              metric: Callable[..., Any] | None = ..., **metric_kws: Any) -> Any: ...
    def simulate(self, x0: ArrayLike, t: int, u: ArrayLike | Callable[[int], ArrayLike] | None = ...,
                 stop_condition: Callable[[Array], bool] | None = ...) -> Array: ...
