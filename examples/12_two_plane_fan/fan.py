"""A fan balanced in two planes; the plug of one probe was turned round in one run. Its table of runs, truth and check."""
import cmath
import math
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import truth as examples

PLANES, PROBES = ("A", "B"), ("DE", "NDE")
BAD_RUN, BAD_PROBE = 4, 1


def vector(amplitude, degrees):
    return cmath.rect(amplitude, math.radians(degrees))


# um peak to peak a gram at 1480 rpm. Angles of the masses count with the rotation, phases are lags.
INFLUENCE = [[vector(2.1, -62), vector(0.7, -140)], [vector(0.9, -118), vector(1.8, -48)]]
UNBALANCE = [vector(23, 75), vector(14, 310)]  # gram


def readings(masses):
    return [sum(INFLUENCE[i][j] * (UNBALANCE[j] + masses[j]) for j in range(2)) for i in range(2)]


def make(folder):
    draw = random.Random(12)
    runs = [(0, 0), (vector(10, 0), 0), (0, vector(10, 90)), (vector(12, 200), vector(8, 120)),
            (vector(9, 300), vector(9, 20)), (0, 0)]
    lines = ["run_1,speed_rpm," + ",".join(f"{p}_amp_um,{p}_phase_deg" for p in PROBES) + ","
             + ",".join(f"{p}_mass_gram,{p}_angle_deg" for p in PLANES)]
    for run, masses in enumerate(runs, 1):
        cells = [str(run), "1480"]
        for probe, reading in enumerate(readings(masses)):
            reading *= 1 + vector(0.01, draw.uniform(0, 360))
            if (run, probe) == (BAD_RUN, BAD_PROBE):
                reading = -reading
            cells += [f"{abs(reading):.2f}", f"{-math.degrees(cmath.phase(reading)) % 360:.1f}"]
        for m in masses:
            cells += [f"{abs(m):.2f}", f"{math.degrees(cmath.phase(m)) % 360 if m else 0:.1f}"]
        lines.append(",".join(cells))
    (folder / "runs.csv").write_text("\n".join(lines) + "\n")
    return {"masses": {p: {"gram": abs(u), "angle_deg": math.degrees(cmath.phase(-u)) % 360}
                       for p, u in zip(PLANES, UNBALANCE)},
            "bad_run": str(BAD_RUN), "bad_probe": PROBES[BAD_PROBE]}


def check(folder, truth, result):
    found = examples.load(folder / "balance.json")
    masses = []
    for plane in found["planes"]:
        mass, angle, true = plane["mass"], plane["angle"], truth["masses"][plane["plane"]]
        result.within(f"mass on {plane['plane']} [g]", true["gram"], *(1e3 * m for m in mass["ci95"]))
        middle = math.degrees(angle["value"])
        turned = middle + (true["angle_deg"] - middle + 180) % 360 - 180
        result.within(f"angle on {plane['plane']} [deg]", turned, *(math.degrees(a) for a in angle["ci95"]))
        masses.append(cmath.rect(1e3 * mass["value"], angle["value"]))
    before, after = readings([0, 0]), readings(masses)
    for probe, b, a in zip(PROBES, before, after):
        result.below(f"true vibration left at {probe}, of that before", abs(a) / abs(b), 0.1)
    named = found["contradictions"][0] if found["contradictions"] else {"run": "none", "looks_as_if": ""}
    result.holds(f"run {truth['bad_run']} is named and left out", named["run"] == truth["bad_run"] and named["left_out"])
    result.holds(f"with its cause: {named['looks_as_if']}", truth["bad_probe"] in named["looks_as_if"])


examples.command_line(make, check)
