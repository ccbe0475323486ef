"""whirl: from records of a rotor's run-up or run-down to its equations of motion and to a controller of its vibration.

    import whirl
    record = whirl.VirtualRig({"rotor.added_mass_g": 5}).record(seed=1)
    found = whirl.identify(record)
    print(found, found.parameters["k1"], found.summary)

All values are SI. A result carries `summary` (status, warnings, what it may be trusted for); bad input raises
`whirl.Error`, a ValueError whose message names the field, the value and what is allowed.
"""
from ._whirl import (  # noqa: F401
    Controller,
    Equation,
    Error,
    Estimate,
    FrequencyResponse,
    Identification,
    Metrics,
    ModalModel,
    Mode,
    Model,
    Recording,
    Run,
    Status,
    StiffnessLaw,
    Summary,
    Term,
    Validation,
    VirtualRig,
    __version__,
    balance,
    design,
    export,
    finite_difference,
    frf,
    load,
    modes,
    read,
    regression_methods,
    run,
    save,
    score,
    smooth,
    sparse_regression,
    stiffness,
    validate,
    write,
)
from ._whirl import _identify
from . import plot as _plot
from .differentiation import FiniteDifference, SmoothingSpline  # noqa: F401
from .libraries import CustomLibrary, FourierLibrary, PolynomialLibrary, TermLibrary  # noqa: F401
from .optimizers import STLSQ, SparseRegression  # noqa: F401
from .sindy import SINDy  # noqa: F401


Recording.plot = _plot.recording
FrequencyResponse.plot = _plot.frequency_response
Run.plot = _plot.run


def identify(records, method="automatic", *, states=(), inputs=(), order=1, library=(), discrete=False, holdout=0.3,
             progress=None):
    """Equations of motion from one record or a list of records; returns an Identification.

    Rotor records (channels x, y in m and beta in rad) need no more. Any other system: name its `states` and `inputs`
    (channels); `order=2` for displacements whose rates are not measured, `library` for candidate terms as text
    (default: monomials), `discrete=True` for maps. `holdout`: share of the record that a second fit does not see and
    is judged on (0: no second fit). `progress(what, fraction)` is called now and then. Methods as in `whirl identify`:
    automatic, weak, sindy, paper, consistent, second-order. Raises Error for missing channels.
    """
    if isinstance(records, Recording):
        records = [records]
    return _identify(list(records), method, list(states), list(inputs), order, list(library), discrete, holdout, progress)
