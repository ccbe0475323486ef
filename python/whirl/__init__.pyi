from pathlib import Path
from typing import Callable, Mapping, Sequence

from . import plot as plot
from ._base import Frame
from ._whirl import Error as Error
from ._whirl import Status as Status
from ._whirl import Finding as Finding
from ._whirl import Summary as Summary
from ._whirl import Estimate as Estimate
from ._whirl import Recording as Recording
from ._whirl import Term as Term
from ._whirl import Equation as Equation
from ._whirl import Model as Model
from ._whirl import Identification as Identification
from ._whirl import Validation as Validation
from ._whirl import StiffnessLaw as StiffnessLaw
from ._whirl import FrequencyResponse as FrequencyResponse
from ._whirl import Mode as Mode
from ._whirl import ModalModel as ModalModel
from ._whirl import OperationalMode as OperationalMode
from ._whirl import OperationalModes as OperationalModes
from ._whirl import RunupMode as RunupMode
from ._whirl import RecordFinding as RecordFinding
from ._whirl import RecordReport as RecordReport
from ._whirl import SteadyResponse as SteadyResponse
from ._whirl import VirtualRig as VirtualRig
from ._whirl import Controller as Controller
from ._whirl import Metrics as Metrics
from ._whirl import Run as Run
from ._whirl import check as check
from ._whirl import info as info
from ._whirl import write as write
from ._whirl import load as load
from ._whirl import save as save
from ._whirl import validate as validate
from ._whirl import at_common_instants as at_common_instants
from ._whirl import score as score
from ._whirl import find_vibration as find_vibration
from ._whirl import stiffness as stiffness
from ._whirl import frf as frf
from ._whirl import modes as modes
from ._whirl import run as run
from ._whirl import balance as balance
from ._whirl import oma as oma
from ._whirl import response as response
from ._whirl import export as export
from ._whirl import regression_methods as regression_methods
from ._whirl import sparse_regression as sparse_regression
from ._whirl import smooth as smooth
from ._whirl import finite_difference as finite_difference
from .differentiation import FiniteDifference as FiniteDifference
from .differentiation import SmoothedFiniteDifference as SmoothedFiniteDifference
from .differentiation import SmoothingSpline as SmoothingSpline
from .differentiation import SpectralDerivative as SpectralDerivative
from .libraries import ConcatLibrary as ConcatLibrary
from .libraries import CustomLibrary as CustomLibrary
from .libraries import FourierLibrary as FourierLibrary
from .libraries import GeneralizedLibrary as GeneralizedLibrary
from .libraries import IdentityLibrary as IdentityLibrary
from .libraries import PolynomialLibrary as PolynomialLibrary
from .libraries import TensoredLibrary as TensoredLibrary
from .libraries import TermLibrary as TermLibrary
from .optimizers import FROLS as FROLS
from .optimizers import SR3 as SR3
from .optimizers import SSR as SSR
from .optimizers import STLSQ as STLSQ
from .optimizers import EnsembleOptimizer as EnsembleOptimizer
from .optimizers import SparseRegression as SparseRegression
from .results import Comparison as Comparison
from .results import Decay as Decay
from .results import Derivation as Derivation
from .results import Margins as Margins
from .results import Robustness as Robustness
from .results import RunUpPlan as RunUpPlan
from .results import SineTest as SineTest
from .results import Transient as Transient
from . import rotor as rotor
from .sindy import SINDy as SINDy
from .studies import compare as compare
from .studies import decay as decay
from .studies import derive as derive
from .studies import margins as margins
from .studies import report as report
from .studies import robustness as robustness
from .studies import runup as runup
from .studies import simulate as simulate
from .studies import sine as sine
from .studies import transient as transient

__version__: str

def read(path: str | Path | Frame, *, rate: float | None = ..., columns: Sequence[str] = ...) -> Recording: ...
def identify(records: Recording | Sequence[Recording], method: str = ..., *, states: Sequence[str] = ...,
             inputs: Sequence[str] = ..., order: int = ..., library: Sequence[str] = ..., discrete: bool = ...,
             holdout: float = ..., bounds: Sequence[str] = ..., least_decay: float = ..., trapping: bool = ...,
             hold: Mapping[str, str] | None = ..., dead_time: Mapping[str, float] | None = ..., hidden: int = ...,
             denominators: Sequence[str] = ..., progress: Callable[[str, float], object] | None = ...) -> Identification: ...
def design(model: Model, *, law: str = ..., estimator: str = ..., mass_kg: float | None = ...,
           stiffness: StiffnessLaw | None = ..., modes: ModalModel | None = ..., data_sheets: VirtualRig | None = ..., feedforward: bool = ...,
           fixed: Mapping[str, float] | None = ..., evaluations: int = ..., seed: int = ...,
           progress: Callable[[float], object] | None = ...) -> Controller: ...
