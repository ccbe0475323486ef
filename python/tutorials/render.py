#!/usr/bin/env python3
"""Runs the tutorials and writes each as a notebook and as a Markdown page with what it printed and drew.

Usage: render.py OUT [TUTORIAL.py ...]      OUT/1_first_model.ipynb, OUT/1_first_model.md, OUT/1_first_model_1.png, ...

A tutorial is a script: `# %%` begins a cell; comment lines at the start of a cell are its text.
"""
import base64
import contextlib
import io
import json
import re
import sys
import textwrap
from pathlib import Path


def cells(source):
    """[(text, code)] of a script."""
    out = []
    for part in re.split(r"^# %%.*\n", source, flags=re.M):
        lines = part.strip("\n").split("\n")
        text = []
        while lines and lines[0].startswith("#"):
            text.append(re.sub(r"^# ?", "", lines.pop(0)))
        out.append(("\n".join(text).strip(), "\n".join(lines).strip("\n")))
    return out


def execute(parts):
    """Runs the cells in one namespace; [(printed, [PNG of every figure drawn])]."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    space, out = {"__name__": "__main__"}, []
    for _, code in parts:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "<cell>", "exec"), space)
        pictures = []
        for number in pyplot.get_fignums():
            picture = io.BytesIO()
            pyplot.figure(number).savefig(picture, format="png", dpi=110)
            pictures.append(picture.getvalue())
        pyplot.close("all")
        out.append((printed.getvalue(), pictures))
    return out


def notebook(parts, results):
    """The tutorial in the notebook format, version 4.4."""
    out, count = [], 0
    for (text, code), (printed, pictures) in zip(parts, results):
        if text:
            out.append({"cell_type": "markdown", "metadata": {}, "source": text})
        if not code:
            continue
        count += 1
        outputs = [{"output_type": "stream", "name": "stdout", "text": printed}] if printed else []
        outputs += [{"output_type": "display_data", "metadata": {}, "data": {"image/png": base64.b64encode(p).decode()}} for p in pictures]
        out.append({"cell_type": "code", "execution_count": count, "metadata": {}, "source": code, "outputs": outputs})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"nbformat": 4, "nbformat_minor": 4, "metadata": {"kernelspec": kernel}, "cells": out}


def page(name, parts, results):
    """(Markdown, [(file name, PNG)])."""
    text, files = "", []
    for (words, code), (printed, pictures) in zip(parts, results):
        text += words + "\n\n"
        if code:
            text += f"```python\n{code}\n```\n\n"
        if printed:
            text += textwrap.indent(printed.rstrip(), "    ") + "\n\n"
        for picture in pictures:
            files.append((f"{name}_{len(files) + 1}.png", picture))
            text += f"![figure]({files[-1][0]})\n\n"
    return text, files


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for script in map(Path, sys.argv[2:] or sorted(Path(__file__).parent.glob("[0-9]_*.py"))):
        parts = cells(script.read_text())
        results = execute(parts)
        (folder / f"{script.stem}.ipynb").write_text(json.dumps(notebook(parts, results), indent=1))
        text, files = page(script.stem, parts, results)
        (folder / f"{script.stem}.md").write_text(text)
        for name, data in files:
            (folder / name).write_bytes(data)


if __name__ == "__main__":
    main()
