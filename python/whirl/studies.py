"""The program's studies as functions: the same library calls, results as dataclasses (whirl.results)."""
import pathlib
import tempfile

import numpy as np

from . import _whirl
from .results import Comparison, Decay, Derivation, Margins, Robustness, RunUpPlan, SineTest, Transient


def simulate(model, from_rpm=None, to_rpm=None, seconds=None, *, dwell_s=0.0, rate_hz=1000.0, unbalance=1.0, eccentricity_um=None,
             phase_deg=0.0, record=None):
    """Motion of a model as a Recording: a rotor over a ramp of its speed (then `dwell_s` at the last one), from its steady
    whirl; a model of other equations over the inputs in `record`, from its first sample.

    `unbalance`: times the identified eccentricity; `eccentricity_um` at `phase_deg`: instead of it. Raises Error where the
    motion diverges.
    """
    if record is not None:
        if not (from_rpm is to_rpm is seconds is eccentricity_um is None) or unbalance != 1:
            raise TypeError("record and a speed profile exclude each other")
        return _whirl._run_over_record(model, record)
    if from_rpm is None or to_rpm is None or seconds is None:
        raise TypeError("give from_rpm, to_rpm and seconds, or record with the inputs of the model")
    offset = None if eccentricity_um is None else 1e-6 * eccentricity_um * np.exp(1j * np.radians(phase_deg))
    return _whirl._run_over_speeds(model, from_rpm, to_rpm, seconds, dwell_s, rate_hz, unbalance, offset)


def decay(record, *, channel="", start=None, stop=None, periods=8):
    """Backbone and damping over amplitude from the free decay in a channel (default: the first). `start`, `stop` in s
    (default: where the amplitude begins to fall, and where it is lost in the noise); `periods` in a window, at least 3."""
    if not 3 <= periods <= 1000:
        raise _whirl.Error(f"periods = {periods}: must be between 3 and 1000")
    document, summary, model = _whirl._decay(record, channel, -1.0 if start is None else start, -1.0 if stop is None else stop, periods)
    return Decay(summary, document, model)


def sine(data, *, force="force", channel="", periods=6):
    """One nonlinear mode from steady responses to sines at one or more force levels.

    `data`: Recordings with a swept sine (channels `force` and `channel`, default: the first other one; `periods` in a
    window), or tables, or a list of these. A table has frequency_Hz, force_N, amplitude_m (peak) and phase_rad (of the
    displacement against the force), as a dictionary or a pandas.DataFrame.
    """
    parts = [data] if isinstance(data, _whirl.Recording) or hasattr(data, "keys") else list(data)
    table, records = [], []
    for part in parts:
        if isinstance(part, _whirl.Recording):
            records.append(part)
            continue
        missing = [name for name in ("frequency_Hz", "force_N", "amplitude_m", "phase_rad") if name not in part]
        if missing:
            raise _whirl.Error(f"a table of steady responses has no {', '.join(missing)}: must have frequency_Hz, force_N, "
                               "amplitude_m and phase_rad")
        columns = [np.asarray(part[name], dtype=float) for name in ("frequency_Hz", "force_N", "amplitude_m", "phase_rad")]
        table += zip(2 * np.pi * columns[0], *columns[1:])
    document, summary, model, points = _whirl._sine(table, records, force, channel, periods)
    columns = np.array(points).T
    found = {"frequency_Hz": columns[0] / 2 / np.pi, "force": columns[1], "amplitude": columns[2], "phase_rad": columns[3]}
    return SineTest(summary, document, model, found)


def transient(omega, vector, *, modes=2):
    """Modes from the 1X vector of one fast run through critical speeds: `omega` in rad/s and the complex `vector` in m
    peak, one entry per revolution, x(t) = Re(vector exp(i beta)): a phase lag enters with minus. `modes`: 1 or 2."""
    omega, vector = np.asarray(omega, dtype=float), np.asarray(vector, dtype=complex)

    def fit(steady):
        f = _whirl._transient(omega, vector, modes, steady)
        document = {"fit_percent": f.fit_percent, "peak_speed": f.peak_speed, "alpha": f.alpha, "beats": f.beats}
        return Transient(f.summary, document, f.modes, f.runout, f.alpha, f.fit_percent, f.peak_speed, f.peak_speed_measured, f.beats,
                         f.beats_measured, omega, vector, f.simulated)

    found = fit(False)
    found.steady = fit(True)
    return found


def margins(controller, model, *, mass_kg=None, stiffness=None, modes=None, data_sheets=None, speeds=12, seed=1, threads=0):
    """Gain, phase, delay and modulus margin of the loop from standstill to the top of the profile. The plant as in
    `design`; `threads`: 0 takes all cores, the result does not depend on it."""
    document, summary = _whirl._margins(model, mass_kg, stiffness, modes, data_sheets, controller=controller, speeds=speeds, seed=seed,
                                        threads=threads)
    return Margins(summary, document)


