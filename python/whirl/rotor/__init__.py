"""Flexible rotors from a rotor file: modes, critical speeds, response, runs, and the machine from its records.

    import whirl
    rotor = whirl.rotor.template("two-disc")           # or whirl.rotor.read("rotor.toml")
    print(rotor.criticals(to_rpm=5000))
    record = rotor.run(3000, 300, seconds=15)
    rotor.response(to_rpm=5000).plot()

Speeds are in rpm and positions in mm where the argument says so; results are SI. docs/rotor.md describes the file.
"""
import pathlib
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _whirl
from ..results import Result, _panel

_RPM = 2 * np.pi / 60


def templates():
    """Names of the rotors to begin with."""
    return _whirl._rotor_templates()


def template(name="two-disc"):
    """A rotor to begin with: jeffcott, two-disc, overhung, centrifuge, kit, active-centrifuge or levitated. Its `text` is the file."""
    return Rotor(_whirl._rotor_template(name), name)


def read(path):
    """A rotor from its file (TOML)."""
    return Rotor(pathlib.Path(path).read_text(encoding="utf-8"), str(path))


def read_ross(path):
    """A rotor that ROSS saved (Rotor.save, TOML). What does not mean quite the same here is a warning."""
    text, remarks = _whirl._rotor_from_ross(str(path))
    for remark in remarks:
        warnings.warn(f"{path}: {remark}", stacklevel=2)
    return Rotor(text, str(path))


def _named(records):
    """(name, Recording) of one record, a list of them, or a dictionary name -> Recording."""
    from .. import _recordings  # not there yet while the package is imported

    if isinstance(records, _whirl.Recording):
        records = [records]
    names = list(records.keys()) if hasattr(records, "items") else None
    checked = _recordings(records.values() if names else records)
    return list(zip(names or [f"run{k + 1}" for k in range(len(checked))], checked))


def _controller(control):
    return control.controller if isinstance(control, RotorControl) else _whirl._RotorController(pathlib.Path(control))


class Rotor:
    """A rotor file and its finite-element model. `text`: the file, TOML."""

    def __init__(self, text, name="rotor"):
        self.text = text
        self._rotor = _whirl._Rotor(text, name)

    @property
    def name(self):
        return self._rotor.name

    @property
    def length(self):
        """Of the shaft, m."""
        return self._rotor.length

    @property
    def mass(self):
        """Of shaft and discs, kg."""
        return self._rotor.mass

    def __repr__(self):
        return f"<whirl.rotor.Rotor '{self.name}': {1e3 * self.length:.4g} mm, {self.mass:.4g} kg>"

    def modes(self, speed_rpm=0.0, count=8):
        """Modes at a speed with damping and whirl direction."""
        document, summary = self._rotor.modes(_RPM * speed_rpm, count)
        return RotorModes(summary, document)

    def criticals(self, to_rpm, order=1.0):
        """Critical speeds of an excitation `order` times a turn, and the speed from which the rotor is unstable."""
        return Criticals(_whirl.Summary(), self._rotor.criticals(_RPM * to_rpm, order))

    def campbell(self, to_rpm, points=50, count=8):
        """Whirl frequencies over speed."""
        document, summary = self._rotor.campbell(list(_RPM * np.linspace(0, to_rpm, points)), count)
        return Campbell(summary, document)

    def response(self, to_rpm, from_rpm=60.0, points=400):
        """Unbalance response of every probe; of the major axis at each disc where the file has no probe. Around peaks more
        speeds than `points` are taken."""
        document, speeds, curves, summary = self._rotor.response(list(_RPM * np.linspace(from_rpm, to_rpm, points)))
        return RotorResponse(summary, document, np.array(speeds), {name: (a, phase) for name, a, phase in curves})

    def run(self, from_rpm, to_rpm, seconds, *, rate_hz=1000.0, full=False, modes=8, weight=False, noise_db=None, seed=1):
        """A simulated run-up or run-down as a Recording: probes (or discs), accelerometers, beta. `noise_db`: rms of a channel
        over that of the noise added to it. Raises Error where the motion grows without bound."""
        noise = 0.0 if noise_db is None else noise_db
        return self._run(from_rpm, to_rpm, seconds, rate_hz, full, modes, weight, noise, seed, None)[0]

    def _run(self, from_rpm, to_rpm, *options):
        record, summary, document = self._rotor.simulate(_RPM * from_rpm, _RPM * to_rpm, *options)
        if summary.status == _whirl.Status.unusable:
            raise _whirl.Error(summary.warnings[-1])
        return record, summary, document

    def control(self, from_rpm, to_rpm, *, law="lqg", rate_hz=5000.0, modes=6, schedule=6, points=25, sensitivity=3.0, adaptation_per_s=2.0,
                share=0.8, force_weight=0.1, unbalance_unknown=False):
        """A controller: law "lqg" of all actuators from all probes, "pid" of each actuator from the displacement beside it. It is
        `refused` where the loop is unstable at any speed, also with changes of the machine (docs/rotor.md); then
        `summary.status` is unusable."""
        return RotorControl(*self._rotor.control(_RPM * from_rpm, _RPM * to_rpm, law, rate_hz, modes, schedule, points, sensitivity,
                                                 adaptation_per_s, share, force_weight, not unbalance_unknown, None))

    def check_control(self, control, from_rpm, to_rpm, *, points=25, sensitivity=3.0):
        """The same table of a controller (a RotorControl, or its file) on this rotor."""
        return RotorControl(*self._rotor.control(_RPM * from_rpm, _RPM * to_rpm, "lqg", 5000.0, 6, 6, points, sensitivity, 2.0, 0.8, 0.1,
                                                 True, _controller(control)))

    def passages(self, control, from_rpm, to_rpm, seconds, *, rate_hz=1000.0, full=False, modes=8, weight=False, seed=1):
        """A run with a controller (a RotorControl, or its file) and one without: the largest deflection at every critical speed."""
        record, summary, document = self._run(from_rpm, to_rpm, seconds, rate_hz, full, modes, weight, 0.0, seed,
                                              _controller(control))
        return Passages(summary, document, record)

    def fit(self, records, restarts=10):
        """Bearings, damping and unbalance of the machine from records of its runs, as [fit] of the file says. `records`: one
        Recording, a list, or a dictionary name -> Recording ([[trial]] names a run)."""
        return RotorFit.of(self._rotor.fit(_named(records), restarts))

    def trend(self, records, restarts=10):
        """Is it getting worse? Each record, in the order of time, fitted alone; which unknowns fall or rise."""
        document, summary = self._rotor.trend(_named(records), restarts)
        return Trend(summary, document)

    def check_load(self, record, *, sensors=(), to_rpm=0.0):
        """Is the centrifuge loaded right? Imbalance from a spin-up below the first critical speed."""
        [(_, record)] = _named(record)
        document, summary = self._rotor.check_load(record, list(sensors), _RPM * to_rpm)
        return LoadCheck(summary, document)

    def limits(self, to_rpm, from_rpm=60.0, points=200, safety=2.0):
        """Where to trip: limits of every sensor of a centrifuge over speed."""
        return SpeedLimits(_whirl.Summary(), self._rotor.limits(list(_RPM * np.linspace(from_rpm, to_rpm, points)), safety))

    def run_up_plan(self, to_rpm, limit_um, torque_nm=0.0):
        """How fast through? The acceleration that each critical speed of a centrifuge needs."""
        document, summary = self._rotor.run_up(_RPM * to_rpm, 1e-6 * limit_um, torque_nm)
        return PassagePlan(summary, document)


