"""Flexible rotors from Python: the same numbers as the program prints, and the machine found from records that it made."""
import json
import subprocess
import os

import numpy as np
import pytest

import whirl

RPM = 2 * np.pi / 60


@pytest.mark.parametrize("name", whirl.rotor.templates())
def test_every_template_goes_through_every_verb(name):
    rotor = whirl.rotor.template(name)
    assert rotor.name in repr(rotor) and rotor.mass > 0 and rotor.length > 0
    assert len(rotor.modes(1000).to_pandas()) == 8
    held = name != "levitated"  # by magnets, which pull it away without control
    if held:
        assert (np.diff(rotor.criticals(10000).speeds) >= 0).all()
    else:
        with pytest.raises(whirl.Error, match="negative stiffness"):
            rotor.criticals(10000)
    lines = rotor.campbell(3000, points=9)
    assert lines.frequency.shape[0] == lines.speed.size == 9
    response = rotor.response(3000, points=50)
    assert response.speed.size >= 50 and all(a.shape == response.speed.shape for a, _ in response.curves.values())
    if held:
        assert rotor.run(600, 500, 0.2)["beta"].shape == (201,)
    else:
        with pytest.raises(whirl.Error, match="grows without bound"):
            rotor.run(600, 500, 0.2)
    for result in (rotor.modes(1000), lines, response):
        assert held or "falls away" in result.summary.warnings[0]
    for result in (lines, response):
        assert result.plot() is not None
        assert repr(result).startswith("whirl.")


def test_the_program_prints_the_same_critical_speeds(tmp_path):
    rotor = whirl.rotor.template("two-disc")
    (tmp_path / "rotor.toml").write_text(rotor.text)
    printed = subprocess.run([os.environ["WHIRL_PROGRAM"], "rotor", "criticals", "rotor.toml", "--to-rpm", "5000", "--json"],
                             cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert np.allclose([c["speed"] for c in json.loads(printed)["criticals"]], rotor.criticals(5000).speeds, rtol=1e-12)


def test_a_rotor_that_ross_saved(tmp_path):
    shaft = ("L = 0.5\nidl = 0.0\nodl = 0.03\nidr = 0.0\nodr = 0.03\nn = 0\nshear_method_calc = 'cowper'\n"
             "[ShaftElement_a.material]\nname = 'Steel'\nrho = 7810.0\nE = 2.11e11\nG_s = 8.12e10\n")
    bearing = "[BearingElement_{}]\nn = {}\nkxx = [1e7,]\nkyy = [1e7,]\nkzz = [{},]\n"
    file = tmp_path / "ross.toml"
    file.write_text("[ShaftElement_a]\n" + shaft + bearing.format("l", 0, 0) + bearing.format("r", 1, 5))
    with pytest.warns(UserWarning, match="axial"):
        rotor = whirl.rotor.read_ross(file)
    assert rotor.length == 0.5 and len(rotor.modes(1000, count=2).to_pandas()) == 2
    with pytest.raises(whirl.Error, match="Rotor.save"):
        file.write_text("[rotor]\nname = 'x'\n")
        whirl.rotor.read_ross(file)


def test_fit_finds_the_machine_that_made_the_records():
    drawing = whirl.rotor.template("two-disc").text
    stations = "\n[[unbalance]]\nposition_mm = 1000\nsize_gmm = {}\n"
    fit = "\n[fit]\nmaterial_damping = false\n[fit.tolerance]\nprobe_gain_percent = 5\n"
    machine = drawing.replace("stiffness_x_N_m = 1e6", "stiffness_x_N_m = 1.3e6", 1) + stations.format(60)
    records = {"up": whirl.rotor.Rotor(machine).run(300, 3500, 20, noise_db=30)}
    found = whirl.rotor.Rotor(drawing + stations.format(0) + fit).fit(records)
    row = found.to_pandas().set_index("name").loc["stiffness x of left"]
    assert row.low < 1.3e6 < row.high and row.high - row.low < 0.02 * 1.3e6
    assert found.rotor.criticals(5000).speeds.size == whirl.rotor.Rotor(machine).criticals(5000).speeds.size
    motion = found.motion(1000, [1000, 2000])["motions"][0]
    assert len(motion["x"]["amplitude"]) == 2


def test_a_centrifuge_from_its_spin_up():
    rotor = whirl.rotor.template("centrifuge")
    check = rotor.check_load(rotor.run(40, 170, 60, noise_db=30))
    assert check.verdict == "wrong" and check.imbalance[1] < 0.010 < check.imbalance[2]
    plan = rotor.run_up_plan(3000, 500)
    assert [p["critical"] for p in plan.document["passages"]] == sorted(p["critical"] for p in plan.document["passages"])
    assert len(rotor.limits(2000).document["speed"]) == 200


def test_bad_input_is_one_clear_error():
    with pytest.raises(whirl.Error, match="rotor:"):
        whirl.rotor.Rotor("[rotor]\nnme = 'x'\n")
    with pytest.raises(whirl.Error, match="jeffcott"):
        whirl.rotor.template("jeffcot")
    with pytest.raises(whirl.Error, match="no channel|turning shaft"):
        whirl.rotor.template("kit").fit(whirl.Recording({"left_x": np.zeros(100)}, dt=1e-3, units={"left_x": "m"}))
    rotor = whirl.rotor.template("centrifuge")
    for verb in (rotor.check_load, rotor.fit, rotor.trend):
        with pytest.raises(TypeError, match="whirl.read"):
            verb("spinup.csv")


def test_a_controller_designed_checked_run_and_exported(tmp_path):
    rotor = whirl.rotor.template("levitated")
    design = rotor.control(0, 6000, points=4, schedule=3)
    assert design.refused == [] and design.worst_sensitivity < 3
    assert len(design.to_pandas()) == 4
    design.save(tmp_path / "controller.json")
    assert [p.name for p in design.export("fmu", tmp_path)] == ["controller.fmu"]
    assert [p.name for p in design.export("c", tmp_path)] == ["controller.h", "controller.c"]
    passages = rotor.passages(tmp_path / "controller.json", 100, 6000, 2)
    assert passages.record["beta"].shape == (2001,) and all(p is None for p in passages.to_pandas().open)
    slow = rotor.check_control(tmp_path / "controller.json", 0, 6000, points=3, sensitivity=1.1)
    assert slow.worst_sensitivity == pytest.approx(design.worst_sensitivity, abs=0.5) and slow.summary.warnings
    wrong = whirl.rotor.Rotor(rotor.text.replace("bias_stiffness_N_m = -2e5", "bias_stiffness_N_m = -2e7"))
    refused = wrong.check_control(design, 0, 6000, points=3)
    assert refused.refused[0]["with"] == "nominal"
    with pytest.raises(whirl.Error, match="unstable"):
        refused.save(tmp_path / "other.json")
