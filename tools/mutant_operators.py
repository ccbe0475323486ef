"""The changes that tools/mutants.py makes: one operator, constant, axis or sign of one line at a time."""
import re
from typing import NamedTuple

OPERATORS = [
    (r"<=", "<"), (r">=", ">"), (r"(?<![<\-=])<(?![<=\w:])", "<="), (r"(?<![\->=])> (?!=)", ">= "),
    (r"==", "!="), (r"!=", "=="), (r"&&", "||"), (r"\|\|", "&&"),
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "), (r" \+= ", " -= "), (r" -= ", " += "),
    (r"\bux\b", "uy"), (r"\buy\b", "ux"), (r"\bm\.x\b", "m.y"), (r"\bm\.y\b", "m.x"),
    (r"\.real\(\)", ".imag()"), (r"\.imag\(\)", ".real()"), (r"std::conj\(", "("),
    (r"(?<=return )-(?=[\w(])", ""), (r"(?<=[(,=] )-(?=[A-Za-z(])", ""), (r"(?<=\()-(?=[A-Za-z(])", ""),
    (r"\btrue\b", "false"), (r"\bfalse\b", "true"), (r"std::abs\(", "("), (r"\b60\b", "1"),
    (r"std::max\b", "std::min"), (r"std::min\b", "std::max"), (r"\+\+", "--"),
]
SKIP = re.compile(r"^\s*(//|#|///|/\*|\*|template|using|static_assert|namespace|inline [a-z]|constexpr [a-z]+ [a-z]+\()")
TYPES = re.compile(r"(Expected|vector|array|optional|static_cast|clamp|pair|map|atomic|_cast|span|tuple|Vector|Matrix)<")


class Mutant(NamedTuple):
    line: int  # from 0
    original: str
    change: str
    text: str  # of the whole file


def without_texts(line):
    """The line with the contents of its strings and comments blanked: words are not decisions."""
    line = re.sub(r'"(?:\\.|[^"\\])*"', lambda m: '"' + " " * (len(m.group()) - 2) + '"', line)
    line = re.sub(r"/\*.*?\*/", lambda m: " " * len(m.group()), line)
    return line.split("//")[0]


def mutants(path):
    lines = path.read_text().splitlines()
    for number, line in enumerate(lines):
        code = without_texts(line)
        if SKIP.match(line) or not code.strip() or code.strip().startswith("template"):
            continue
        for pattern, new in OPERATORS:
            for at in re.finditer(pattern, code):
                if "<" in at.group() and TYPES.search(code):
                    continue
                changed = line[:at.start()] + new + line[at.end():]
                text = "\n".join(lines[:number] + [changed] + lines[number + 1:]) + "\n"
                yield Mutant(number, line.strip(), changed.strip(), text)
