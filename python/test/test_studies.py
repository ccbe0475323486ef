"""The studies in Python against the program: the same document from the same files."""
import json
import os
import pickle
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import whirl

ROOT = Path(__file__).resolve().parents[2]
MASS = 1.5


def program(*arguments, cwd):
    """What the program prints with --json."""
    done = subprocess.run([os.environ["WHIRL_PROGRAM"], *map(str, arguments), "--json"], cwd=cwd, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)


def assert_same(found, wanted, path=""):
    """Equal but for the last digits, and for where a document comes from."""
    if isinstance(wanted, dict):
        for key in wanted.keys() - {"provenance", "summary", "result", "program", "command"}:
            assert key in found, f"{path}/{key}"
            assert_same(found[key], wanted[key], f"{path}/{key}")
    elif isinstance(wanted, list):
        assert len(found) == len(wanted), path
        for k, (a, b) in enumerate(zip(found, wanted)):
            assert_same(a, b, f"{path}[{k}]")
    elif isinstance(wanted, float) or isinstance(found, float):
        assert found == pytest.approx(wanted, rel=1e-6, abs=1e-12), path
    else:
        assert found == wanted, path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("studies")


@pytest.fixture(scope="module")
def model(folder):
    record = whirl.VirtualRig({"rotor.added_mass_g": 5}).record(seed=1, snr_db=20)
    found = whirl.identify(record, holdout=0).model
    whirl.write(folder / "record.csv", record)
    whirl.save(folder / "model.json", found)
    return found


@pytest.fixture(scope="module")
def controller(folder, model):
    made = whirl.design(model, law="pd", estimator="lpf", mass_kg=MASS, evaluations=10)
    whirl.save(folder / "controller.json", made)
    return made


def shows(result, first):
    """repr, HTML, table, JSON and figure of a result."""
    pytest.importorskip("matplotlib").use("Agg")
    text = repr(result)
    assert text.startswith(first) and len(text.splitlines()) > 1 and "<table>" in result._repr_html_()
    assert len(pytest.importorskip("pandas").DataFrame(result.to_pandas())) > 0
    assert json.loads(result.to_json()) == result.document
    if hasattr(result, "plot"):
        assert len(result.plot()) >= 1


def test_simulate_a_rotor(folder, model):
    motion = whirl.simulate(model, 300, 900, 1.0, unbalance=1.2)
    program("simulate", "model.json", "--from-rpm", 300, "--to-rpm", 900, "--seconds", 1, "--unbalance", 1.2, "--out", "run.csv",
            "--force", cwd=folder)
    same = whirl.read(folder / "run.csv")
    assert motion.names == ["x", "y", "beta"] and len(motion) == len(same)
    assert motion["x"] == pytest.approx(same["x"], abs=1e-12)
    with pytest.raises(whirl.Error, match="seconds"):
        whirl.simulate(model, 300, 900, 0.0)
    with pytest.raises(TypeError, match="exclude"):
        whirl.simulate(model, 300, 900, 1.0, record=motion)


def test_simulate_over_the_inputs_of_a_record():
    """x'' = -4 x - 0.3 x' + u with u = 1: the end is the static deflection."""
    t = np.arange(4000) * 0.01
    record = whirl.Recording({"x": np.zeros(4000), "v": np.zeros(4000), "u": np.ones(4000)}, t=t)
    rng = np.random.default_rng(1)
    u = np.repeat(rng.normal(size=400), 10)
    x = np.zeros((4000, 2))
    for k in range(3999):
        def rate(z):
            return np.array([z[1], -4 * z[0] - 0.3 * z[1] + u[k]])
        h = 0.01
        a = rate(x[k]); b = rate(x[k] + h / 2 * a); c = rate(x[k] + h / 2 * b); d = rate(x[k] + h * c)
        x[k + 1] = x[k] + h / 6 * (a + 2 * b + 2 * c + d)
    found = whirl.identify(whirl.Recording({"x": x[:, 0], "v": x[:, 1], "u": u}, t=t), "sindy", states=["x", "v"], inputs=["u"],
                           library=["x", "v", "u"], hold={"u": "zero"}, holdout=0)
    assert whirl.simulate(found.model, record=record)["x"][-1] == pytest.approx(0.25, rel=2e-3)
    with pytest.raises(TypeError, match="record"):
        whirl.simulate(found.model)


