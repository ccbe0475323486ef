#!/usr/bin/env python3
"""Twenty-six mistakes that users make. Each must be named, with the right fix, before it does harm.

Usage: mistakes.py WHIRL FOLDER      prints the table; exit code 1 when a mistake is not named
"""
import csv
import math
import os
import re
import shutil
import subprocess
import sys

MARK = ".seeded-mistakes"
program, folder = os.path.abspath(sys.argv[1]), sys.argv[2]
# Cleared only when it is a folder of this script's own.
if os.path.isdir(folder) and os.listdir(folder) and not os.path.exists(os.path.join(folder, MARK)):
    sys.exit(f"{folder}: is not empty and not from this script: give another folder")
shutil.rmtree(folder, ignore_errors=True)
os.makedirs(folder)
os.chdir(folder)
open(MARK, "w").close()


def whirl(*words):
    return subprocess.run([program, *words], capture_output=True, text=True, env=os.environ | {"WHIRL_CONFIG": ""})


def need(*words):
    done = whirl(*words)
    if done.returncode:
        sys.exit(f"whirl {' '.join(words)}: {done.stderr}")


need("rig", "record", "--added-mass-g", "5", "--snr-db", "20", "--out", "r.csv")
need("rig", "stiffness", "--out", "pull.csv")
need("identify", "r.csv", "--no-holdout", "--out", "model.json")
need("stiffness", "pull.csv", "--out", "stiffness.json")
header, *rows = csv.reader(open("r.csv"))
rows = [[float(v) for v in row] for row in rows]
pull_header, *pull = csv.reader(open("pull.csv"))
pull = [[float(v) for v in row] for row in pull]


def write(name, head, lines):
    with open(name, "w") as out:
        out.write(",".join(head) + "\n")
        out.writelines(",".join(map(repr, line)) + "\n" for line in lines)
    return name


def record(name, change, head=header):
    return ["identify", write(name, head, (change(*row) for row in rows)), "--no-holdout"]


logger = write("o.csv", ["Logger 7"], [])
with open(logger, "a") as file:
    file.write("Time [s];Probe [V]\n" + "".join(f"{i};{i % 7}\n" for i in range(9)))

# What was done wrong, the command, what the answer must say, and the exit codes that are right (0: done with a warning).
MISTAKES = [
    ("x and y swapped", record("a.csv", lambda t, x, y, b: (t, y, x, b)), "rotation is against the angle: x and y are swapped", (1,)),
    ("angle counts backwards", record("b.csv", lambda t, x, y, b: (t, x, y, -b)), "rotation is against the angle.*angle counts backwards", (1,)),
    ("sign of one probe", record("c.csv", lambda t, x, y, b: (t, -x, y, b)), "rotation is against the angle.*wrong sign", (1,)),
    ("angle in degrees", record("d.csv", lambda t, x, y, b: (t, x, y, math.degrees(b))), "angle.*as deg", (1,)),
    ("angle in turns", record("e.csv", lambda t, x, y, b: (t, x, y, b / math.tau)), "turns: multiply the angle by 2 pi", (1,)),
    ("time in ms", record("f.csv", lambda t, x, y, b: (1e3 * t, x, y, b)), "time in ms, not s", (1,)),
    ("um in a column of mm", record("g.csv", lambda t, x, y, b: (t, 1e3 * x, 1e3 * y, b)), "um, not mm", (1,)),
    ("mm in a column of m", record("h.csv", lambda *row: row, ["t_s", "x_m", "y_m", "beta_rad"]), "mm or um, not m", (1,)),
    ("one probe in um", record("i.csv", lambda t, x, y, b: (t, x, 1e3 * y, b)), "channel y.*um, not mm", (1,)),
    ("no units", record("j.csv", lambda *row: row, ["t", "x", "y", "beta"]), "'t' has no unit; .* 't_s'", (2,)),
    ("angle with a unit of length", record("k.csv", lambda *row: row, ["t_s", "x_mm", "y_mm", "beta_mm"]), "beta_rad", (2,)),
    ("speed in place of the angle", record("l.csv", lambda *row: row, ["t_s", "x_mm", "y_mm", "beta_rpm"]), "speed is no angle", (2,)),
    ("arguments swapped", ["validate", "r.csv", "model.json"], "r.csv.*not a JSON result.*each other's place", (2,)),
    ("two results swapped", ["design", "stiffness.json", "--stiffness", "model.json"], "whirl.stiffness/1.*must be 'whirl.model/1'.*whirl identify", (2,)),
    ("a model where a controller belongs", ["run", "model.json"], "must be 'whirl.controller/1'.*whirl design", (2,)),
    ("a pull table for a record", ["identify", "pull.csv"], "no column 'x'.*present: deflection, force", (2,)),
    ("a pull table in m", ["stiffness", write("m.csv", ["deflection_m", "force_N"], pull)], "unit mm, not m", (1,)),
    ("force with the other sign", ["stiffness", write("n.csv", pull_header, [(d, -f) for d, f in pull])], "check the signs", (1,)),
    ("mass in g", ["design", "model.json", "--mass-kg", "1500"], "mass in g, not kg", (2,)),
    ("radius in m", ["balance", "model.json", "--mass-kg", "1.5", "--radius-mm", "0.083", "--speed-rpm", "1800"], "radius in m", (1,)),
    ("speed in Hz", ["response", "model.json", "--from-rpm", "5", "--to-rpm", "31"], "range in Hz", (0, 1)),
    ("a flag misspelt", ["identify", "r.csv", "--hold-out", "0.2"], "did you mean '--holdout'", (2,)),
    ("a spreadsheet for a balancing table", ["balance", write("fan.csv", ["run", "speed", "DE amp", "DE phase", "mass", "angle"], [(1, 1480, 48.3, 7.8, 0, 0)])],
     "needs the header run_1,speed_rpm,PROBE_amp_um", (2,)),
    ("a line about the test above the names", ["info", logger], "line 2 looks like the header: --header-line 2", (2,)),
    ("time signals for frequency responses", ["modes", "r.csv"], "whirl frf r.csv --out frf.json", (2,)),
    ("a result for a recording", ["info", "model.json"], "whirl report model.json", (2,)),
]

failed = 0
for name, words, wanted, codes in MISTAKES:
    answer = whirl(*words)
    named = re.search(wanted, answer.stderr) is not None and answer.returncode in codes
    failed += not named
    said = next((line for line in answer.stderr.split("\n") if re.search(wanted, line)), answer.stderr.strip().split("\n")[-1])
    print(f"{'named ' if named else 'MISSED'} {name:36} {answer.returncode}  {said[:170]}")
# What is right is not refused.
for words in (["validate", "model.json", "r.csv"], ["stiffness", "pull.csv"], ["info", "r.csv"],
              ["balance", "model.json", "--mass-kg", "1.5", "--radius-mm", "83", "--speed-rpm", "1800"]):
    answer = whirl(*words)
    if answer.returncode:
        failed += 1
        print(f"REFUSED whirl {' '.join(words)}: {answer.stderr}")
print(f"{len(MISTAKES) - failed} of {len(MISTAKES)} named")
sys.exit(1 if failed else 0)
