from pathlib import Path
from typing import Any, Callable, Mapping, Sequence, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .differentiation import FiniteDifference as FiniteDifference
from .differentiation import SmoothingSpline as SmoothingSpline
from .libraries import CustomLibrary as CustomLibrary
from .libraries import FourierLibrary as FourierLibrary
from .libraries import PolynomialLibrary as PolynomialLibrary
from .libraries import TermLibrary as TermLibrary
from .optimizers import STLSQ as STLSQ
from .optimizers import SparseRegression as SparseRegression
from .sindy import SINDy as SINDy

__version__: str
Array = NDArray[np.float64]

class Error(ValueError):
    file: str | None
    line: int | None
    field: str | None
    value: str | None
    allowed: str | None

class Status:
    ok: Status
    warning: Status
    unusable: Status

class Finding:
    code: str
    consequence: str
    where: str
    amounts: dict[str, float]

class Summary:
    status: Status
    residual: float
    condition_number: float
    chi_square: float
    trust: str
    warnings: list[str]
    findings: list[Finding]
    trusted: bool
    usable: bool

class Estimate:
    value: float
    sd: float
    low: float
    high: float
    def covers(self, truth: float) -> bool: ...
    def __float__(self) -> float: ...

class Recording:
    dt: float
    t0: float
    source: str
    duration: float
    t: Array
    names: list[str]
    units: dict[str, str]
    def __init__(self, channels: Mapping[str, ArrayLike], *, t: ArrayLike | None = ..., dt: float = ..., t0: float = ...,
                 units: Mapping[str, str] = ..., source: str = ...) -> None: ...
    def __getitem__(self, name: str) -> Array: ...
    def __contains__(self, name: str) -> bool: ...
    def __len__(self) -> int: ...
    def plot(self, channels: Sequence[str] | None = ..., axes: Any = ...) -> Any: ...

class Term:
    function: str
    coefficient: Estimate
    unit: str

class Equation:
    lhs: str
    terms: list[Term]

class Model:
    method: str
    states: list[str]
    inputs: list[str]
    equations: list[Equation]
    parameters: dict[str, Estimate]
    noise_sd: float
    noise_correlation: list[tuple[str, float]]
    summary: Summary
    usable: bool
    is_rotor: bool
    def to_json(self) -> str: ...

class Identification:
    model: Model
    summary: Summary
    usable: bool
    parameters: dict[str, Estimate]
    held_out: dict[str, dict[str, float]]
    held_out_part: str
    ambiguities: list[dict[str, str]]

class Validation:
    rmse_x: float
    rmse_y: float
    nrmse: float
    noise_x: float
    noise_y: float
    peak_measured: float
    peak_simulated: float
    fold_sensitive: bool
    simulated: Recording
    summary: Summary

class StiffnessLaw:
    k1: Estimate
    k2: Estimate
    offset: Estimate
    summary: Summary
    def to_json(self) -> str: ...

class FrequencyResponse:
    frequency: Array
    kind: str
    names: list[tuple[str, str]]
    values: NDArray[np.complex128]
    summary: Summary
    def to_json(self) -> str: ...
    def plot(self, axes: Any = ...) -> Any: ...

class Mode:
    frequency: Estimate
    damping: Estimate
    pole: complex
    residues: NDArray[np.complex128]

class ModalModel:
    modes: list[Mode]
    reconstruction_error: float
    summary: Summary
    def __len__(self) -> int: ...
    def to_json(self) -> str: ...

class OperationalMode:
    frequency: Estimate
    damping: Estimate
    shape: NDArray[np.complex128]
    mpc: float

class OperationalModes:
    channels: list[str]
    modes: list[OperationalMode]
    harmonics: list[float]
    summary: Summary
    def __len__(self) -> int: ...

class SteadyResponse:
    speed: Array
    amplitude: Array
    phase: Array
    stable: NDArray[np.bool_]
    events: list[tuple[str, float, float]]
    peak_interval: tuple[float, float] | None
    summary: Summary
    def to_json(self) -> str: ...
    def plot(self, axes: Any = ...) -> Any: ...

class VirtualRig:
    def __init__(self, settings: Mapping[str, float] = ..., *, file: str | Path = ...) -> None: ...
    def run_up(self) -> VirtualRig: ...
    def toml(self) -> str: ...
    def record(self, *, seed: int = ..., snr_db: float | None = ...) -> Recording: ...
    def stiffness_test(self, *, seed: int = ...) -> tuple[Array, Array]: ...
    def hammer_test(self, *, blows: int = ..., seed: int = ...) -> list[Recording]: ...

