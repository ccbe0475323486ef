#!/usr/bin/env python3
"""Runs the commands of README and docs one after the other, as a reader would, in a folder with the files that they name.

Usage: documents_run.py SOURCE_DIR WHIRL FOLDER      prints what fails; exit code 1 when a command fails

Not run: words that stand for others (FILE, `...`), a subcommand that is only mentioned (`whirl design`), and what ELSEWHERE names.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import wave

import numpy as np

import documents

root, program, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3])
random = np.random.default_rng(1)

REFUSED = {  # with exit code 1, and the document says so
    "whirl identify rundown.csv --columns t_s x_mm beta_rad --out one_probe.json",
}
ELSEWHERE = {  # the beginning of a command: where the suite runs it
    "whirl reproduce": "StudyE2e",
    "mpirun": "RobustnessE2e",
    "whirl compare": "CompareE2e; minutes",
    "whirl robustness out/compare": "what compare writes",
    "whirl rotor import": "RotorE2e; a file of ROSS",
    "whirl rig serve": "examples/08_realtime",
    "whirl io test": "examples/08_realtime",
    "whirl run controller.json --io": "examples/08_realtime",
    "whirl replay run.h5": "examples/08_realtime",
    "whirl balance --session fan.toml --record": "BalanceSessionE2e",
    "whirl balance fan.toml": "BalanceSessionE2e",
    "whirl balance lengths.csv": "BalancingAmplitudesUnit",
    "whirl balance asfound.csv --phase lag --amplitude 0p --angles with --radius-mm 80": "BalanceRunsE2e, modes.json",
    "whirl report --pdf": "needs a browser: ReportPageE2e",
    "whirl frf hammer_raw.csv.gz": "a measured file: reference tests",
    "whirl modes building9.csv.gz": "a measured file: reference tests",
    "whirl modes blow.json": "a measured file: reference tests",
    "whirl identify big.csv": "a gigabyte",
    "whirl rotor control": "RotorE2e",
    "whirl rotor fit": "RotorE2e, examples/11_rotor_fit",
    "whirl identify rundown.csv --columns t_s DE_acc_g": "SensedRatesE2e",
    "whirl centrifuge": "RotorE2e, examples/18_centrifuge",
    "whirl rotor trend": "RotorE2e",
    "whirl design model.json --stiffness stiffness.json --law-file": "LawFileE2e",
    "whirl rotor which": "RotorE2e",
    "whirl info r.csv --json >/dev/full": "fails on purpose: OutputE2e",
}


def table(name, head, *columns):
    np.savetxt(folder / name, np.column_stack(columns), fmt="%.9g", delimiter=",", header=",".join(head), comments="")


def oscillate(t, force, k1=8883.0, c=7.5):
    """x, x' of x'' + c x' + k1 x = force from rest, the force straight between its samples: exact steps of the pole."""
    h = t[1] - t[0]
    pole = complex(-c / 2, np.sqrt(k1 - c * c / 4))
    turn = np.exp(pole * h)
    last = (turn - 1 - pole * h) / (pole * pole * h)
    first = (turn - 1) / pole - last
    push = (first * force[:-1] + last * force[1:]).tolist()
    z = [0j]  # x' - conj(pole) x
    for p in push:
        z.append(turn * z[-1] + p)
    z = np.array(z)
    x = z.imag / pole.imag
    return np.column_stack([x, z.real + pole.real * x])


def responses():
    """Decays, sines and ambient vibration of linear oscillators."""
    t = np.arange(0, 6, 1e-3)
    x = 4 * np.exp(-0.9 * t) * np.cos(94 * t) + random.normal(0, 2e-3, len(t))
    table("ringdown.csv", ["t_s", "x_mm"], t, x)
    hz = np.repeat(np.linspace(10, 20, 21), 2)
    newton = np.tile([8.0, 25.0], 21)
    answer = newton / (8883 - (2 * np.pi * hz) ** 2 + 2j * np.pi * hz * 7.5)
    table("stepped.csv", ["frequency_Hz", "force_N", "amplitude_mm", "phase_deg"], hz, newton, 1e3 * abs(answer),
          np.degrees(np.angle(answer)))
    t = np.arange(0, 20, 2e-3)
    for name, newton, low, high in (("up_8N", 8, 10, 20), ("up_25N", 25, 10, 20), ("down_25N", 25, 20, 10)):
        force = newton * np.cos(2 * np.pi * (low * t + (high - low) * t * t / 40))
        table(name + ".csv", ["t_s", "force_N", "x_m"], t, force, oscillate(t, force)[:, 0] + random.normal(0, 1e-5, len(t)))
    t = np.arange(0, 200, 5e-3)
    force = random.normal(0, 5, len(t))
    x = oscillate(t, force)[:, 0]
    acceleration = np.gradient(np.gradient(x, t), t) + random.normal(0, 1e-3, len(t))
    table("random.csv", ["t_s", "force_N", "acc_1_m_s2"], t, force, acceleration)
    floor = random.normal(0, 1, len(t))  # relative motion of a mass on a floor that shakes
    top = np.gradient(oscillate(t, -floor)[:, 1], t) + floor
    table("floor.csv", ["t_s", "acc_floor_m_s2", "acc_top_m_s2"], t, floor, top)
    shapes = np.array([[1, 1.4, 1.2, 0.8, 0.5], [1, 0.3, -0.9, -1.1, 0.6]])
    for name, channels in (("ambient", range(5)), ("setup1", [0, 1, 2]), ("setup2", [0, 1, 3]), ("setup3", [0, 1, 4])):
        sum_ = np.zeros((len(t), len(channels)))
        for shape, hz in zip(shapes, (9.0, 17.0)):
            push = random.normal(0, 30, len(t))
            w = 2 * np.pi * hz
            q = oscillate(t, push, w * w, 0.02 * w)
            acceleration = np.gradient(q[:, 1], t)
            sum_ += np.outer(acceleration, shape[list(channels)])
        sum_ += random.normal(0, 0.05 * sum_.std(), sum_.shape)
        table(name + ".csv", ["t_s", *(f"acc_{k + 1}_m_s2" for k in channels)], t, *sum_.T)


def systems():
    """A driven Duffing oscillator with a lagging store, and a rotor's run-up under a motor."""
    for name, seed in (("a", 3), ("b", 4)):
        r = np.random.default_rng(seed)
        n, h = 1500, 2e-2
        u = np.repeat(r.normal(0, 1, n // 10), 10)
        z = np.zeros((n, 3))
        z[0] = (0.2, 0, 1.5)

        def rate(z, u):
            x, v, s = z
            return np.array([v, -4 * x - 0.5 * x**3 - 0.4 * v + u, 0.6 - 1.5 * s / (0.3 + s) + 0 * u])

        for i in range(n - 1):
            p = rate(z[i], u[i])
            q = rate(z[i] + h / 2 * p, u[i])
            s = rate(z[i] + h / 2 * q, u[i])
            z[i + 1] = z[i] + h / 6 * (p + 2 * q + 2 * s + rate(z[i] + h * s, u[i]))
        z += r.normal(0, 1e-3, z.shape) * z.std(axis=0)
        table(name + ".csv", ["t_s", "x_m", "v_m_s", "s_1", "u_N"], np.arange(n) * h, *z.T, u)


def drive_run():
    """Run-up of an unbalanced disk under a motor and its coast-down: t_s, x, y, beta, voltage. The unbalance brakes the shaft."""
    k1, c, e, mass, inertia = 5666.0, 1.5, 2e-4, 1.5, 0.004
    n, h = 20000, 1e-3

    def voltage(s):
        return 12.0 if s < 12 else 0.0

    def rate(s, q):
        z, v, beta, omega = q
        turn = np.exp(1j * beta.real)
        alpha = (0.03 * voltage(s) - 1.2e-3 * omega.real - 0.01 * np.tanh(omega.real)) / inertia
        for _ in range(2):
            a = -k1 * z - c * v + e * turn * (omega.real**2 - 1j * alpha)
            alpha_all = alpha - mass * e / inertia * (a / turn).imag
        return np.array([v, a, omega, alpha_all])

    q = np.zeros((n, 4), complex)
    for i in range(n - 1):
        s = i * h
        r1 = rate(s, q[i])
        r2 = rate(s, q[i] + h / 2 * r1)
        r3 = rate(s, q[i] + h / 2 * r2)
        q[i + 1] = q[i] + h / 6 * (r1 + 2 * r2 + 2 * r3 + rate(s, q[i] + h * r3))
    z = q[:, 0] + random.normal(0, 2e-6, n) + 1j * random.normal(0, 2e-6, n)
    t = np.arange(n) * h
    columns = t, z.real, z.imag, q[:, 2].real, np.where(t < 12, 12, 0)
    table("run.csv", ["t_s", "x_m", "y_m", "beta_rad", "voltage_V"], *(c[::2] for c in columns))  # 500 Hz are enough for 20 Hz


def logger():
    """A table as a logger writes it: two lines about the test, names with units in brackets, probes in volts, angle in degrees."""
    t = np.arange(0, 4, 1e-3)
    beta = 120 * t - 10 * t * t
    with open(folder / "log.csv", "w") as file:
        file.write("Logger 7, channel list below\nrun 12, 5 g\nTime [s],Probe 1 [V],Probe 2 [V],Angle [deg]\n")
        np.savetxt(file, np.column_stack([t, 0.8 * np.cos(beta), 0.8 * np.sin(beta), np.degrees(beta)]), fmt="%.9g", delimiter=",")


def casing():
    """An accelerometer on a bearing housing of a machine at 1480 rpm: 1X, 2X and a line at 100 Hz, with noise."""
    t = np.arange(0, 6, 1 / 5120)
    acc = sum(a * np.cos(2 * np.pi * f * t + p) for a, f, p in ((0.5, 24.7, 0), (0.3, 49.3, 1), (0.8, 100, 2)))
    table("casing.csv", ["t_s", "DE_acc_m_s2"], t, acc + random.normal(0, 0.05, t.size))
    # A motor at 49.3 Hz whose 2X exceeds 1X, beside twice the line frequency.
    t = np.arange(0, 10, 1 / 2000)
    angle = 2 * np.pi * 49.3 * t
    x = 12 * np.cos(angle) + 18 * np.cos(2 * angle + 0.7) + 9 * np.cos(2 * np.pi * 100 * t)
    y = 12 * np.sin(angle) + 18 * np.sin(2 * angle + 0.7)
    table("motor.csv", ["t_s", "x_um", "y_um", "beta_rad"], t, x + random.normal(0, 0.3, t.size), y + random.normal(0, 0.3, t.size), angle)


def laboratory():
    if folder.is_dir() and any(folder.iterdir()) and not (folder / ".documents-run").exists():
        sys.exit(f"{folder}: is not empty and not from this script: give another folder")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / ".documents-run").touch()
    responses()
    systems()
    casing()
    shutil.copy(root / "examples/05_derive/anisotropic.toml", folder / "rotor.toml")
    shutil.copy(root / "examples/09_balance/runs.csv", folder)
    shutil.copytree(root / "examples/data", folder / "examples/data")
    for name in ("fan3", "rig2"):
        (folder / f"{name}.toml").write_text('[machine]\nname = "Fan 3"\nservice_rpm = 2958\n[measurement]\nanalyst = "A. Weber"\n')
    (folder / "brief.toml").write_text("[profile]\nramp_s = 4\ndwell_end_s = 0.2\n")  # designs are tried on shorter runs
    (folder / "slow.toml").write_text("[profile]\nstart_rpm = 33.4\nend_rpm = 23.9\nramp_s = 9\ndwell_end_s = 0\n")
    (folder / "asfound.csv").write_text("run_1,speed_rpm,x_amp_um,x_phase_deg,y_amp_um,y_phase_deg,P1_mass_gram,P1_angle_deg\n"
                                        "1,1500,420,182,418,92,0,0\n")
    with wave.open(str(folder / "blow.wav"), "wb") as sound:
        sound.setnchannels(2)
        sound.setsampwidth(2)
        sound.setframerate(4096)
        sound.writeframes((2000 * random.normal(0, 1, (8192, 2))).astype("<i2").tobytes())
    for command in (
        "whirl rig hammer --out blow_",
        "whirl convert blow_1.csv blow.uff",
        "whirl rig stiffness --angle-deg 0 --out p0.csv",
        "whirl rig stiffness --angle-deg 45 --out p45.csv",
        "whirl rig stiffness --angle-deg 90 --out p90.csv",
        "whirl balance runs.csv --phase lag --amplitude pp --angles against --slow-roll-rpm 400 --out earlier.json",
        "whirl rig record --rig slow.toml --out slow.csv",
    ):
        done = shell(command)
        if done.returncode:
            sys.exit(f"{command}: {done.stderr}")


def shell(command, seconds=300):
    return subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=seconds,
                          env=os.environ | {"PATH": f"{program.parent}:{os.environ['PATH']}", "WHIRL_CONFIG": ""})


