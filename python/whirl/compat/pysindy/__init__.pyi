from . import differentiation as differentiation
from . import feature_library as feature_library
from . import optimizers as optimizers
from . import utils as utils
from ._core import DiscreteSINDy as DiscreteSINDy
from ._core import SINDy as SINDy
from .differentiation import FiniteDifference as FiniteDifference
from .differentiation import SINDyDerivative as SINDyDerivative
from .differentiation import SmoothedFiniteDifference as SmoothedFiniteDifference
from .differentiation import SpectralDerivative as SpectralDerivative
from .feature_library import ConcatLibrary as ConcatLibrary
from .feature_library import CustomLibrary as CustomLibrary
from .feature_library import FourierLibrary as FourierLibrary
from .feature_library import GeneralizedLibrary as GeneralizedLibrary
from .feature_library import IdentityLibrary as IdentityLibrary
from .feature_library import ParameterizedLibrary as ParameterizedLibrary
from .feature_library import PolynomialLibrary as PolynomialLibrary
from .feature_library import TensoredLibrary as TensoredLibrary
from .optimizers import FROLS as FROLS
from .optimizers import SR3 as SR3
from .optimizers import SSR as SSR
from .optimizers import STLSQ as STLSQ
from .optimizers import BaseOptimizer as BaseOptimizer
from .optimizers import EnsembleOptimizer as EnsembleOptimizer
from .optimizers import WrappedOptimizer as WrappedOptimizer

__version__: str
