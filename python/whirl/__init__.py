"""whirl: from records of a rotor's run-up or run-down to its equations of motion and to a controller of its vibration.

    import whirl
    record = whirl.VirtualRig({"rotor.added_mass_g": 5}).record(seed=1)
    found = whirl.identify(record)
    print(found, found.parameters["k1"], found.summary)

All values are SI. A result carries `summary` (status, warnings, what it may be trusted for); bad input raises
`whirl.Error`, a ValueError whose message names the place, the value and what is allowed; they are also its attributes
`file` and `line`, or `field`, `value` and `allowed` (None where the message names none).
"""
import pathlib as _pathlib
import re as _re
import tempfile as _tempfile

from . import _processor

__path__[:0] = _processor.faster_modules(__path__[0])

from ._whirl import (  # noqa: F401
    Controller,
    Equation,
    Error,
    Estimate,
    Finding,
    FrequencyResponse,
    Identification,
    Metrics,
    ModalModel,
    Mode,
    Model,
    OperationalMode,
    OperationalModes,
    Recording,
    RecordFinding,
    RecordReport,
    Run,
    RunupMode,
    Status,
    SteadyResponse,
    StiffnessLaw,
    Summary,
    Term,
    Validation,
    VirtualRig,
    __version__,
    at_common_instants,
    balance,
    check,
    export,
    find_vibration,
    finite_difference,
    frf,
    info,
    load,
    modes,
    oma,
    regression_methods,
    response,
    run,
    save,
    score,
    smooth,
    sparse_regression,
    stiffness,
    validate,
    write,
)
from ._whirl import _design, _identify
from ._whirl import read as _read
from . import _display
from . import plot as _plot
from .differentiation import FiniteDifference, SmoothedFiniteDifference, SmoothingSpline, SpectralDerivative  # noqa: F401
from .libraries import (  # noqa: F401
    ConcatLibrary,
    CustomLibrary,
    FourierLibrary,
    GeneralizedLibrary,
    IdentityLibrary,
    PolynomialLibrary,
    TensoredLibrary,
    TermLibrary,
)
from .optimizers import FROLS, SR3, SSR, STLSQ, EnsembleOptimizer, SparseRegression  # noqa: F401
from .results import (  # noqa: F401
    Comparison,
    Decay,
    Derivation,
    Margins,
    Robustness,
    RunUpPlan,
    SineTest,
    Transient,
)
from .sindy import SINDy  # noqa: F401
from .studies import compare, decay, derive, margins, report, robustness, runup, simulate, sine, transient  # noqa: F401
from . import rotor  # noqa: F401

_display.install()


def _place(pattern, group):
    """What an Error's message names: its first words have one of two forms (whirl::Error::in_file and in_field)."""
    compiled = _re.compile(pattern, _re.DOTALL)

    def read(self):
        found = compiled.match(str(self))
        value = found and found[group]
        return int(value) if value and group == "line" else value or None

    return property(read)


_FILE, _FIELD = r"(?P<file>[^:\n]*\.\w+)(?::(?P<line>\d+))?: ", r"(?P<field>[^:=]+?) = (?P<value>.*?): must be (?P<allowed>.*)"
for _name in ("file", "line"):
    setattr(Error, _name, _place(_FILE, _name))
for _name in ("field", "value", "allowed"):
    setattr(Error, _name, _place(_FIELD, _name))

Recording.plot = _plot.recording
FrequencyResponse.plot = _plot.frequency_response
Run.plot = _plot.run
SteadyResponse.plot = _plot.steady_response
ModalModel.plot = OperationalModes.plot = _plot.modes
Model.plot = Identification.plot = _plot.parameters


