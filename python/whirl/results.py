"""Results of the studies as dataclasses. Each has `summary`, `to_pandas()`, `to_json()`, most have `plot()`."""
import html
import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._display import estimates, frame, head, lines_of, number, table_html
from ._whirl import Controller, Estimate, Model, Summary


def _estimate(entry):
    """(Estimate, unit) of a JSON member; NaN for what is not known."""
    numbers = [entry["value"], entry.get("sd"), *entry["ci95"]]
    return Estimate(*(np.nan if v is None else v for v in numbers)), entry.get("unit", "")


def _panel(axes, rows=1):
    from .plot import _axes

    return np.atleast_1d(_axes(axes, rows))


@dataclass(repr=False)
class Result:
    """Base: `document` is the content of the JSON file that the program writes of the same study."""

    summary: Summary
    document: dict

    def _columns(self):
        """The table of the result: column name -> values."""
        raise NotImplementedError

    def _lines(self):
        """What repr says below the first line."""
        return []

    def __repr__(self):
        return "\n".join(head(self, f"whirl.{type(self).__name__}") + [f"  {line}" for line in self._lines()])

    def _repr_html_(self):
        return f"<pre>{html.escape(repr(self))}</pre>" + table_html(self._columns())

    def to_pandas(self):
        return frame(self._columns())

    def to_json(self):
        return json.dumps(self.document)


@dataclass(repr=False)
class NonlinearMode(Result):
    """One mode x'' + c x' + q |x'| x' + f sgn(x') + k1 x + k3 x^3 + k5 x^5 = u, per unit of modal mass."""

    model: Model

    @property
    def parameters(self):
        return {name: _estimate(self.document[name])[0] for name in ("k1", "k3", "k5", "c", "q", "f")}

    @property
    def lowest(self):
        """Smallest amplitude that the data covered."""
        return self.document["lowest"]

    @property
    def highest(self):
        return self.document["highest"]

    def frequency(self, amplitude):
        """Backbone, Hz, at amplitudes (peak) of the first harmonic."""
        p, a = {name: e.value for name, e in self.parameters.items()}, np.asarray(amplitude, dtype=float)
        square = p["k1"] + 0.75 * p["k3"] * a**2 + 0.625 * p["k5"] * a**4
        third = 0.25 * p["k3"] * a**2 / (9 * square - p["k1"] - 1.5 * p["k3"] * a**2)  # harmonic, over the first
        return np.sqrt(square + 0.75 * p["k3"] * a**2 * third) / (2 * np.pi)

    def _lines(self):
        columns = estimates({n: _estimate(self.document[n]) for n, e in self.parameters.items() if e.value})
        ends = f"{number(self.frequency(self.lowest))} Hz at the amplitude {number(self.lowest)}, " \
               f"{number(self.frequency(self.highest))} Hz at {number(self.highest)}"
        return [ends] + lines_of(columns, "per unit of modal mass")


@dataclass(repr=False)
class Decay(NonlinearMode):
    """A mode from a free decay: `points` hold amplitude, omega, rate over time, with standard deviations."""

    @property
    def points(self):
        points = self.document["points"]
        return {name: np.array([p[name] for p in points]) for name in points[0]}

    def _columns(self):
        return self.points

    def plot(self, axes=None):
        """Frequency and damping ratio over amplitude, with the fitted backbone."""
        axes, p = _panel(axes, 2), self.points
        axes[0].errorbar(p["amplitude"], p["omega"] / 2 / np.pi, 1.96 * p["omega_sd"] / 2 / np.pi, fmt="o", markersize=3)
        grid = np.linspace(self.lowest, self.highest, 200)
        axes[0].plot(grid, self.frequency(grid))
        axes[1].errorbar(p["amplitude"], p["rate"] / p["omega"], 1.96 * p["rate_sd"] / p["omega"], fmt="o", markersize=3)
        axes[0].set_ylabel("frequency [Hz]")
        axes[1].set_ylabel("damping ratio")
        axes[1].set_xlabel("amplitude, peak [SI]")
        return axes


@dataclass(repr=False)
class SineTest(NonlinearMode):
    """A mode from stepped or swept sine: `points` hold frequency_Hz, force, amplitude (peak), phase_rad; `gain` in m/s^2
    per newton, the inverse of the modal mass."""

    points: dict

    @property
    def gain(self):
        return _estimate(self.document["gain"])[0]

    def _columns(self):
        return self.points

    def _lines(self):
        return [f"modal mass {number(1 / self.gain.value)} kg"] + super()._lines()

    def plot(self, axes=None):
        """Amplitude and phase over frequency, with the backbone."""
        axes, p = _panel(axes, 2), self.points
        axes[0].scatter(p["frequency_Hz"], p["amplitude"], c=p["force"], s=8)
        grid = np.linspace(self.lowest, self.highest, 200)
        axes[0].plot(self.frequency(grid), grid, "k--", linewidth=0.8)
        axes[1].scatter(p["frequency_Hz"], np.degrees(p["phase_rad"]), c=p["force"], s=8)
        axes[0].set_ylabel("amplitude, peak [SI]")
        axes[1].set_ylabel("phase [deg]")
        axes[1].set_xlabel("frequency [Hz]")
        return axes


