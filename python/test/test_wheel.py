"""`pip install .` in an environment of its own, without network. The module is the one that is already compiled."""
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = """
import numpy as np, pathlib, pickle, sys, whirl
assert pathlib.Path(whirl.__file__).is_relative_to(sys.prefix), whirl.__file__
t = np.arange(2000) * 5e-3
x = np.column_stack([np.cos(2 * t), -2 * np.sin(2 * t)])
model = whirl.SINDy(feature_library=whirl.PolynomialLibrary(1)).fit(x, t=t)
import whirl.compat.pysindy as ps
print(model.equations(2), ps.STLSQ().fit(x, x).complexity, whirl.__version__)
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    folder = tmp_path_factory.mktemp("venv")
    made = subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", folder], capture_output=True, text=True)
    if made.returncode:
        pytest.skip("python3-venv is not installed: " + made.stdout)
    return folder / "bin" / "python"


@pytest.mark.skipif("WHIRL_PREBUILT" not in os.environ, reason="needs a build folder")
def test_pip_installs_the_tree_without_network(environment, tmp_path):
    clean = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {"PIP_CONFIG_FILE": os.devnull}
    pip = [environment, "-m", "pip", "-q", "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--no-index", ROOT], check=True, env=clean)
    seen = subprocess.run([environment, "-c", SCRIPT], check=True, env=clean, cwd=tmp_path, capture_output=True, text=True)
    version = seen.stdout.split()[-1]
    assert "1.00 x1" in seen.stdout and "-4.00 x0" in seen.stdout, seen.stdout
    assert f"VERSION {version} " in (ROOT / "CMakeLists.txt").read_text()
    shown = subprocess.run([*pip[:-2], "show", "-f", "whirl"], check=True, env=clean, capture_output=True, text=True).stdout
    assert f"Version: {version}" in shown and "whirl/__init__.pyi" in shown and "whirl/py.typed" in shown
    subprocess.run([*pip, "uninstall", "-y", "whirl"], check=True, env=clean)
    assert subprocess.run([environment, "-c", "import whirl"], env=clean, cwd=tmp_path, capture_output=True).returncode


def test_the_source_distribution_holds_what_a_build_needs(tmp_path):
    sys.path.insert(0, str(ROOT / "python" / "build"))
    import tarfile

    import wheel as backend

    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    name = backend.build_sdist(tmp_path)
    with tarfile.open(tmp_path / name) as archive:
        files = {entry.split("/", 1)[1] for entry in archive.getnames()}
    assert {"CMakeLists.txt", "pyproject.toml", "python/build/wheel.py", "python/src/module.cpp", "PKG-INFO"} <= files


def test_the_faster_module_is_taken_where_the_processor_has_its_instructions(tmp_path):
    from whirl import _processor

    new, old = tmp_path / "new", tmp_path / "old"
    new.write_text("processor\t: 0\nflags\t\t: fpu sse2 abm avx avx2 bmi1 bmi2 f16c fma movbe\n")
    old.write_text("processor\t: 0\nflags\t\t: fpu sse2 avx\n")
    assert _processor.faster_modules(tmp_path, new) == []  # not installed
    (tmp_path / _processor.LEVEL).mkdir()
    assert _processor.faster_modules(tmp_path, new) == [str(tmp_path / _processor.LEVEL)]
    assert _processor.faster_modules(tmp_path, old) == []
    assert _processor.faster_modules(tmp_path, tmp_path / "missing") == []
