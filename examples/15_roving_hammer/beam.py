"""A free beam hit at eight points, an accelerometer at the first; some blows are double hits. Records, truth, check."""
import math
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import truth as examples

LENGTH, MASS, POINTS, RATE, SECONDS, BLOWS = 1.2, 6.0, 8, 2048, 1.5, 4  # m, kg, Hz, s
ROOTS = (4.730040745, 7.853204624, 10.99560784)  # of cos x cosh x = 1
FIRST, DAMPING = 62.0, (0.012, 0.009, 0.011)  # Hz of the first bending mode
DOUBLE = {(3, 2): 0.020, (5, 1): 0.014, (6, 4): 0.030}  # point and blow: s from the first hit to the second


def shape(root, part):
    """Free-free bending mode at a part of the length, root mean square 1."""
    x = root * part
    ratio = (math.cosh(root) - math.cos(root)) / (math.sinh(root) - math.sin(root))
    return math.cosh(x) + math.cos(x) - ratio * (math.sinh(x) + math.sin(x))


def frequencies():
    return [FIRST * (r / ROOTS[0]) ** 2 for r in ROOTS]


def force_of(draw, double):
    n, force = int(RATE * SECONDS), [0.0] * int(RATE * SECONDS)
    width, start = draw.uniform(0.0012, 0.0018), 0.1 + draw.uniform(0, 0.01)
    hits = [(start, draw.uniform(80, 160))] + ([(start + double, draw.uniform(20, 40))] if double else [])
    for at, peak in hits:
        for i in range(n):
            s = (i / RATE - at) / width
            if 0 < s < 1:
                force[i] += peak * math.sin(math.pi * s) ** 2
    return force


def acceleration(force, point, fine=16):
    """Exact response of each mode to a force of straight lines, by recursion at a finer step."""
    total = [0.0] * len(force)
    step = 1 / RATE / fine
    for root, hertz, damping in zip(ROOTS, frequencies(), DAMPING):
        w = math.tau * hertz
        gain = shape(root, 0.0) * shape(root, point / (POINTS - 1)) / MASS
        q = v = 0.0
        decay, turn = math.exp(-damping * w * step), w * math.sqrt(1 - damping ** 2) * step
        c, s, wd = math.cos(turn), math.sin(turn), w * math.sqrt(1 - damping ** 2)
        before = 0.0
        for i, f in enumerate(force):
            for k in range(fine):
                static = (before + (f - before) * (k + 0.5) / fine) / w ** 2
                d = q - static
                q = static + decay * (d * (c + damping * w / wd * s) + v * s / wd)
                v = decay * (v * (c - damping * w / wd * s) - d * w * w / wd * s)
            total[i] += gain * (f - 2 * damping * w * v - w * w * q)
            before = f
    return total


def make(folder):
    draw = random.Random(15)
    for point in range(1, POINTS + 1):
        for blow in range(1, BLOWS + 1):
            force = force_of(draw, DOUBLE.get((point, blow), 0))
            rows = ["t_s,force_N,acc_m_s2"]
            for i, (f, a) in enumerate(zip(force, acceleration(force, point - 1))):
                rows.append(f"{i / RATE:.8f},{f + draw.gauss(0, 0.02):.5f},{a + draw.gauss(0, 0.02):.5f}")
            (folder / f"p{point}_{blow}.csv").write_text("\n".join(rows) + "\n")
    return {"frequency_hz": frequencies(), "damping": DAMPING, "double_hits": [point for point, blow in DOUBLE]}


def check(folder, truth, result):
    for point in range(1, POINTS + 1):
        used = examples.load(folder / f"frf_{point}.json")["averages"]
        wanted = BLOWS - truth["double_hits"].count(point)
        result.line(used == wanted, f"blows used at point {point}", used, f"{wanted} of {BLOWS} are single hits")
    modes = examples.load(folder / "modes.json")["modes"]
    result.holds(f"{len(truth['damping'])} modes: {len(modes)}", len(modes) == len(truth["damping"]))
    for k, (mode, f, d) in enumerate(zip(modes, truth["frequency_hz"], truth["damping"]), 1):
        result.near(f"mode {k} [Hz]", mode["frequency"]["value"], f, 0.002)
        result.near("  damping ratio", mode["damping"]["value"], d, 0.03)


examples.command_line(make, check)
