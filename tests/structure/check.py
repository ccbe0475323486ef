#!/usr/bin/env python3
"""The tree against docs/architecture.md: folders, include direction, sizes of folders and functions, format,
what .clang-tidy asks of the public headers, the API reference.

Usage: check.py SOURCE_DIR tree|includes|folders|functions|decisions|options|units|names|format|tidy|api [MEMO]     exit code 1 and one line per deviation
  MEMO    of tidy: the file that keeps which bytes were clean, so that it runs again only where one of them changed
"""
import hashlib
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# What a reader takes in at once.
FOLDER_LIMIT = 24
FUNCTION_LIMIT = 80
OPTION_LIMIT = 12
# Functions that were longer when the limit was set. Both numbers may be lowered, not raised.
LONG_FUNCTIONS, LONGEST = 0, 80


def tracked(root):
    """Files of the tree: those git knows, or all source files where there is no repository."""
    listing = subprocess.run(["git", "-C", root, "ls-files"], capture_output=True, text=True)
    if listing.returncode == 0:
        return [f for f in listing.stdout.split("\n") if f and (root / f).exists()]
    return [str(f.relative_to(root)) for f in root.rglob("*")
            if f.is_file() and not re.match(r"(build|out|\.)", str(f.relative_to(root)))]


def table(root):
    """library -> the libraries it may include, in the order of the document."""
    rows = re.findall(r"^\| `libs/(\w+)` \|[^|]*\| ([^|]*) \|$", (root / "docs/architecture.md").read_text(), re.M)
    return {name: [u for u in re.split(r"[,\s]+", uses) if u not in ("", "-")] for name, uses in rows}


def tree(root):
    text = (root / "docs/architecture.md").read_text()
    documented = set(re.findall(r"^\| `([\w/]+)` \|", text, re.M))
    actual = set()
    for file in tracked(root):
        parts = file.split("/")
        if len(parts) > 1 and not parts[0].startswith("."):
            actual.add("/".join(parts[:2]) if parts[0] in ("libs", "apps") else parts[0])
    merged = [f"{f}: a merge was left unfinished" for f in tracked(root)
              if re.search(rb"^(<<<<<<<|>>>>>>>) ", (root / f).read_bytes(), re.M)]
    return (merged +
            [f"{f}: in the tree, not in docs/architecture.md" for f in sorted(actual - documented)] +
            [f"{f}: in docs/architecture.md, not in the tree" for f in sorted(documented - actual)])


def includes(root):
    allowed = table(root)
    order = list(allowed)
    wrong = [f"{name} uses {u}: listed after it" for name in order for u in allowed[name]
             if u not in order or order.index(u) >= order.index(name)]
    for file in tracked(root):
        part = re.match(r"libs/(\w+)/(?:include|internal|src)/", file)
        if not part:
            continue
        for line, text in enumerate((root / file).read_text(errors="replace").split("\n"), 1):
            used = re.match(r'\s*#\s*include\s*["<]whirl/(\w+)/', text)
            if used and used[1] != part[1] and used[1] not in allowed.get(part[1], []):
                wrong.append(f"{file}:{line}: {part[1]} includes {used[1]}, which docs/architecture.md does not allow")
    return wrong + inner_includes(root) + installed_includes(root)


def installed_includes(root):
    """A header under an include root is installed, so it includes no header under an internal root, which is not."""
    inside = {f.partition("/internal/")[2] for f in tracked(root) if re.match(r"libs/\w+/internal/.*\.hpp$", f)}
    return [f"{f}:{line}: a public header includes {used[1]}, which is not installed"
            for f in tracked(root) if re.match(r"(libs/\w+/|)include/.*\.hpp$", f)
            for line, text in enumerate((root / f).read_text().split("\n"), 1)
            if (used := re.match(r'\s*#\s*include\s*["<]([\w./]+)[">]', text)) and used[1] in inside]


