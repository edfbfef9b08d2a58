"""The command regress: figures, findings, files, sentences for what is wrong."""

import json
from pathlib import Path

from typer.testing import CliRunner

from tribrach.cli import app

RUN = CliRunner()
ROWS = Path(__file__).parents[1] / "comparison" / "sixteen_sites.csv"


def test_figures_and_findings(tmp_path: Path) -> None:
    files = [tmp_path / "r.json", tmp_path / "r.html"]
    result = RUN.invoke(
        app, ["regress", str(ROWS), "--json", str(files[0]), "--html", str(files[1])]
    )
    assert result.exit_code == 0, result.output
    assert "Only mean against incidence (t = 4.51) is significantly curved" in result.output
    assert "range and incidence are correlated 0.94" in " ".join(result.output.split())
    data = json.loads(files[0].read_text())
    assert data["rows"] == 16
    assert [r["curved"] for r in data["relations"]] == [False, False, True, False]
    assert len(data["physical"]) == 2
    page = files[1].read_text()
    assert page.count("data:image/png;base64,") == 2
    assert "significantly curved" in page
    assert "http" not in page.split("</head>")[0]


def test_columns_are_chosen(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text("d,rms\n1,2\n2,3.1\n3,4.3\n4,4.9\n5,6.2\n")
    result = RUN.invoke(app, ["regress", str(table), "--x", "d", "--y", "rms"])
    assert result.exit_code == 0, result.output
    assert "rms against d" in result.output
    assert "physical" not in result.output


def test_wrong_calls_end_in_a_sentence(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text("d,rms\n1,2\n2,3\n")
    for options, words in (
        ([], "there is no column range"),
        (["--x", ",", "--y", "rms"], "names no column"),
        (["--x", "d", "--y", "rms"], "cannot carry"),
    ):
        result = RUN.invoke(app, ["regress", str(table), *options])
        assert result.exit_code == 2
        assert words in result.output
        assert "Traceback" not in result.output
