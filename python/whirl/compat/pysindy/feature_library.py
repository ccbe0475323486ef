"""Feature libraries under the names of PySINDy."""
from ...libraries import (  # noqa: F401
    ConcatLibrary,
    CustomLibrary,
    FourierLibrary,
    GeneralizedLibrary,
    IdentityLibrary,
    Library,
    PolynomialLibrary,
    TensoredLibrary,
)
from ._missing import missing as _missing

BaseFeatureLibrary = Library


class ParameterizedLibrary(Library):
    """`feature_library` in the first `num_features` variables times `parameter_library` in the `num_parameters` after them."""

    def __init__(self, parameter_library=None, feature_library=None, num_parameters=3, num_features=3):
        self.parameter_library = parameter_library
        self.feature_library = feature_library
        self.num_parameters = num_parameters
        self.num_features = num_features

    def _whole(self, n):
        split = self.num_features
        if n != split + self.num_parameters:
            raise ValueError(f"{n} variables: must be num_features + num_parameters = {split + self.num_parameters}")
        parts = [self.parameter_library or PolynomialLibrary(1), self.feature_library or PolynomialLibrary()]
        return TensoredLibrary(parts, [range(split, n), range(split)])

    def terms(self, names):
        return self._whole(len(names)).terms(names)

    def names(self, names):
        return self._whole(len(names)).names(names)

    def evaluate(self, x, names):
        return self._whole(len(names)).evaluate(x, names)


__getattr__ = _missing(__name__)