def inner_includes(root):
    """Inside a library the includes between the folders of src form no circle."""
    arrows = {}  # (library, folder) -> {folder: first place}
    for file in tracked(root):
        part = re.match(r"(libs/\w+/src)/(?:(\w+)/)?", file)
        if not part:
            continue
        for line, text in enumerate((root / file).read_text(errors="replace").split("\n"), 1):
            used = re.match(r'\s*#\s*include\s*"([\w./]+)"', text)
            if not used or not (root / part[1] / used[1]).exists():
                continue
            folder = used[1].split("/")[0] if "/" in used[1] else ""
            if folder != (part[2] or ""):
                arrows.setdefault((part[1], part[2] or ""), {}).setdefault(folder, f"{file}:{line}")
    wrong = []
    for (library, start), first in sorted(arrows.items()):
        for folder, place in sorted(first.items()):
            seen, open_ = set(), [folder]
            while open_:
                at = open_.pop()
                if at not in seen:
                    seen.add(at)
                    open_ += arrows.get((library, at), {})
            if start in seen:
                wrong.append(f"{place}: {library}/{start} includes {folder or 'the files beside it'}, which leads back")
    return wrong


def folders(root):
    count = {}
    for file in tracked(root):
        folder = file.rpartition("/")[0]
        if folder and "/corpus/" not in file:
            count[folder] = count.get(folder, 0) + 1
    return [f"{folder}: {n} files, the limit is {FOLDER_LIMIT}"
            for folder, n in sorted(count.items()) if n > FOLDER_LIMIT]


def functions(root):
    """By the format of the tree a definition at namespace scope begins and ends in the first column."""
    long = []
    for file in tracked(root):
        if not re.match(r"(libs/\w+/(src|include|internal)|apps)/.*\.[ch]pp$", file):
            continue
        start = None
        for line, text in enumerate((root / file).read_text().split("\n"), 1):
            if start is None and re.match(r"[A-Za-z].*\(", text) and not text.endswith(";") and 'R"' not in text:
                start = line
            elif start is not None and text.startswith("}"):
                if line - start + 1 > FUNCTION_LIMIT:
                    long.append((line - start + 1, f"{file}:{start}: {line - start + 1} lines, the limit is {FUNCTION_LIMIT}"))
                start = None
    wrong = [text for lines, text in long if lines > LONGEST]
    if len(long) > LONG_FUNCTIONS:
        wrong += [f"{len(long)} functions above {FUNCTION_LIMIT} lines, {LONG_FUNCTIONS} are known:"] + [t for _, t in long]
    return wrong


def decisions(root):
    """No decision reads a sentence: messages are compared in tests alone."""
    reads = re.compile(r"what\(\)\.find\(|(warning|trust|finding|message)s?\b[^;]*\.(starts_with|ends_with|find|contains)\(\"")
    wrong = []
    for file in tracked(root):
        if re.match(r"(libs/\w+/(src|include|internal)|apps|python/src)/.*\.[ch]pp$", file):
            wrong += [f"{file}:{line}: decides by a sentence: use a Finding or a type of Error"
                      for line, text in enumerate((root / file).read_text().split("\n"), 1) if reads.search(text)]
    return wrong


def members(body):
    """Names of the data members of a struct, without those of its functions."""
    flat, depth = "", 0
    for c in re.sub(r"//[^\n]*", "", body):
        depth += (c == "{") - (c == "}")
        flat += c if depth == 0 and c != "}" else ""
    names = []
    for statement in flat.split(";"):
        statement = re.sub(r"=\s*[^,]*", "", statement)
        while re.search(r"<[^<>]*>", statement):
            statement = re.sub(r"<[^<>]*>", "", statement)
        if "(" not in statement and not re.match(r"\s*(using|static|struct|enum|friend|bool operator)\b", statement):
            names += [name for part in statement.split(",") for name in re.findall(r"(\w+)\s*$", part)]
    return names


