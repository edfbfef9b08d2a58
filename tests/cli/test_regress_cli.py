"""The command regress: figures, findings, files, sentences for what is wrong."""

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.io.comparison_table import read_comparison

RUN = CliRunner()
ROWS = Path(__file__).parents[1] / "comparison" / "sixteen_sites.csv"


def test_figures_and_findings(tmp_path: Path) -> None:
    files = [tmp_path / "r.json", tmp_path / "r.html"]
    result = RUN.invoke(
        app, ["regress", str(ROWS), "--json", str(files[0]), "--html", str(files[1])]
    )
    assert result.exit_code == 0, result.output
    assert "Only mean against incidence (t = 4.51) is significantly curved" in result.output
    assert "Range and incidence are correlated 0.94" in " ".join(result.output.split())
    data = json.loads(files[0].read_text())
    assert data["rows"] == 16
    assert [r["curved"] for r in data["relations"]] == [False, False, True, False]
    assert len(data["physical"]) == 2
    page = files[1].read_text()
    assert page.count("<figure") == page.count("<svg") == 2
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


def compared(table: Path) -> Path:
    """The rows of the table as the JSON of a comparison, in metres and radians."""
    rows = [line.split(",") for line in ROWS.read_text().splitlines() if line[:1].isdigit()]
    sites = [
        {
            "name": f"site {name}",
            "range": float(length),
            "incidence": math.radians(float(angle)),
            "c2c": {"mean": float(mean) / 1e3, "std": float(std) / 1e3},
            "m3c2": {"mean": 0.5e-3 * k, "std": None},
        }
        for k, (name, length, angle, mean, std) in enumerate(rows)
    ]
    table.write_text(json.dumps({"schema": 1, "sites": sites}))
    return table


def test_sites_of_a_comparison(tmp_path: Path) -> None:
    path = compared(tmp_path / "compare.json")
    result = RUN.invoke(app, ["regress", str(path), "--json", str(tmp_path / "r.json")])
    assert result.exit_code == 0, result.output
    assert "Only mean against incidence (t = 4.51) is significantly curved" in result.output
    table = RUN.invoke(app, ["regress", str(ROWS), "--json", str(tmp_path / "t.json")])
    assert table.exit_code == 0
    one, two = (json.loads((tmp_path / name).read_text()) for name in ("r.json", "t.json"))
    for a, b in zip(one["relations"], two["relations"], strict=True):
        assert a["quadratic"]["r2"] == pytest.approx(b["quadratic"]["r2"], rel=1e-9)
        values = [[t["value"] for t in r["quadratic"]["terms"]] for r in (a, b)]
        assert values[0] == pytest.approx(values[1], rel=1e-6)
    other = RUN.invoke(app, ["regress", str(path), "--y", "m3c2.mean"])
    assert "16 rows; range in m, m3c2.mean in mm, incidence in °" in other.output
    assert "m3c2.mean against range" in other.output


def test_figures_that_are_no_lengths(tmp_path: Path) -> None:
    """Shares and ratios stay as they are, angles of a station are angles."""
    path = compared(tmp_path / "compare.json")
    data = json.loads(path.read_text())
    for k, site in enumerate(data["sites"]):
        site["prediction"] = {"ratio": 1 + 0.1 * k}
        site["stations"] = {"b": {"incidence": site["incidence"], "range": site["range"]}}
    path.write_text(json.dumps(data))
    names = ["prediction.ratio", "stations.b.incidence"]
    table = read_comparison(path, names)
    assert table.values[names[0]] == pytest.approx([1 + 0.1 * k for k in range(16)])
    assert table.values[names[1]] == pytest.approx(
        [math.degrees(site["incidence"]) for site in data["sites"]]
    )
    assert table.units == {names[0]: "", names[1]: "deg"}


def test_sites_without_a_figure_are_named(tmp_path: Path) -> None:
    path = compared(tmp_path / "compare.json")
    data = json.loads(path.read_text())
    data["sites"][3]["incidence"] = None
    path.write_text(json.dumps(data))
    result = RUN.invoke(app, ["regress", str(path)])
    assert "Left out for want of a figure: site 4." in result.output
    for text, words in (
        ("{", "no JSON of a comparison"),
        ('{"sites": [1]}', "no JSON of a comparison"),
        ('{"sites": []}', "no site has range"),
        ('{"sites": [{"name": "a", "range": 1, "c2c": 3}]}', "no site has range"),
        ("[" * 100_000, "no JSON of a comparison"),
    ):
        path.write_text(text)
        result = RUN.invoke(app, ["regress", str(path)])
        assert result.exit_code == 2
        assert words in result.output
