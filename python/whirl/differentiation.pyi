from typing import Any, Callable

from numpy.typing import ArrayLike

from ._base import Array

class Differentiation:
    smoothed_x_: Array
    def __call__(self, x: ArrayLike, t: ArrayLike = ...) -> Array: ...
    def get_params(self, deep: bool = ...) -> dict[str, Any]: ...
    def set_params(self, **params: Any) -> Differentiation: ...

class FiniteDifference(Differentiation):
    def __init__(self, order: int = ..., d: int = ..., axis: int = ..., is_uniform: bool = ..., drop_endpoints: bool = ...,
                 periodic: bool = ...) -> None: ...

class SmoothedFiniteDifference(FiniteDifference):
    def __init__(self, smoother: Callable[..., Array] | None = ..., smoother_kws: dict[str, Any] | None = ..., save_smooth: bool = ...,
                 order: int = ..., d: int = ..., axis: int = ..., is_uniform: bool = ..., drop_endpoints: bool = ...,
                 periodic: bool = ...) -> None: ...

class SmoothingSpline(Differentiation): ...

class SpectralDerivative(Differentiation):
    def __init__(self, d: int = ..., axis: int = ...) -> None: ...
