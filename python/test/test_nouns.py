"""The nouns of the package against each other and against the program."""
import json
import os
import pickle
import subprocess

import numpy as np
import pytest
import whirl


@pytest.fixture(scope="module")
def rig():
    return whirl.VirtualRig({"rotor.added_mass_g": 5})


@pytest.fixture(scope="module")
def record(rig):
    return rig.record(seed=1, snr_db=20)


@pytest.fixture(scope="module")
def found(record):
    return whirl.identify(record, holdout=0)


def test_channels_are_views_that_keep_the_record():
    x = whirl.VirtualRig().record(seed=3)["x"]
    assert not x.flags.writeable and not x.flags.owndata
    assert np.isfinite(x).all()


def test_a_record_from_arrays():
    t = np.arange(100) * 1e-3
    r = whirl.Recording({"x": np.sin(t), "u": np.cos(t)}, t=t, units={"x": "m"})
    assert r.dt == pytest.approx(1e-3) and len(r) == 100 and "x" in r and r.units == {"x": "m", "u": "1"}
    again = pickle.loads(pickle.dumps(r))
    assert (again["x"] == r["x"]).all() and again.units == r.units


def test_a_channel_read_late_is_brought_to_the_instants_of_the_others():
    t = np.arange(400) * 0.01
    r = whirl.Recording({"x": np.sin(3 * t), "v": np.sin(3 * (t + 0.004))}, t=t)
    moved = whirl.at_common_instants(r, {"v": 0.004})
    assert len(moved) == 399
    assert np.abs(moved["v"] - moved["x"])[20:-20].max() < 2e-3
    with pytest.raises(whirl.Error):
        whirl.at_common_instants(r, {"w": 0.004})


@pytest.mark.parametrize("arguments, message", [
    (dict(channels={"x": np.zeros(9)}, t=np.zeros(9)), "times must rise"),
    (dict(channels={"x": np.zeros(9)}, t=np.arange(9.0) ** 2), "must be uniform"),
    (dict(channels={"x": np.zeros(9), "y": np.zeros(8)}, dt=1), "x"),
    (dict(channels={"x": np.zeros(9)}, dt=1, units={"x": "mm"}), "SI unit"),
    (dict(channels={"x": np.zeros(9)}, dt=1, units={"y": "m"}), "name of a channel"),
    (dict(channels={"x": np.full(9, np.nan)}, dt=1), "x"),
    (dict(channels={"x": np.zeros((9, 2))}, dt=1), r"'x' has shape \(9, 2\): must be one-dimensional"),
    (dict(channels={"x": np.zeros(9, complex)}, dt=1), "'x' has complex values"),
    (dict(channels={"x": ["a", "b"]}, dt=1), "'x' holds <U1: must be numbers"),
    (dict(channels={"x": np.ma.masked_array(np.zeros(3), [0, 1, 0])}, dt=1), "masked"),
    (dict(channels={"x": np.zeros(9)}, t=np.arange(8.0)), "'x' has 9 samples, t has 8"),
    (dict(channels={"x": np.zeros(9)}, t=np.arange(9.0), dt=1), "give one of them"),
    (dict(channels={"x": np.zeros(9)}, dt=1, t0=np.nan), "t0 = nan s"),
    (dict(channels={}, dt=1), "at least one"),
])
def test_bad_records_are_refused_with_the_reason(arguments, message):
    channels = arguments.pop("channels")
    with pytest.raises(whirl.Error, match=message):
        whirl.Recording(channels, **arguments)
    assert issubclass(whirl.Error, ValueError)


@pytest.mark.parametrize("samples", [
    [0, 1, 2, 3], np.arange(4), np.arange(4, dtype=np.float32), np.arange(4, dtype=">f8"), np.arange(8.0)[::2] / 2,
    np.arange(4.0)[::-1][::-1], np.asfortranarray(np.arange(8.0).reshape(4, 2))[:, 0] / 2, np.array([0, 1, 2, 3], object),
])
def test_arrays_of_every_layout_and_type_hold_the_same_numbers(samples):
    r = whirl.Recording({"x": samples}, dt=1)
    assert (r["x"] == [0, 1, 2, 3]).all() and list(r) == ["x"]


