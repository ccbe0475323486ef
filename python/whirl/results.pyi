from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike, NDArray
import numpy as np

from ._whirl import Controller, Estimate, Model, RunupMode, Summary
from ._base import Array, Axes, Frame

__all__ = ["Comparison", "Decay", "Derivation", "Margins", "NonlinearMode", "Result", "Robustness", "RunUpPlan", "SineTest", "Transient"]

@dataclass(repr=False)
class Result:
    summary: Summary
    document: dict[str, Any]
    def to_pandas(self) -> Frame: ...
    def to_json(self) -> str: ...

@dataclass(repr=False)
class NonlinearMode(Result):
    model: Model
    @property
    def parameters(self) -> dict[str, Estimate]: ...
    @property
    def lowest(self) -> float: ...
    @property
    def highest(self) -> float: ...
    def frequency(self, amplitude: ArrayLike) -> Array: ...

@dataclass(repr=False)
class Decay(NonlinearMode):
    @property
    def points(self) -> dict[str, Array]: ...
    def plot(self, axes: Axes = ...) -> Axes: ...

@dataclass(repr=False)
class SineTest(NonlinearMode):
    points: dict[str, Array]
    @property
    def gain(self) -> Estimate: ...
    def plot(self, axes: Axes = ...) -> Axes: ...

@dataclass(repr=False)
class Transient(Result):
    modes: list[RunupMode]
    runout: complex
    alpha: float
    fit_percent: float
    peak_speed: float
    peak_speed_measured: float
    beats: list[float]
    beats_measured: list[float]
    omega: Array
    measured: NDArray[np.complex128]
    simulated: NDArray[np.complex128]
    steady: Transient | None = ...
    def plot(self, axes: Axes = ...) -> Axes: ...

@dataclass(repr=False)
class Margins(Result):
    @property
    def plants(self) -> list[dict[str, Any]]: ...
    @property
    def worst(self) -> dict[str, Any]: ...
    def plot(self, axes: Axes = ...) -> Axes: ...

@dataclass(repr=False)
class Comparison(Result):
    controllers: dict[str, Controller]
    @property
    def best(self) -> str: ...
    def plot(self, axes: Axes = ...) -> Axes: ...

@dataclass(repr=False)
class Robustness(Result):
    @property
    def stable(self) -> Estimate: ...
    @property
    def exceeds(self) -> Estimate | None: ...
    def plot(self, axes: Axes = ...) -> Axes: ...

@dataclass(repr=False)
class RunUpPlan(Result):
    @property
    def up(self) -> dict[str, Any]: ...
    @property
    def down(self) -> dict[str, Any]: ...
    def plot(self, axes: Axes = ...) -> Axes: ...

@dataclass(repr=False)
class Derivation(Result):
    text: str
    latex: str
    library: str
    @property
    def parameters(self) -> dict[str, Estimate]: ...
