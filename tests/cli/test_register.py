"""The command register: files in, poses with covariances out; refusals as sentences."""

import csv
import json
import re
from pathlib import Path
from shutil import copyfile

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.registration.clouds.scenes import NOISE, error, points_of, yard
from tests.registration.clouds.test_reference import ORIGIN, model
from tribrach.cli import app
from tribrach.geometry.pose import Pose
from tribrach.io.keeping import keep, keeping
from tribrach.io.outputs import write_text
from tribrach.io.scans.formats import read_scans
from tribrach.job.poses import read_poses
from tribrach.simulate.setups import levelled

RUN = CliRunner()
PLACES = ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5), (2.0, 8.0, -1.4))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three scans of the yard as PLY, one as E57 too, and their true poses."""
    place = tmp_path_factory.mktemp("register")
    rng = np.random.default_rng(1)
    poses = []
    for k, (x, y, heading) in enumerate(PLACES):
        pose = levelled((x, y, 1.6), heading, 5e-5, rng)
        xyz = points_of(yard(), pose, 50_000, k)
        np.savetxt(place / f"S{k + 1}.xyz", xyz, fmt="%.4f")
        poses.append(pose.matrix.tolist())
    for k in (1, 2):
        source = place / f"S{k}.xyz"
        result = RUN.invoke(app, ["convert", str(source), str(place / f"E{k}.e57"), "-q"])
        assert result.exit_code == 0, result.output
    (place / "truth.json").write_text(json.dumps(poses))
    assert NOISE.range == 0.001
    return place


def true_poses(folder: Path) -> list[Pose]:
    return [Pose.from_matrix(np.array(m)) for m in json.loads((folder / "truth.json").read_text())]


def test_three_scans_from_nothing(folder: Path) -> None:
    out = folder / "out"
    files = [str(folder / f"S{k}.xyz") for k in (1, 2, 3)]
    call = ["register", *files, "--out", str(out), "--json", str(folder / "found.json")]
    result = RUN.invoke(app, call)
    assert result.exit_code == 0, result.output
    assert "S1 - S2 - S3 - S1" in result.output
    true = true_poses(folder)
    data = json.loads((folder / "found.json").read_text())
    assert data["schema"] == 1
    assert [p["registered"] for p in data["pairs"]] == [True] * 3
    assert [loop["closes"] for loop in data["loops"]] == [True]
    (group,) = data["groups"]
    assert group["frame_of"] == "S1"
    for k, name in enumerate(("S1", "S2", "S3")):
        one = group["stations"][name]
        found = Pose.from_matrix(np.array(one["world_from_scanner"]))
        assert error(found, true[0].inverse @ true[k])[0] < 1e-3
        covariance = np.array(one["covariance"])
        assert (np.diag(covariance) > 0).all() == (name != "S1")
    poses = read_poses(out / "poses.json")
    assert poses.stations == ("S1", "S2", "S3")
    assert poses.shared is not None
    assert poses.shared.covariance.shape == (18, 18)
    with (out / "poses.csv").open() as file:
        assert [row["scan"] for row in csv.DictReader(file)] == ["S1", "S2", "S3"]


def test_another_registration_is_not_replaced(folder: Path, tmp_path: Path) -> None:
    with keeping(command="register"):
        keep(folder=tmp_path, kind="of S8.xyz, S9.xyz")
        write_text(tmp_path / "poses.json", "{}")
    files = [str(folder / f"S{k}.xyz") for k in (1, 2)]
    result = RUN.invoke(app, ["register", *files, "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "of S8.xyz, S9.xyz wrote this file" in result.output.replace("\n", " ")
    assert (tmp_path / "poses.json").read_text() == "{}"


def test_e57_files_get_their_poses(folder: Path) -> None:
    out = folder / "placed"
    files = [str(folder / f"E{k}.e57") for k in (1, 2)]
    result = RUN.invoke(app, ["register", *files, "--out", str(out)])
    assert result.exit_code == 0, result.output
    true = true_poses(folder)
    (second,) = read_scans(out / "E2.e57")
    assert second.pose is not None
    assert error(second.pose, true[0].inverse @ true[1])[0] < 1e-3


def test_one_scan_is_refused(folder: Path) -> None:
    result = RUN.invoke(app, ["register", str(folder / "S1.xyz")])
    assert result.exit_code == 2
    assert "there is one scan in these files; give at least two scans" in result.output


def test_a_cloud_of_the_world_is_refused(folder: Path, tmp_path: Path) -> None:
    away = tmp_path / "away.xyz"
    xyz = np.loadtxt(folder / "S2.xyz")[:2000] + np.array([5000.0, 7000.0, 100.0])
    np.savetxt(away, xyz, fmt="%.3f")
    result = RUN.invoke(app, ["register", str(folder / "S1.xyz"), str(away)])
    assert result.exit_code == 2
    assert "it is not known where the scanner stood" in result.output


def test_the_same_file_twice_is_refused(folder: Path) -> None:
    result = RUN.invoke(app, ["register", str(folder / "S1.xyz"), str(folder / "S1.xyz")])
    assert result.exit_code == 2
    assert "two scans have the name" in result.output


def test_nothing_is_written_where_nothing_hangs_together(folder: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    flat = rng.uniform((-3, -3, -1.5), (3, 3, -1.5), (20_000, 3))
    lone = tmp_path / "lone.xyz"
    np.savetxt(lone, flat + rng.normal(0, 1e-3, flat.shape), fmt="%.4f")
    out = tmp_path / "out"
    result = RUN.invoke(app, ["register", str(folder / "S1.xyz"), str(lone), "--out", str(out)])
    assert result.exit_code == 2
    assert "no two scans could be joined" in result.output
    alone = RUN.invoke(app, ["register", str(folder / "S1.xyz"), str(lone)])
    assert alone.exit_code == 0
    words = " ".join(alone.output.split())
    assert "S1 and lone" in words
    assert "lone is not joined to S1 by clouds" in words
    assert not (out / "poses.csv").exists()


def test_poses_beside_the_scans_are_proposals_and_no_observations(
    folder: Path, tmp_path: Path
) -> None:
    """With them and without them the poses are the same; wrong ones are told by how much."""
    true = true_poses(folder)
    files = []
    for k in (1, 2):
        source = tmp_path / f"S{k}.xyz"
        source.write_bytes((folder / f"S{k}.xyz").read_bytes())
        files.append(str(source))
        moved = Pose(true[k - 1].rotation, true[k - 1].translation + np.array([0.3, 0.1, 0.0]) * k)
        np.savetxt(tmp_path / f"S{k}_pose.txt", moved.matrix)

    def found(*more: str) -> tuple[Pose, str]:
        out = tmp_path / "found.json"
        result = RUN.invoke(app, ["register", *files, "--json", str(out), *more])
        assert result.exit_code == 0, result.output
        (group,) = json.loads(out.read_text())["groups"]
        pose = group["stations"]["S2"]["world_from_scanner"]
        return Pose.from_matrix(np.array(pose)), " ".join(result.output.split())

    blind, words = found("--no-approximate")
    assert "approximate poses" not in words
    helped, words = found()
    assert "approximate poses of 2 scans (beside the scans: matrix, world from scanner" in words
    assert "is wrong by" not in words
    assert error(blind, helped)[0] < 1e-4
    # the same poses, said to be good to 5 cm, are wrong
    _, words = found("--pose-sigma-m", "0.05")
    assert "the approximate pose of S2 in S1 is wrong by 0.3 m" in words
    listed = tmp_path / "poses.txt"
    rows = [true[k].matrix[:3].ravel() for k in range(3)]
    np.savetxt(listed, rows)
    result = RUN.invoke(app, ["register", *files, "--poses", str(listed)])
    assert result.exit_code == 0
    words = " ".join(result.output.split())
    # S1 and S2 are the second and the third line of three
    assert "poses.txt: a matrix in each line" in words
    assert "is wrong by" in words
    np.savetxt(listed, rows[:1])
    result = RUN.invoke(app, ["register", *files, "--poses", str(listed)])
    assert result.exit_code == 2
    assert "the file has one pose, there are 2 scans" in " ".join(result.output.split())


def test_clouds_with_sigmas_and_a_page(folder: Path, tmp_path: Path) -> None:
    """Points of both clouds lie where the true poses put them, with the sigmas of the scanner."""
    files = [str(folder / f"S{k}.xyz") for k in (1, 2, 3)]
    out, page = tmp_path / "out", tmp_path / "page.html"
    call = ["register", *files, "--out", str(out), "--clouds", "laz", "--html", str(page)]
    result = RUN.invoke(app, [*call, "--instrument", "Leica RTC360"])
    assert result.exit_code == 0, result.output
    assert "no sigmas" not in result.output
    true = true_poses(folder)
    given = np.loadtxt(folder / "S2.xyz")
    with laspy.open(out / "S2.laz") as file:
        cloud = file.read()
    assert len(cloud.points) == len(given)
    off = cloud.xyz - true[0].inverse @ (true[1] @ given)
    assert np.abs(off).max() < 5e-3
    sigma = np.stack([np.asarray(cloud[name]) for name in ("sigma_x", "sigma_y", "sigma_z")])
    assert (sigma > 3e-4).all()
    np.testing.assert_allclose(np.linalg.norm(sigma, axis=0), cloud["sigma"], rtol=0.02)
    text = page.read_text()
    for words in ("3 of 3 pairs that were tried", "1 of 1 loop closes", "Verdicts", "Stations"):
        assert words in text
    drawn = text.split('id="plan-1"')[1].split("</figure>")[0]
    assert drawn.count('class="station"') == 3
    assert drawn.count("times its limit") == 3
    # a second run leaves its own clouds as they are, and replaces nobody else's
    before = (out / "S2.laz").stat().st_mtime_ns
    assert RUN.invoke(app, [*call, "--instrument", "Leica RTC360"]).exit_code == 0
    assert (out / "S2.laz").stat().st_mtime_ns == before
    other = tmp_path / "other"
    other.mkdir()
    (other / "S1.laz").write_bytes(b"mine")
    call[call.index(str(out))] = str(other)
    result = RUN.invoke(app, call)
    assert result.exit_code == 2
    assert "a file of this name that this program did not write" in result.output
    assert (other / "S1.laz").read_bytes() == b"mine"
    assert not (other / "poses.csv").exists()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--clouds", "laz"], "clouds need a folder; name it with --out"),
        (["--merged"], "--merged and --instrument are of clouds"),
        (["--out", "x", "--clouds", "e57", "--merged"], "one scan per file"),
        (["--out", "x", "--clouds", "laz", "--instrument", "Leica NA2"], "Leica NA2"),
        (["--poses", "nowhere.txt"], "nowhere.txt: the file cannot be read"),
    ],
)
def test_what_cannot_be_is_said_before_any_work(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, more: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    files = [str(folder / f"S{k}.xyz") for k in (1, 2)]
    result = RUN.invoke(app, ["register", *files, *more])
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())
    assert "points of" not in result.output


def obj_of(mesh, path: Path, scale: float = 1.0) -> None:
    """A model with its elements as objects."""
    lines, count = [], 0
    for k, name in enumerate(mesh.names):
        lines.append(f"o {name}")
        for triangle in mesh.triangles[mesh.element == k]:
            lines += ["v {:.13g} {:.13g} {:.13g}".format(*corner * scale) for corner in triangle]
            lines.append(f"f {count + 1} {count + 2} {count + 3}")
            count += 3
    path.write_text("\n".join(lines))


@pytest.mark.parametrize("known", [True, False])
def test_scans_on_a_model(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, known: bool
) -> None:
    """As the page on references has it; or in millimetres, without approximate poses."""
    obj_of(model(), tmp_path / "town.obj", 1.0 if known else 1000.0)
    (tmp_path / "near").mkdir()
    for k, pose in enumerate(true_poses(folder)[:2]):
        moved = np.array(pose.matrix)
        moved[:3, 3] += ORIGIN + np.array([0.2, -0.1, 0.1])
        np.savetxt(tmp_path / "near" / f"S{k + 1}.pose", moved)
        copyfile(folder / f"S{k + 1}.xyz", tmp_path / f"S{k + 1}.xyz")
    page = (Path(__file__).parents[2] / "docs" / "references.md").read_text()
    (shown,) = re.findall(r"^tribrach (register .*)$", page, re.MULTILINE)
    call = shown.split()
    if not known:
        at = call.index("--poses")
        call[at : at + 2] = ["--reference-unit", "mm"]
    monkeypatch.chdir(tmp_path)
    result = RUN.invoke(app, call)
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "placed.json").read_text())
    group = data["groups"][0]
    assert group["frame_of"] == "town", data["sentences"]
    assert [(o["name"], o["prior"], o["dof"]) for o in data["offsets"]] == [("town", 0.02, 0)]
    assert {on["scan"] for on in data["placed_on"]} == {"S1", "S2"}, data["sentences"]
    for k, true in enumerate(true_poses(folder)[:2]):
        found = group["stations"][f"S{k + 1}"]
        pose = Pose.from_matrix(np.array(found["world_from_scanner"]))
        shift, turn = error(pose, Pose(true.rotation, true.translation + ORIGIN))
        assert shift < 0.01
        assert turn < 1e-3
        sigma = np.sqrt(np.diag(found["covariance"]))[:3]
        assert (sigma > 0.02).all()
        assert (sigma < 0.03).all()
    placed = {s.scan: s.placement for s in read_poses(tmp_path / "placed" / "poses.json").scans}
    assert set(placed) == {"S1", "S2"}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--reference", "nothing.obj"], "no such file"),
        (["--reference", "flat.obj"], "has an area"),
        (["--reference", "small.obj"], "pieces of surface"),
        (["--reference", "small.obj", "--reference-unit", "cubits"], "no unit"),
        ([], "one scan"),
    ],
)
def test_wrong_references(folder: Path, tmp_path: Path, options: list[str], words: str) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    (tmp_path / "small.obj").write_text("v 0 0 0\nv .3 0 0\nv 0 .3 0\nf 1 2 3\n")
    placed = [str(tmp_path / o) if o.endswith(".obj") else o for o in options]
    result = RUN.invoke(app, ["register", str(folder / "S1.xyz"), *placed])
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())
    assert "Traceback" not in result.output
