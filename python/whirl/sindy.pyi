from typing import Any, Callable, Sequence

from numpy.typing import ArrayLike

from ._whirl import Model
from ._model import SparseModel
from ._base import Array, Trajectories

class SINDy(SparseModel):
    model_: Model | None
    optimizer: Any
    feature_library: Any
    differentiation_method: Any
    feature_names: Sequence[str] | None
    t_default: float
    discrete_time: bool
    def __init__(self, optimizer: Any = ..., feature_library: Any = ..., differentiation_method: Any = ...,
                 feature_names: Sequence[str] | None = ..., t_default: float = ..., discrete_time: bool = ...) -> None: ...
    def fit(self, x: Trajectories, y: object = ..., *, t: Any = ..., x_dot: Trajectories | None = ..., u: Trajectories | None = ...) -> SINDy: ...
    def simulate(self, x0: ArrayLike, t: ArrayLike, u: ArrayLike | Callable[[float], ArrayLike] | None = ...) -> Array: ...
    def score(self, x: Trajectories, y: object = ..., *, t: Any = ..., x_dot: Trajectories | None = ..., u: Trajectories | None = ...,
              metric: Callable[..., Any] | None = ..., **metric_kws: Any) -> Any: ...
