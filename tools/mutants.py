#!/usr/bin/env python3
"""Mutation testing of the parts that keep a rotor safe: changes one operator, constant or axis at a time and counts how many
changes the tests beside the code notice.

Usage: tools/mutants.py BUILD_DIR [--only NAME] [--limit N] [--list]

BUILD_DIR: a configured and built tree (its static libraries are linked). A mutant is compiled into a folder of its own, the
tree is not touched. Exit code 0 when at least 95 % are killed, else 1; survivors are listed with line and change.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent

# File under test, its include root (None: a source), and the tests that must notice.
TARGETS = {
    "gate": ("libs/rt/include/whirl/rt/safety.hpp", "libs/rt/include", ["libs/rt/test/safety_test.cpp"]),
    "pace": ("libs/rt/include/whirl/rt/pace.hpp", "libs/rt/include", ["libs/rt/test/pace_test.cpp"]),
    "loop": ("libs/rt/include/whirl/rt/loop.hpp", "libs/rt/include",
             ["libs/rt/test/safety_test.cpp", "libs/rt/test/loop_test.cpp", "libs/rt/test/pace_test.cpp",
              "libs/rt/test/release_test.cpp"]),
    "sample_gate": ("libs/control/include/whirl/control/gate.hpp", "libs/control/include",
                    ["libs/control/test/controller_test.cpp"]),
    "units": ("libs/io/src/units.cpp", None, ["libs/io/test/hash_units_test.cpp"]),
}

OPERATORS = [
    (r"<=", "<"), (r">=", ">"), (r"(?<![<\-=])<(?![<=\w:])", "<="), (r"(?<![\->=])> (?!=)", ">= "),
    (r"==", "!="), (r"!=", "=="), (r"&&", "||"), (r"\|\|", "&&"),
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "),
    (r"\bux\b", "uy"), (r"\buy\b", "ux"), (r"\bm\.x\b", "m.y"), (r"\bm\.y\b", "m.x"),
    (r"\btrue\b", "false"), (r"\bfalse\b", "true"), (r"std::abs\(", "("), (r"\b60\b", "1"),
    (r"std::max\b", "std::min"), (r"std::min\b", "std::max"), (r"\+\+", "--"),
]
SKIP = re.compile(r"^\s*(//|#|///|template|using|static_assert|namespace|inline [a-z]|constexpr [a-z]+ [a-z]+\()")


def mutants(path):
    lines = (ROOT / path).read_text().splitlines()
    for number, line in enumerate(lines):
        code = line.split("//")[0]
        if SKIP.match(line) or not code.strip() or code.strip().startswith("template"):
            continue
        for pattern, new in OPERATORS:
            for at in re.finditer(pattern, code):
                if "<" in at.group() and re.search(r"(Expected|vector|array|optional|static_cast|clamp|pair|map|atomic)<", code):
                    continue
                changed = code[:at.start()] + new + code[at.end():]
                yield number, line, "\n".join(lines[:number] + [changed] + lines[number + 1:]) + "\n", changed.strip()


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build")
    p.add_argument("--only", choices=TARGETS)
    p.add_argument("--limit", type=int, default=0, help="every N-th mutant so that about this many remain")
    p.add_argument("--list", action="store_true")
    o = p.parse_args()
    build = pathlib.Path(o.build).resolve()
    includes = [f"-I{d}" for d in sorted(ROOT.glob("libs/*/include"))] + [f"-I{ROOT}/testing/include", "-I/usr/include/eigen3"]
    libraries = []
    for name in ("control", "rotor", "io", "expr", "core"):
        libraries += [str(f) for f in build.glob(f"libs/{name}/libwhirl_{name}.a")]
    guard = [str(f) for f in build.glob("**/whirl_alloc_guard.dir/**/alloc_guard.cpp.o")]
    total = killed = broken = 0
    for name, (path, root, tests) in TARGETS.items():
        if o.only not in (None, name):
            continue
        every = list(mutants(path))
        step = max(1, len(every) // o.limit) if o.limit else 1
        seen = noticed = 0
        for number, line, text, changed in every[::step]:
            if o.list:
                print(f"{path}:{number + 1}: {changed}")
                continue
            with tempfile.TemporaryDirectory() as folder:
                folder = pathlib.Path(folder)
                file = folder / (pathlib.Path(path).relative_to(root) if root else pathlib.Path(path).name)
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text)
                sources = [str(ROOT / t) for t in tests] + ([] if root else [str(file)])
                extra = [f"-I{ROOT / pathlib.Path(path).parent}"]
                command = ["g++", "-std=c++20", "-O0", "-w", "-DEIGEN_MAX_ALIGN_BYTES=64", f"-I{folder}", *extra, *includes, *sources,
                           *guard, "-o", str(folder / "test"), "-lgtest_main", "-lgtest", "-lgmock", *libraries, *libraries,
                           "-lfmt", "-lz", "-lpugixml", "-ltomlplusplus", "-lsndfile", "-lpthread", "-ldl",
                           "-L/usr/lib/x86_64-linux-gnu/hdf5/serial", "-lhdf5"]
                if guard:
                    command.append("-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=posix_memalign")
                built = subprocess.run(command, capture_output=True, text=True)
                if built.returncode != 0:
                    broken += 1
                    if broken == 1:
                        print("does not compile:", built.stderr[-600:], file=sys.stderr)
                    continue
                seen += 1
                try:
                    code = subprocess.run([str(folder / "test")], capture_output=True, timeout=120).returncode
                except subprocess.TimeoutExpired:
                    code = 124
                if code != 0:
                    noticed += 1
                else:
                    print(f"survived  {path}:{number + 1}: {line.strip()}  ->  {changed}", flush=True)
        if seen:
            print(f"{name}: {noticed} of {seen} killed ({100 * noticed / seen:.0f} %)", flush=True)
        total += seen
        killed += noticed
    if o.list:
        return 0
    print(f"total: {killed} of {total} killed ({100 * killed / max(total, 1):.1f} %), {broken} did not compile")
    return 0 if total and killed >= 0.95 * total else 1


if __name__ == "__main__":
    sys.exit(main())
