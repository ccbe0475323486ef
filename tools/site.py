#!/usr/bin/env python3
"""The documentation as a site of plain pages (mkdocs): tutorials, how-to, reference, background. No script, nothing from a network.

A dead link or heading is an error.

Usage: tools/site.py OUT [--whirl PROGRAM] [--python FOLDER] [--without-tutorials]
  --whirl   reference of the subcommands from this program (default build/bin/whirl)
  --python  folder that holds the Python package (default build/python): the tutorials are run, with what they print and draw
"""
import argparse
import html
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[1]
# File of the tree -> page. Links between these follow; links to other files of the tree lose their target, not their text.
PAGES = {"README.md": "index.md", "examples/README.md": "examples.md", "python/README.md": "python.md",
         "docs/start/data.md": "data.md", "docs/start/tutorial.md": "tutorial.md", "docs/start/gallery.md": "gallery.md", "CHANGELOG.md": "changes.md", "RELEASING.md": "releasing.md"}
SECTIONS = {
    "How-to": ["data.md", "choosing.md", "howto.md", "troubleshooting.md", "balancing.md", "response.md", "rotor.md", "export.md", "hardware.md", "monitor.md", "parts.md"],
    "Reference": ["subcommands.md", "formats.md", "notation.md", "glossary.md", "python.md", "python-pysindy.md", "reliability.md"],
    "Background": ["method.md", "references.md", "paper-errata.md", "peers.md", "validation.md", "validation-modal.md", "validation-control.md",
                   "validation-realtime.md", "architecture.md", "releasing.md", "changes.md"],
}


def references():
    """docs/references.bib as a page, and key -> (number, short text)."""
    short, text = {}, "# References\n\n"
    for number, (key, body) in enumerate(re.findall(r"@\w+\{([\w-]+), (.*)\}$", (ROOT / "docs/references.bib").read_text(), re.M), 1):
        field = dict(re.findall(r"(\w+) = \{((?:[^{}]|\{[^{}]*\})*)\}", body))
        clean = {k: re.sub(r"\{\\(?:o|\"o)\}|\{\\o\}", "ø", v).replace('{\\"o}', "ö").replace("{", "").replace("}", "").replace("\\o", "ø")
                 .replace('\\"o', "ö").replace("--", "–") for k, v in field.items()}
        names = [n.split(",")[0] for n in clean["author"].split(" and ")]
        short[key] = f"{names[0] if len(names) == 1 else ' and '.join(names) if len(names) == 2 else names[0] + ' et al.'} {clean['year']}"
        place = ", ".join(clean[k] for k in ("journal", "publisher", "institution", "volume", "pages", "doi") if k in clean)
        text += f'<a id="{key}"></a>{clean["author"].replace(" and ", "; ")} ({clean["year"]}). *{clean["title"]}.* {place}.\n\n'
    return short, text


def formula(tex):
    """A displayed formula as a line of text; the pages hold no script that could set it."""
    text = re.sub(r"\\(?:text|t?frac\{1\})\{([^{}]*)\}", lambda m: ("1/" if "frac" in m[0] else "") + m[1], tex)
    for name, sign in {r"\ddot z": "z″", r"\dot z": "z′", r"\qquad": " ", r"\varphi": "φ", r"\beta": "β", r"\,": " ", r"\ ": " ",
                       r"e^{iφ}": "exp(iφ)", "_1": "₁", "_2": "₂", "_i": "ᵢ", "|^2": "|²", "-": "−"}.items():
        text = text.replace(name, sign)
    if "\\" in text:
        sys.exit(f"site.py: a formula that cannot be written as text: {text}")
    return "    " + " ".join(text.split()).replace(" given ", "\n    given ")


