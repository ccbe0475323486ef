from ...libraries import ConcatLibrary as ConcatLibrary
from ...libraries import CustomLibrary as CustomLibrary
from ...libraries import FourierLibrary as FourierLibrary
from ...libraries import GeneralizedLibrary as GeneralizedLibrary
from ...libraries import IdentityLibrary as IdentityLibrary
from ...libraries import Library
from ...libraries import PolynomialLibrary as PolynomialLibrary
from ...libraries import TensoredLibrary as TensoredLibrary

BaseFeatureLibrary = Library

class ParameterizedLibrary(BaseFeatureLibrary):
    def __init__(self, parameter_library: BaseFeatureLibrary | None = ..., feature_library: BaseFeatureLibrary | None = ...,
                 num_parameters: int = ..., num_features: int = ...) -> None: ...
