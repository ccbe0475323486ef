#!/usr/bin/env python3
"""Mutation testing of the lines that decide: changes one operator, constant or axis at a time and counts how many changes the
tests beside the code notice.

Usage: tools/mutants.py BUILD_DIR [--only NAME] [--limit N] [--random N [--seed S]] [--table FILE] [--list]

BUILD_DIR: a configured and built tree (its static libraries are linked). A mutant is compiled into a folder of its own, the
tree is not touched. --random draws N of all mutants. --table keeps one row per mutant; a row that is there is not run again,
so that an interrupted run goes on. Exit code 0 when at least 95 % are killed, else 1; survivors are listed with line and change.
Those that nothing can notice stand with their reason in tools/mutants_equivalent.tsv and count by themselves.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import time

from mutant_operators import mutants

ROOT = pathlib.Path(__file__).resolve().parent.parent
EQUIVALENT = ROOT / "tools/mutants_equivalent.tsv"

# File under test, its include root (None: a source), the tests that must notice.
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
    "board": ("libs/rt/src/drivers/udp_board.cpp", None, ["libs/rt/test/udp_board_test.cpp", "libs/rt/test/board_key_test.cpp"]),
    "board_key": ("libs/rt/src/drivers/board_key.cpp", None, ["libs/rt/test/board_key_test.cpp"]),
    "board_socket": ("libs/hardware/src/board_socket.cpp", None, ["libs/hardware/test/board_socket_test.cpp"]),
    **{"estimator_" + name: (f"libs/control/src/estimators/{name}.cpp", None,
                             ["libs/control/test/estimators_test.cpp", "libs/control/test/kalman_test.cpp"])
       for name in ("difference", "eso", "kalman", "red")},
    "door": ("libs/monitor/src/door.cpp", None, ["libs/monitor/test/door_test.cpp"]),
    "atomic_write": ("libs/io/src/disk/file_output.cpp", None, ["libs/io/test/file_output_test.cpp"]),
    "settings": ("libs/io/src/settings.cpp", None, ["libs/io/test/settings_test.cpp"]),
    "array_bytes": ("libs/io/src/formats/arrays/bytes.cpp", None, ["libs/io/test/foreign_formats_test.cpp"]),
    "json": ("libs/io/src/json.cpp", None, ["libs/io/test/json_test.cpp"]),
    **{name: (f"libs/control/src/{name}.cpp", None,
              [f"libs/control/test/{name}_rules_test.cpp", "libs/deploy/test/supervision/supervision_ticks_test.cpp"])
       for name in ("supervisor", "force_check")},
    "fmu_core": ("libs/deploy/c/fmi/fmu_core.c", None, ["libs/deploy/test/fmu_test.cpp", "libs/deploy/test/fmu_exchange_test.cpp"]),
    "fmu_state": ("libs/deploy/c/fmi/fmi_common.c", None,
                  ["libs/deploy/test/fmu_test.cpp", "libs/deploy/test/fmu_conformance_test.cpp"]),
    "verdict_rules": ("libs/identify/src/evidence/verdict.cpp", None, ["libs/identify/test/evidence/verdict_rules_test.cpp"]),
    "verdict_rotor": ("libs/identify/src/evidence/rotor_verdict.cpp", None,
                      ["libs/identify/test/evidence/rotor_verdict_rules_test.cpp"]),
    "verdict_system": ("libs/identify/src/evidence/sindy_verdict.cpp", None,
                       ["libs/identify/test/evidence/sindy_verdict_rules_test.cpp"]),
    **{"finding_" + name: (f"libs/diagnosis/src/findings/{name}.cpp", None,
                           ["libs/diagnosis/test/finding_rules_test.cpp", "libs/diagnosis/test/vibration_findings_test.cpp"])
       for name in ("chances", "electric", "orders", "run_out", "sidebands", "subsynchronous")},
    "standards": ("libs/diagnosis/src/standards.cpp", None, ["libs/diagnosis/test/standards_test.cpp", "libs/diagnosis/test/zone_limits_test.cpp"]),
    "correction": ("libs/diagnosis/src/correction.cpp", None,
                   ["libs/diagnosis/test/correction_rules_test.cpp", "libs/diagnosis/test/correction_test.cpp"]),
    "influence": ("libs/diagnosis/src/influence.cpp", None,
                  ["libs/diagnosis/test/influence_rules_test.cpp", "libs/diagnosis/test/drift_option_test.cpp",
                   "libs/diagnosis/test/influence_test.cpp"]),
    "balancing_sign": ("libs/diagnosis/src/balancing.cpp", None,
                       ["libs/diagnosis/test/advice_intervals_test.cpp", "libs/diagnosis/test/balancing_test.cpp"]),
    "balancing_session": ("libs/balancing/src/session.cpp", None, ["libs/balancing/test/session_rules_test.cpp", "libs/balancing/test/session_test.cpp"]),
    "certificate": ("libs/tuning/src/certificate/certificate_runs.cpp", None,
                    ["libs/tuning/test/certificate_rules_test.cpp", "libs/tuning/test/certificate_test.cpp"]),
    "tuning_verdict": ("libs/tuning/src/verdict.cpp", None, ["libs/tuning/test/verdict_rules_test.cpp"]),
    "modal_selection": ("libs/modal/src/poles/select_poles.cpp", None,
                        ["libs/modal/test/pole_selection_rules_test.cpp"]),
    "blow_checks": ("libs/modal/src/blows/checks.cpp", None, ["libs/modal/test/blow_checks_rules_test.cpp"]),
    "centrifuge": ("libs/shaft/src/centrifuge/load_check.cpp", None, ["libs/shaft/test/centrifuge_test.cpp"]),
    "identities": ("libs/core/src/finding.cpp", None, ["libs/core/test/finding_test.cpp", "libs/core/test/trust_text_test.cpp"]),
    "names": ("libs/core/src/names.cpp", None, ["libs/core/test/names_test.cpp"]),
}

# Their tests take minutes: run last, so that an interrupted run has most of the others.
SLOW = {"certificate", "fmu_core", "fmu_state", *(name for name in TARGETS if name.startswith("finding_"))}

# Beside their tests of rules these have statistics that take minutes: left out.
RULES_ONLY = {"influence", "balancing_sign", "correction"}

PRECOMPILED = """#include <gtest/gtest.h>
#include <gmock/gmock.h>
#include <Eigen/Dense>
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

