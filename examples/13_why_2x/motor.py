"""Two motors at 2958 rpm with vibration near 100 Hz: one by misalignment, one by its magnetic field. Records, truth, check."""
import math
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import truth as examples

TURNING, MAINS, RATE, SECONDS = 49.3, 50.02, 1000, 12  # Hz, s
# um, zero to peak: 1X, 2X at 98.6 Hz, twice the line frequency at 100.04 Hz.
MOTORS = {"misaligned": (12, 18, 4), "electric": (12, 0, 18)}


def make(folder):
    draw = random.Random(13)
    for name, (first, second, line) in MOTORS.items():
        rows = ["t_s,x_um,key_V"]
        for i in range(RATE * SECONDS):
            t = i / RATE
            turns = TURNING * t
            x = (first * math.cos(math.tau * turns + 0.4) + second * math.cos(2 * math.tau * turns + 1)
                 + line * math.cos(2 * math.tau * MAINS * t + 2) + draw.gauss(0, 0.8))
            rows.append(f"{t:.3f},{x:.4f},{5 if turns % 1 < 0.12 else 0}")
        (folder / f"{name}.csv").write_text("\n".join(rows) + "\n")
    return {name: {"first_order": first, "second_order": second, "twice_line_frequency": line}
            for name, (first, second, line) in MOTORS.items()}


def check(folder, truth, result):
    for name, sizes in truth.items():
        found = examples.load(folder / f"{name}.json")["tables"][0]["vibration_findings"]["findings"]
        for code, size in sizes.items():
            here = [f["size"] for f in found if f["code"] == code]
            if size:
                result.near(f"{name}: {code} [um peak]", 1e6 * here[0] if here else None, size, 0.03)
            else:
                result.holds(f"{name}: no {code}", not here)


examples.command_line(make, check)
