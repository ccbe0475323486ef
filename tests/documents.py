#!/usr/bin/env python3
"""What is written about the program against the program.

Usage: documents.py SOURCE_DIR WHIRL CHECK...      CHECK: manual, completion, commands, links, snippets, words, sentences,
                                                  messages, version

Exit code 1 and one line per deviation. The checks of the language are in plain_words.py. Checks of one call ask the program
for its helps once.
"""
import functools
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

import plain_words


def run(*words, **settings):
    return subprocess.run([str(w) for w in words], capture_output=True, text=True, **settings)


def help_text(program, place):
    """--help-all where there is one."""
    found = run(program, *place, "--help-all")
    return found.stdout if found.returncode == 0 else run(program, *place, "--help").stdout


def subcommands(text):
    """Names under the headings of groups: after "Usage ... SUBCOMMAND", a line of two blanks, a name without a dash, its summary."""
    if "SUBCOMMAND" not in text:
        return []
    names, flags = [], False
    for line in text.split("\n"):
        if re.match(r"\S.*:$", line):
            flags = line.startswith(("Options", "Positionals"))
        elif not flags and (m := re.match(r"  ([a-z][\w-]*)  +\S", line)):
            names.append(m[1])
    return names


@functools.cache
def tree(program):
    """place (a tuple of words) -> its help."""
    found, todo = {}, [()]
    while todo:
        place = todo.pop()
        found[place] = help_text(program, place)
        todo += [place + (name,) for name in subcommands(found[place])]
    return found


def flags(text):
    listed = set()
    for line in text.split("\n"):
        if re.match(r"  -", line):
            listed |= set(re.findall(r"(?<![\w-])(--[a-z][\w-]*)", line.split("  ", 2)[1] if "  " in line[2:] else line))
    return listed | {"--help"}


def documents(root):
    """(file, its text) of what users read."""
    files = [root / "README.md", root / "CHANGELOG.md", root / "CONTRIBUTING.md", *sorted((root / "docs").rglob("*.md")),
             *sorted(root.glob("libs/*/README.md")), root / "python/README.md", *sorted(root.glob("examples/**/*.md"))]
    return [(f, f.read_text()) for f in files if f.exists()]


def manual(root, program):
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        made = run(program, "manual", "--out", folder, "--quiet")
        if made.returncode:
            return [f"whirl manual: {made.stderr}"]
        pages = {p.name: p.read_text() for p in pathlib.Path(folder).iterdir()}
    reference = run(program, "manual", "--format", "markdown").stdout
    for place, text in tree(program).items():
        name = "-".join(("whirl",) + place) + ".1"
        page = pages.pop(name, None)
        if page is None:
            wrong.append(f"{name} is missing")
            continue
        plain = page.replace("\\-", "-").replace("\\&", "").replace("\\e", "\\")
        plain = re.sub(r"\\f[BIR]", "", plain)
        for flag in flags(text):
            if not re.search(r"(?<![\w-])" + re.escape(flag) + r"(?![\w-])", plain):
                wrong.append(f"{name}: {flag} of --help-all is missing")
            if f"{flag} " not in reference and f"{flag}`" not in reference and f"{flag}," not in reference:
                wrong.append(f"reference: {flag} of {name} is missing")
        for section in ("NAME", "SYNOPSIS", "OPTIONS", "EXIT STATUS"):
            if f".SH {section}\n" not in page:
                wrong.append(f"{name}: no section {section}")
        for number, line in enumerate(page.split("\n"), 1):
            if line.startswith(("'", ".")) and not re.match(r"\.(TH|SH|SS|TP|PP|B|BR|nf|fi)\b", line):
                wrong.append(f"{name}:{number}: unknown macro {line}")
        if shutil.which("groff"):
            noise = run("groff", "-man", "-Tutf8", "-ww", "-z", "-K", "utf8", input=page).stderr
            wrong += [f"{name}: groff: {line}" for line in noise.split("\n") if line]
    return wrong + [f"{name}: no such subcommand" for name in pages]


