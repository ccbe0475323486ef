"""How values show themselves: text, HTML, tables."""
import html
import json
import pathlib
import tempfile

import numpy as np

from . import _whirl

ESTIMATE_COLUMNS = ("value", "sd", "low", "high", "unit")


def number(value):
    """A number as text, six digits."""
    if value is None or isinstance(value, float) and np.isnan(value):
        return ""
    return f"{value:.6g}" if isinstance(value, (int, float, np.floating)) and not isinstance(value, bool) else str(value)


def estimate_text(name, value, sd, low, high, unit):
    text = f"{name:<12} {number(value)}"
    if sd is not None and np.isfinite(sd) and sd > 0:
        text += f" ± {sd:.2g}"
    if low is not None and np.isfinite(low):
        text += f"  [{number(low)}, {number(high)}]"
    return text + (f" {unit}" if unit and unit != "1" else "")


def head(value, title):
    """The first line of a result, and its warnings."""
    summary = value.summary
    lines = [f"{title}: {summary.status.name}"]
    return lines + [f"  ! {warning}" for warning in summary.warnings]


def table_html(columns, caption=""):
    """Columns (name -> values) as an HTML table; of more than 30 rows the first 30."""
    names = list(columns)
    rows = list(zip(*columns.values()))
    cells = ["<table>"] + ([f"<caption>{html.escape(caption)}</caption>"] if caption else [])
    cells.append("<tr>" + "".join(f"<th>{html.escape(str(name))}</th>" for name in names) + "</tr>")
    cells += ["<tr>" + "".join(f"<td>{html.escape(number(cell))}</td>" for cell in row) + "</tr>" for row in rows[:30]]
    if len(rows) > 30:
        cells.append(f"<tr><td colspan='{len(names)}'>{len(rows) - 30} more rows</td></tr>")
    return "".join(cells) + "</table>"


def frame(columns, index=None):
    import pandas

    data = pandas.DataFrame(columns)
    return data.set_index(index) if index else data


def estimates(named):
    """Columns of estimates: {name: (Estimate, unit)}."""
    columns = {"name": list(named), **{c: [] for c in ESTIMATE_COLUMNS}}
    for estimate, unit in named.values():
        for column in ESTIMATE_COLUMNS[:-1]:
            columns[column].append(getattr(estimate, column))
        columns["unit"].append(unit)
    return columns


def lines_of(columns, title):
    """Estimates one a line under a title."""
    rows = zip(*(columns[c] for c in ("name", *ESTIMATE_COLUMNS)))
    return [title] + ["  " + estimate_text(*row) for row in rows] if columns["name"] else []


# -- the values of the C++ library


def _model_columns(model):
    units = {name: p.get("unit", "") for name, p in json.loads(model.to_json())["parameters"].items()}
    return estimates({name: (estimate, units.get(name, "")) for name, estimate in model.parameters.items()})


def _modes_columns(modes):
    columns = {"mode": list(range(1, len(modes) + 1))}
    for name, part in (("frequency_Hz", "frequency"), ("damping", "damping")):
        columns[name] = [getattr(mode, part).value for mode in modes.modes]
        columns[name + "_sd"] = [getattr(mode, part).sd for mode in modes.modes]
    return columns


def _response_columns(found):
    return {"speed_rpm": found.speed * 30 / np.pi, "amplitude": found.amplitude, "phase_rad": found.phase, "stable": found.stable}


def _metrics_columns(metrics):
    segments = list(metrics.open)
    return {"segment": segments, **{name: [getattr(metrics, name)[s] for s in segments] for name in ("open", "closed", "suppression")}}


def _frf_columns(frf):
    columns = {"frequency_Hz": frf.frequency}
    for (response, reference), values in zip(frf.names, frf.values.T):
        columns[f"{response}/{reference}"] = values
    return columns


def _controller_columns(controller):
    pairs = [("parameter", name, value) for name, value in controller.parameters.items()]
    pairs += [("margin", name, value) for name, value in controller.margins.items()]
    return {"kind": [p[0] for p in pairs], "name": [p[1] for p in pairs], "value": [p[2] for p in pairs]}


def _law_columns(law):
    return estimates({"k1": (law.k1, "N/m"), "k2": (law.k2, "N/m^3"), "offset": (law.offset, "m")})


def _validation_columns(found):
    rms, peak = found.unit + " rms", found.unit + " peak"
    units = {"rmse_x": rms, "rmse_y": rms, "nrmse": "1", "noise_x": rms, "noise_y": rms, "peak_measured": peak, "peak_simulated": peak}
    return {"name": list(units), "value": [getattr(found, name) for name in units], "unit": list(units.values())}


def _findings_columns(report):
    names = ("kind", "severity", "channel", "begin", "end", "samples", "size", "frequency", "advice")
    return {name: [getattr(finding, name) for finding in report.findings] for name in names}


def _pairs(columns, titled=False):
    rows = ([list(columns)] if titled else []) + list(zip(*columns.values()))
    return ["  " + "  ".join(f"{number(cell):<14}" for cell in row).rstrip() for row in rows]