@dataclass(repr=False)
class _Table(Result):
    _list = ""  # member of the document whose entries are the rows
    _names = ()

    def _columns(self):
        return {name: [entry[name] for entry in self.document[self._list]] for name in self._names}

    def _lines(self):
        return [", ".join(f"{k} {v:.5g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items())
                for row in (dict(zip(self._columns(), cells)) for cells in zip(*self._columns().values()))]


@dataclass(repr=False)
class RotorControl(_Table):
    """The closed loop over speed, and its `controller`."""

    controller: Any

    def _columns(self):
        points = self.document["points"]
        columns = {name: [p[name] for p in points] for name in ("speed", "open_damping", "closed_damping", "growth")}
        return columns | {f"sensitivity_{k + 1}": [p["sensitivity"][k] for p in points] for k in range(len(points[0]["sensitivity"]))}

    @property
    def refused(self):
        """Changes of the machine with which the loop is unstable, and the first speed in rad/s; empty: none."""
        return self.document["refused"]

    @property
    def worst_sensitivity(self):
        return self.document["worst_sensitivity"]

    def save(self, path):
        """controller.json, as `whirl rotor run --controller` and `whirl export` take it. Raises Error for a refused one."""
        self._allowed().save(pathlib.Path(path))

    def export(self, form, folder, *, prefix="controller"):
        """form: 'c' (C99) or 'fmu'; returns the files. Raises Error for a refused controller."""
        return _whirl.export(self._allowed(), form, folder, prefix=prefix)

    def _allowed(self):
        if self.summary.status == _whirl.Status.unusable:
            raise _whirl.Error("; ".join(self.summary.warnings))
        return self.controller


@dataclass(repr=False)
class Passages(_Table):
    """Speeds in rad/s, deflections in m zero-to-peak; `open` is None where the rotor is unstable without control."""

    record: Any
    _list = "passages"
    _names = ("speed", "open", "closed")


@dataclass(repr=False)
class RotorModes(_Table):
    """Frequencies in rad/s."""

    def _columns(self):
        modes = self.document["modes"]
        return {name: [m[name] for m in modes] for name in ("frequency", "damping", "direction")}


@dataclass(repr=False)
class Criticals(_Table):
    """`speeds` in rad/s; `unstable_from` in rad/s or None."""

    _list = "criticals"
    _names = ("speed", "frequency", "direction")

    @property
    def speeds(self):
        return np.array([c["speed"] for c in self.document["criticals"]])

    @property
    def unstable_from(self):
        threshold = self.document["unstable_from"]
        return threshold["speed"] if threshold else None


@dataclass(repr=False)
class Campbell(Result):
    """Whirl frequencies over speed, rad/s; a line a mode."""

    @property
    def speed(self):
        return np.array([p["speed"] for p in self.document["points"]])

    @property
    def frequency(self):
        """Points x modes."""
        count = min(len(p["modes"]) for p in self.document["points"])
        return np.array([[m["frequency"] for m in p["modes"][:count]] for p in self.document["points"]])

    def _columns(self):
        return {"speed": self.speed} | {f"mode{k + 1}": line for k, line in enumerate(self.frequency.T)}

    def plot(self, axes=None):
        (ax,) = _panel(axes)
        ax.plot(self.speed / _RPM, self.frequency / 2 / np.pi)
        ax.plot(self.speed / _RPM, self.speed / 2 / np.pi, color="0.5", linestyle="--", label="1X")
        ax.set(xlabel="speed [rpm]", ylabel="whirl frequency [Hz]")
        ax.legend()
        return ax


@dataclass(repr=False)
class RotorResponse(Result):
    """`curves`: name -> (amplitude in m zero-to-peak, phase lag in rad) over `speed` in rad/s."""

    speed: np.ndarray
    curves: dict

    def _columns(self):
        return {"speed": self.speed} | {name: a for name, (a, _) in self.curves.items()}

    def _lines(self):
        return [f"{name}: {1e6 * a.max():.4g} um at {self.speed[a.argmax()] / _RPM:.0f} rpm" for name, (a, _) in self.curves.items()]

    def plot(self, axes=None):
        upper, lower = _panel(axes, 2)
        for name, (amplitude, phase) in self.curves.items():
            upper.plot(self.speed / _RPM, 1e6 * amplitude, label=name)
            lower.plot(self.speed / _RPM, np.degrees(phase))
        upper.set(ylabel="amplitude, peak [um]")
        upper.legend()
        lower.set(xlabel="speed [rpm]", ylabel="phase lag [deg]")
        return upper, lower


@dataclass(repr=False)
class RotorFit(_Table):
    """`rotor`: the Rotor with the estimates; `unknowns` in `to_pandas()`."""

    rotor: Rotor
    _fit: Any

    @classmethod
    def of(cls, fit):
        return cls(fit.summary, fit.document(), Rotor(fit.text(), "fitted"), fit)

    def _columns(self):
        rows = self.document["unknowns"]
        ends = [row["estimate"]["ci95"] for row in rows]
        return {"name": [row["name"] for row in rows], "value": [row["estimate"]["value"] for row in rows],
                "low": [e[0] for e in ends], "high": [e[1] for e in ends], "identifiable": [row["identifiable"] for row in rows]}

    def motion(self, at_mm, speeds_rpm):
        """Motion at stations and forces of the bearings over speed with intervals, as in whirl.rotor_fit/1."""
        found = self._fit.motion([1e-3 * p for p in np.atleast_1d(at_mm)], list(_RPM * np.atleast_1d(speeds_rpm)))
        return {"motions": found["motions"], "forces": found["forces"]}


@dataclass(repr=False)
class Trend(_Table):
    """`changed`: names of the unknowns that fall or rise."""

    def _columns(self):
        rows = self.document["unknowns"]
        ends = [row["change"]["ci95"] for row in rows]
        return {"name": [row["name"] for row in rows], "change": [row["change"]["value"] for row in rows],
                "low": [e[0] for e in ends], "high": [e[1] for e in ends], "changed": [row["changed"] for row in rows]}

    @property
    def changed(self):
        return [row["name"] for row in self.document["unknowns"] if row["changed"]]


@dataclass(repr=False)
class LoadCheck(Result):
    """`verdict`: right, wrong or open; `imbalance` in kg at the buckets' radius, (value, low, high)."""

    @property
    def verdict(self):
        return self.document["verdict"]

    @property
    def imbalance(self):
        e = self.document["imbalance"]
        return (e["value"], *e["ci95"])

    def _columns(self):
        return {"bucket": [c["bucket"] for c in self.document["changes"]], "mass": [c["mass"]["value"] for c in self.document["changes"]]}

    def _lines(self):
        value, low, high = (1e3 * v for v in self.imbalance)
        return [f"loaded: {self.verdict}; imbalance {value:.3g} g ({low:.3g} to {high:.3g})"]


@dataclass(repr=False)
class SpeedLimits(Result):
    def _columns(self):
        return {"speed": self.document["speed"]} | {f"{s['name']}_trip": s["trip"] for s in self.document["sensors"]}


@dataclass(repr=False)
class PassagePlan(_Table):
    """Accelerations in rad/s^2: `needed` is 0 where 30 rpm/s keeps the limit, None where none does."""

    _list = "passages"
    _names = ("critical", "needed", "peak", "peak_slow", "place")
