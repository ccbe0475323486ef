"""Largest motion at both critical speeds with 10 % more unbalance: noise for the record, truth of the machine, check."""
import csv
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import truth as examples

NOISE_UM = 0.1
BETWEEN_RPM = 1600  # of the two critical speeds


def table(path):
    with open(path, newline="") as file:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]


def make(folder):
    draw = random.Random(14)
    lines = (folder / "clean.csv").read_text().splitlines()
    out = [lines[0]]
    for line in lines[1:]:
        t, x, y, beta = line.split(",")
        out.append(f"{t},{float(x) + draw.gauss(0, NOISE_UM):.4f},{float(y) + draw.gauss(0, NOISE_UM):.4f},{beta}")
    (folder / "up.csv").write_text("\n".join(out) + "\n")
    return {"unbalance": 1.1}


def peaks(rows, probe):
    for low, high in ((0, BETWEEN_RPM), (BETWEEN_RPM, 1e9)):
        yield max((row[probe], row["speed_rpm"]) for row in rows if low <= row["speed_rpm"] < high)


def check(folder, truth, result):
    machine, heavier, foretold = (table(folder / f"{name}.csv") for name in ("machine", "heavier", "foretold"))
    probe = next(name for name in machine[0] if name.endswith("_amp_um"))
    for k, (was, true, found) in enumerate(zip(*(peaks(rows, probe) for rows in (machine, heavier, foretold))), 1):
        result.near(f"critical speed {k} [rpm]", found[1], true[1], 0.005)
        result.near(f"{probe} there with {100 * truth['unbalance'] - 100:.0f} % more unbalance", found[0], true[0], 0.03)
        result.near("  over that of the machine as it is", true[0] / was[0], truth["unbalance"], 1e-3)


examples.command_line(make, check)