def options(root):
    """What a caller may set, in the headers of users: a dozen fields a struct, what is rarely set in one of its own."""
    wrong = []
    for file in tracked(root):
        if re.match(r"libs/\w+/include/.*\.hpp$", file):
            for name, body in re.findall(r"^struct (\w*(?:Options|Settings))\b[^;{]*\{(.*?)^\};", (root / file).read_text(), re.M | re.S):
                if len(members(body)) > OPTION_LIMIT:
                    wrong.append(f"{file}: {name} has {len(members(body))} fields, at most {OPTION_LIMIT}: nest those that are rarely set")
    return wrong


def units(root):
    """The unit of a figure's axis comes from its quantity, or from report/units.hpp: no literal in the code that draws."""
    literal = re.compile(r'\{"(nm|µm|um|mm|m|mil|mm/s|m/s|m/s²|g|N|kN|Hz|kHz|rpm|rpm/s|rad/s|°|deg|%|s|ms|dB|V)", *[0-9k(]')
    return [f"{file}:{line}: unit literal: take AmplitudeScale::unit_for, engineering_unit or report/units.hpp"
            for file in tracked(root) if re.match(r"(libs/(report/src/figures|pages/src|study/src|modal/src)|apps)/.*\.[ch]pp$", file)
            for line, text in enumerate((root / file).read_text().split("\n"), 1) if literal.search(text)]


def names(root):
    """Sources of a folder tree are compiled together, so a constant or a type of an anonymous namespace has its name alone there."""
    places = {}
    for file in tracked(root):
        part = re.match(r"(libs/\w+/(?:src|test)|apps/\w+|tests/\w+)/.*\.cpp$", file)
        inside = False
        for line, text in enumerate((root / file).read_text().split("\n") if part else [], 1):
            inside = text == "namespace {" or (inside and text != "}  // namespace")
            if inside and re.match(r"const(expr|init)? ", text):
                found = re.findall(r"\b(k[A-Z]\w*)(?= *[=\[{])", text)
            else:
                found = re.findall(r"^(?:struct|class|enum class|enum|union) (\w+)[^;]*$", text) if inside else []
            for name in found:
                places.setdefault((part[1], name), {}).setdefault(file, line)
    return [f"{file}:{line}: {name} is a name of {', '.join(f for f in at if f != file)} too"
            for (_, name), at in sorted(places.items()) if len(at) > 1 for file, line in list(at.items())[1:]]


def form(root):
    tool = shutil.which("clang-format")
    if tool is None:
        print("SKIPPED: no clang-format here (packages-test.txt)")
        return []
    files = [f for f in tracked(root) if re.search(r"\.[ch]pp$", f)]
    result = subprocess.run([tool, "--dry-run", *files], cwd=root, capture_output=True, text=True)
    return sorted({f"{m}: not formatted (clang-format -i)" for m in
                   re.findall(r"^([^:\n]+):\d+:\d+: warning: code should be clang-formatted", result.stderr, re.M)})


def unchanged(memo, key):
    """Whether the run that `memo` holds was the same call, and every file that it read still has the same bytes."""
    if memo is None or not memo.is_file():
        return False
    kept = json.loads(memo.read_text())
    return kept["key"] == key and all(pathlib.Path(f).is_file() and digest(f) == d for f, d in kept["files"].items())


def digest(file):
    return hashlib.sha256(pathlib.Path(file).read_bytes()).hexdigest()


# Checks that clang answers while it parses: as matchers over every node of Eigen and the C++ library they take ten times as long.
# A view of a null pointer does not compile from C++23 on.
PARSED = {
    "bugprone-reserved-identifier": ["-Wreserved-identifier", "-Wreserved-macro-identifier"],
    "modernize-use-nullptr": ["-Wzero-as-null-pointer-constant"],
    "bugprone-stringview-nullptr": ["-std=c++2b"],
}


