#!/usr/bin/env python3
"""`whirl oma` on the five-storey frame of pyOMA2's first example: records of our own with its figures, seeds 1 to 5.

Five masses of 25.91 kg, springs of 10 kN/m, damping 2 % in every mode, white forces on all storeys, accelerations with 10 % noise,
300 s at 100 Hz. Usage: oma_shear_frame.py WHIRL
"""
import json
import subprocess
import sys
import tempfile

import numpy as np

mass, spring, zeta, fine, step, seconds = 25.91, 10e3, 0.02, 2, 0.01, 300.0
stiffness = spring * (2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))
stiffness[4, 4] = spring
squared, shapes = np.linalg.eigh(stiffness / mass)
omega = np.sqrt(squared)


def record(seed):
    """Accelerations: modal sums of exact steps under forces held for half a sample."""
    random = np.random.default_rng(seed)
    h = step / fine
    n = int(seconds / step) * fine
    force = random.normal(0, 1, (n, 5)) @ shapes / mass
    total = np.zeros((n, 5))
    for k, w in enumerate(omega):
        damped = w * np.sqrt(1 - zeta**2)
        e, c, s = np.exp(-zeta * w * h), np.cos(damped * h), np.sin(damped * h)
        a11, a12 = e * (c + zeta * w / damped * s), e * s / damped
        a21, a22 = -w * w * a12, e * (c - zeta * w / damped * s)
        b1, b2 = (1 - a11) / w**2, a12
        q, v = 0.0, 0.0
        acceleration = np.empty(n)
        for i in range(n):
            f = force[i, k]
            acceleration[i] = f - w * w * q - 2 * zeta * w * v
            q, v = a11 * q + a12 * v + b1 * f, a21 * q + a22 * v + b2 * f
        total += np.outer(acceleration, shapes[:, k])
    out = total[::fine]
    return out + random.normal(0, 0.1, out.shape) * out.std(axis=0)


def main():
    truth = omega / (2 * np.pi)
    print("truth       ", *(f"{f:.3f} Hz {100 * zeta:.1f} %" for f in truth))
    errors = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, 6):
            file = f"{folder}/frame.csv"
            y = record(seed)
            np.savetxt(file, np.column_stack([np.arange(len(y)) * step, y]), fmt="%.9g", delimiter=",", comments="",
                       header="t_s," + ",".join(f"storey{j + 1}_m_s2" for j in range(5)))
            done = subprocess.run([sys.argv[1], "oma", file, "--json", "--quiet"], capture_output=True, text=True, check=True)
            modes = json.loads(done.stdout)["modes"]
            print(f"whirl seed {seed}", *(f"{m['frequency']['value']:.3f} Hz {100 * m['damping']['value']:.1f} %" for m in modes))
            errors += [abs(m["damping"]["value"] / zeta - 1) for m in modes]
    print(f"{len(errors)} modes of 25; damping off by {100 * np.median(errors):.1f} % (median), {100 * max(errors):.1f} % at most")


if __name__ == "__main__":
    main()