BEFORE = {  # the command that needs it, and no other command of a document
    "whirl rotor criticals drawing.toml --to-rpm 6000": "whirl rotor new --template two-disc --out drawing.toml",
    "whirl centrifuge check cent.toml spin.csv": "whirl rotor new --template centrifuge --out cent.toml && "
                                                 "whirl rotor run cent.toml --from-rpm 30 --to-rpm 300 --seconds 30 --out spin.csv",
    "whirl run controller.json --fmu plant.fmu": "whirl export fmu model.json --mass-kg 1.5 --out plant && cp plant/*.fmu plant.fmu",
    "whirl info log.csv --header-line 3": logger,
    "whirl identify run.csv --drive voltage --inertia-kgm2 0.004 --out driven.json": drive_run,
    "whirl report rundown.csv model.json log.csv --out report.html": "cp run.csv log.csv",
}


def cheaper(command):
    """The command with less work in it where its form and not its numbers is what is tried here."""
    if command.startswith("whirl design"):
        few = "" if "--evaluations" in command else " --evaluations 12"
        return command + few + ("" if "--hardware" in command else " --hardware brief.toml")
    if command.startswith("whirl rig record") and "--snr-db" not in command:
        return command + " --snr-db 20"  # nearly without noise, an identification finds more and takes thrice as long
    if re.search("whirl monitor|--monitor", command):
        return f"timeout --foreground --preserve-status -s INT 3 {command} --port 0"
    return command


