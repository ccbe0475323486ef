"""What an example found beside its truth: a line each, exit code 1 where one is off."""
import json
import pathlib
import sys


def load(path):
    return json.loads(pathlib.Path(path).read_text())


class Check:
    def __init__(self):
        self.wrong = 0

    def line(self, good, what, found, wanted):
        self.wrong += not good
        print(f"{'ok   ' if good else 'WRONG'}  {what}: {found} ({wanted})")

    def near(self, what, found, truth, part):
        """Within `part` of the truth; found None is wrong."""
        good = found is not None and abs(found - truth) <= part * abs(truth)
        self.line(good, what, "nothing" if found is None else f"{found:.5g}", f"truth {truth:.5g} within {100 * part:g} %")

    def within(self, what, truth, low, high):
        """The truth lies in the interval found."""
        self.line(low <= truth <= high, what, f"{low:.5g} to {high:.5g}", f"truth {truth:.5g}")

    def below(self, what, found, limit):
        self.line(found < limit, what, f"{found:.5g}", f"below {limit:.5g}")

    def holds(self, what, good):
        self.line(bool(good), what, "yes" if good else "no", "yes")

    def end(self):
        sys.exit(1 if self.wrong else 0)


def command_line(make, check):
    """SCRIPT make FOLDER writes records and truth.json, SCRIPT check FOLDER compares what was found."""
    if len(sys.argv) != 3 or sys.argv[1] not in ("make", "check"):
        sys.exit(f"usage: {sys.argv[0]} make|check FOLDER")
    folder = pathlib.Path(sys.argv[2])
    if sys.argv[1] == "make":
        (folder / "truth.json").write_text(json.dumps(make(folder), indent=2) + "\n")
    else:
        result = Check()
        check(folder, load(folder / "truth.json"), result)
        result.end()
