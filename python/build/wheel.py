"""A PEP 517 backend: builds the package with CMake and packs the wheel. It needs no package of its own."""
import base64
import hashlib
import io
import os
import re
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
VERSION = re.search(r"project\(whirl VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
METADATA = f"""Metadata-Version: 2.1
Name: whirl
Version: {VERSION}
Summary: Identification and control of rotor vibration through critical speeds
Requires-Python: >=3.9
Requires-Dist: numpy
"""


def get_requires_for_build_wheel(config_settings=None):
    return []


def _tag():
    return f"cp{sys.version_info.major}{sys.version_info.minor}-cp{sys.version_info.major}{sys.version_info.minor}-" + (
        sysconfig.get_platform().replace("-", "_").replace(".", "_"))


def _compile():
    """The build folder that holds the finished package."""
    if "WHIRL_PREBUILT" in os.environ:  # a build folder that is up to date, e.g. of `make`
        return Path(os.environ["WHIRL_PREBUILT"])
    build = Path(os.environ.get("WHIRL_BUILD", ROOT / "build-python"))
    configure = ["cmake", "-S", ROOT, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DWHIRL_TESTS=OFF",
                 "-DWHIRL_NATIVE=OFF", f"-DWHIRL_PYTHON_EXECUTABLE={sys.executable}"]
    subprocess.run(configure, check=True)
    subprocess.run(["cmake", "--build", build, "--target", "whirl_python"], check=True)
    return build


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build = _compile()
    if not list((build / "python" / "whirl").glob("_whirl*.so")):
        raise RuntimeError(f"{build}/python/whirl has no compiled module: are the packages of packages.txt installed?")
    name = f"whirl-{VERSION}-{_tag()}.whl"
    record = []
    with zipfile.ZipFile(Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:

        def add(path, data):
            wheel.writestr(path, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{path},sha256={digest},{len(data)}")

        package = build / "python" / "whirl"
        for file in sorted(package.rglob("*")):
            if file.is_file() and (file.parent == package or file.suffix in (".py", ".pyi")):
                add(f"whirl/{file.relative_to(package).as_posix()}", file.read_bytes())
        info = f"whirl-{VERSION}.dist-info"
        add(f"{info}/METADATA", METADATA.encode())
        add(f"{info}/WHEEL", f"Wheel-Version: 1.0\nGenerator: whirl\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode())
        add(f"{info}/LICENSE", (ROOT / "LICENSE").read_bytes())
        record.append(f"{info}/RECORD,,")
        wheel.writestr(f"{info}/RECORD", "\n".join(record) + "\n")
    return name


def build_sdist(sdist_directory, config_settings=None):
    base = f"whirl-{VERSION}"
    files = subprocess.run(["git", "-C", ROOT, "ls-files"], check=True, capture_output=True, text=True).stdout.split("\n")
    with tarfile.open(Path(sdist_directory) / f"{base}.tar.gz", "w:gz") as archive:
        for file in filter(None, files):
            archive.add(ROOT / file, f"{base}/{file}")
        info = tarfile.TarInfo(f"{base}/PKG-INFO")
        info.size = len(METADATA.encode())
        archive.addfile(info, io.BytesIO(METADATA.encode()))
    return f"{base}.tar.gz"
