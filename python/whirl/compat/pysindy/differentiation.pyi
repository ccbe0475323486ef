from typing import Any, Callable, ClassVar

from ..._base import Array
from ...differentiation import Differentiation
from ...differentiation import FiniteDifference as _FiniteDifference
from ...differentiation import SmoothedFiniteDifference as _SmoothedFiniteDifference
from ...differentiation import SpectralDerivative as SpectralDerivative

BaseDifferentiation = Differentiation

class FiniteDifference(_FiniteDifference):
    def __init__(self, order: int = ..., d: int = ..., axis: int = ..., is_uniform: bool = ..., drop_endpoints: bool = ...,
                 periodic: bool = ...) -> None: ...

class SmoothedFiniteDifference(_SmoothedFiniteDifference):
    def __init__(self, smoother: Callable[..., Array] | None = ..., smoother_kws: dict[str, Any] | None = ..., save_smooth: bool = ...,
                 order: int = ..., d: int = ..., axis: int = ..., is_uniform: bool = ..., drop_endpoints: bool = ...,
                 periodic: bool = ...) -> None: ...

class SINDyDerivative(BaseDifferentiation):
    KINDS: ClassVar[dict[str, dict[str, Any]]]
    def __init__(self, axis: int = ..., save_smooth: bool = ..., **kwargs: Any) -> None: ...
