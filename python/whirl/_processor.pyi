from pathlib import Path

LEVEL: str
NEEDED: set[str]

def faster_modules(package: str | Path, cpuinfo: str | Path = ...) -> list[str]: ...
