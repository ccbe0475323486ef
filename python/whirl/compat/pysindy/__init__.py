"""The names and arguments of PySINDy 2.1 on whirl's library.

    import whirl.compat.pysindy as ps
    model = ps.SINDy(optimizer=ps.STLSQ(threshold=0.1)).fit(x, t=t, feature_names=["x", "y"])
    model.print()

The chain is that of PySINDy: differentiation, candidate matrix, sparse regression. docs/python-pysindy.md lists what is
not here and what differs. `whirl.SINDy` identifies without a derivative and without a threshold.
"""
from . import differentiation, feature_library, optimizers, utils  # noqa: F401
from ._core import DiscreteSINDy, SINDy  # noqa: F401
from ._missing import missing as _missing
from .differentiation import (  # noqa: F401
    FiniteDifference,
    SINDyDerivative,
    SmoothedFiniteDifference,
    SpectralDerivative,
)
from .feature_library import (  # noqa: F401
    ConcatLibrary,
    CustomLibrary,
    FourierLibrary,
    GeneralizedLibrary,
    IdentityLibrary,
    ParameterizedLibrary,
    PolynomialLibrary,
    TensoredLibrary,
)
from .optimizers import FROLS, SR3, SSR, STLSQ, BaseOptimizer, EnsembleOptimizer, WrappedOptimizer  # noqa: F401

__version__ = "2.1.0"  # of PySINDy, whose names these are

__getattr__ = _missing(__name__)