def completion(root, program):
    wrong = []
    scripts = {shell: run(program, "completion", shell).stdout for shell in ("bash", "zsh", "fish")}
    everything = tree(program)
    for place, text in everything.items():
        for flag in flags(text):
            for shell, script in scripts.items():
                if (f"-l {flag[2:]}" if shell == "fish" else flag) not in script:
                    wrong.append(f"{shell}: {flag} of {' '.join(place)} is missing")
    for shell, script in scripts.items():
        if shutil.which(shell):
            checked = run(shell, "-n", input=script)
            wrong += [f"{shell}: {checked.stderr}"] if checked.returncode else []
    asked = {("whirl", "ident"): {"identify"}, ("whirl", "rig", "rec"): {"record"}, ("whirl", "identify", "--method", "pa"): {"paper"},
             ("whirl", "identify", "--hold"): {"--hold", "--holdout"}, ("whirl", "plot", "--window", "ha"): {"hann"}, ("whirl", "identify", "da"): set()}
    for words, wanted in asked.items():
        line = (f"COMP_WORDS=({shlex.join(words)}); COMP_CWORD={len(words) - 1}; _whirl; "
                "printf '%s\\n' \"${COMPREPLY[@]}\"")
        given = set(filter(None, run("bash", "-c", scripts["bash"] + "\n" + line).stdout.split("\n")))
        if given != wanted:
            wrong.append(f"bash: {' '.join(words)} gives {sorted(given)}, wanted {sorted(wanted)}")
    if run(program, "completion", "tcsh").returncode != 2:
        wrong.append("a shell that is not known is not refused")
    return wrong


def commands_of(text):
    """Command lines of whirl: in code blocks (with their continuation lines) and between backticks."""
    text, fenced = re.sub(r"\\\n\s*", " ", text), False
    for line in text.split("\n"):
        if line.startswith("```"):
            fenced = not fenced
        block = re.match(r"\s*(?:\$ )?((?:\w+=\S+ )*(?:mpirun [^|;&]*?)?whirl [^`]*)$", line)
        if block and (fenced or line.startswith(("    ", "\t"))):
            yield block[1]
        for inline in re.findall(r"`(whirl [^`]+)`", line):
            yield inline


def wrong_words(everything, line):
    """(number of commands of whirl in a line, what is wrong with their subcommands and flags)."""
    wrong, seen = [], 0
    for part in re.split(r"\s(?:&&|\|\|?|;)\s", re.sub(r"\s#.*", "", line)):
        words = part.split()
        if "whirl" not in words[:8]:
            continue
        words = words[words.index("whirl") + 1:]
        if not words or not re.fullmatch(r"[a-z]+", words[0]) or words[0] in ("help",):
            continue
        place = ()
        while words and place + (words[0],) in everything:
            place += (words.pop(0),)
        if not place:
            wrong.append(f"`{part.strip()}`: no such subcommand")
            continue
        seen += 1
        named = (re.match(r"(--[a-z][\w-]*)", word) for word in words)
        wrong += [f"`{part.strip()}`: no flag {flag[1]}" for flag in named if flag and flag[1] not in flags(everything[place])]
    return seen, wrong


def commands(root, program):
    """The commands of the documents, and the examples of the helps."""
    everything = tree(program)
    lines = [(file.relative_to(root), line) for file, text in documents(root) for line in commands_of(text)]
    helps = [(" ".join(("whirl",) + place) + " --help", re.sub(r"\\\n\s*", " ", example)) for place, text in everything.items()
             for example in re.findall(r"Example: (whirl (?:[^\n]*\\\n)*[^\n]*)", text)]
    wrong, seen = [], 0
    for where, line in lines + helps:
        number, found = wrong_words(everything, line)
        seen += number
        wrong += [f"{where}: {problem}" for problem in found]
    if seen < 100 or len(helps) < 30:
        wrong.append(f"only {seen} commands found in the documents and {len(helps)} examples in the helps: are they still read?")
    return wrong


