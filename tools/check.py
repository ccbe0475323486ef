#!/usr/bin/env python3
"""The quick tier of the suite: every test of less than 0.2 s, two programs at a time, and what a developer asks every hour.

Usage: check.py BUILD [--lib NAME] [--record]
  --lib NAME    one library: its test program alone (its slow tests too: bin/whirl_NAME_test)
  --record      write the tests above 0.2 s of the last `ctest` run into tests/slow.txt

Prints the tests that failed, the test programs that cover the changed files (from the link graph), and what became slower:
tests against the run before, units of compilation against the build before. Exit code 1 if a test failed.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import time

from suite import tests_of as tests_in

ROOT = pathlib.Path(__file__).resolve().parent.parent
SLOW = ROOT / "tests/slow.txt"
QUICK = 0.2  # s; a test above it belongs into tests/slow.txt


def family(test):
    """A test without its parameter, which ctest and the program itself name in different ways."""
    suite, _, name = test.partition(".")
    return f"{suite}.{name.partition('/')[0]}"


def slow_tests():
    """Families of tests above QUICK."""
    return {family(line.split()[0]) for line in SLOW.read_text().splitlines() if line and not line.startswith("#")}


def programs(build):
    """Test programs that are built: name -> path."""
    return {p.name: p for p in sorted((build / "bin").glob("whirl_*_test"))}


def tests_of(program):
    listing = subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True, check=True).stdout
    suite, names = "", []
    for line in listing.splitlines():
        if line.startswith("Running main"):
            continue
        if not line.startswith(" "):
            suite = line.split("#")[0].strip()
        else:
            names.append(suite + line.split("#")[0].strip())
    return names


def run(program, names, shard, build):
    """Outcome of the tests of one program: (name, seconds, failed, text)."""
    if not names:
        return []
    report = build / f"check/{program.name}_{shard}.json"
    report.parent.mkdir(exist_ok=True)
    done = subprocess.run([program, "--gtest_brief=1", f"--gtest_output=json:{report}", "--gtest_filter=" + ":".join(names)],
                          capture_output=True, text=True, cwd=build)
    if done.returncode < 0 or not report.exists():
        return [(program.name, 0, True, done.stdout + done.stderr)]
    results = []
    for suite in json.loads(report.read_text())["testsuites"]:
        for test in suite["testsuite"]:
            failures = "\n".join(f["failure"] for f in test.get("failures", []))
            results.append((f"{suite['name']}.{test['name']}", float(test["time"].rstrip("s")), bool(failures), failures))
    report.unlink()
    return results


def covering(build):
    """Changed files -> test programs whose link contains them, by ninja's own graph."""
    changed = subprocess.run(["git", "-C", ROOT, "diff", "--name-only", "HEAD"], capture_output=True, text=True).stdout.split()
    libraries = {m[1] for f in changed if (m := re.match(r"libs/(\w+)/", f))}
    if not libraries:
        return {}
    covers = {}
    for name in programs(build):
        inputs = subprocess.run(["ninja", "-C", build, "-t", "inputs", f"bin/{name}"], capture_output=True, text=True).stdout
        hit = {lib for lib in libraries if f"libwhirl_{lib}.a" in inputs or name == f"whirl_{lib}_test"}
        if hit:
            covers[name] = sorted(hit)
    return covers


def unit_times(build):
    """Seconds that each unit took when it was last compiled."""
    times = {}
    for line in (build / ".ninja_log").read_text().splitlines()[1:]:
        start, end, _, output, _ = line.split("\t")
        if output.endswith(".o"):
            times[output] = (int(end) - int(start)) / 1000
    return times


def print_slower(what, before, now, least):
    for name, seconds in sorted(now.items(), key=lambda row: row[1] - before.get(row[0], row[1]), reverse=True)[:5]:
        if name in before and seconds > 1.5 * before[name] and seconds - before[name] > least:
            print(f"slower: {what} {name}: {before[name]:.2f} -> {seconds:.2f} s")


def record(build):
    known, costs = {name for name, _ in tests_in(build)}, {}
    for line in (build / "Testing/Temporary/CTestCostData.txt").read_text().splitlines():
        if line == "---":
            break
        name, _, cost = line.rsplit(" ", 2)
        if name in known:  # tests that are gone stay in ctest's file
            costs[name] = float(cost)
    rows = [f"{name} {cost:.1f}" for name, cost in sorted(costs.items()) if cost >= QUICK]
    SLOW.write_text("# Tests above 0.2 s on two cores, with their seconds: `tools/check.py build --record` after `make test`.\n" +
                    "\n".join(rows) + "\n")
    print(f"{len(rows)} of {len(costs)} tests are slow: {SLOW.relative_to(ROOT)}")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build", type=pathlib.Path)
    p.add_argument("--lib")
    p.add_argument("--record", action="store_true")
    o = p.parse_args()
    build = o.build.resolve()
    if o.record:
        return record(build)
    available = programs(build)
    if o.lib and f"whirl_{o.lib}_test" not in available:
        print(f"check: no test program of '{o.lib}'; there are: {', '.join(n[6:-5] for n in available)}", file=sys.stderr)
        return 2
    slow, begin, jobs = slow_tests(), time.monotonic(), []
    cores = os.cpu_count() or 2
    for name, path in available.items():
        if o.lib and name != f"whirl_{o.lib}_test":
            continue
        names = [t for t in tests_of(path) if family(t) not in slow]
        shards = max(1, min(4 * cores if o.lib else 4, len(names)))
        jobs += [(path, names[k::shards], k) for k in range(shards)]
    with concurrent.futures.ThreadPoolExecutor(cores) as pool:
        results = [r for rows in pool.map(lambda j: run(*j, build), jobs) for r in rows]
    failed = [r for r in results if r[2]]
    for name, _, _, text in failed:
        print(f"FAILED {name}\n{text}")
    times = {name: seconds for name, seconds, _, _ in results}
    memory = build / "check/times.json"
    before = json.loads(memory.read_text()) if memory.exists() else {"tests": {}, "units": {}}
    units = unit_times(build)
    print_slower("test", before["tests"], times, 0.1)
    print_slower("unit", before["units"], units, 2)
    if not o.lib:
        for name in sorted(n for n, s in times.items() if s > 2 * QUICK):
            print(f"slow: {name} took {times[name]:.2f} s: make it quicker, or add it to tests/slow.txt")
    memory.parent.mkdir(exist_ok=True)
    memory.write_text(json.dumps({"tests": before["tests"] | times, "units": units}))
    for name, libraries in covering(build).items():
        print(f"covers what changed: {name} ({', '.join(libraries)})")
    print(f"{time.monotonic() - begin:.0f} s\n{len(results) - len(failed)} passed, {len(failed)} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