def system_libraries(build):
    """What the program links beside the libraries of the tree."""
    ninja = (build / "build.ninja").read_text()
    line = re.search(r"^build bin/whirl:.*?\n  LINK_LIBRARIES = ([^\n]*)", ninja, re.M | re.S).group(1)
    return [word for word in line.split() if not re.search(r"libwhirl_\w+\.a$", word)] + ["-lpthread"]


class Workshop:
    """Compiles and runs mutants; what does not change (the tests of a source, the headers of the tests, the sources that share
    a unit with it) is compiled once."""

    def __init__(self, build, folder):
        self.folder, self.build = folder, build
        native = "WHIRL_NATIVE:BOOL=ON" in (build / "CMakeCache.txt").read_text()
        self.flags = ["g++", "-std=c++20", "-O0", "-w", "-fPIE", "-DEIGEN_MAX_ALIGN_BYTES=64", *(["-march=native"] if native else [])]
        roots = [d for kind in ("include", "internal", "src") for d in sorted(ROOT.glob(f"libs/*/{kind}"))]
        self.includes = [f"-I{ROOT}"] + [f"-I{d}" for d in roots] + [
            f"-I{ROOT}/testing/include", f"-I{ROOT}/libs/deploy/c/fmi", "-I/usr/include/eigen3", "-I/usr/include/hdf5/serial"]
        self.libraries = [str(f) for f in sorted(build.glob("libs/*/libwhirl_*.a"))] + [str(build / "testing/libwhirl_testing.a")]
        self.guard = [str(f) for f in build.glob("**/whirl_alloc_guard.dir/**/alloc_guard.cpp.o")]
        (folder / "common.hpp").write_text(PRECOMPILED)
        self.run([*self.flags, "-I/usr/include/eigen3", "-x", "c++-header", str(folder / "common.hpp"), "-o", str(folder / "common.hpp.gch")])
        self.system = system_libraries(build)
        self.objects, self.beside, self.normal = {}, {}, {}

    @staticmethod
    def run(command):
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr[-800:])

    def compile(self, source, to, extra):
        self.run([*self.flags, f"-I{self.folder}", "-include", "common.hpp", *extra, *self.includes, "-c", str(source), "-o", str(to)])
        return str(to)

    def link(self, objects, to, libraries=None):
        libraries = libraries or self.libraries
        command = ["g++", "-fuse-ld=gold", *objects, *self.guard, "-o", str(to), "-lgtest_main", "-lgtest", "-lgmock",
                   "-Wl,--start-group", *libraries, "-Wl,--end-group", *self.system]
        if self.guard:
            command.append("-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=posix_memalign")
        self.run(command)

    def test(self, program, limit, names, report=None):
        """Whether the tests of these names pass, in a folder of its own; all but statistics of rules where there are none."""
        chosen = ":".join(names) if names else "-*Property.*" if self.rules_only else "*"
        with tempfile.TemporaryDirectory(dir=self.folder) as place:
            output = [f"--gtest_output=json:{report}"] if report else []
            try:
                done = subprocess.run([str(program), "--gtest_fail_fast", f"--gtest_filter={chosen}", *output],
                                      capture_output=True, timeout=limit, cwd=place, env={**os.environ, "TEST_TMPDIR": place + "/", "TMPDIR": place})
                return done.returncode == 0
            except subprocess.TimeoutExpired:
                return False

    def noticed(self, objects, program, libraries, tests):
        """Quick tests first: most mutants end there. The first program run is the original, whose times are measured."""
        self.link(objects, program, libraries)
        key = tuple(tests)
        if key not in self.normal:
            report = self.folder / "times.json"
            passed = self.test(program, 1800, [], report)
            found = [(float(case["time"].rstrip("s")), f"{suite['name']}.{case['name']}") for suite in
                     json.loads(report.read_text())["testsuites"] for case in suite["testsuite"]] if passed else []
            self.normal[key] = [[t for t in found if (t[0] < 1) == quick] for quick in (True, False)]
            return not passed
        for part in self.normal[key]:
            if part and not self.test(program, max(30, 5 * sum(seconds for seconds, _ in part)), [name for _, name in part]):
                return True
        return False

    def siblings(self, path):
        """The other sources of the unit that `path` is compiled in, and the libraries without that unit."""
        if path in self.beside:
            return self.beside[path]
        library = path.split("/")[1]
        archive = self.build / f"libs/{library}/libwhirl_{library}.a"
        member, others = pathlib.Path(path).name, []
        if path.endswith(".c"):
            member = "templates.cpp"
        for unit in (self.build / f"libs/{library}/units").glob(f"whirl_{library}_[0-9]*.cpp"):
            lines = unit.read_text().split("\n")
            if f'#include "{path}"' in lines:
                member, others = unit.name, [line for line in lines if line and path not in line]
        copy = self.folder / f"lib{len(self.beside)}.a"
        copy.write_bytes(archive.read_bytes())
        self.run(["ar", "d", str(copy), member + ".o"])
        objects = []
        if others:
            text = self.folder / f"siblings{len(self.beside)}.cpp"
            text.write_text("\n".join(others) + "\n")
            objects = [self.compile(text, text.with_suffix(".o"), ["-O1"])]
        self.beside[path] = objects, [str(copy) if f == str(archive) else f for f in self.libraries]
        return self.beside[path]

    def source(self, path, text, place):
        """The file to compile for a changed text: of a template, the source that holds all templates."""
        file = place / pathlib.Path(path).name
        if path.endswith(".c"):
            file = place / "templates.cpp"
            templates, template = (self.build / "libs/deploy/templates.cpp").read_text(), (ROOT / path).read_text()
            if template not in templates:
                raise RuntimeError(f"{path}: newer than the build")
            text = templates.replace(template, text)
        file.write_text(text)
        return file

    def killed(self, path, root, tests, text):
        """True, False, or None when the mutant does not compile."""
        try:
            with tempfile.TemporaryDirectory(dir=self.folder) as place:
                place = pathlib.Path(place)
                extra = [f"-I{place}", f"-I{ROOT / pathlib.Path(path).parent}"]
                if root:  # one file of tests after the other: most mutants end at the first
                    file = place / pathlib.Path(path).relative_to(root)
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_text(text)
                    return any(self.noticed([self.compile(ROOT / t, place / "test.o", extra)], place / "test", None, [t])
                               for t in tests)
                for t in tests:
                    if t not in self.objects:
                        self.objects[t] = self.compile(ROOT / t, self.folder / f"test{len(self.objects)}.o", ["-O1"])
                beside, libraries = self.siblings(path)
                objects = [self.compile(self.source(path, text, place), place / "mutant.o", extra)]
                return self.noticed(objects + beside + [self.objects[t] for t in tests], place / "test", libraries, tests)
        except RuntimeError as e:
            self.last_error = e
            return None


