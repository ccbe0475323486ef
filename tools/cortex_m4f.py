#!/usr/bin/env python3
"""What one step of every exported float controller costs on a Cortex-M4F: instructions (mean, worst), stack, flash, state.

Usage: tools/cortex_m4f.py WHIRL [--law NAME] [--design controller.json]

Compiles with Debian's gcc-arm-none-eabi and counts in qemu-system-arm (machine mps2-an386) on a run through resonance. Prints the
table of docs/export.md; exit code 1 when a law needs more than twice its mean in the worst step, 77 when a tool is missing.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BOARD = ROOT / "targets/cortex-m4f"
FLAGS = ["-O2", "-std=c99", "-Wall", "-Wextra", "-Werror", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard",
         "-ffunction-sections", "-fdata-sections", "-fno-math-errno", "-nostartfiles"]
DESIGN = BOARD / "controller.json"


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr  # semihosting prints on stderr


def flash(image):
    text, data = run("arm-none-eabi-size", image).splitlines()[1].split()[:2]
    return int(text) + int(data)


def build(folder, law, sources):
    image = folder / "image.elf"
    run("arm-none-eabi-gcc", *FLAGS, f"-I{law}", f"-I{BOARD}", BOARD / "start.c", *sources, "-T", BOARD / "link.ld",
        "-Wl,--gc-sections", "--specs=nosys.specs", "-lm", "-o", image)
    return image


def measure(whirl, design, law, folder):
    design = dict(design, law=law, estimator="lpf", margins={}, parameters={})
    (folder / "controller.json").write_text(json.dumps(design))
    out = folder / "law"
    run(whirl, "export", "c", folder / "controller.json", "--float", "--prefix", "law", "--out", out, "--force", "--quiet")
    image = build(folder, out, [BOARD / "count.c", out / "law.c"])
    said = run("qemu-system-arm", "-M", "mps2-an386", "-nographic", "-semihosting-config", "enable=on,target=native", "-icount", "shift=0",
               "-kernel", image)
    numbers = {k: int(v) for k, v in re.findall(r"(\w+) (\d+)", said)}
    (folder / "empty.c").write_text("int main(void) { return 0; }\n")
    library = folder / "keep.c"
    library.write_text('#include "law.h"\nint main(void) { static law_params p; static law_state s; law_input i = {0}; law_output o;\n'
                       "  law_default_params(&p); return (int)law_init(&s, &p) + (int)law_step(&s, &i, &o); }\n")
    with_law = flash(build(folder, out, [library, out / "law.c"]))
    numbers["flash"] = with_law - flash(build(folder, out, [folder / "empty.c"]))
    return numbers


def missing_tool():
    for tool in ("arm-none-eabi-gcc", "qemu-system-arm"):
        if shutil.which(tool) is None:
            return f"{tool} is not installed"
    if subprocess.run(["arm-none-eabi-gcc", "--specs=nosys.specs", "-x", "c", "-E", "-"], input=b"#include <math.h>\n",
                      capture_output=True).returncode != 0:
        return "newlib for arm-none-eabi is not installed"
    return ""


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("whirl")
    p.add_argument("--law")
    p.add_argument("--design", default=str(DESIGN))
    o = p.parse_args()
    missing = missing_tool()
    if missing:
        print(missing)
        return 77
    listed = run(o.whirl, "design", "--list").split("estimators")[0].splitlines()
    laws = [o.law] if o.law else [line.split()[0] for line in listed[3:] if line.strip()]
    design = json.loads(pathlib.Path(o.design).read_text())
    good = bool(laws)
    print("| law | instructions, mean | worst step | worst / mean | stack, bytes | flash with math functions, bytes | state, bytes |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for law in laws:
        try:
            with tempfile.TemporaryDirectory() as folder:
                n = measure(o.whirl, design, law, pathlib.Path(folder))
        except RuntimeError as e:
            # A law may refuse float by name; everything else is a failure.
            if "float cannot hold" not in str(e):
                raise
            print(f"| `{law}` | refuses float | | | | | |", flush=True)
            continue
        ratio = n["worst"] / n["mean"]
        good = good and ratio <= 2
        print(f"| `{law}` | {n['mean']} | {n['worst']} | {ratio:.2f} | {n['stack']} | {n['flash']} | {n['state']} |", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
