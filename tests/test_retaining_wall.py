"""The retaining wall from scans to motions: both campaigns against their truth, and each other."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.geometry.pose import Pose
from tribrach.io.twins import write_twin
from tribrach.simulate.twins import build
from tribrach.simulate.twins.retaining_wall import FACE, HEIGHT, MOVED, PANELS, REFERENCES, ROAD

CAMPAIGNS = ("epoch1", "epoch2")


def done(*words: object) -> str:
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both campaigns, run."""
    where = tmp_path_factory.mktemp("wall")
    told: list[str] = []
    path = write_twin(build("retaining-wall", 10_000, 1), where, lambda *what: told.append(what[0]))
    assert path == where / "epoch1.toml"
    assert {"S1 of epoch1", "S1 of epoch2"} <= set(told)
    for name in CAMPAIGNS:
        done("run", where / f"{name}.toml", "-q")
    return where


def read(path: Path) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(path.read_text())
    return data


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_campaign_agrees_with_its_truth(folder: Path, name: str) -> None:
    """Stations, points and boards; of single points those of fine scans, as the others are few."""
    result = read(folder / "out" / name / "result.json")
    rows = result["scans"]["truth"]
    assert {row["what"] for row in rows} >= {"station", "stations", "point", "points", "targets"}
    # normals of so few points do not tell the incidence that the noise grows with
    coarse = [row for row in rows if row["what"] in ("points of", "cloud")]
    coarse = [row for row in coarse if not row["name"].endswith("-targets")]
    assert len(coarse) == 6
    judged = [row for row in rows if row not in coarse]
    assert [row for row in judged if not row["agrees"]] == []
    assert result["sigma0"]["global_test"]["accepted"]


def test_the_truth_holds_the_motions(folder: Path) -> None:
    truths = [read(folder / name / "truth" / "truth.json") for name in CAMPAIGNS]
    first, second = (truth["facts"]["panels"] for truth in truths)
    assert all(np.array_equal(panel["motion"], np.eye(4)) for panel in first.values())
    still = [name for name in PANELS if np.array_equal(second[name]["motion"], np.eye(4))]
    assert still == ["P3", "P5", "P6"]
    for name in ("P1", "P2"):
        motion = Pose.from_matrix(np.array(second[name]["motion"]))
        low, high = np.array(second[name]["face"])
        # about its foot: 4.5 m x 2.2 mrad at the top, towards the road
        assert np.allclose(motion @ low, low, atol=1e-12)
        assert (motion @ high - high)[1] == pytest.approx(-HEIGHT * np.sin(0.0022), abs=1e-12)
        assert (motion @ high - high)[2] == pytest.approx(-HEIGHT * (1 - np.cos(0.0022)), abs=1e-9)
    moved = {
        name: np.subtract(place, truths[0]["points"][name])
        for name, place in truths[1]["points"].items()
        if place != truths[0]["points"][name]
    }
    assert set(moved) == {"R5", "W1", "W2", "W4"}
    assert moved["R5"] == pytest.approx(MOVED["R5"])
    assert truths[1]["facts"]["moved"] == {"R5": list(MOVED["R5"])}


def test_points_on_panels_lie_where_the_motions_put_them() -> None:
    """True places on the front of a panel, carried back, are in the plane before the motion."""
    (twin,) = build("retaining-wall", 10_000, 2).later
    panels = twin.facts["panels"]
    first = len(twin.scene) - len(twin.targets) - len(PANELS)
    seen = set()
    for block in twin.measure(0):
        for k, name in enumerate(PANELS):
            on = block.truth[(block.primitive == first + k) & ~block.mixed]
            back = Pose.from_matrix(np.array(panels[name]["motion"])).inverse @ on
            front = back[(np.abs(back[:, 1] - FACE) < 0.05) & (back[:, 2] < ROAD + HEIGHT - 0.01)]
            edge = np.abs(front[:, 0] - np.array(panels[name]["face"])[:, :1]).min(axis=0)
            front = front[edge > 1e-6]
            assert np.abs(front[:, 1] - FACE).max(initial=0.0) < 1e-9
            seen |= {name} if len(front) > 20 else set()
    assert seen == set(PANELS)


def test_the_pillar_that_moved_is_named_and_no_other(folder: Path) -> None:
    chosen = [word for name in REFERENCES for word in ("--reference", name)]
    files = [folder / "out" / name / "epoch.json" for name in CAMPAIGNS]
    out = folder / "epochs.json"
    done("epochs", *files, *chosen, "--json", out, "-q")
    (found,) = read(out)["comparisons"]
    rows = found["points"]
    moved = {name for name, row in rows.items() if row["verdict"] == "moved"}
    assert moved == {"R5", "W1", "W2", "W4"}
    # run with [[epochs]], the second campaign says so itself
    (same,) = read(folder / "out" / "epoch2" / "result.json")["epochs"]
    verdicts = {name: row["verdict"] for name, row in same["points"].items()}
    assert {name for name, verdict in verdicts.items() if verdict == "moved"} == moved


def test_control_is_given_once_and_all_else_is_measured_again() -> None:
    twin = build("retaining-wall", 10_000, 5)
    (later,) = twin.later
    assert twin.files["control.csv"] == later.files["control.csv"]
    assert twin.files["epoch1/network.gsi"] != later.files["epoch2/network.gsi"]
    places = [[s.pose.translation for s in one.stations] for one in (twin, later)]
    assert (np.linalg.norm(np.subtract(*places), axis=1) > 0.5).all()
    seeds = {one.seed for k in (1, 2, 3) for one in [build("retaining-wall", 10_000, k)]}
    seeds |= {one.seed for k in (1, 2, 3) for one in build("retaining-wall", 10_000, k).later}
    assert len(seeds) == 6