def test_run_up(folder, model):
    plan = whirl.runup(model, 300, 1900, limit_mm=1.5, drive={"torque_nm": 0.5, "inertia_kgm2": 0.01, "mass_kg": MASS})
    assert_same(plan.document, program("runup", "model.json", "--from-rpm", 300, "--to-rpm", 1900, "--limit-mm", 1.5, "--torque-nm", 0.5,
                                       "--inertia-kgm2", 0.01, "--mass-kg", MASS, cwd=folder))
    assert plan.up["slowest_safe"] <= plan.up["suggested"] and plan.document["drive"]["reached"] in (True, False)
    shows(plan, "whirl.RunUpPlan")
    for bad, message in (({"torque_nm": 1}, "drive needs"), ({"speed": 1}, "torque_slope_nms")):
        with pytest.raises(whirl.Error, match=message):
            whirl.runup(model, 300, 1900, drive=bad)


def test_margins_and_robustness(folder, model, controller):
    found = whirl.margins(controller, model, mass_kg=MASS, speeds=2)
    arguments = ("controller.json", "model.json", "--mass-kg", MASS)
    assert_same(found.document, program("margins", *arguments, "--speeds", 2, cwd=folder))
    assert found.worst["peak_sensitivity"] == max(found.to_pandas()["peak_sensitivity"])
    shows(found, "whirl.Margins")
    seen = []
    chance = whirl.robustness(controller, model, mass_kg=MASS, samples=8, limit_mm=0.03, progress=seen.append)
    assert_same(chance.document, program("robustness", *arguments, "--samples", 8, "--limit-mm", 0.03, cwd=folder))
    assert chance.exceeds.low <= chance.exceeds.value <= chance.exceeds.high and seen[-1] == 1
    shows(chance, "whirl.Robustness")
    with pytest.raises(whirl.Error, match="mass"):
        whirl.margins(controller, model)


def test_compare(folder, model):
    found = whirl.compare(model, mass_kg=MASS, laws=["pd:lpf", "pd:lpf:no-feedforward"], rig=whirl.VirtualRig({"rotor.added_mass_g": 5}),
                          balanced=model, evaluations=5, seeds=1, matrix=False)
    assert_same(found.document, program("compare", "model.json", "--mass-kg", MASS, "--laws", "pd:lpf", "pd:lpf:no-feedforward",
                                        "--balanced", "model.json", "--evaluations", 5, "--seeds", 1, "--no-matrix", cwd=folder))
    assert found.best in found.controllers and len(found.controllers) == 2
    shows(found, "whirl.Comparison")


