#!/usr/bin/env python3
"""The whole suite, by ctest. A test that passed is not run again while all that it depends on is the same.

Usage: suite.py BUILD JOBS [--all]
  --all    run every test, whatever passed before

A test of a library depends on its program (bytes), on the files that it reads below the source tree and in the folder
of measured data, and on the installed packages (compilers that exported code meets). Command line, Python and examples
depend on all that is built and on every file of the tree but the tests of the libraries. Checks of the tree and of the
documents run each time. What passed is kept in BUILD/passed.json. Exit code: ctest's.
"""
import argparse
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
READS = re.compile(r'source_dir\(\)\)?(?:\s*[+/]\s*"/?([^"]+)")?')  # without a path behind it: any file of the tree


def tests_of(build):
    """Name and program of every test, in ctest's order."""
    listing = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True, check=True).stdout
    return [(test["name"], pathlib.Path(test["command"][0])) for test in json.loads(listing)["tests"]]


def asked(*command):
    """What a command prints; where it does not work, what is never the same twice: nothing is left out then."""
    try:
        return subprocess.run(command, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return os.urandom(16)


def tree():
    """Files of the source tree, and their list as git prints it."""
    listing = asked("git", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    names = sorted(set(listing.decode(errors="ignore").replace("\0", "\n").splitlines()))
    return [ROOT / name for name in names if (ROOT / name).is_file()], listing


def below(path):
    """A file, all files of a folder, or those whose paths begin like it."""
    if path.is_file():
        return [path]
    folder = path if path.is_dir() else path.parent
    return sorted(p for p in folder.rglob("*") if p.is_file() and str(p).startswith(str(path)))


def read_by(library, data):
    """Files that the tests of a library read: the sources name them."""
    files, sources = set(), [*(ROOT / "libs" / library / "test").rglob("*"), *(ROOT / "testing").rglob("*")]
    for source in sources:
        if source.suffix not in {".cpp", ".hpp"} or source.name == "paths.hpp":
            continue
        text = source.read_text()
        for path in READS.findall(text):
            if path:
                files.update(below(ROOT / path))
            else:
                files.update(tree()[0])
        if "data_file(" in text and source.name != "data.hpp":
            files.update(below(data))
    return sorted(files)


def digest(files, machine):
    h = hashlib.sha256(machine)
    for path in files:
        h.update(str(path).encode())
        h.update(path.read_bytes())
    return h.hexdigest()


def dependencies(build, tests):
    """Test -> digest of what it depends on; none for those that run each time."""
    cache = (build / "CMakeCache.txt").read_text()
    data = pathlib.Path(os.environ.get("WHIRL_DATA") or re.search(r"^WHIRL_DATA:PATH=(.*)$", cache, re.M)[1])
    machine = asked("dpkg-query", "--show")
    of_libraries = {f"whirl_{folder.name}_test": folder.name for folder in (ROOT / "libs").iterdir()}
    module = sorted((build / "python").rglob("*.so"))  # its sources are of the tree; beside it lie caches
    built = [*(p for p in below(build / "bin") if p.name not in of_libraries), *module]
    files, listing = tree()
    others = [p for p in files if p.relative_to(ROOT).parts[::2][:2] != ("libs", "test")]
    everything = digest([*built, *others, *below(data)], machine + listing)
    keys = {program: digest([program, *read_by(of_libraries[program.name], data)], machine)
            for program in {program for _, program in tests} if program.name in of_libraries and program.exists()}
    return {name: keys.get(program, everything) for name, program in tests if not name.startswith(("structure.", "documents."))}


def outcomes(report):
    """Test -> "run" where it passed, else "fail", "notrun" or "disabled"."""
    return {case.get("name"): case.get("status") for case in xml.etree.ElementTree.parse(report).getroot().iter("testcase")}


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build", type=pathlib.Path)
    p.add_argument("jobs", type=int)
    p.add_argument("--all", action="store_true")
    o = p.parse_args()
    build = o.build.resolve()
    if not (build / "CTestTestfile.cmake").exists():
        print(f"suite: {o.build}: no build folder with tests; make one by 'make build' or 'cmake -S . -B {o.build}'", file=sys.stderr)
        return 2
    memory, report = build / "passed.json", build / "Testing/report.xml"
    tests = tests_of(build)
    keys = dependencies(build, tests)
    before = json.loads(memory.read_text()) if memory.exists() and not o.all else {}
    passed = {name: key for name, key in before.items() if keys.get(name) == key}
    todo = [k for k, (name, _) in enumerate(tests, 1) if name not in passed]
    if passed:
        same = sorted({program.name for name, program in tests if name in passed})
        print(f"{len(passed)} of {len(tests)} tests passed before and what they depend on is the same: not run again "
              f"({', '.join(same)}). All of them: make test ALL=1", flush=True)
    chosen = build / "Testing/chosen.txt"
    chosen.parent.mkdir(exist_ok=True)
    chosen.write_text("0,0,0," + ",".join(map(str, todo)) + "\n")  # ctest drops a number without a character behind it
    report.unlink(missing_ok=True)
    code = subprocess.run(["ctest", "--test-dir", build, "--output-on-failure", "-j", str(o.jobs), "-I", chosen,
                           "--output-junit", report]).returncode
    result = outcomes(report) if report.exists() else {}
    passed |= {name: keys[name] for name, _ in tests if result.get(name) == "run" and name in keys}
    memory.write_text(json.dumps(passed, indent=0))
    forgotten = [tests[k - 1][0] for k in todo if tests[k - 1][0] not in result]
    if forgotten:
        print(f"suite: ctest did not report {len(forgotten)} tests that it was told to run, among them {forgotten[0]}", file=sys.stderr)
    return code or (1 if forgotten else 0)


if __name__ == "__main__":
    sys.exit(main())