def runnable(command):
    words = command.split()
    if "..." in command or "[" in re.sub(r'"[^"]*"', "", command) or re.search(r"\b(FILE|FORM|IN|OUT|SUB|DIR|NAME)\b", command):
        return False
    if not re.search(r"\.(csv|json|uff|toml|wav|gz)|--list|--out \w", command):
        return False
    return words[0] == "whirl" and not any(command.startswith(e) for e in ELSEWHERE)


def main():
    laboratory()
    done, failed = set(), []
    example = re.search(r"Example: (whirl .*)", shell("whirl --help").stdout)[1]
    for file, text in [*documents.documents(root), (root / "docs/whirl --help", "    " + example)]:
        if file.name in ("CHANGELOG.md", "CONTRIBUTING.md") or not file.is_relative_to(root / "docs") and file != root / "README.md":
            continue
        for line in documents.commands_of(text):
            line = re.sub(r"\s+#.*", "", line).strip()
            for command in (part.strip() for part in line.split("&&")):
                if command in done or not runnable(command):
                    continue
                done.add(command)
                before = BEFORE.get(command)
                if callable(before):
                    before()
                elif before and shell(before).returncode:
                    failed.append(f"before `{command}`: {before}")
                outcome = shell(cheaper(command))
                if outcome.returncode != (command in REFUSED):
                    failed.append(f"{file.relative_to(root)}: `{command}`: exit code {outcome.returncode}\n{outcome.stderr[-600:]}")
    if len(done) < 50:
        failed.append(f"only {len(done)} commands found: are the documents still read?")
    print("\n".join([*failed, f"{len(done)} commands, {len(failed)} failed"]))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