class Controller:
    law: str
    estimator: str
    parameters: dict[str, float]
    margins: dict[str, float]
    sample_time: float
    force_limit: float
    summary: Summary
    def to_json(self) -> str: ...

class Metrics:
    open: dict[Any, float]
    closed: dict[Any, float]
    suppression: dict[Any, float]
    standstill_rms: float
    force_rms: float
    force_peak: float
    total_variation: float
    saturated: float
    stable: bool

class Run:
    log: Recording
    metrics: Metrics
    def plot(self, axes: Any = ...) -> Any: ...

def read(path: str | Path | Any, *, rate: float | None = ..., columns: Sequence[str] = ...) -> Recording: ...
def write(path: str | Path, recording: Recording) -> None: ...
def load(path: str | Path) -> Model | Controller | ModalModel | FrequencyResponse | StiffnessLaw: ...
def save(path: str | Path, value: Model | Controller | ModalModel | FrequencyResponse | StiffnessLaw) -> None: ...
def identify(records: Recording | Sequence[Recording], method: str = ..., *, states: Sequence[str] = ...,
             inputs: Sequence[str] = ..., order: int = ..., library: Sequence[str] = ..., discrete: bool = ...,
             holdout: float = ..., bounds: Sequence[str] = ..., least_decay: float = ...,
             hold: Mapping[str, str] | None = ..., dead_time: Mapping[str, float] | None = ..., hidden: int = ...,
             denominators: Sequence[str] = ..., progress: Callable[[str, float], object] | None = ...) -> Identification: ...
def validate(model: Model, record: Recording, *, unbalance: str = ..., added: complex = ...) -> Validation: ...
def at_common_instants(record: Recording, late: Mapping[str, float]) -> Recording: ...
def score(model: Model, record: Recording, horizon: float = ...) -> dict[str, dict[str, float]]: ...
def stiffness(deflection: ArrayLike, force: ArrayLike) -> StiffnessLaw: ...
def find_vibration(record: Recording, *, mains: Sequence[float] = ..., chance: float = ...) -> dict[str, Any]: ...
def frf(
    records: Sequence[Recording], *, force: str | Sequence[str] = ..., resolution_hz: float = ...
) -> FrequencyResponse: ...
def modes(frf: FrequencyResponse, *, band_low: float = ..., band_high: float = ...) -> ModalModel: ...
def design(model: Model, *, law: str = ..., estimator: str = ..., mass_kg: float | None = ...,
           stiffness: StiffnessLaw | None = ..., data_sheets: VirtualRig | None = ..., feedforward: bool = ...,
           fixed: Mapping[str, float] = ..., evaluations: int = ..., seed: int = ...,
           progress: Callable[[float], object] | None = ...) -> Controller: ...
def run(controller: Controller, rig: VirtualRig = ..., *, seed: int = ...) -> Run: ...
@overload
def balance(model: Model, *, mass_kg: float, radius_mm: float, speed_rpm: float, grade: float = ...) -> dict[str, Any]: ...
@overload
def balance(runs: str | Path, *, phase: str = ..., amplitude: str = ..., angles: str = ..., slow_roll_rpm: float = ...,
            criterion: str = ..., limit_gram: float = ..., noise_um: float = ..., prior: str | Path = ...,
            mass_kg: float = ..., radius_mm: float = ...) -> dict[str, Any]: ...
def oma(records: Recording | Sequence[Recording], *, method: str = ..., band_low: float = ..., band_high: float = ...,
        max_order: int = ..., orders: int | None = ..., harmonics: Sequence[float] = ...) -> OperationalModes: ...
def response(model: Model, from_rpm: float, to_rpm: float, *, input: str = ..., amplitude: float = ...,
             unbalance: float = ..., isolas: bool = ..., record: Recording | None = ...) -> SteadyResponse: ...
@overload
def export(value: Controller, form: str, folder: str | Path, *, prefix: str = ...) -> list[Path]: ...
@overload
def export(value: Model, form: str, folder: str | Path, *, prefix: str = ...) -> list[Path]: ...
def regression_methods() -> list[str]: ...
def sparse_regression(theta: Array, y: Array, **options: Any) -> Array: ...
def smooth(x: Array, dt: float) -> tuple[Array, Array]: ...
def finite_difference(x: Array, dt: float, order: int = ...) -> Array: ...