def page(file, cited):
    """Text of a file with its links made to those of the site."""
    text = file.read_text()

    def link(match):
        label, target = match[1], match[2]
        if re.match(r"(https?:|mailto:|#)", target):
            return match[0]
        path, hash_sign, part = target.partition("#")
        aim = (file.parent / path).resolve()
        if not aim.is_relative_to(ROOT):
            return label
        inside = str(aim.relative_to(ROOT))
        if inside.startswith("docs/images/"):
            return f"[{label}]({inside[5:]})"
        if inside in PAGES or (inside.startswith("docs/") and inside.endswith(".md")):
            return f"[{label}]({PAGES.get(inside, inside[5:])}{hash_sign}{part})"
        if inside in ("examples", "examples/"):
            return f"[{label}](examples.md)"
        return label

    text = re.sub(r"\$\$\n(.*?)\n\$\$", lambda m: formula(m[1]), text, flags=re.S)
    text = re.sub(r"\[([^]]*)\]\(([^)\s]+)\)", link, text)
    return re.sub(r"\[@([\w-]+)\]", lambda m: f"([{cited[m[1]]}](references.md#{m[1]}))", text)


def dead_links(site):
    """Links of the built pages to pages, figures or headings that do not exist."""
    pages = {f.name: f.read_text() for f in sorted(site.glob("*.html"))}
    anchors = {name: {html.unescape(i) for i in re.findall(r'\bid="([^"]+)"', text)} for name, text in pages.items()}
    out = []
    for name, text in pages.items():
        for link in map(html.unescape, re.findall(r'\b(?:href|src)="([^"]+)"', text)):
            path, _, part = link.partition("#")
            path = path or name
            if re.match(r"(https?|mailto|data):", link):
                continue
            if not (site / path).is_file():
                out.append(f"{name}: no page {path}")
            elif part and path in anchors and urllib.parse.unquote(part) not in anchors[path]:
                out.append(f"{name}: no heading #{part} in {path}")
    return out


def main():
    options = argparse.ArgumentParser()
    options.add_argument("out", type=pathlib.Path)
    options.add_argument("--whirl", type=pathlib.Path, default=ROOT / "build/bin/whirl")
    options.add_argument("--python", type=pathlib.Path, default=ROOT / "build/python")
    options.add_argument("--without-tutorials", action="store_true")
    given = options.parse_args()
    if shutil.which("mkdocs") is None:
        print("site.py: mkdocs is not installed (apt install mkdocs)")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder) / "docs"
        source.mkdir()
        shutil.copytree(ROOT / "docs/images", source / "images")
        cited, list_of = references()
        (source / "references.md").write_text(list_of)
        for file in [ROOT / name for name in PAGES] + sorted((ROOT / "docs").glob("*.md")):
            name = PAGES.get(str(file.relative_to(ROOT)), file.name)
            (source / name).write_text(page(file, cited))
        text = subprocess.run([given.whirl, "manual", "--format", "markdown"], check=True, capture_output=True, text=True).stdout
        (source / "subcommands.md").write_text(text)
        if not given.without_tutorials:
            subprocess.run([sys.executable, ROOT / "python/tutorials/render.py", source], check=True,
                           env=os.environ | {"PYTHONPATH": str(given.python)})
        tutorials = sorted(p.name for p in source.glob("[0-9]_*.md"))
        nav = [{"First steps": "index.md"}, {"Gallery": "gallery.md"}, {"Tutorials": ["tutorial.md", *tutorials, "examples.md"]}, *({k: v} for k, v in SECTIONS.items())]
        lines = "\n".join(f"  - {k}: {v}" if isinstance(v, str) else f"  - {k}:\n" + "\n".join(f"      - {p}" for p in v)
                          for part in nav for k, v in part.items())
        version = re.search(r"^project\(whirl VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
        config = pathlib.Path(folder) / "mkdocs.yml"
        config.write_text(f"site_name: whirl\nsite_url: ''\nextra: {{version: '{version}'}}\ndocs_dir: {source}\nsite_dir: {given.out.resolve()}\nuse_directory_urls: false\nplugins: []\n"
                          f"theme:\n  name: null\n  custom_dir: {ROOT}/docs/theme\nmarkdown_extensions: [tables, fenced_code, toc]\nnav:\n{lines}\n")
        subprocess.run(["mkdocs", "build", "-q", "--strict", "-f", config], check=True)
        (given.out / "sitemap.xml.gz").unlink(missing_ok=True)
    if dead := dead_links(given.out):
        sys.exit("\n".join(f"site.py: {line}" for line in dead))


if __name__ == "__main__":
    main()
