#!/usr/bin/env python3
"""Firmware with an exported float controller on an emulated Cortex-M4F, in closed loop with `whirl rig serve --lockstep`.

Usage: tools/firmware.py WHIRL [--law NAME] [--design controller.json]
       tools/firmware.py WHIRL --build-only BOARD --out FOLDER --design controller.json [--range-mm R] [--shunt-ohm R] [--force-N-V K]

Builds targets/firmware for QEMU's mps2-an386 (and for the NUCLEO-F446RE, which is not run), runs it in qemu-system-arm, relays
its first serial line to the rig's UDP board and talks to it on the second as a host of its own process, and checks:

- suppression within 1 % of `whirl run` in one process;
- a host killed with SIGKILL sets the outputs to zero within 50 ms and they stay zero;
- parameters are taken inside their bounds, refused outside, and told;
- bytes lost or altered on the host's line do no harm.

Prints what was measured; exit code 1 when something does not hold, 77 when a tool is missing.
"""
import argparse
import binascii
import json
import math
import pathlib
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import cortex_m4f  # noqa: E402

ROOT = cortex_m4f.ROOT
FLAGS = ["-O2", "-std=c99", "-Wall", "-Wextra", "-Werror", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard",
         "-ffunction-sections", "-fdata-sections", "-fno-math-errno", "-nostartfiles"]
TARGETS = ROOT / "targets"
ZERO_WITHIN = 50  # ticks, 1 ms each, after the host's death
WATCHDOG = ZERO_WITHIN - 1  # since its last command, which may still be on its way when it dies
KILLED = 600  # tick
RIG = "[profile]\nstart_rpm = 1200\nramp_s = 2\ndwell_end_s = 0.3\n[rotor]\nadded_mass_g = 5\n"
ARMED, START = 1, 2
TRIPS = {0: "none", 1: "displacement", 2: "stale", 3: "not finite", 4: "gap", 5: "supervision", 6: "parameters"}


def flash(image):
    text, data = cortex_m4f.run("arm-none-eabi-size", image).splitlines()[1].split()[:2]
    return int(text) + int(data)


def missing_tool():
    for tool in ("arm-none-eabi-gcc", "qemu-system-arm"):
        if shutil.which(tool) is None:
            return f"{tool} is not installed"
    if subprocess.run(["arm-none-eabi-gcc", "--specs=nosys.specs", "-x", "c", "-E", "-"], input=b"#include <math.h>\n",
                      capture_output=True).returncode != 0:
        return "newlib for arm-none-eabi is not installed"
    return ""


def framed(message):
    return message + struct.pack("<H", binascii.crc_hqx(message, 0xFFFF))  # CRC-16/CCITT-FALSE


class Line:
    """Messages out of a byte stream."""

    def __init__(self, read):
        self._read, self._bytes = read, b""

    def message(self, magic, size):
        """The next message of this kind; None at the end of the line."""
        while True:
            at = self._bytes.find(magic)
            if at >= 0 and len(self._bytes) >= at + size + 2:
                whole, self._bytes = self._bytes[at:at + size + 2], self._bytes[at + size + 2:]
                if framed(whole[:-2]) == whole:
                    return whole[:-2]
                raise RuntimeError(f"a wrong CRC behind {magic}")
            more = self._read()
            if not more:
                return None
            self._bytes += more


def host(start_after):
    """The host as a process: one command for each reading, armed after so many ticks without a gap. Ends with its input."""
    line = Line(lambda: sys.stdin.buffer.raw.read(4096))
    number, last, whole, armed = 0, 0, 0, False
    while (reading := line.message(b"WHR1", 72)) is not None:
        tick, = struct.unpack_from("<I", reading, 4)
        number += 1
        whole = whole + 1 if tick == last + 1 else 0
        last = tick
        armed = armed or whole >= start_after
        flags = ARMED | START if armed else 0
        sys.stdout.buffer.write(framed(b"WHC1" + struct.pack("<IIIdd", number, tick, flags, 0, 0)))
        sys.stdout.buffer.flush()


def export(whirl, design, folder):
    law = folder / "law"
    (folder / "controller.json").write_text(json.dumps(design))
    cortex_m4f.run(whirl, "export", "c", folder / "controller.json", "--float", "--prefix", "law", "--out", law, "--force", "--quiet")
    return law