def _model_text(model, title="whirl.Model"):
    equations = [f"  {line}" for line in str(model).rstrip("\n").splitlines()]
    return head(model, f"{title} by {model.method}") + equations + lines_of(_model_columns(model), "parameters")


def _identification_text(found):
    lines = _model_text(found.model, "whirl.Identification")
    lines[: len(head(found.model, ""))] = head(found, f"whirl.Identification by {found.model.method}")
    lines += [f"held out       {state}: error {number(s['nrmse'])} of the motion (rms)" for state, s in found.held_out.items()]
    return lines + [f"ambiguous      {a['readings']}" for a in found.ambiguities]


def _csv_header(record):
    """The names that the columns of a record have in a CSV file, the time first."""
    short = _whirl.Recording({name: np.zeros(2) for name in record.names}, dt=1.0, units=record.units)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "names.csv"
        _whirl.write(path, short)
        return path.read_text().splitlines()[0].split(",")


def _recording_frame(record):
    """Columns as in a CSV file (x_m, beta_rad; the time t_s as index), so that whirl.read takes the frame back."""
    names = _csv_header(record)
    return frame({names[0]: record.t, **{name: record[channel] for name, channel in zip(names[1:], record.names)}}, names[0])


def _install(kind, columns, text, index=None):
    """Gives a class of the C++ module its repr, HTML and table."""
    kind.__repr__ = lambda self: "\n".join(text(self))
    if columns is None:
        return
    kind._repr_html_ = lambda self: f"<pre>{html.escape(text(self)[0])}</pre>" + table_html(columns(self))
    kind.to_pandas = lambda self: frame(columns(self), index)


def install():
    w = _whirl
    _install(w.Model, _model_columns, _model_text, "name")
    _install(w.Identification, lambda found: _model_columns(found.model), _identification_text, "name")
    _install(w.ModalModel, _modes_columns, lambda m: head(m, f"whirl.ModalModel, {len(m)} modes") + _pairs(_modes_columns(m), True), "mode")
    _install(w.OperationalModes, _modes_columns,
             lambda m: head(m, f"whirl.OperationalModes, {len(m)} modes") + _pairs(_modes_columns(m), True), "mode")
    _install(w.SteadyResponse, _response_columns,
             lambda f: head(f, f"whirl.SteadyResponse, {len(f.speed)} points") + [
                 f"  {kind} at {number(speed * 30 / np.pi)} rpm, amplitude {number(height)}" for kind, speed, height in f.events])
    _install(w.FrequencyResponse, _frf_columns, lambda f: head(
        f, f"whirl.FrequencyResponse ({f.kind}), {len(f.frequency)} lines to {number(f.frequency[-1])} Hz") + [
            f"  {response}/{reference}" for response, reference in f.names], "frequency_Hz")
    _install(w.Metrics, _metrics_columns, lambda m: ["whirl.Metrics: " + ("stable" if m.stable else "not stable"),
                                                     "  m peak of the disk centre, by segment"]
             + _pairs(_metrics_columns(m), True), "segment")
    _install(w.Run, lambda r: _metrics_columns(r.metrics), lambda r: [f"whirl.Run, {len(r.log)} ticks"] + repr(r.metrics).splitlines(),
             "segment")
    _install(w.Controller, _controller_columns, lambda c: head(c, f"whirl.Controller {c.law} with {c.estimator}")
             + _pairs(_controller_columns(c)), "name")
    _install(w.StiffnessLaw, _law_columns, lambda law: head(law, "whirl.StiffnessLaw") + lines_of(_law_columns(law), "k1 d + k2 d^3"),
             "name")
    _install(w.Validation, _validation_columns, lambda v: head(v, "whirl.Validation") + _pairs(_validation_columns(v)), "name")
    w.RecordReport.to_pandas = lambda self: frame(_findings_columns(self))
    w.RecordReport._repr_html_ = lambda self: table_html(_findings_columns(self), "refused" if self.refused else "usable")
    w.Recording.to_pandas = _recording_frame
    w.Recording._repr_html_ = lambda self: table_html(
        {"channel": self.names, "unit": [self.units[n] for n in self.names], "minimum": [float(np.min(self[n])) for n in self.names],
         "maximum": [float(np.max(self[n])) for n in self.names]}, f"{self.source}: {len(self)} samples every {self.dt:g} s")
    w.RunupMode.__repr__ = lambda self: (f"whirl.RunupMode at {number(self.omega.value * 30 / np.pi)} ± {self.omega.sd * 30 / np.pi:.2g} rpm, "
                                        f"damping ratio {number(self.zeta.value)} ± {self.zeta.sd:.2g}")
    w.VirtualRig.__repr__ = lambda self: "whirl.VirtualRig\n" + "\n".join(f"  {line}" for line in self.toml().splitlines() if line)
    w.Estimate.__reduce__ = lambda self: (w.Estimate, (self.value, self.sd, self.low, self.high))
    w.Equation.__repr__ = lambda self: f"{self.lhs} = " + " + ".join(repr(term) for term in self.terms)