def test_decay(folder):
    """x'' + 0.8 x' + 3600 x + 4e7 x^3 = 0 by small steps."""
    dt, n, fine = 1e-3, 12000, 4
    z, x = np.array([5e-3, 0.0]), np.empty(n)
    for k in range(n * fine):
        if k % fine == 0:
            x[k // fine] = z[0]
        def rate(z):
            return np.array([z[1], -0.8 * z[1] - 3600 * z[0] - 4e7 * z[0] ** 3])
        h = dt / fine
        a = rate(z); b = rate(z + h / 2 * a); c = rate(z + h / 2 * b); z = z + h / 6 * (a + 2 * b + 2 * c + rate(z + h * c))
    x += 1e-6 * np.random.default_rng(2).normal(size=n)
    record = whirl.Recording({"x": x}, dt=dt, units={"x": "m"})
    whirl.write(folder / "decay.csv", record)
    found = whirl.decay(record)
    assert_same(found.document, program("decay", "decay.csv", cwd=folder))
    assert found.parameters["k1"].value == pytest.approx(3600, rel=2e-3) and found.parameters["k3"].value == pytest.approx(4e7, rel=0.02)
    assert found.frequency(0) == pytest.approx(np.sqrt(found.parameters["k1"].value) / 2 / np.pi)
    shows(found, "whirl.Decay")
    with pytest.raises(whirl.Error, match="channel"):
        whirl.decay(record, channel="y")


def steady_sine(levels=(0.1, 0.4), mass=2.0, k1=3600.0, c=0.8, k3=4e7):
    """Points on the first harmonic's balance: mass (k1 - w^2 + 3/4 k3 a^2 + i c w) a = F exp(-i phase)."""
    table = {"frequency_Hz": [], "force_N": [], "amplitude_m": [], "phase_rad": []}
    for force in levels:
        for amplitude in np.linspace(0.2, 0.95, 12) * force / mass / (c * np.sqrt(k1)):
            stiff = k1 + 0.75 * k3 * amplitude**2
            for sign in (-1, 1):
                p = stiff - 0.5 * c**2
                inside = p**2 - stiff**2 + (force / mass / amplitude) ** 2
                if inside <= 0 or p + sign * np.sqrt(inside) <= 0:
                    continue  # no frequency has this amplitude
                w = np.sqrt(p + sign * np.sqrt(inside))
                table["frequency_Hz"].append(w / 2 / np.pi)
                table["force_N"].append(force)
                table["amplitude_m"].append(amplitude)
                table["phase_rad"].append(-np.angle(stiff - w**2 + 1j * c * w))
    return table


def test_sine(folder):
    table = steady_sine()
    rows = ["frequency_Hz,force_N,amplitude_m,phase_rad"] + [",".join(map(repr, map(float, row))) for row in zip(*table.values())]
    (folder / "sine.csv").write_text("\n".join(rows) + "\n")
    found = whirl.sine(table)
    assert_same(found.document, program("sine", "sine.csv", cwd=folder))
    assert 1 / found.gain.value == pytest.approx(2, rel=1e-3) and found.parameters["k3"].value == pytest.approx(4e7, rel=1e-2)
    shows(found, "whirl.SineTest")
    assert whirl.sine([table, table]).gain.value == pytest.approx(found.gain.value)
    with pytest.raises(whirl.Error, match="phase_rad"):
        whirl.sine({name: table[name] for name in ("frequency_Hz", "force_N", "amplitude_m")})


def test_transient(folder):
    """A fast run through one mode, integrated in the rotating frame."""
    w0, zeta, alpha, rate = 2 * np.pi * 30, 0.02, 2 * np.pi * 8, 4000.0
    t = np.arange(0, 6, 1 / rate)
    omega = 2 * np.pi * 10 + alpha * t
    beta = np.cumsum(omega) / rate
    q, v = np.zeros(len(t), complex), 0j
    force = np.exp(1j * beta) * (omega**2 - 1j * alpha)
    step = np.linalg.inv(np.eye(2) - 0.5 / rate * np.array([[0, 1], [-w0**2, -2 * zeta * w0]]))
    go = step @ (np.eye(2) + 0.5 / rate * np.array([[0, 1], [-w0**2, -2 * zeta * w0]]))
    z = np.array([omega[0] ** 2 / (w0**2 - omega[0] ** 2 + 2j * zeta * w0 * omega[0]), 0])
    z[1] = 1j * omega[0] * z[0]
    for k in range(len(t) - 1):
        q[k] = z[0]
        z = go @ z + step @ np.array([0, 0.5 / rate * (force[k] + force[k + 1])])
    once = np.searchsorted(beta, np.arange(beta[0], beta[-1] - 1, 2 * np.pi))
    vector = 20e-6 * q[once] * np.exp(-1j * beta[once])
    found = whirl.transient(omega[once], vector, modes=1)
    assert found.modes[0].omega.value == pytest.approx(w0, rel=3e-3) and found.modes[0].zeta.value == pytest.approx(zeta, rel=0.1)
    assert found.steady.fit_percent < found.fit_percent
    shows(found, "whirl.Transient")
    rows = ["rpm,amp_1x_um,phase_1x_deg"] + [f"{w * 30 / np.pi!r},{abs(v) * 1e6!r},{np.degrees(np.angle(v))!r}"
                                             for w, v in zip(omega[once], vector)]
    (folder / "bode.csv").write_text("\n".join(rows) + "\n")
    wanted = program("transient", "bode.csv", "--modes", 1, cwd=folder)["transient"]
    assert found.modes[0].omega.value == pytest.approx(wanted["modes"][0]["omega"]["value"], rel=1e-9)
    assert_same(found.document, {key: wanted[key] for key in ("fit_percent", "peak_speed", "alpha", "beats")})


def test_derive(folder):
    path = ROOT / "examples/05_derive/duffing.toml"
    found = whirl.derive(path)
    assert_same(found.document, program("derive", path, cwd=folder))
    assert "m*x''" in found.text and "aligned" in found.latex and "[[" in found.library
    shows(found, "whirl.Derivation")
    (folder / "bad.toml").write_text('coordinates = ["x"]\nkinetic = "q"\n')
    with pytest.raises(whirl.Error, match="bad.toml"):
        whirl.derive(folder / "bad.toml")


def test_check_and_info(folder, model):
    record = whirl.read(folder / "record.csv")
    x = np.array(record["x"])
    x[1000:1040] = np.nan
    x = np.clip(x, -4e-3, 4e-3)
    spoiled = whirl.Recording({"x": np.nan_to_num(x), "y": record["y"], "beta": record["beta"]}, dt=record.dt,
                              units={"x": "m", "y": "m", "beta": "rad"})
    found = whirl.check(spoiled)
    kinds = {f.kind for f in found.findings}
    assert {"dropout", "clipped"} <= kinds and not found.refused and "x" in repr(found)
    assert not found.usable["x"][1005:1035].any() and found.usable["x"].shape == x.shape
    assert set(found.to_pandas()["kind"]) == kinds and "<table>" in found._repr_html_()
    assert whirl.check(record, mains=[]).refused is False
    contents = whirl.info(folder / "record.csv")
    assert [c["name"] for c in contents["tables"][0]["channels"]] == ["x", "y", "beta"]
    assert_same(contents, program("info", "record.csv", cwd=folder) | {"source": contents["source"]})


def test_report(folder, model, controller):
    page = whirl.report(whirl.read(folder / "record.csv"), model, controller, out=folder / "page.html", title="Fan 3", service_rpm=1800)
    text = page.read_text()
    assert "<title>Fan 3" in text and "model_2.json" in text and "controller_3.json" in text
    if shutil.which("chromium"):
        whirl.report(model, out=folder / "page.html", pdf=folder / "page.pdf")
        assert (folder / "page.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(TypeError, match="takes no int"):
        whirl.report(5, out=folder / "no.html")
    assert not (folder / "no.html").exists()


def test_values_show_themselves(folder, model, controller):
    pytest.importorskip("pandas")
    text = repr(model)
    assert text.startswith("whirl.Model by weak: ") and "k1 " in text and "1/s^2" in text and "±" in text
    assert list(model.to_pandas().columns) == ["value", "sd", "low", "high", "unit"]
    assert model.to_pandas().loc["k1", "value"] == model.parameters["k1"].value and "<td>k1</td>" in model._repr_html_()
    assert repr(controller).startswith("whirl.Controller pd with lpf") and "gain_margin" in controller.to_pandas().index
    rig = whirl.VirtualRig()
    law = whirl.stiffness(*rig.stiffness_test())
    assert "N/m^3" in repr(law) and law.to_pandas().loc["k1", "unit"] == "N/m"
    frf = whirl.frf(rig.hammer_test(blows=2))
    modes = whirl.modes(frf, band_high=60)
    assert len(frf.to_pandas()) == len(frf.frequency) and len(modes.to_pandas()) == len(modes) and "frequency_Hz" in repr(modes)
    run = whirl.run(controller)
    assert run.to_pandas().loc["all", "suppression"] == run.metrics.suppression["all"] and "stable" in repr(run)
    record = whirl.read(folder / "record.csv")
    again = whirl.read(record.to_pandas())
    assert again.units == record.units and (again["x"] == record["x"]).all() and "beta" in record._repr_html_()
    assert pickle.loads(pickle.dumps(whirl.Estimate(1.0, 0.1))).value == 1.0