class Table:
    """One row per mutant that has been run: place, change, result."""

    def __init__(self, path):
        self.path, self.rows = path, {}
        if path and path.exists():
            for row in path.read_text().splitlines():
                place, change, result = row.split("\t")
                self.rows[place, change] = {"killed": True, "survived": False}.get(result)

    def add(self, key, dead):
        self.rows[key] = dead
        if self.path:
            with self.path.open("a") as out:
                out.write("\t".join([*key, {True: "killed", False: "survived"}.get(dead, "does not compile")]) + "\n")


def equivalents():
    """(file, original line, change) -> reason."""
    rows = [r.split("\t") for r in EQUIVALENT.read_text().splitlines() if r and not r.startswith("#")] if EQUIVALENT.exists() else []
    return {(file, line, change): reason for file, line, change, reason in rows}


def draw(options):
    """Target -> its mutants that shall be run."""
    every = {name: list(mutants(ROOT / path)) for name, (path, *_) in TARGETS.items() if options.only in (None, name)}
    if options.random:
        all_of_them = [(name, i) for name, list_ in every.items() for i in range(len(list_))]
        drawn = set(random.Random(options.seed).sample(all_of_them, min(options.random, len(all_of_them))))
        return {name: [m for i, m in enumerate(list_) if (name, i) in drawn] for name, list_ in every.items()}
    return {name: list_[::max(1, len(list_) // options.limit) if options.limit else 1] for name, list_ in every.items()}


def run_target(shop, name, chosen, table, jobs):
    """Results of the mutants of one target; none when its tests fail without a change."""
    path, root, tests = TARGETS[name]
    shop.rules_only = name in RULES_ONLY
    key = {id(m): (f"{path}:{m.line + 1}", m.change) for m in chosen}
    waiting = [m for m in chosen if key[id(m)] not in table.rows]
    if waiting and shop.killed(path, root, tests, (ROOT / path).read_text()) is not False:
        print(f"{name}: the tests fail or do not compile without a change: {getattr(shop, 'last_error', '')}", flush=True)
        return None

    def one(m):
        table.add(key[id(m)], shop.killed(path, root, tests, m.text))
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        list(pool.map(one, waiting))
    return [table.rows[key[id(m)]] for m in chosen]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build")
    p.add_argument("--only", choices=TARGETS)
    p.add_argument("--limit", type=int, default=0, help="every N-th mutant so that about this many remain")
    p.add_argument("--random", type=int, default=0, help="so many, drawn over all targets")
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--table", type=pathlib.Path, help="one row per mutant; rows that are there are not run again")
    p.add_argument("--jobs", type=int, default=2)
    p.add_argument("--list", action="store_true")
    o = p.parse_args()
    chosen = draw(o)
    if o.list:
        for name, list_ in chosen.items():
            for m in list_:
                print(f"{name}: {TARGETS[name][0]}:{m.line + 1}: {m.original}  ->  {m.change}")
        return 0
    table, known = Table(o.table), equivalents()
    total = killed = broken = same = failed = 0
    with tempfile.TemporaryDirectory() as folder:
        shop = Workshop(pathlib.Path(o.build).resolve(), pathlib.Path(folder))
        for name, list_ in sorted(chosen.items(), key=lambda item: item[0] in SLOW):
            results = run_target(shop, name, list_, table, o.jobs) if list_ else []
            if results is None:
                failed += 1
                continue
            seen = [(m, dead) for m, dead in zip(list_, results)
                    if dead is not None and (dead or (TARGETS[name][0], m.original, m.change) not in known)]
            for m, dead in seen:
                if not dead:
                    print(f"survived  {TARGETS[name][0]}:{m.line + 1}: {m.original}  ->  {m.change}", flush=True)
            broken += results.count(None)
            same += len(results) - results.count(None) - len(seen)
            noticed = sum(dead for _, dead in seen)
            if seen:
                print(f"{name}: {noticed} of {len(seen)} killed ({100 * noticed / len(seen):.0f} %)", flush=True)
            total += len(seen)
            killed += noticed
    print(f"total: {killed} of {total} killed ({100 * killed / max(total, 1):.1f} %), {same} without effect, {broken} did not compile")
    return 2 if failed else 0 if total and killed >= 0.95 * total else 1


if __name__ == "__main__":
    sys.exit(main())
