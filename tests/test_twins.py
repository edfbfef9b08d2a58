"""Twins from scans to clouds: every target found, none invented, every error as stated.

The whole of it, all twins with five seeds each, is slow; ordinary tests take two twins with fine
windows around some targets only.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from scipy.stats import chi2
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.io.twins import write_twin
from tribrach.simulate.aiming import fine_scan
from tribrach.simulate.twin import Twin
from tribrach.simulate.twins import TWINS, build
from tribrach.simulate.twins.newcastle_lab import FINE_STEP

SEEDS = (1, 2, 3, 4, 5)
POINTS = 500_000
#: one of the many errors of a run may be beyond its 99 %, but not beyond this share of chance
IMPOSSIBLE = 1e-5

Rows = list[dict[str, Any]]
DOCS = Path(__file__).resolve().parents[1] / "docs"
SCHEMA = Draft202012Validator(json.loads((DOCS / "schema" / "result.json").read_text()))


def compared(project: Path) -> Rows:
    """The comparison with the truth of a run of a project."""
    result = CliRunner().invoke(app, ["run", str(project), "-q"])
    assert result.exit_code == 0, result.output
    report = json.loads((project.parent / "out" / "result.json").read_text())
    SCHEMA.validate(report)
    rows: Rows = report["scans"]["truth"]
    return rows


def of(rows: Rows, what: str) -> Rows:
    return [row for row in rows if row["what"] == what]


def jointly(rows: Rows, what: str) -> dict[str, Any]:
    (row,) = [row for row in of(rows, what) if row["name"] == "jointly"]
    return row


def every_target_is_found(rows: Rows, twin: Twin) -> None:
    """None missed, none invented, every name right, at every station."""
    counts = of(rows, "targets")
    assert [row["name"] for row in counts] == [s.name for s in twin.stations]
    assert [row["words"] for row in counts if not row["agrees"]] == []


def errors_are_possible(rows: Rows) -> None:
    """Own noise of points within its band; nothing that chance does not bring."""
    own = of(rows, "points of")
    assert own
    # few points of a fine scan tell their mean to some percent only
    assert [row["words"] for row in own if not row["agrees"]] == []
    for row in rows:
        if row["dof"]:
            far = chi2.sf(row["statistic"], row["dof"])
            assert far > IMPOSSIBLE, row
            assert row["name"] != "jointly" or far < 1 - IMPOSSIBLE, row


def few_boards(seed: int) -> Twin:
    """The laboratory, scanned in windows around its control and check targets."""
    twin = build("newcastle-lab", 10_000, seed)
    wanted = {f"T{k:02d}" for k in range(1, 53, 3)}
    boards = [target for target in twin.targets if target.name in wanted]
    scans = [fine_scan(s.name, s.pose, boards, FINE_STEP) for s in twin.stations]
    return replace(twin, scans=scans)


def fine_spheres(seed: int) -> Twin:
    """The courtyard, scanned in windows around its spheres."""
    twin = build("sphere-courtyard", 10_000, seed)
    return replace(twin, scans=[s for s in twin.scans if s.name.endswith("-targets")])


@pytest.mark.parametrize("make", [few_boards, fine_spheres])
def test_a_small_twin_agrees_with_its_truth(make: Any, tmp_path: Path) -> None:
    twin = make(1)
    rows = compared(write_twin(twin, tmp_path, truth=20_000))
    every_target_is_found(rows, twin)
    errors_are_possible(rows)
    assert sum(row["dof"] for row in of(rows, "points")) > 0
    assert all(jointly(rows, what)["agrees"] for what in ("stations", "points"))


@pytest.fixture(scope="module")
def known() -> dict[tuple[str, int], Rows]:
    """Comparisons that were made already."""
    return {}


def whole(name: str, seed: int, known: dict[tuple[str, int], Rows], folder: Path) -> Rows:
    """The comparison of a twin as the commands make it, once."""
    if (name, seed) not in known:
        words = ["simulate", name, "--out", str(folder), "--points", str(POINTS)]
        result = CliRunner().invoke(app, [*words, "--seed", str(seed), "-q"])
        assert result.exit_code == 0, result.output
        known[name, seed] = compared(folder / build(name, POINTS, seed).project_file)
    return known[name, seed]


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", sorted(TWINS))
def test_a_twin_agrees_with_its_truth(
    name: str, seed: int, known: dict[tuple[str, int], Rows], tmp_path: Path
) -> None:
    rows = whole(name, seed, known, tmp_path)
    every_target_is_found(rows, build(name, POINTS, seed))
    errors_are_possible(rows)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TWINS))
def test_errors_over_all_seeds_are_as_stated(
    name: str, known: dict[tuple[str, int], Rows], tmp_path: Path
) -> None:
    """Squares add up to chi-square, on both sides; at most one seed has anything beyond 99 %."""
    runs = [whole(name, seed, known, tmp_path / str(seed)) for seed in SEEDS]
    for what in ("stations", "points"):
        joint = [jointly(rows, what) for rows in runs]
        total, dof = (sum(row[key] for row in joint) for key in ("statistic", "dof"))
        assert chi2.ppf(0.005, dof) < total < chi2.ppf(0.995, dof), what
    assert sum(any(not row["agrees"] for row in rows) for rows in runs) <= 1
