"""whirl: from records of a rotor's run-up or run-down to its equations of motion and to a controller of its vibration.

    import whirl
    record = whirl.VirtualRig({"rotor.added_mass_g": 5}).record(seed=1)
    model = whirl.identify(record)
    print(model, model.parameters["k1"])

All values are SI. A result carries `summary` (status, warnings, what it may be trusted for); bad input raises
`whirl.Error`, a ValueError whose message names the field, the value and what is allowed.
"""
from ._whirl import (  # noqa: F401
    Controller,
    Equation,
    Error,
    Estimate,
    FrequencyResponse,
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
from .sindy import (  # noqa: F401
    CustomLibrary,
    FiniteDifference,
    FourierLibrary,
    PolynomialLibrary,
    SINDy,
    SmoothingSpline,
    SparseRegression,
    STLSQ,
    TermLibrary,
)


def identify(records, method=None, *, states=(), inputs=(), order=1, library=(), discrete=False):
    """Equations of motion from one record or a list of records.

    Rotor records (channels x, y in m and beta in rad) need no more. Any other system: name its `states` and `inputs`
    (channels); `order=2` for displacements whose rates are not measured, `library` for candidate terms as text
    (default: monomials), `discrete=True` for maps. `method`: "weak" (rotor) or "sindy"; by default the one that fits
    the arguments. Returns a Model; raises Error for missing channels.
    """
    if isinstance(records, Recording):
        records = [records]
    if method is None:
        method = "sindy" if states else "weak"
    return _identify(list(records), method, list(states), list(inputs), order, list(library), discrete)