def test_the_program_and_python_find_the_same(tmp_path, record, found):
    whirl.write(tmp_path / "r.csv", record)
    again = whirl.identify(whirl.read(tmp_path / "r.csv"), holdout=0)
    out = tmp_path / "model.json"
    subprocess.run([os.environ["WHIRL_PROGRAM"], "identify", tmp_path / "r.csv", "--no-holdout", "--out", out, "--quiet"],
                   check=True, capture_output=True)
    program = json.loads(out.read_text())["parameters"]
    for name, value in again.parameters.items():
        assert value.value == pytest.approx(program[name]["value"], rel=1e-12, abs=1e-300), name
    assert found.parameters["k1"].value == pytest.approx(again.parameters["k1"].value, rel=1e-6)


def test_models_travel(tmp_path, found):
    model = found.model
    assert pickle.loads(pickle.dumps(model)).to_json() == model.to_json()
    whirl.save(tmp_path / "model.json", model)
    assert whirl.load(tmp_path / "model.json").to_json() == model.to_json()
    assert found.usable and "x" in str(found)


def test_the_whole_chain(rig, found, tmp_path):
    check = whirl.validate(found.model, rig.run_up().record(seed=2))
    assert check.nrmse < 0.05
    law = whirl.stiffness(*rig.stiffness_test())
    seen = []
    controller = whirl.design(found.model, stiffness=law, evaluations=20, progress=seen.append)
    assert seen and seen[-1] == pytest.approx(1)
    result = whirl.run(controller, rig)
    assert result.metrics.stable and result.metrics.suppression["all"] > 0.9
    assert len(result.log) > 1000
    modes = whirl.modes(whirl.frf(rig.hammer_test()), band_high=60)
    assert any(mode.frequency.covers(46.0) or abs(mode.frequency.value - 46) < 0.05 for mode in modes)
    advice = whirl.balance(found.model, mass_kg=1.5, radius_mm=83, speed_rpm=1800)
    assert advice["correction_mass_g"] > 0
    files = whirl.export(controller, "c", tmp_path / "c")
    assert any(file.suffix == ".c" for file in files)
    assert pickle.loads(pickle.dumps(controller)).to_json() == controller.to_json()


