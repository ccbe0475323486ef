#!/usr/bin/env python3
"""Files of every schema version that was released still load, with the values they had; a newer version is refused by name.

Usage: schemas.py SOURCE_DIR WHIRL FOLDER      exit code 1 and one line per deviation

tests/data/schemas/NAME-VERSION.json is one file of `whirl.NAME/VERSION`.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys

root, program, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3])
KEPT = root / "tests/data/schemas"
RUNS = f"{root}/examples/09_balance/runs.csv --phase lag --amplitude pp --angles against --slow-roll-rpm 400"

# File -> command that reads it, and a value of its JSON answer as the version that wrote the file gave it.
READERS = {
    "model-1": ("balance {} --mass-kg 1.5 --radius-mm 83 --speed-rpm 1800", ("unbalance_kg_m",), 0.00047930487),
    "stiffness-1": ("balance model-1.json --stiffness {} --radius-mm 83 --speed-rpm 1800", ("correction_mass", "value"), 0.005887455),
    "frf-1": ("modes {}", ("modes", 0, "frequency", "value"), 10.000027),
    "modes-1": ("report {} --out page.html", ("report",), "page.html"),
    "controller-1": ("margins {} model-1.json --mass-kg 1.5 --speeds 1", ("plants", 0, "worst", "stable"), True),
    "plant-1": ("margins controller-1.json {} --speeds 1", ("plants", 0, "worst", "stable"), True),
    "law-1": ("design plant-1.json --law-file {} --evaluations 1 --quiet --out law.json --json", ("law",), "state_space"),
    "balancing-1": (f"balance {RUNS} --prior {{}} --noise-um 0.5", ("planes", 0, "mass", "value"), 0.0032561637),
    "rotor_controller-1": ("rotor control rotor_controller.toml --check {} --from-rpm 1000 --to-rpm 1000 --modes 1 --points 2",
                           ("worst_sensitivity",), 1.0597957),
}


def run(line):
    return subprocess.run([program, *line.split()], capture_output=True, text=True, cwd=folder)


def value_at(answer, path):
    for key in path:
        answer = answer[key]
    return answer


def read_by_the_sources():
    """name -> newest version that the sources read."""
    newest = {}
    for file in [f for top in ("libs", "apps") for f in (root / top).rglob("*.cpp")]:
        for name, version in re.findall(r'require_schema\("whirl\.([\w-]+)", (\d+)\)', file.read_text()):
            newest[name] = max(newest.get(name, 0), int(version))
    return newest


def check(name):
    command, path, wanted = READERS[name]
    done = run(command.format(f"{name}.json") + " --json")
    if done.returncode not in (0, 1):
        return [f"{name}.json: `whirl {command.format(name + '.json')}`: {done.stderr.strip()}"]
    found = value_at(json.loads(done.stdout), path)
    same = abs(found - wanted) <= 1e-4 * abs(wanted) if isinstance(wanted, float) else found == wanted
    wrong = [] if same else [f"{name}.json: {path} is {found}, was {wanted}"]
    document = json.loads((KEPT / f"{name}.json").read_text())
    schema = document["schema"].rpartition("/")
    document["schema"] = f"{schema[0]}/{read_by_the_sources()[schema[0][6:]] + 1}"
    (folder / "newer.json").write_text(json.dumps(document))
    done = run(command.format("newer.json"))
    if done.returncode != 2 or "written by a newer program" not in done.stderr or document["schema"] not in done.stderr or "newer.json" not in done.stderr:
        wrong.append(f"{document['schema']} is not refused by name: exit code {done.returncode}, {done.stderr.strip()[:200]}")
    return wrong


def main():
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(KEPT, folder)
    wrong = [f"tests/data/schemas/{name}-{version}.json is missing" for name, newest in sorted(read_by_the_sources().items())
             for version in range(1, newest + 1) if not (KEPT / f"{name}-{version}.json").exists()]
    for file in sorted(KEPT.glob("*.json")):
        wrong += check(file.stem) if file.stem in READERS else [f"{file.name}: no command reads it"]
    print("\n".join([*wrong, f"{len(READERS)} files, {len(wrong)} wrong"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
