from typing import Any

from ...optimizers import FROLS as FROLS
from ...optimizers import SR3 as SR3
from ...optimizers import SSR as SSR
from ...optimizers import STLSQ as STLSQ
from ...optimizers import EnsembleOptimizer as EnsembleOptimizer
from ...optimizers import Optimizer

BaseOptimizer = Optimizer

class WrappedOptimizer(BaseOptimizer):
    def __init__(self, optimizer: Any) -> None: ...