def test_ctrl_c_ends_a_long_call(rig, found):
    def stop(fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        whirl.design(found.model, mass_kg=1.5, evaluations=20, progress=stop)

    def stop_later(fraction):  # inside the optimiser, which hides what a callback throws
        if fraction > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        whirl.design(found.model, mass_kg=1.5, evaluations=20, progress=stop_later)
    with pytest.raises(ZeroDivisionError):
        whirl.design(found.model, mass_kg=1.5, evaluations=20, progress=lambda fraction: 1 / int(fraction < 0.8))


def test_what_is_no_record_or_no_number_is_refused(rig, found, tmp_path):
    record = rig.record(seed=1)
    for records in (None, "rundown.csv", 5, [record, "x"]):
        with pytest.raises(TypeError, match="no whirl.Recording"):
            whirl.identify(records)
    with pytest.raises(whirl.Error, match="disp"):
        whirl.identify(record, states="disp")
    with pytest.raises(whirl.Error, match="hidden = -1"):
        whirl.identify(record, states=["x"], hidden=-1)
    for bad in (0, -1, np.nan, np.inf):
        with pytest.raises(whirl.Error, match="dt"):
            whirl.smooth(np.arange(50.0), bad)
        with pytest.raises(whirl.Error, match="dt"):
            whirl.finite_difference(np.arange(50.0), bad)
    with pytest.raises(whirl.Error, match="sample 1"):
        whirl.finite_difference(np.array([1, np.nan, 3, 4, 5, 6]), 1)
    (tmp_path / "file").write_text("x")
    with pytest.raises(whirl.Error, match="file"):
        whirl.export(found.model, "c", tmp_path / "file")
    with pytest.raises(whirl.Error, match="band"):
        whirl.modes(whirl.frf(rig.hammer_test(blows=2)), band_low=np.nan)


def test_errors_name_field_and_allowed_values(found, tmp_path):
    with pytest.raises(whirl.Error, match="rotor.foo"):
        whirl.VirtualRig({"rotor.foo": 1})
    with pytest.raises(whirl.Error, match="no_such.csv") as refused:
        whirl.read(tmp_path / "no_such.csv")
    assert refused.value.file == str(tmp_path / "no_such.csv") and refused.value.line is None
    (tmp_path / "bad.csv").write_text("t_s,x_mm\n0,1\n0.1,one\n")
    with pytest.raises(whirl.Error) as refused:
        whirl.read(tmp_path / "bad.csv")
    assert (refused.value.file, refused.value.line) == (str(tmp_path / "bad.csv"), 3)
    with pytest.raises(whirl.Error) as refused:
        whirl.balance(tmp_path / "bad.csv", criterion="best")
    assert (refused.value.field, refused.value.value) == ("criterion", "best")
    assert "min-max" in refused.value.allowed and refused.value.file is None
    with pytest.raises(whirl.Error, match="mass"):
        whirl.design(found.model)
    with pytest.raises(whirl.Error, match="unbalance"):
        whirl.validate(found.model, whirl.VirtualRig().record(), unbalance="guess")


def test_figures(record, rig, found):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert len(record.plot()) == 3
    frf = whirl.frf(rig.hammer_test())
    assert len(frf.plot()) == 2
    modes = whirl.modes(frf)
    drawn = modes.plot()[0].containers[0].lines[0]
    np.testing.assert_allclose(drawn.get_xdata(), [mode.frequency.value for mode in modes])
    np.testing.assert_allclose(drawn.get_ydata(), [100 * mode.damping.value for mode in modes])
    labels = [label.get_text() for label in found.plot()[0].get_yticklabels()]
    assert labels[0].startswith("k1 = ") and len(labels) == len(found.model.parameters)
    assert [label.get_text() for label in found.model.plot()[0].get_yticklabels()] == labels


def test_texts_of_rig_and_modes_of_a_run(rig):
    assert repr(rig).startswith("whirl.VirtualRig\n") and "mass_kg" in repr(rig)


def oscillators(seconds=300, rate=64.0, seed=3):
    """Two modes, 3 and 8 Hz with 1 and 2 % damping, under white forces: exact transition of each, two channels."""
    rng = np.random.default_rng(seed)
    n = int(seconds * rate)
    channels = np.zeros((n, 2))
    for frequency, zeta, shape in ((3.0, 0.01, (1, 1)), (8.0, 0.02, (1, -0.8))):
        pole = 2 * np.pi * frequency * (-zeta + 1j * np.sqrt(1 - zeta**2))
        q, step = 0j, np.exp(pole / rate)
        for k, force in enumerate(rng.normal(size=n)):
            q = step * q + force
            channels[k] += np.multiply(shape, q.imag)
    return whirl.Recording({"a": channels[:, 0], "b": channels[:, 1]}, dt=1 / rate, units={"a": "m/s^2", "b": "m/s^2"})


@pytest.mark.parametrize("method", ["ssi-data", "ssi-cov"])
def test_operational_modes(method):
    found = whirl.oma(oscillators(), method=method)
    assert [mode.frequency.value for mode in found.modes] == pytest.approx([3, 8], rel=5e-3)
    assert [mode.damping.value for mode in found] == pytest.approx([0.01, 0.02], rel=0.4)
    assert found.modes[1].shape[1].real == pytest.approx(-0.8, abs=0.05) and found.modes[0].mpc > 0.99
    assert found.channels == ["a", "b"] and found.harmonics == []
    with pytest.raises(whirl.Error, match="method"):
        whirl.oma(oscillators(30), method="fft")


def test_steady_response_and_its_figure(found, record):
    curve = whirl.response(found.model, 200, 2000, record=record)
    p = {name: estimate.value for name, estimate in found.parameters.items()}
    # Far below the critical speed the rotor is linear: radius = e w^2 / (k1 - w^2), to the 3 % of its anisotropy.
    low = curve.speed < 0.4 * np.sqrt(p["k1"])
    w = curve.speed[low]
    assert low.sum() > 5 and curve.amplitude[low] == pytest.approx(p["e"] * w**2 / (p["k1"] - w**2), rel=0.03)
    assert curve.stable.any() and {kind for kind, _, _ in curve.events} <= {"fold", "branch point", "period doubling",
                                                                           "Neimark-Sacker"}
    assert json.loads(curve.to_json())["schema"].startswith("whirl.response/")
    pytest.importorskip("matplotlib").use("Agg")
    assert len(curve.plot()) == 2
    with pytest.raises(whirl.Error, match="rpm"):
        whirl.response(found.model, 0, 100)


def test_balance_from_runs_equals_the_vectors(tmp_path):
    influence, found, trial = 4e-3 * np.exp(0.7j), 50e-6 * np.exp(-1.1j), 5e-3 * np.exp(1j * np.pi / 3)
    rows = ["run_1,speed_rpm,X_amp_um,X_phase_deg,A_mass_gram,A_angle_deg"]
    for run, mass in enumerate((0, trial)):
        v = found + influence * mass
        rows.append(f"{run + 1},1500,{abs(v) * 1e6},{-np.degrees(np.angle(v))},{abs(mass) * 1e3},{np.degrees(np.angle(mass))}")
    path = tmp_path / "runs.csv"
    path.write_text("\n".join(rows) + "\n")
    unstated = whirl.balance(path, noise_um=0.1)
    assert unstated["summary"]["status"] == "unusable" and not unstated["amplitude_stated"]
    job = whirl.balance(path, phase="lag", angles="with", amplitude="0p", noise_um=0.1)
    assert job["amplitude_stated"] and job["summary"]["status"] != "unusable"
    wanted = -found / influence
    plane = job["planes"][0]
    assert plane["mass"]["value"] == pytest.approx(abs(wanted), rel=1e-9)
    assert plane["angle"]["value"] % (2 * np.pi) == pytest.approx(np.angle(wanted) % (2 * np.pi), rel=1e-9)
    with pytest.raises(whirl.Error, match="phase"):
        whirl.balance(path, phase="sideways")


def test_what_cannot_be_told_apart_is_said(found):
    assert all(set(a) == {"readings", "consequence", "experiment"} for a in found.ambiguities)


def test_bounds_and_timing_reach_the_identification():
    t = np.arange(0, 20, 0.01)
    x = np.exp(-0.2 * t) * np.cos(2 * t)
    record = whirl.Recording({"x": x, "v": np.exp(-0.2 * t) * (-0.2 * np.cos(2 * t) - 2 * np.sin(2 * t))}, dt=0.01)
    kept = whirl.identify(record, "sindy", states=["x", "v"], library=["x", "v"], bounds=["[v': v] <= -0.6"])
    assert kept.parameters["v': v"].value == pytest.approx(-0.6, abs=1e-6)
    with pytest.raises(whirl.Error, match="exclude"):
        whirl.identify(record, "sindy", states=["x", "v"], least_decay=0.1, trapping=True)
    with pytest.raises(whirl.Error, match="hold"):
        whirl.identify(record, "sindy", states=["x"], inputs=["v"], hold={"v": "sticky"})


def test_frf_of_a_shaker_record():
    """x'' + 2 zeta w x' + w^2 x = f, solved exactly between samples for a force that is held: 11 Hz, 1 %."""
    random = np.random.default_rng(4)
    dt, w, zeta = 1 / 256, 2 * np.pi * 11, 0.01
    force = random.normal(size=256 * 40)
    p = w * complex(-zeta, np.sqrt(1 - zeta**2))
    step, gain, q = np.exp(p * dt), (np.exp(p * dt) - 1) / p, 0j
    x = np.empty(len(force))
    for i, f in enumerate(force):
        x[i] = 2 * (q / (2j * p.imag)).real
        q = step * q + gain * f
    x += 0.01 * x.std() * random.normal(size=len(x))
    record = whirl.Recording({"force": force, "x": x}, dt=dt, units={"force": "N", "x": "m"})
    modes = whirl.modes(whirl.frf([record], resolution_hz=0.5), band_high=40)
    assert len(modes) == 1
    # A held force acts half a sample late, which turns the residues alone.
    assert modes.modes[0].frequency.value == pytest.approx(11, rel=1e-3)
    assert modes.modes[0].damping.value == pytest.approx(0.01, rel=0.02)
