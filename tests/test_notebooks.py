"""The pages of docs/notebooks: their code runs and says what the text beside it claims."""

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import matplotlib
import pytest

matplotlib.use("agg")
DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = sorted((DOCS / "notebooks").glob("*.md"))


@pytest.fixture(scope="module")
def made() -> ModuleType:
    spec = importlib.util.spec_from_file_location("notebooks", DOCS / "notebooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def printed(page: str, made: ModuleType, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What each piece of code of a page prints."""
    names: dict[str, object] = {}
    out = []
    for kind, text in made.cells((DOCS / "notebooks" / f"{page}.md").read_text()):
        if kind == "code":
            exec(compile(text, page, "exec"), names)
            out.append(capsys.readouterr().out)
    return out


def test_a_network(made: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    _, adjusted, without, between, drawn = printed("network", made, capsys)
    lines = adjusted.splitlines()
    assert lines[1] == "False"
    assert re.match(r"horizontal_distance:P01:P12:.*: v -?\d+\.\d mm, w -?\d", lines[2])
    assert without.startswith("True\n")
    joint, apart = (float(x) for x in re.findall(r"([\d.]+) mm", between))
    assert joint < apart
    assert drawn.startswith("<svg")
    assert drawn.rstrip().endswith("</svg>")


def test_points(made: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    """The stated sigmas are those of a simulation of the same survey, within its own scatter."""
    _, placed, scatter = printed("points", made, capsys)
    stated = [float(x) for x in re.findall(r"[ENU] ([\d.]+)", placed.splitlines()[2])]
    drawn = [float(x) for x in re.findall(r"[ENU] ([\d.]+)", scatter)]
    # a standard deviation from 2000 draws has 1.6 %
    assert stated == pytest.approx(drawn, rel=0.08)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_a_notebook_holds_its_page(page: Path, made: ModuleType) -> None:
    text = page.read_text()
    book = json.loads(made.notebook(text))
    assert (book["nbformat"], book["nbformat_minor"]) == (4, 5)
    code = ["".join(cell["source"]) for cell in book["cells"] if cell["cell_type"] == "code"]
    assert len(code) == text.count("```python ") >= 3
    assert all("```" not in "".join(cell["source"]) for cell in book["cells"])
    assert len({cell["id"] for cell in book["cells"]}) == len(book["cells"])
