#!/usr/bin/env python3
"""What one step of every exported float controller costs on a Cortex-M4F: instructions (mean, worst), stack, flash, state.

Usage: tools/cortex_m4f.py WHIRL [--law NAME] [--design controller.json]

Runs `whirl export c --target cortex-m4f` for each law with the estimator lpf. Prints the table of docs/export.md; exit code 1
when a law needs more than twice its mean in the worst step, 77 when a tool is missing.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
DESIGN = ROOT / "targets/cortex-m4f/controller.json"


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def measure(whirl, design, law, folder):
    design = dict(design, law=law, estimator="lpf", margins={}, parameters={})
    (folder / "controller.json").write_text(json.dumps(design))
    said = run(whirl, "export", "c", folder / "controller.json", "--target", "cortex-m4f", "--out", folder / "law", "--json")
    return json.loads(said)["target"]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("whirl")
    p.add_argument("--law")
    p.add_argument("--design", default=str(DESIGN))
    o = p.parse_args()
    listed = run(o.whirl, "design", "--list").split("estimators")[0].splitlines()
    laws = [o.law] if o.law else [line.split()[0] for line in listed[3:] if line.strip()]
    design = json.loads(pathlib.Path(o.design).read_text())
    good = bool(laws)
    print("| law | instructions, mean | worst step | worst / mean | stack, bytes | flash with math functions, bytes | state, bytes |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for law in laws:
        try:
            with tempfile.TemporaryDirectory() as folder:
                n = measure(o.whirl, design, law, pathlib.Path(folder))
        except RuntimeError as e:
            if "is not installed" in str(e):
                print(e)
                return 77
            # A law may refuse float by name; everything else is a failure.
            if "float cannot hold" not in str(e):
                raise
            print(f"| `{law}` | refuses float | | | | | |", flush=True)
            continue
        ratio = n["worst"] / n["mean"]
        good = good and ratio <= 2
        print(f"| `{law}` | {n['mean']} | {n['worst']} | {ratio:.2f} | {n['stack']} | {n['flash']} | {n['state']} |", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
