"""Plain language in what users read: no word of the house, sentences of at most 25 words, 15 in the mean of a page."""
import re

# Words of the house that readers of other tools do not know, and what the field says.
HOUSE_WORDS = {
    r"\bthe judge\b|\bjudge[sd]?\b": "acceptance limits", r"\b(is|are|was|were|be|been) (told|said)\b": "reported, printed",
    r"\btold apart\b": "distinguished", r"\bforetold\b": "predicted", r"\b(ask|asks|asked) for\b": "requires", r"\bstands? (in|for)\b": "is in, represents",
    r"\btrust away\b": "downgrades the verdict", r"machines? the model may be": "the uncertainty of the model",
    r"\bblows?\b": "impacts", r"\bput aside\b": "left out", r"\bspeaks? (for|against)\b": "supports, contradicts",
    r"\bknows\b": "has, reads", r"\bconj z\b": "anisotropic stiffness", r"\bpull tests?\b": "static stiffness test",
    r"\bvirtual rig\b": "simulated rig", r"one way to the disk": "written atomically", r"\bwithout a word\b": "without a warning"}
LONGEST, MEAN = 25, 15  # words of a sentence; of a page in the mean

# A string of C++, what may not be taken for one, and what lies between two parts of one string.
_TOKEN = re.compile(r"""//[^\n]*|/\*.*?\*/|R"(?P<mark>\w*)\((?P<raw>.*?)\)(?P=mark)"|"(?P<text>(?:[^"\\\n]|\\.)*)"|'(?:[^'\\\n]|\\.)*'|\s+|.""", re.S)
_FILE_NAME = re.compile(r"\bblow(_[\d*]\S*|_?\.(?:csv|json|uff|wav)|_(?=\s|$))|--keep-odd-blows")


def found_in(where, text):
    """House words of a text."""
    text = _FILE_NAME.sub("", text)
    return [f"{where}: '{m[0]}': write '{better}'" for word, better in HOUSE_WORDS.items() for m in re.finditer(word, text, re.I)]


def house_words(file, text):
    """House words of a page, code apart."""
    wrong, fenced = [], False
    for number, line in enumerate(text.split("\n"), 1):
        fenced ^= line.startswith("```")
        if fenced or line.startswith("    ") or file.name == "glossary.md" and line.startswith("| impact, blow |"):
            continue
        wrong += found_in(f"{file}:{number}", re.sub(r"`[^`]*`|\]\([^)]*\)", "", line))
    return wrong


def paragraphs(text):
    """(line, paragraph) of a page without its code, tables, formulas, headings and generated lists."""
    start, lines, skipped = 0, [], False
    for number, line in enumerate([*text.split("\n"), ""], 1):
        if line.startswith(("```", "$$")) or re.match(r"<!-- .*: (begin|end) -->", line):
            skipped = not skipped
        item = re.match(r"\s*(?:[-*]|\d+\.) +(.*)", line)
        prose = bool(line.strip()) and not skipped and not re.match(r"\s*[|#]|<!--|!\[|    |\t|```|\$\$", line)
        if lines and (item or not prose):
            yield start, " ".join(lines)
            lines = []
        if prose:
            start = start if lines else number
            lines.append(item[1] if item else line.strip())


def sentences_of(text):
    """(line, sentence, number of words); code counts as one word, numbers as none."""
    for line, paragraph in paragraphs(text):
        plain = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", re.sub(r"\[@[^]]*\]", "", re.sub(r"`[^`]*`", "CODE", paragraph))).replace("**", "")
        plain = re.sub(r"\b(eqs?|e\.g|i\.e|[Ff]ig|cf|no|vs)\.\s", r"\1 ", plain)
        for sentence in re.split(r"(?<=[.!?])[)\"]?\s+(?=[A-Z0-9(\"*]|whirl )|:\s*$", plain):
            if words := re.findall(r"[^\W\d_][\w'/-]*", sentence):
                yield line, sentence, len(words)


def long_sentences(file, text):
    found = list(sentences_of(text))
    wrong = [f"{file}:{line}: {n} words, at most {LONGEST}: {sentence}" for line, sentence, n in found if n > LONGEST]
    mean = sum(n for _, _, n in found) / max(1, len(found))
    if len(found) >= 10 and mean > MEAN:
        wrong.append(f"{file}: {mean:.1f} words a sentence, at most {MEAN} in the mean")
    return wrong


def strings_of(source):
    """(line, text) of the strings of a C++ source, adjacent parts joined."""
    line, start, parts = 1, 0, []
    for token in _TOKEN.finditer(source):
        part = token["raw"] if token["raw"] is not None else token["text"]
        if part is not None:
            start = start if parts else line
            parts.append(part)
        elif parts and not token[0].isspace() and not token[0].startswith(("//", "/*")):
            yield start, "".join(parts)
            parts = []
        line += token[0].count("\n")


def source_texts(root):
    """House words in the texts of the program: strings of apps, libs and the Python module, and the page of the live view."""
    wrong, seen = [], 0
    for folder in ("apps", "libs", "python/src"):
        for file in sorted((root / folder).rglob("*")):
            where = file.relative_to(root)
            if "test" in where.parts or file.suffix not in (".cpp", ".hpp", ".html"):
                continue
            text = file.read_text()
            if file.suffix == ".html":
                wrong += found_in(where, re.sub(r"<[^>]*?(title=\"[^\"]*\")?[^>]*>", r" \1 ", text))
                continue
            for line, string in strings_of("\n".join("" if l.startswith("#include") else l for l in text.split("\n"))):
                seen += 1
                if not re.fullmatch(r"[\w.-]+", string):  # a name of the interface
                    wrong += found_in(f"{where}:{line}", string)
    return wrong + ([] if seen > 5000 else [f"only {seen} texts found in the sources: are they still read?"])