def read(path, *, rate=None, columns=()):
    """A record from a file: CSV, UFF, ATFX, MAT, HDF5, WAV or LVM, found from its first bytes; or from a
    pandas.DataFrame whose columns are named like those of a CSV file (t_s, x_mm, ...; the index may be the time, with its
    name). `rate` in Hz for records without time; `columns` selects and names channels as --columns does.
    """
    if not hasattr(path, "to_csv"):
        return _read(path, rate=rate, columns=_names(columns))
    with _tempfile.TemporaryDirectory() as folder:
        file = _pathlib.Path(folder) / "DataFrame.csv"
        path.to_csv(file, index=isinstance(path.index.name, str))
        return _read(file, rate=rate, columns=_names(columns))


def _recordings(records):
    if hasattr(records, "to_csv"):
        raise TypeError("a DataFrame is no whirl.Recording: whirl.read(frame) makes one of columns such as t_s, x_mm, beta_rad")
    if isinstance(records, (str, bytes)) or not hasattr(records, "__iter__"):
        raise TypeError(f"{records!r} is no whirl.Recording: read a file with whirl.read, or make one of arrays")
    records = list(records)
    for record in records:
        if not isinstance(record, Recording):
            raise TypeError(f"{record!r} is no whirl.Recording: read a file with whirl.read, or make one of arrays")
    return records


def _names(words):
    """One name is a list of one, not of its letters."""
    return [words] if isinstance(words, str) else list(words)


def identify(records, method="automatic", *, states=(), inputs=(), order=1, library=(), discrete=False, holdout=0.3,
             bounds=(), least_decay=float("nan"), trapping=False, hold=None, dead_time=None, hidden=0, denominators=(), progress=None):
    """Equations of motion from one record or a list of records; returns an Identification.

    Rotor records (channels x, y in m and beta in rad) need no more. Any other system: name its `states` and `inputs`
    (channels); `order=2` for displacements whose rates are not measured, `library` for candidate terms as text
    (default: monomials), `discrete=True` for maps. `holdout`: share of the record that a second fit does not see and
    is judged on (0: no second fit). `bounds`: inequalities between coefficients as text ("[v': x] + 2*[v': v] <= -1");
    `least_decay`: least rate, 1/s, at which every mode of the linear part decays; `trapping=True`: a quadratic
    system whose motion stays bounded from any start; `hold`: what an input does between its
    samples ({"u": "zero"}, "first" or "band-limited"; else by evidence), `dead_time` in s ({"u": 0.02}); `hidden`: states
    without a channel, at most; `denominators`: candidate terms of rational right-hand sides. `progress(what, fraction)`
    is called now and then. Methods as in `whirl identify`: automatic, weak, sindy, paper, consistent, second-order.
    Interpretations that the records cannot separate are listed in `ambiguities`. Raises Error for missing channels.
    """
    records = [records] if isinstance(records, Recording) else _recordings(records)
    if hidden < 0:
        raise Error(f"hidden = {hidden}: must be between 0 and 4")
    if progress is not None and not callable(progress):
        raise TypeError("progress must be a function of (what, fraction)")
    return _identify(records, method, _names(states), _names(inputs), order, _names(library), discrete, holdout,
                     _names(bounds), least_decay, bool(trapping), dict(hold or {}), dict(dead_time or {}), hidden, list(denominators), progress)


def design(model, *, law="tsmc", estimator="kfe", mass_kg=None, stiffness=None, modes=None, data_sheets=None, feedforward=True,
           fixed=None, evaluations=160, seed=1, progress=None):
    """A controller tuned on the identified model. The mass comes from mass_kg or from the stiffness law of a static
    stiffness test; `modes`: of a hammer test, the tuning plant gets them; `data_sheets`: a VirtualRig whose sensors,
    actuators and profile are known; `fixed`: parameters that are not tuned. `progress(fraction)` is called now and then."""
    return _design(model, mass_kg, stiffness, modes, data_sheets, law=law, estimator=estimator, feedforward=feedforward,
                   fixed=dict(fixed or {}), evaluations=evaluations, seed=seed, progress=progress)