def write_config(law, range_m, shunt, force_per_volt, limit, report_every=1):
    (law / "config.h").write_text(
        f"#define RANGE_M {range_m}\n#define SHUNT_OHM {shunt}\n#define FORCE_PER_VOLT {float(force_per_volt)}f\n"
        f"#define LIMIT_V {float(limit)}f\n#define TRIP_M {0.3 * range_m}f\n#define WATCHDOG_TICKS {WATCHDOG}u\n"
        f"#define REPORT_EVERY {report_every}u\n#define SAMPLE_TIME 1e-3\n")


def build(law, board, folder):
    """The firmware's image for a board."""
    image = folder / f"{board}.elf"
    start = TARGETS / "cortex-m4f"
    script = start / "link.ld" if board == "mps2-an386" else TARGETS / board / "link.ld"
    sources = [start / "start.c", TARGETS / board / "board.c", *sorted((TARGETS / "firmware").glob("*.c")), law / "law.c"]
    cortex_m4f.run("arm-none-eabi-gcc", *FLAGS, f"-I{law}", f"-I{TARGETS / 'firmware'}", f"-I{start}", *sources, "-T", script,
                   "-Wl,--gc-sections", "--specs=nosys.specs", "-lm", "-o", image)
    return image


def settings(io_toml):
    out, table = {}, ""
    for line in io_toml.splitlines():
        line = line.split("#")[0].strip()
        if line.startswith("["):
            table = line.strip("[]") + "."
        elif "=" in line:
            key, value = (part.strip() for part in line.split("=", 1))
            out[table + key] = value.strip('"')
    return out


class LostLockstep(Exception):
    """The rig waits 2 s for a command, and this machine did not let it come in time."""


