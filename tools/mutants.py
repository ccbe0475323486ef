#!/usr/bin/env python3
"""Mutation testing of the parts that keep a rotor safe: changes one operator, constant or axis at a time and counts how many
changes the tests beside the code notice.

Usage: tools/mutants.py BUILD_DIR [--only NAME] [--limit N] [--list]

BUILD_DIR: a configured and built tree (its static libraries are linked). A mutant is compiled into a folder of its own, the
tree is not touched. Exit code 0 when at least 95 % are killed, else 1; survivors are listed with line and change.
"""
import argparse
import concurrent.futures
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent

# File under test, its include root (None: a source), and the tests that must notice.
TARGETS = {
    "gate": ("libs/rt/include/whirl/rt/safety.hpp", "libs/rt/include", ["libs/rt/test/safety_test.cpp"]),
    "pace": ("libs/rt/internal/whirl/rt/pace.hpp", "libs/rt/internal", ["libs/rt/test/pace_test.cpp"]),
    "loop": ("libs/rt/internal/whirl/rt/loop.hpp", "libs/rt/internal",
             ["libs/rt/test/gap_test.cpp", "libs/rt/test/loop_test.cpp", "libs/rt/test/safety_test.cpp", "libs/rt/test/release_test.cpp",
              "libs/rt/test/pace_test.cpp"]),
    "sample_gate": ("libs/control/include/whirl/control/gate.hpp", "libs/control/include",
                    ["libs/control/test/gate_test.cpp"]),
    "control_gate": ("libs/rt/internal/whirl/rt/loop_control.hpp", "libs/rt/internal", ["libs/rt/test/loop_control_test.cpp"]),
    "units": ("libs/io/src/units.cpp", None, ["libs/io/test/hash_units_test.cpp"]),
    "laser": ("libs/rt/src/drivers/optoncdt.cpp", None, ["libs/rt/test/optoncdt_test.cpp"]),
    "board": ("libs/rt/src/drivers/udp_board.cpp", None, ["libs/rt/test/udp_board_test.cpp"]),
    **{"estimator_" + name: (f"libs/control/src/estimators/{name}.cpp", None,
                             ["libs/control/test/estimators_test.cpp", "libs/control/test/kalman_test.cpp"])
       for name in ("difference", "eso", "kalman", "red")},
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


PRECOMPILED = """#include <gtest/gtest.h>
#include <gmock/gmock.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>
"""
COMPILE = ["g++", "-std=c++20", "-O0", "-w", "-DEIGEN_MAX_ALIGN_BYTES=64"]


class Workshop:
    """Compiles and runs mutants; what does not change (the tests of a source, the headers of the tests) is compiled once."""

    def __init__(self, build, folder):
        self.folder = folder
        roots = [d for kind in ("include", "internal") for d in sorted(ROOT.glob(f"libs/*/{kind}"))]
        self.includes = [f"-I{d}" for d in roots] + [f"-I{ROOT}/testing/include", "-I/usr/include/eigen3"]
        self.libraries = []
        for name in ("rt", "control", "rotor", "io", "records", "signal", "expr", "core"):
            self.libraries += [str(f) for f in build.glob(f"libs/{name}/libwhirl_{name}.a")]
        self.libraries += [str(f) for f in build.glob("testing/libwhirl_testing.a")]
        self.guard = [str(f) for f in build.glob("**/whirl_alloc_guard.dir/**/alloc_guard.cpp.o")]
        (folder / "common.hpp").write_text(PRECOMPILED)
        self.run([*COMPILE, "-x", "c++-header", str(folder / "common.hpp"), "-o", str(folder / "common.hpp.gch")])
        self.objects = {}

    @staticmethod
    def run(command):
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr[-800:])

    def compile(self, source, to, extra):
        self.run([*COMPILE, f"-I{self.folder}", "-include", "common.hpp", *extra, *self.includes, "-c", str(source), "-o", str(to)])
        return str(to)

    def link(self, objects, to):
        command = ["g++", *objects, *self.guard, "-o", str(to), "-lgtest_main", "-lgtest", "-lgmock", *self.libraries, *self.libraries,
                   "-lfmt", "-lfftw3", "-lcrypto", "-lz", "-lpugixml", "-ltomlplusplus", "-lsndfile", "-lpthread", "-ldl",
                   "-L/usr/lib/x86_64-linux-gnu/hdf5/serial", "-lhdf5"]
        if self.guard:
            command.append("-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=posix_memalign")
        self.run(command)

    def noticed(self, objects, program):
        self.link(objects, program)
        try:
            return subprocess.run([str(program), "--gtest_fail_fast"], capture_output=True, timeout=60).returncode != 0
        except subprocess.TimeoutExpired:
            return True

    def killed(self, path, root, tests, text):
        """True, False, or None when the mutant does not compile."""
        try:
            with tempfile.TemporaryDirectory(dir=self.folder) as place:
                place = pathlib.Path(place)
                file = place / (pathlib.Path(path).relative_to(root) if root else pathlib.Path(path).name)
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text)
                extra = [f"-I{place}", f"-I{ROOT / pathlib.Path(path).parent}"]
                if root:  # one file of tests after the other: most mutants end at the first
                    return any(self.noticed([self.compile(ROOT / t, place / "test.o", extra)], place / "test") for t in tests)
                for t in tests:
                    if t not in self.objects:
                        self.objects[t] = self.compile(ROOT / t, self.folder / f"test{len(self.objects)}.o", [])
                objects = [self.compile(file, place / "mutant.o", extra)] + [self.objects[t] for t in tests]
                return self.noticed(objects, place / "test")
        except RuntimeError as e:
            self.last_error = e
            return None


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build")
    p.add_argument("--only", choices=TARGETS)
    p.add_argument("--limit", type=int, default=0, help="every N-th mutant so that about this many remain")
    p.add_argument("--jobs", type=int, default=2)
    p.add_argument("--list", action="store_true")
    o = p.parse_args()
    total = killed = broken = 0
    with tempfile.TemporaryDirectory() as folder:
        shop = None if o.list else Workshop(pathlib.Path(o.build).resolve(), pathlib.Path(folder))
        for name, (path, root, tests) in TARGETS.items():
            if o.only not in (None, name):
                continue
            every = list(mutants(path))
            chosen = every[::max(1, len(every) // o.limit) if o.limit else 1]
            if o.list:
                for number, _, _, changed in chosen:
                    print(f"{path}:{number + 1}: {changed}")
                continue
            original = shop.killed(path, root, tests, (ROOT / path).read_text())
            if original is not False:
                print(f"{name}: the tests fail or do not compile without a change: {getattr(shop, 'last_error', '')}")
                return 2
            with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
                results = list(pool.map(lambda m: shop.killed(path, root, tests, m[2]), chosen))
            for (number, line, _, changed), dead in zip(chosen, results):
                if dead is False:
                    print(f"survived  {path}:{number + 1}: {line.strip()}  ->  {changed}", flush=True)
            seen, noticed = sum(r is not None for r in results), results.count(True)
            broken += results.count(None)
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