def tidy(root, memo=None):
    """.clang-tidy over every header that another library may include, as one unit. Without a finding, the files that it read
    are kept in `memo`, those of Eigen and the C++ library too: minutes, and most changes touch no header."""
    tool = shutil.which("clang-tidy")
    if tool is None:
        print("SKIPPED: no clang-tidy here (packages-test.txt)")
        return []
    headers = [f for f in tracked(root) if re.match(r"(libs/\w+/|testing/|)(include|internal)/whirl/.*\.hpp$", f)]
    roots = sorted({h.partition("whirl/")[0] for h in headers})
    flags = subprocess.run(["pkg-config", "--cflags", "eigen3", "tomlplusplus"], capture_output=True, text=True).stdout.split()
    settings = root / ".clang-tidy"
    text = "".join(f"#include <{h[h.index('whirl/'):]}>\n" for h in headers)
    warned = [flag for replaced in PARSED.values() for flag in replaced]
    call = ["-std=c++20", "-DEIGEN_MAX_ALIGN_BYTES=64", *[f"-I{root / r}" for r in roots],
            *[re.sub("^-I", "-isystem", flag) for flag in flags], *warned]
    checks = ",".join([*(f"-{check}" for check in PARSED), *(f"clang-diagnostic-{flag[2:]}" for flag in warned if flag[:2] == "-W")])
    version = subprocess.run([tool, "--version"], capture_output=True, text=True).stdout
    key = [version, text, call, checks]
    if unchanged(memo, key):
        print("the headers are those of the last run, which found nothing")
        return []
    with tempfile.NamedTemporaryFile("w", suffix=".cpp") as unit:
        unit.write(text)
        unit.flush()
        result = subprocess.run([tool, "--quiet", f"--config-file={settings}", f"--checks={checks}", unit.name, "--", *call], capture_output=True,
                                text=True)
        read = subprocess.run([shutil.which("clang++") or "c++", "-M", *call, unit.name], capture_output=True, text=True)
        files = {f for f in re.split(r"[\s\\]+", read.stdout.partition(":")[2]) if f} - {unit.name}
    wrong = sorted(set(re.findall(r"^(\S+:\d+:\d+: (?:error|warning): .*)$", result.stdout, re.M)))
    wrong = wrong or ([result.stderr] if result.returncode else [])
    if memo is not None and not wrong and read.returncode == 0:
        memo.write_text(json.dumps({"key": key, "files": {f: digest(f) for f in sorted(files | {str(settings)})}}))
    return wrong


def api(root):
    """The API reference without a warning, and written notation that exists: code names of docs/notation.md."""
    text = "\n".join((root / f).read_text(errors="replace") for f in tracked(root) if re.match(r"libs/.*\.[ch]pp$", f))
    rows = re.findall(r"^\| [^|]+ \| ([^|]*`[^|]*) \|", (root / "docs/notation.md").read_text().partition("## Param")[0], re.M)
    words = {w for row in rows for name in re.findall(r"`([^`]+)`", row) for w in re.findall(r"[A-Za-z_]\w*", name)}
    wrong = [f"docs/notation.md: `{w}` is nowhere in the code" for w in sorted(words) if not re.search(rf"\b{w}\b", text)]
    tool = shutil.which("doxygen")
    if tool is None:
        print("SKIPPED: no doxygen here (packages-test.txt)")
        return wrong
    with tempfile.TemporaryDirectory() as out:
        settings = (root / "docs/api/Doxyfile").read_text() + f"\nOUTPUT_DIRECTORY = {out}\n"
        result = subprocess.run([tool, "-"], input=settings, cwd=root, capture_output=True, text=True)
    return wrong + [line for line in result.stderr.split("\n") if ": error:" in line or ": warning:" in line]


def main():
    root = pathlib.Path(sys.argv[1])
    check = {"tree": tree, "includes": includes, "folders": folders, "functions": functions, "decisions": decisions, "options": options,
             "units": units, "names": names, "format": form, "tidy": tidy, "api": api}
    memo = [pathlib.Path(sys.argv[3])] if sys.argv[2] == "tidy" and len(sys.argv) > 3 else []
    wrong = check[sys.argv[2]](root, *memo)
    print("\n".join(wrong))
    return 1 if wrong else 0


sys.exit(main())
