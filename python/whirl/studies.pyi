from pathlib import Path
from typing import Any, Callable, Mapping, Sequence

from numpy.typing import ArrayLike

from ._whirl import (
    Controller,
    FrequencyResponse,
    Identification,
    ModalModel,
    Model,
    Recording,
    StiffnessLaw,
    VirtualRig,
)
from ._base import Frame
from .results import Comparison, Decay, Derivation, Margins, Robustness, RunUpPlan, SineTest, Transient

def simulate(model: Model, from_rpm: float | None = ..., to_rpm: float | None = ..., seconds: float | None = ..., *, dwell_s: float = ...,
             rate_hz: float = ..., unbalance: float = ..., eccentricity_um: float | None = ..., phase_deg: float = ...,
             record: Recording | None = ...) -> Recording: ...
def decay(record: Recording, *, channel: str = ..., start: float | None = ..., stop: float | None = ..., periods: float = ...) -> Decay: ...
def sine(data: Recording | Frame | Mapping[str, ArrayLike] | Sequence[Any], *, force: str = ..., channel: str = ...,
         periods: float = ...) -> SineTest: ...
def transient(omega: ArrayLike, vector: ArrayLike, *, modes: int = ...) -> Transient: ...
def margins(controller: Controller, model: Model, *, mass_kg: float | None = ..., stiffness: StiffnessLaw | None = ...,
            modes: ModalModel | None = ..., data_sheets: VirtualRig | None = ..., speeds: int = ..., seed: int = ...,
            threads: int = ...) -> Margins: ...
def compare(model: Model, *, mass_kg: float | None = ..., stiffness: StiffnessLaw | None = ..., modes: ModalModel | None = ...,
            data_sheets: VirtualRig | None = ..., rig: VirtualRig | None = ..., laws: str | Sequence[str] = ..., balanced: Model | None = ...,
            evaluations: int = ..., seeds: int = ..., seed: int = ..., threads: int = ..., matrix: bool = ...) -> Comparison: ...
def robustness(controller: Controller, model: Model, *, mass_kg: float | None = ..., stiffness: StiffnessLaw | None = ...,
               modes: ModalModel | None = ..., data_sheets: VirtualRig | None = ..., samples: int = ..., limit_mm: float = ...,
               seed: int = ..., threads: int = ..., progress: Callable[[float], object] | None = ...) -> Robustness: ...
def runup(model: Model, from_rpm: float, to_rpm: float, *, limit_mm: float = ..., unbalance: float = ..., slowest_rpm_s: float = ...,
          fastest_rpm_s: float = ..., drive: Mapping[str, float] | None = ...) -> RunUpPlan: ...
def derive(path: str | Path, model: Model | None = ...) -> Derivation: ...
def report(*items: str | Path | Recording | Identification | Model | Controller | FrequencyResponse | ModalModel | StiffnessLaw,
           out: str | Path = ..., pdf: str | Path | None = ..., title: str = ..., about: str | Path = ...,
           service_rpm: float = ..., slow_roll_rpm: float = ...) -> Path: ...