@dataclass(repr=False)
class Transient(Result):
    """Modes from the 1X vector of one fast run: speeds in rad/s, vectors in m peak. `steady` is the fit that takes each
    point for a steady one, for comparison."""

    modes: list
    runout: complex
    alpha: float  # rad/s^2
    fit_percent: float
    peak_speed: float
    peak_speed_measured: float
    beats: list
    beats_measured: list
    omega: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    steady: Any = None

    def _columns(self):
        return {"speed_rpm": self.omega * 30 / np.pi, "measured": self.measured, "simulated": self.simulated}

    def _lines(self):
        rpm = 30 / np.pi
        lines = [f"mode {k + 1}: {number(m.omega.value * rpm)} ± {m.omega.sd * rpm:.2g} rpm, damping ratio {number(m.zeta.value)} "
                 f"± {m.zeta.sd:.2g}" for k, m in enumerate(self.modes)]
        return lines + [f"fit {self.fit_percent:.1f} %; largest amplitude at {number(self.peak_speed * rpm)} rpm"]

    def plot(self, axes=None):
        """Amplitude and phase over speed, measured and fitted."""
        axes = _panel(axes, 2)
        for vector, style in ((self.measured, "."), (self.simulated, "-")):
            axes[0].plot(self.omega * 30 / np.pi, np.abs(vector), style, markersize=3, label="measured" if style == "." else "fitted")
            axes[1].plot(self.omega * 30 / np.pi, np.degrees(np.unwrap(np.angle(vector))), style, markersize=3)
        axes[0].set_ylabel("1X amplitude, peak [m]")
        axes[0].legend()
        axes[1].set_ylabel("phase [deg]")
        axes[1].set_xlabel("speed [rpm]")
        return axes


@dataclass(repr=False)
class Margins(Result):
    """Margins of a control loop over the speed. `plants`: one entry for each choice of the signs that are not known."""

    @property
    def plants(self):
        return self.document["plants"]

    @property
    def worst(self):
        """The worst over speeds and plants, by the peak sensitivity."""
        return max((p["worst"] for p in self.plants), key=lambda w: w["peak_sensitivity"])

    def _columns(self):
        rows = [(plant["plant"], speed) for plant in self.plants for speed in plant["speeds"]]
        names = ("stable", "gain_up", "gain_down", "phase", "delay", "modulus", "peak_sensitivity", "zone")
        return {"plant": [p for p, _ in rows], "speed_rpm": [s["speed"] * 30 / np.pi for _, s in rows],
                **{name: [s[name] for _, s in rows] for name in names}}

    def _lines(self):
        w = self.worst
        return [f"gain {number(w['gain_down'])} to {number(w['gain_up'])}, phase {number(np.degrees(w['phase']))} deg, "
                f"delay {number(w['delay'])} s, peak sensitivity {number(w['peak_sensitivity'])} (zone {w['zone']})"]

    def plot(self, axes=None):
        """Peak sensitivity over speed, with the limits of the zones of ISO 14839-3."""
        axes, c = _panel(axes), self._columns()
        for plant in dict.fromkeys(c["plant"]):
            own = [k for k, p in enumerate(c["plant"]) if p == plant]
            axes[0].semilogy([c["speed_rpm"][k] for k in own], [c["peak_sensitivity"][k] for k in own], "o-", label=plant or None)
        for limit in (3, 4, 5):
            axes[0].axhline(limit, color="0.6", linewidth=0.8)
        axes[0].set_xlabel("speed [rpm]")
        axes[0].set_ylabel("peak sensitivity")
        return axes


@dataclass(repr=False)
class Comparison(Result):
    """Control laws on the same rig: `controllers` by label, `best` the label of the one to use."""

    controllers: dict[str, Controller]

    @property
    def best(self):
        return self.document["best"]

    def _columns(self):
        m = self.document["methods"]
        return {"method": [x["method"] for x in m], "peak_mean_m": [x["peak_mean"] for x in m], "peak_worst_m": [x["peak_worst"] for x in m],
                "suppression": [x["run"]["whole"]["suppression"] for x in m], "force_rms_N": [x["run"]["force_rms"] for x in m],
                "stable": [x["run"]["stable"] for x in m], "stable_everywhere": [x["stable_everywhere"] for x in m]}

    def _lines(self):
        c = self._columns()
        return [f"best: {self.best}"] + [f"{label:<28} {1e6 * peak:8.1f} um peak{'' if ok else ', not stable'}"
                                         for label, peak, ok in zip(c["method"], c["peak_mean_m"], c["stable"])]

    def plot(self, axes=None):
        """Peak over the effort, one point a method."""
        axes, c = _panel(axes), self._columns()
        for label, force, peak in zip(c["method"], c["force_rms_N"], c["peak_mean_m"]):
            axes[0].plot(force, 1e6 * peak, "o")
            axes[0].annotate(label, (force, 1e6 * peak), fontsize=7, xytext=(3, 3), textcoords="offset points")
        axes[0].set_xlabel("force, rms [N]")
        axes[0].set_ylabel("whole-run peak [um]")
        return axes


