"""Every tutorial runs; what it prints and draws becomes a notebook and a page."""
import base64
import sys
import textwrap
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")
TUTORIALS = Path(__file__).resolve().parents[1] / "tutorials"
sys.path.insert(0, str(TUTORIALS))
import render  # noqa: E402

SCRIPTS = sorted(TUTORIALS.glob("[0-9]_*.py"))


def test_there_are_eight():
    assert [s.name[0] for s in SCRIPTS] == list("12345678")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda s: s.stem)
def test_tutorial(script):
    if "sklearn" in script.read_text():
        pytest.importorskip("sklearn")
    parts = render.cells(script.read_text())
    assert len(parts) >= 3 and parts[0][0].startswith("# ") and all(text or code for text, code in parts)
    results = render.execute(parts)
    assert any(printed for printed, _ in results)
    book = render.notebook(parts, results)
    code = [c for c in book["cells"] if c["cell_type"] == "code"]
    assert [c["execution_count"] for c in code] == list(range(1, len(code) + 1))
    for cell in code:
        for output in cell["outputs"]:
            if "data" in output:
                assert base64.b64decode(output["data"]["image/png"]).startswith(b"\x89PNG")
    text, files = render.page(script.stem, parts, results)
    assert all(f"]({name})" in text for name, _ in files)


def test_the_page_on_measured_data(monkeypatch, capsys):
    root = TUTORIALS.parents[1]
    monkeypatch.chdir(root)
    text = (root / "docs/start/tutorial.md").read_text()
    exec(textwrap.dedent(text.split("The same in Python:")[1].split("And in C++")[0]), {})
    found = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert found == ["695.74", "1898.05", "2777.59"]


def test_a_tutorial_whose_claim_fails_is_told():
    parts = render.cells("# # Title\n\n# %%\nassert 1 > 2\n")
    with pytest.raises(AssertionError):
        render.execute(parts)