class Bench:
    """Rig, emulated board and host, with the relay between them."""

    def __init__(self, whirl, law, folder, faults=None):
        self.folder = folder
        (folder / "rig.toml").write_text(RIG)
        (folder / "io.toml").unlink(missing_ok=True)
        self.rig = subprocess.Popen([whirl, "rig", "serve", "--rig", folder / "rig.toml", "--lockstep", "--io", folder / "io.toml", "--log",
                                     folder / "truth.csv", "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for _ in range(600):
            if (folder / "io.toml").exists():
                break
            time.sleep(0.05)
        io = settings((folder / "io.toml").read_text())
        write_config(law, 1e-3 * float(io.get("sensor.x.range_mm", 50)), 250, float(io.get("actuator.x.force_N_V", 4)),
                     float(io.get("actuator.x.limit_V", 10)))
        self.image = build(law, "mps2-an386", folder)
        ends, names = [], []
        for name in ("machine", "host"):
            path = folder / f"{name}.sock"
            path.unlink(missing_ok=True)
            server = socket.socket(socket.AF_UNIX)
            server.bind(str(path))
            server.listen(1)
            names.append(path)
            ends.append(server)
        self.qemu = subprocess.Popen(["qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-monitor", "none",
                                      *(part for path in names for part in ("-serial", f"unix:{path}")), "-kernel", self.image])
        for server in ends:
            server.settimeout(30)
        self.machine, self.wire = (server.accept()[0] for server in ends)
        for link in (self.machine, self.wire):
            link.settimeout(30)
        address, port = io["board.address"].rsplit(":", 1)
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.connect((address, int(port)))
        self.udp.settimeout(10)
        self.from_machine, self.from_board = Line(lambda: self.machine.recv(4096)), Line(lambda: self.wire.recv(4096))
        self.host = subprocess.Popen([sys.executable, __file__, "--host", "40"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.from_host = Line(lambda: self.host.stdout.raw.read(4096) if hasattr(self.host.stdout, "raw") else b"")
        self.ticks, self.last = 0, 0
        # All of them have run before the rig begins to wait for them.
        for k in range(1, 6):
            self.relay(b"WHR1" + struct.pack("<III7d", k, 0, 0, 0, 0, 0, 3, 3, 0, 0))
        # The rig answers to whoever commands it.
        self.udp.send(b"WHC1" + struct.pack("<IIIdd", 0, 0, 0, 0, 0))

    def relay(self, reading):
        """One reading through board and host: the board's command, and the reading it gave its host."""
        self.machine.sendall(framed(reading))
        command = self.from_machine.message(b"WHC1", 32)
        report = self.from_board.message(b"WHR1", 72)
        if self.host.poll() is None:
            self.host.stdin.write(framed(report))
            self.host.stdin.flush()
            answer = self.from_host.message(b"WHC1", 32)
            if answer is not None:
                self.wire.sendall(framed(answer))
        return command, report

    def tick(self):
        """One sample time of all of them. The reading the board gave its host, and the volts it sent; None at the end."""
        try:
            reading = self.udp.recv(100)
            # Until the rig waits for its commands the newest reading is the one to answer.
            while select.select([self.udp], [], [], 0)[0]:
                reading = self.udp.recv(100)
        except (TimeoutError, ConnectionRefusedError):
            return None
        self.ticks += 1
        now, = struct.unpack_from("<I", reading, 4)
        whole, self.last = now == self.last + 1, now
        over = struct.unpack_from("<I", reading, 8)[0] & 4  # then the rig waits no more
        if self.ticks > 50 and not whole and not over:
            raise LostLockstep
        command, report = self.relay(reading)
        try:
            self.udp.send(command)
        except ConnectionRefusedError:
            return None
        return report, struct.unpack_from("<dd", command, 16)

    def kill_host(self):
        self.host.send_signal(signal.SIGKILL)
        self.host.wait()

    def parameter(self, index, value):
        """Sets a parameter; what the board answers: (0 or number refused, value that holds)."""
        self.wire.sendall(framed(b"WHP1" + struct.pack("<IId", 7, index, value)))
        answer = self.from_board.message(b"WHA1", 24)
        return struct.unpack_from("<Id", answer, 12)

    def close(self, over=False):
        """Ends all; what the rig says when its run is over."""
        if not over:
            self.rig.kill()
        self.host.kill()
        self.host.wait()
        self.qemu.kill()
        self.qemu.wait()
        for link in (self.machine, self.wire, self.udp):
            link.close()
        out, _ = self.rig.communicate(timeout=60)
        return json.loads(out) if out.strip() else {}


def check(good, text):
    print(("ok      " if good else "FAILED  ") + text, flush=True)
    return good


def trip_of(report):
    return TRIPS[struct.unpack_from("<I", report, 8)[0] >> 8 & 0xFF]


def closed_loop(whirl, design, folder):
    law = export(whirl, design, folder)
    bench = Bench(whirl, law, folder)
    started, ticks, report = time.time(), 0, None
    try:
        while (done := bench.tick()) is not None:
            report, ticks = done[0], ticks + 1
    except BaseException:
        bench.close()
        raise
    served = bench.close(True)
    alone = json.loads(cortex_m4f.run(whirl, "run", folder / "controller.json", "--rig", folder / "rig.toml", "--json"))
    good = check(trip_of(report) == "none", f"{ticks} ticks in {time.time() - started:.1f} s, trip {trip_of(report)}")
    for mine, theirs in zip([*served["segments"], served["whole"]], [*alone["segments"], alone["whole"]]):
        if theirs["suppression"] is None:
            continue
        good &= check(abs(mine["suppression"] - theirs["suppression"]) <= 0.01,
                      f"{theirs['name']}: suppression {100 * mine['suppression']:.2f} % on the board, {100 * theirs['suppression']:.2f} % "
                      "in one process")
    return good


def killed_host(whirl, design, folder):
    bench = Bench(whirl, export(whirl, design, folder), folder)
    volts, reports = [], []
    try:
        for k in range(800):
            done = bench.tick()
            if done is None:
                break
            reports.append(done[0])
            volts.append(max(abs(v) for v in done[1]))
            if k == KILLED:
                bench.kill_host()
    finally:
        bench.close()
    after = next((k for k in range(KILLED + 1, len(volts)) if volts[k] == 0), None)
    good = check(min(volts[KILLED - 100:KILLED + 1]) > 0, f"the force acts before: {max(volts[KILLED - 100:KILLED + 1]):.2f} V peak")
    good &= check(after is not None and after - KILLED <= ZERO_WITHIN, f"outputs zero {after - KILLED if after else '?'} ms after the host was killed")
    good &= check(after is not None and max(volts[after:]) == 0, "and they stay zero")
    good &= check(struct.unpack_from("<I", reports[-1], 8)[0] & 3 == 2, "the board says: watchdog")
    return good


def parameters(whirl, design, folder):
    law = export(whirl, design, folder)
    names = [line.split("whirl_real")[-1] for line in (law / "law.h").read_text().splitlines() if line.startswith("  /* ") and "law_real" in line]
    names = [name.split("law_real ")[1].split(";")[0] for name in names]
    bench = Bench(whirl, law, folder)
    try:
        for _ in range(100):
            bench.tick()
        gain, period = names.index("surface_gain") + 1, names.index("sample_time") + 1
        wrong, value = bench.parameter(gain, math.nan)
        good = check(wrong == 0 and value > 0, f"surface_gain is {value:g}")
        was = value
        wrong, value = bench.parameter(gain, 1.1 * was)
        good &= check(wrong == 0 and abs(value - 1.1 * was) < 1e-5 * was, f"set to {value:g}")
        wrong, value = bench.parameter(gain, -1.0)
        good &= check(wrong == gain and abs(value - 1.1 * was) < 1e-5 * was, f"-1 refused as parameter {wrong}, still {value:g}")
        good &= check(bench.parameter(period, 2e-3)[0] == period, "another sample time refused")
        good &= check(bench.parameter(0, 1.0)[0] == 0 and math.isnan(bench.parameter(0, 1.0)[1]), "parameter 0 is none")
        good &= check(bench.parameter(9999, 1.0)[0] == 9999, "parameter 9999 is refused")
        # Half a message, noise, a message with a wrong byte: the board goes on with the next whole one.
        bench.wire.sendall(framed(b"WHP1" + struct.pack("<IId", 7, gain, 5.0))[:9] + bytes(range(256)) + b"WHC1WHPWHP1")
        bad = bytearray(framed(b"WHP1" + struct.pack("<IId", 7, gain, 5.0)))
        bad[13] ^= 1
        bench.wire.sendall(bytes(bad))
        good &= check(abs(bench.parameter(gain, math.nan)[1] - 1.1 * was) < 1e-5 * was, "damaged messages change nothing")
        report = None
        for _ in range(300):
            report = bench.tick()[0]
        good &= check(trip_of(report) == "none" and struct.unpack_from("<I", report, 8)[0] & 1 == 1, "and the loop runs on")
    finally:
        bench.close()
    return good


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("whirl", nargs="?")
    p.add_argument("--law", default="tsmc")
    p.add_argument("--design", default=str(cortex_m4f.DESIGN))
    p.add_argument("--build-only", metavar="BOARD", choices=["mps2-an386", "nucleo-f446re"])
    p.add_argument("--out", default=".")
    p.add_argument("--range-mm", type=float, default=25, help="measuring range of the displacement sensors")
    p.add_argument("--shunt-ohm", type=float, default=150)
    p.add_argument("--force-N-V", type=float, default=4, help="force of the actuators per volt")
    p.add_argument("--host", type=int, help=argparse.SUPPRESS)
    o = p.parse_args()
    if o.host is not None:
        host(o.host)
        return 0
    missing = missing_tool()
    if missing:
        print(missing)
        return 77
    design = dict(json.loads(pathlib.Path(o.design).read_text()), law=o.law, margins={})
    if o.design == str(cortex_m4f.DESIGN):
        # What a designer knows of the served rig.
        design.update(estimator="kfe", delay_s=2.05e-3)
        design["model"].update(k1=1.01 * 8500 / 1.5, gain=1 / 1.5, eps=[0.00028, 0.00004], k1_conj=[20, -15])
    if o.build_only:
        out = pathlib.Path(o.out)
        out.mkdir(parents=True, exist_ok=True)
        law = export(o.whirl, design, out)
        # 115200 baud carry a reading in ten ticks.
        write_config(law, 1e-3 * o.range_mm, o.shunt_ohm, o.force_N_V, 10, 10 if o.build_only == "nucleo-f446re" else 1)
        print(build(law, o.build_only, out))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        law = export(o.whirl, design, pathlib.Path(folder))
        write_config(law, 0.025, 150, 4, 10, 10)
        image = build(law, "nucleo-f446re", pathlib.Path(folder))
        good = check(flash(image) < 512 * 1024, f"NUCLEO-F446RE: built, {flash(image)} bytes of flash; not run")
    for step in (closed_loop, killed_host, parameters):
        for attempt in range(4):
            with tempfile.TemporaryDirectory() as folder:
                try:
                    good &= step(o.whirl, design, pathlib.Path(folder))
                    break
                except LostLockstep:
                    print(f"        {LostLockstep.__doc__} Once more.")
                    good &= attempt < 3
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
