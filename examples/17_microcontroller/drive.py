"""A controller for a microcontroller that samples at 2 kHz: truth of the rig, cost allowed to a step, check."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import truth as examples

RATE, CLOCK = 2000, 168e6  # Hz, of the loop and of a Cortex-M4F
CYCLES = 1.3               # an instruction, at most (docs/export.md: 2000 instructions take about 15 us)
SHARE = 0.25               # of the sample time that the step may take


def make(folder):
    numbers = {}
    for line in (folder / "rig.toml").read_text().splitlines():
        name, equals, value = line.partition(" = ")
        if equals and name not in numbers:
            numbers[name] = value
    return {"k1": float(numbers["stiffness_N_m"]) / float(numbers["mass_kg"]), "rate_hz": RATE}


def check(folder, truth, result):
    model = examples.load(folder / "model.json")
    result.near("k1 [1/s^2]", model["parameters"]["k1"]["value"], truth["k1"], 0.01)
    run = examples.load(folder / "run.json")
    result.holds("the loop is stable on the true rig", run["stable"] and run["trip"] == "none")
    for segment in run["segments"]:
        result.below(f"largest vibration left, {segment['name']}", 1 - segment["suppression"], 0.05)
    period = examples.load(folder / "controller.json")["sample_time_s"]
    result.near("sample time of the controller [s]", period, 1 / truth["rate_hz"], 1e-9)
    if (folder / "cost.json").exists():
        worst = examples.load(folder / "cost.json")["target"]["worst"]
        result.below(f"longest step, {worst} instructions, of the sample time", worst * CYCLES / CLOCK * RATE, SHARE)


examples.command_line(make, check)
