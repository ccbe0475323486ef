#!/usr/bin/env python3
"""tools/suite.py on a tree of its own: what passed is not run again until something that it depends on changes.

Usage: suite_memory.py SOURCE_DIR      prints what fails; exit code 1 when something does
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

CMAKE = """cmake_minimum_required(VERSION 3.25)
project(tree NONE)
enable_testing()
set(WHIRL_DATA "${PROJECT_SOURCE_DIR}/data" CACHE PATH "")
foreach(test one two fails)
  add_test(NAME a.${test} COMMAND "${PROJECT_BINARY_DIR}/bin/whirl_a_test" ${test})
endforeach()
add_test(NAME b.one COMMAND "${PROJECT_BINARY_DIR}/bin/whirl_b_test" one)
add_test(NAME command.line COMMAND "${PROJECT_BINARY_DIR}/bin/whirl_cli_test" one)
add_test(NAME structure.tree COMMAND "${PROJECT_BINARY_DIR}/bin/whirl_cli_test" tree)
"""
PROGRAM = '#!/bin/sh\necho "$0 $1" >> "{log}"\n[ "$1" != fails ]\n'


def main():
    source = pathlib.Path(sys.argv[1])
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        tree = pathlib.Path(folder)
        log, build = tree / "log", tree / "build"
        for name in ("tools", "libs/a/test", "libs/b/test", "testing", "data", "docs", "cases", "build/bin"):
            (tree / name).mkdir(parents=True)
        shutil.copy(source / "tools/suite.py", tree / "tools")
        (tree / "CMakeLists.txt").write_text(CMAKE)
        (tree / "docs/page.md").write_text("one")
        (tree / "data/record.csv").write_text("1")
        (tree / "libs/a/test/a_test.cpp").write_text('std::ifstream in(testing::source_dir() + "/docs/page.md");')
        (tree / "libs/b/test/b_test.cpp").write_text(
            'read_csv(testing::data_file("record.csv"));\nslurp(source_dir() + "/cases/one_" + name);')
        for name in ("a", "b", "cli"):
            program = build / f"bin/whirl_{name}_test"
            program.write_text(PROGRAM.format(log=log))
            program.chmod(0o755)
        (tree / ".gitignore").write_text("/build\n/log\n")
        subprocess.run(["git", "init", "-q", tree], check=True)
        subprocess.run(["cmake", "-S", tree, "-B", build], check=True, capture_output=True)

        def expect(what, tests, *options, code=8):  # ctest's where a test fails
            log.write_text("")
            done = subprocess.run([sys.executable, tree / "tools/suite.py", build, "1", *options], capture_output=True, text=True)
            ran = sorted(line.split("/whirl_")[1].replace("_test ", ".") for line in log.read_text().splitlines())
            if ran != sorted(tests):
                wrong.append(f"{what}: ran {ran}, expected {sorted(tests)}\n{done.stdout}{done.stderr}")
            if done.returncode != code:
                wrong.append(f"{what}: exit code {done.returncode}, expected {code}\n{done.stdout}{done.stderr}")

        everything, again = ["a.one", "a.two", "a.fails", "b.one", "cli.one", "cli.tree"], ["a.fails", "cli.tree"]
        expect("the first time", everything)
        expect("nothing changed", again)
        expect("all of them", everything, "--all")
        expect("after all of them", again)
        (tree / "docs/page.md").write_text("two")
        expect("a document that a test reads", [*again, "a.one", "a.two", "cli.one"])
        (tree / "cases/one_a.csv").write_text("1")
        expect("a file whose name begins like what a test reads", [*again, "b.one", "cli.one"])
        (tree / "cases/two_a.csv").write_text("1")
        expect("a file beside it", [*again, "cli.one"])
        (tree / "data/record.csv").write_text("2")
        expect("measured data", [*again, "b.one", "cli.one"])
        with open(tree / "libs/b/test/b_test.cpp", "a") as test:
            test.write("// a comment")
        expect("a test of a library whose program stays the same", again)
        for name in ("b", "cli"):
            with open(build / f"bin/whirl_{name}_test", "a") as program:
                program.write("# other bytes\n")
            expect(f"the program of {name}", [*again, f"{name}.one"])
        (tree / "file.txt").write_text("new")
        expect("a new file", [*again, "cli.one"])
        (build / "python/cache").mkdir(parents=True)
        (build / "python/cache/of_a_tool.json").write_text("1")
        expect("nothing changed since", again)
        (build / "python/module.so").write_text("1")
        expect("the Python module", [*again, "cli.one"])
        (build / "bin/whirl_a_test").write_text(PROGRAM.format(log=log).replace("!= fails", "!= nothing"))
        expect("where all pass", ["a.one", "a.two", "a.fails", "cli.tree"], code=0)
        expect("nothing changed since all passed", ["cli.tree"], code=0)
        again = ["cli.tree"]
        shutil.rmtree(tree / ".git")
        for _ in range(2):
            expect("an archive without git", [*again, "cli.one"], code=0)
        done = subprocess.run([sys.executable, tree / "tools/suite.py", tree / "docs", "1"], capture_output=True, text=True)
        if done.returncode != 2 or "no build folder with tests" not in done.stderr:
            wrong.append(f"a folder that is no build: {done.returncode} {done.stderr}")
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