def compare(model, *, mass_kg=None, stiffness=None, modes=None, data_sheets=None, rig=None, laws=(), balanced=None, evaluations=160,
            seeds=5, seed=1, threads=0, matrix=True):
    """Control laws on the same `rig` (default: the virtual one) with the same budget of `evaluations`, `seeds` runs each.

    `laws`: "LAW", "LAW:ESTIMATOR" or "LAW:ESTIMATOR:no-feedforward" (default: all laws and the estimators worth it);
    `balanced`: a model identified on the balanced rotor, for the balanced run; `matrix`: the robustness matrix too.
    """
    laws = [laws] if isinstance(laws, str) else list(laws)
    document, summary, controllers = _whirl._compare(
        model, mass_kg, stiffness, modes, data_sheets, rig=rig if rig is not None else _whirl.VirtualRig(), laws=laws, balanced=balanced,
        evaluations=evaluations, seeds=seeds, seed=seed, threads=threads, matrix=matrix)
    return Comparison(summary, document, controllers)


def robustness(controller, model, *, mass_kg=None, stiffness=None, modes=None, data_sheets=None, samples=200, limit_mm=0.0, seed=1,
               threads=0, progress=None):
    """A controller on `samples` machines drawn from the covariance of the model and the tolerances of the hardware;
    `limit_mm`: displacement not to be exceeded, zero-to-peak (0: none). It covers machines of the model's structure."""
    document, summary = _whirl._robustness(model, mass_kg, stiffness, modes, data_sheets, controller=controller, samples=samples,
                                           limit_mm=limit_mm, seed=seed, threads=threads, progress=progress)
    return Robustness(summary, document)


def runup(model, from_rpm, to_rpm, *, limit_mm=0.0, unbalance=1.0, slowest_rpm_s=0.0, fastest_rpm_s=0.0, drive=None):
    """How fast to run up and down between two speeds so that the radius stays within `limit_mm` (peak; 0: no limit).

    `unbalance`: times the identified eccentricity; rates from `slowest_rpm_s` to `fastest_rpm_s` (0: by the rotor);
    `drive`: a dictionary with torque_nm, inertia_kgm2, mass_kg and where known torque_slope_nms, coulomb_nm, viscous_nms,
    drag_nms2: says whether the drive comes through.
    """
    document, summary = _whirl._runup(model, from_rpm, to_rpm, limit_mm, unbalance, slowest_rpm_s, fastest_rpm_s, dict(drive or {}))
    return RunUpPlan(summary, document)


def derive(path, model=None):
    """Equations of motion, candidate terms and ties from the energies in a TOML file (docs/formats.md, system.toml); with
    an identified `model` its physical parameters."""
    document, summary, text, latex, library = _whirl._derive(path, model)
    return Derivation(summary, document, text, latex, library)


def report(*items, out="report.html", pdf=None, title="", about="", service_rpm=0.0, slow_roll_rpm=0.0):
    """One HTML page of records and results: Recordings, Models, Controllers, FrequencyResponses, ModalModels,
    StiffnessLaws, or paths of files. Returns the path. `pdf`: prints it too (needs chromium); `service_rpm`: speed that
    zones, grade and margins are stated for; `slow_roll_rpm`: the mean 1X vector below it is taken off; `about`: file with name,
    date, analyst, speeds and class of the machine (docs/formats.md)."""
    if not items:
        raise TypeError("report needs at least one record or result")
    out = pathlib.Path(out)
    with tempfile.TemporaryDirectory() as folder:
        files = [_as_file(item, pathlib.Path(folder), k) for k, item in enumerate(items, 1)]
        page = _whirl._report(files, title, service_rpm, slow_roll_rpm, pathlib.Path(about) if about else "")
    if pdf is not None:
        pathlib.Path(pdf).write_bytes(_whirl._printed(page, pdf))
    out.write_text(page, encoding="utf-8")
    return out


def _as_file(item, folder, number):
    if isinstance(item, (str, pathlib.Path)):
        return pathlib.Path(item)
    kind = type(item).__name__
    if isinstance(item, _whirl.Recording):
        path = folder / f"{pathlib.Path(item.source).stem or 'record'}_{number}.csv"
        _whirl.write(path, item)
    elif isinstance(item, _whirl.Identification):
        return _as_file(item.model, folder, number)
    elif hasattr(item, "to_json") and not hasattr(item, "document"):
        path = folder / f"{kind.lower()}_{number}.json"
        _whirl.save(path, item)
    else:
        raise TypeError(f"a report takes no {kind}: must be a Recording, Model, Controller, FrequencyResponse, ModalModel, StiffnessLaw "
                        "or the path of a file")
    return path