def anchor(title):
    title = re.sub(r"[`*]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title)).strip().lower()
    return re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", title))


def links(root, program):
    wrong, seen = [], 0
    for file, text in documents(root):
        bare = re.sub(r"```.*?```", "", text, flags=re.S)
        for target in re.findall(r"\]\(([^)\s]+)\)", bare):
            if re.match(r"(https?|mailto|doi):", target):
                continue
            seen += 1
            path, _, part = target.partition("#")
            aim = (file.parent / path).resolve() if path else file
            if not aim.exists():
                wrong.append(f"{file.relative_to(root)}: {target}: no such file")
            elif part and aim.suffix == ".md" and part not in map(anchor, re.findall(r"^#+ (.*)$", aim.read_text(), re.M)):
                wrong.append(f"{file.relative_to(root)}: {target}: no such heading")
        for key in re.findall(r"\[@([\w-]+)\]", bare):
            seen += 1
            if f"{{{key}," not in (root / "docs/references.bib").read_text():
                wrong.append(f"{file.relative_to(root)}: [@{key}]: not in docs/references.bib")
    return wrong + ([] if seen > 30 else [f"only {seen} links found"])


def snippets(root, program):
    """README's C++ is that of the project which the suite builds against the installed package, the tutorial's that of an example."""
    shown = re.findall(r"^    ((?:auto|if \(|whirl::|#include).*?)(?:\s+//.*)?$", (root / "README.md").read_text(), re.M)
    built = [line.strip() for line in (root / "tests/consumer/main.cpp").read_text().split("\n")]
    wrong = [f"README.md: `{line}` is not in tests/consumer/main.cpp" for line in shown if line not in built]
    tutorial = (root / "docs/start/tutorial.md").read_text().split("And in C++")[1].split("Both print")[0]
    lines = [line.strip().replace('"examples/data/hammer.csv.gz"', "argv[1]") for line in tutorial.split("\n")[1:] if line.startswith("    ")]
    example = [line.strip() for line in (root / "examples/cpp/hammer_modes.cpp").read_text().split("\n")]
    wrong += [f"docs/start/tutorial.md: `{line}` is not in examples/cpp/hammer_modes.cpp" for line in lines if line not in example]
    return wrong + ([] if len(shown) > 5 and len(lines) > 5 else [f"only {len(shown)} and {len(lines)} lines of C++ found"])


def words(root, _):
    return [w for file, text in documents(root) for w in plain_words.house_words(file.relative_to(root), text)]


def sentences(root, _):
    return [w for file, text in documents(root) if not file.is_relative_to(root / "libs")
            for w in plain_words.long_sentences(file.relative_to(root), text)]


def messages(root, program):
    """What the program prints: its helps, and the texts in the sources."""
    wrong = [w for place, text in tree(program).items() for w in plain_words.found_in(f"{' '.join(('whirl',) + place)} --help-all", text)]
    return wrong + plain_words.source_texts(root)


def version(root, program):
    stated = re.search(r"project\(whirl VERSION ([\d.]+)", (root / "CMakeLists.txt").read_text())[1]
    minor = stated.rsplit(".", 1)[0]
    found = {
        "whirl --version": run(program, "--version").stdout.split()[-1],
        "debian/changelog": re.match(r"whirl \(([\d.]+)\)", (root / "debian/changelog").read_text())[1],
        "CITATION.cff": re.search(r"^version: (.*)$", (root / "CITATION.cff").read_text(), re.M)[1],
        "CHANGELOG.md": re.search(r"^## ([\d.]+)", (root / "CHANGELOG.md").read_text(), re.M)[1],
    }
    wrong = [f"{where} says {what}, CMakeLists.txt {stated}" for where, what in found.items() if what != stated]
    for file in (root / "docs/architecture.md", root / "examples/cpp/CMakeLists.txt", root / "tests/consumer/CMakeLists.txt"):
        wrong += [f"{file.relative_to(root)} requires whirl {v}" for v in re.findall(r"find_package\(whirl ([\d.]+)", file.read_text())
                  if v != minor]
    return wrong


CHECKS = {f.__name__: f for f in (manual, completion, commands, links, snippets, words, sentences, messages, version)}

if __name__ == "__main__":
    deviations = [w for check in sys.argv[3:] for w in CHECKS[check](pathlib.Path(sys.argv[1]).resolve(), sys.argv[2])]
    print("\n".join(deviations))
    sys.exit(1 if deviations or not sys.argv[3:] else 0)
