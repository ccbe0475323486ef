from typing import Callable

INSTEAD: dict[str, str]

def missing(module: str) -> Callable[[str], object]: ...
