"""The stubs: strict for who uses the package, and true to what the package is."""
import os
import subprocess
import sys
from pathlib import Path

import pytest

import whirl

pytest.importorskip("mypy")
PACKAGE = Path(whirl.__file__).parent

USE = """\
import numpy as np
import whirl
import whirl.compat.pysindy as ps

record: whirl.Recording = whirl.VirtualRig({"rotor.added_mass_g": 5}).record(seed=1)
found = whirl.identify(record)
k1: float = found.parameters["k1"].value
plan = whirl.runup(found.model, 300, 1900, limit_mm=1.5)
rates: list[float] = [p["rate"] for p in plan.up["passages"]]
motion = whirl.simulate(found.model, 300, 2000, 5.0)
controller = whirl.design(found.model, mass_kg=1.5)
worst = whirl.margins(controller, found.model, mass_kg=1.5).worst["gain_up"]
above: whirl.Estimate | None = whirl.robustness(controller, found.model, mass_kg=1.5).exceeds
kinds = [finding.kind for finding in whirl.check(motion).findings]
model = ps.SINDy(optimizer=ps.STLSQ(threshold=0.1)).fit(np.ones((9, 2)), t=0.1)
terms: list[str] = model.get_feature_names()
library = whirl.PolynomialLibrary(2) + whirl.FourierLibrary() * whirl.IdentityLibrary()
coefficients = whirl.SINDy(feature_library=library).fit(np.ones((30, 2)), t=0.1).coefficients()
whirl.report(record, found, controller, out="report.html")
"""

#: Each line is wrong in one way; what mypy calls it.
MISUSE = {
    'whirl.read("a.csv").speed': "attr-defined",
    "whirl.read(5)\nwhirl.identify('a.csv')": "arg-type",
    "whirl.runup(whirl.load('m.json'), '300', 1900)": "arg-type",
    "whirl.margins(1, 2)": "arg-type",
    "whirl.VirtualRig().record(seeds=1)": "call-arg",
    "whirl.check(whirl.read('a.csv')).refused = True": "misc",
    "whirl.STLSQ(treshold=0.1)": "call-arg",
    "whirl.SINDy().fit([[1.0]], None, 0.1)": "call-arg|misc",
}


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """What mypy read of other packages, by their content: most of its time. A build folder keeps it."""
    build = os.environ.get("WHIRL_PREBUILT")
    return Path(build) / "Testing/mypy" if build else tmp_path_factory.mktemp("cache")


def mypy(text, tmp_path, cache):
    file = tmp_path / "use.py"
    file.write_text(text)
    return subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", cache, file], cwd=PACKAGE.parent,
                          env={"MYPYPATH": str(PACKAGE.parent), "PATH": "/usr/bin:/bin"}, capture_output=True, text=True)


def test_use_is_strictly_typed(tmp_path, cache):
    checked = mypy(USE, tmp_path, cache)
    assert checked.returncode == 0, checked.stdout


def test_misuse_is_found(tmp_path, cache):
    checked = mypy("import whirl\n" + "\n".join(MISUSE) + "\n", tmp_path, cache)
    found = {int(line.split(":")[1]): line for line in checked.stdout.splitlines() if ": error: " in line}
    number = 2
    for line, codes in MISUSE.items():
        number += line.count("\n")
        assert number in found and any(f"[{code}]" in found[number] for code in codes.split("|")), (line, checked.stdout)
        number += 1


#: What pybind11's classes cannot state: their metaclass, their constructor, the name of the first argument of a method
#: that is a function of whirl.plot; and scikit-learn's own base class.
OUTSIDE = ("metaclass differs", "stub does not have *args argument", 'stub argument "self" differs', "whirl._base.")


def test_stubs_say_what_the_package_has(tmp_path):
    (tmp_path / "mypy.ini").write_text("[mypy]\nignore_missing_imports = True\n")  # pandas and others have no stubs
    checked = subprocess.run([sys.executable, "-m", "mypy.stubtest", "--ignore-missing-stub", "--concise", "--mypy-config-file",
                              tmp_path / "mypy.ini", "whirl"], cwd=PACKAGE.parent,
                             env={"PYTHONPATH": str(PACKAGE.parent), "PATH": "/usr/bin:/bin"}, capture_output=True, text=True)
    wrong = [line for line in checked.stdout.splitlines() if not any(part in line for part in OUTSIDE)]
    assert not wrong, "\n".join(wrong)
    assert checked.stdout.count("metaclass differs") > 10, checked.stdout + checked.stderr  # the classes were looked at
