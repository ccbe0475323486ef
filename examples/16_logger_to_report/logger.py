"""A pump at 1488 rpm as a German logger writes it: semicolons, decimal commas, date stamps, two probes, a casing sensor."""
import datetime
import html
import math
import pathlib
import random
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import truth as examples

TURNING, RATE, SECONDS = 24.8, 2000, 10  # Hz, s
PROBE_UM = (31.0, 26.0)     # 1X, zero to peak
SECOND_UM = 5.0             # 2X of the first probe
CASING_MM_S = 2.6           # rms, at 1X
MACHINE, DATE, ANALYST = "Pumpe 7", "26.11.2026", "A. Weber"


def comma(value, digits):
    return f"{value:.{digits}f}".replace(".", ",")


def make(folder):
    draw = random.Random(16)
    start = datetime.datetime(2026, 11, 26, 10, 59, 58)
    rows = ["Datum/Zeit;Weg X [µm];Weg Y [µm];Schwinggeschwindigkeit [mm/s];Drehmarke [V]"]
    for i in range(RATE * SECONDS):
        t = i / RATE
        stamp = start + datetime.timedelta(seconds=t)
        turn = math.tau * TURNING * t
        x = PROBE_UM[0] * math.cos(turn + 0.7) + SECOND_UM * math.cos(2 * turn + 2) + draw.gauss(0, 0.5)
        y = PROBE_UM[1] * math.sin(turn + 0.6) + draw.gauss(0, 0.5)
        v = math.sqrt(2) * CASING_MM_S * math.cos(turn + 1.9) + draw.gauss(0, 0.05)
        key = 5 if (TURNING * t) % 1 < 0.1 else 0
        rows.append(f"{stamp:%d.%m.%Y %H:%M:%S},{stamp.microsecond // 100:04d};{comma(x, 3)};{comma(y, 3)};"
                    f"{comma(v, 4)};{comma(key, 1)}")
    (folder / "messung.csv").write_text("\n".join(rows) + "\n", encoding="latin-1")
    # Zone limits of ISO 20816-3, group 2, rigid: 1.4, 2.8 and 4.5 mm/s rms.
    return {"machine": MACHINE, "date": DATE, "analyst": ANALYST, "speed_rpm": 60 * TURNING, "probe_um": PROBE_UM,
            "second_um": SECOND_UM, "casing_mm_s": CASING_MM_S, "casing_zone": "B"}


def verdict(page):
    """Cells of the first table: the name of a row to what stands beside it."""
    table = page[page.rfind(">Verdict</h2>"):]
    table = table[:table.index("</table>")]
    text = [html.unescape(re.sub("<[^>]*>", "", cell)) for cell in re.findall(r"<t[hd][^>]*>.*?</t[hd]>", table)]
    return dict(zip(text[::2], text[1::2]))


def check(folder, truth, result):
    row = verdict((folder / "report.html").read_text())
    for name in ("machine", "date", "analyst"):
        result.line(row[name] == truth[name], name, row[name], truth[name])
    result.line(row["zone"].split("; ")[-1] == truth["casing_zone"], "zone of the housing", row["zone"], truth["casing_zone"])
    table = examples.load(folder / "info.json")["tables"][0]
    result.near("rate [Hz]", 1 / table["step"], RATE, 1e-6)
    sizes = {(f["channel"], f["code"]): f for f in table["vibration_findings"]["findings"]}
    for name, size in zip("xy", truth["probe_um"]):
        first = sizes.get((name, "first_order"))
        result.near(f"1X of {name} [um peak]", 1e6 * first["size"] if first else None, size, 0.01)
    second = sizes.get(("x", "second_order"))
    result.near("2X of x [um peak]", 1e6 * second["size"] if second else None, truth["second_um"], 0.03)
    result.near("speed [rpm]", sizes["x", "first_order"]["speed"] * 30 / math.pi, truth["speed_rpm"], 1e-3)
    casing = next(v["housing"] for v in table["vibration"] if "housing" in v)
    result.near("velocity of the housing [mm/s rms]", 1e3 * casing["velocity_rms"], truth["casing_mm_s"], 0.02)


examples.command_line(make, check)