@dataclass(repr=False)
class Robustness(Result):
    """A controller on machines drawn from the uncertainty of the model. `exceeds`: probability of exceeding the limit,
    with its 95 % interval; None without a limit."""

    @property
    def stable(self):
        return self._share("stable")

    @property
    def exceeds(self):
        return self._share("exceeds")

    def _share(self, name):
        share = self.document[name]
        return None if share is None else Estimate(share["value"], np.nan, *share["ci95"])

    def _columns(self):
        return self.document["samples"]

    def _lines(self):
        d = self.document
        lines = [f"peak: median {number(d['peak_median'])} m, 95 % below {number(d['peak_p95'])} m, largest {number(d['peak_worst'])} m",
                 f"stable: {100 * self.stable.value:.1f} % [{100 * self.stable.low:.1f}, {100 * self.stable.high:.1f}]"]
        if self.exceeds:
            lines.append(f"above {number(d['limit'])} m: {100 * self.exceeds.value:.1f} % [{100 * self.exceeds.low:.1f}, {100 * self.exceeds.high:.1f}]")
        return lines

    def plot(self, axes=None):
        """Distribution of the whole-run peak, with the limit."""
        axes = _panel(axes)
        axes[0].hist(1e6 * np.asarray(self.document["samples"]["peak"]), bins=30)
        if self.document["limit"]:
            axes[0].axvline(1e6 * self.document["limit"], color="k")
        axes[0].set_xlabel("whole-run peak [um]")
        axes[0].set_ylabel("machines")
        return axes


@dataclass(repr=False)
class RunUpPlan(Result):
    """How fast to run up and down: `up` and `down` with passages, slowest_safe, fastest_useful, suggested (rad/s^2)."""

    @property
    def up(self):
        return self.document["up"]

    @property
    def down(self):
        return self.document["down"]

    def _columns(self):
        rows = [(name, p) for name in ("up", "down") for p in self.document[name]["passages"]]
        return {"direction": [n for n, _ in rows], "rate_rpm_s": [p["rate"] * 30 / np.pi for _, p in rows],
                "peak_m": [p["peak"] for _, p in rows], "peak_speed_rpm": [p["peak_speed"] * 30 / np.pi for _, p in rows]}

    def _lines(self):
        lines = []
        for name in ("up", "down"):
            curve = self.document[name]
            for key, words in (("suggested", "suggested"), ("slowest_safe", "slowest that keeps the limit"), ("fastest_useful", "fastest useful")):
                if key in curve:
                    lines.append(f"run-{name}: {words} {number(curve[key] * 30 / np.pi)} rpm/s")
        return lines

    def plot(self, axes=None):
        """Largest radius over the acceleration, both directions, with the limit."""
        axes = _panel(axes)
        for name in ("up", "down"):
            passages = self.document[name]["passages"]
            axes[0].loglog([p["rate"] * 30 / np.pi for p in passages], [1e3 * p["peak"] for p in passages], "o-", markersize=3,
                           label=f"run-{name}")
        if "limit" in self.document:
            axes[0].axhline(1e3 * self.document["limit"], color="0.4", linewidth=0.8)
        axes[0].set_xlabel("acceleration [rpm/s]")
        axes[0].set_ylabel("largest radius, peak [mm]")
        axes[0].legend()
        return axes


@dataclass(repr=False)
class Derivation(Result):
    """Equations of motion from energies: `text` and `latex`, `library` as TOML for identification, and with a model the
    physical `parameters`, `combinations` and `reported` terms as estimates."""

    text: str
    latex: str
    library: str

    def _named(self):
        return {name: _estimate(entry) for part in ("parameters", "combinations", "reported")
                for name, entry in self.document.get(part, {}).items()}

    @property
    def parameters(self):
        return {name: _estimate(entry)[0] for name, entry in self.document.get("parameters", {}).items()}

    def _columns(self):
        if "parameters" in self.document:
            return estimates(self._named())
        groups = self.document["library"]["groups"]
        return {name: [g[name] for g in groups] for name in ("name", "coefficient", "unit")}

    def _lines(self):
        return self.text.splitlines() + lines_of(estimates(self._named()), "parameters")

    def _repr_latex_(self):
        return f"$${self.latex}$$"


__all__ = ["Comparison", "Decay", "Derivation", "Margins", "NonlinearMode", "Result", "Robustness", "RunUpPlan",
           "SineTest", "Transient"]
