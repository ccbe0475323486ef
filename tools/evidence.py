#!/usr/bin/env python3
"""Prints the tables of the documents anew: each is one command, kept under the hash of its program, arguments and inputs.

Usage: evidence.py BUILD [NAME ...]

docs/evidence/tables.toml lists them. The output of NAME is kept in docs/evidence/NAME.txt with its command, date and commit, and
stands in the page between `<!-- table NAME -->` and `<!-- end NAME -->`. A table whose program, arguments and inputs are as they
were is not run again; one that was interrupted is (its rows so far are left in the build folder), the others are kept. Tables run
two at a time. Exit code 1 if a command failed.
"""
import concurrent.futures
import datetime
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
KEPT = ROOT / "docs/evidence"


def key_of(table, build):
    """Hash of what decides the numbers: the program, its arguments (seeds among them), the files it reads."""
    digest = hashlib.sha256("\0".join(table["command"]).encode())
    for file in [build / "bin" / table["command"][0], *[ROOT / i for i in table.get("inputs", [])]]:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def print_table(name, table, build):
    program = build / "bin" / table["command"][0]
    subprocess.run(["cmake", "--build", build, "--target", program.name], check=True, stdout=subprocess.DEVNULL)
    kept, key = KEPT / f"{name}.txt", key_of(table, build)
    if kept.exists() and f"key {key}" in kept.read_text().split("\n", 1)[0]:
        return f"{name}: as printed before", True
    rows = build / f"evidence_{name}.txt"
    with open(rows, "w") as out:
        done = subprocess.run([program, *table["command"][1:]], stdout=out, stderr=subprocess.STDOUT, cwd=build)
    if done.returncode != 0:
        return f"{name}: exit code {done.returncode}, rows so far in {rows}", False
    commit = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True).stdout.strip()
    kept.write_text(f"# {datetime.date.today()}, commit {commit}, key {key}\n$ {' '.join(table['command'])}\n{rows.read_text()}")
    return f"{name}: printed", True


def into_page(name, table):
    page = ROOT / table["page"]
    head, text = (KEPT / f"{name}.txt").read_text().split("\n", 1)
    said = re.sub(r", key \w+", "", head.lstrip("# "))
    block = f"<!-- table {name} -->\nPrinted {said}:\n\n" + "\n".join("    " + line for line in text.rstrip().split("\n")) + f"\n<!-- end {name} -->"
    marked = re.compile(rf"<!-- table {name} -->.*?<!-- end {name} -->", re.S)
    if not marked.search(page.read_text()):
        sys.exit(f"{table['page']}: no place for table {name}: write <!-- table {name} --> and <!-- end {name} --> where it belongs")
    page.write_text(marked.sub(lambda _: block, page.read_text()))


def main():
    build, wanted = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:]
    tables = tomllib.loads((KEPT / "tables.toml").read_text())
    unknown = [w for w in wanted if w not in tables]
    if unknown:
        sys.exit(f"evidence: no table '{unknown[0]}'; docs/evidence/tables.toml has: {', '.join(tables)}")
    chosen = {n: t for n, t in tables.items() if not wanted or n in wanted}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        outcomes = list(pool.map(lambda row: print_table(*row, build), chosen.items()))
    for (name, table), (text, fine) in zip(chosen.items(), outcomes):
        print(text)
        if fine:
            into_page(name, table)
    return 0 if all(fine for _, fine in outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
