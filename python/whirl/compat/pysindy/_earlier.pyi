from typing import Callable, TypeVar

_Method = TypeVar("_Method", bound=Callable[..., object])

MODEL: dict[str, str]
FIT: dict[str, str]

def refuses(instead: dict[str, str]) -> Callable[[_Method], _Method]: ...
