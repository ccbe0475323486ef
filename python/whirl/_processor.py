"""Packages may hold the compiled module twice: for every processor of its kind, and for x86-64-v3 (AVX2, FMA)."""
import pathlib

LEVEL = "x86-64-v3"
NEEDED = {"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}


def faster_modules(package, cpuinfo="/proc/cpuinfo"):
    """Folders, none or one, in which Python is to look for the compiled module first."""
    folder = pathlib.Path(package) / LEVEL
    if not folder.is_dir():
        return []
    try:
        with open(cpuinfo) as lines:
            flags = next((line for line in lines if line.startswith("flags")), "")
    except OSError:
        return []
    return [str(folder)] if NEEDED <= set(flags.split()) else []
