"""Commands on scans: what every option does; one sentence and status 2 for bad input."""

import json
from pathlib import Path

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from tests.targets.prints import alone
from tribrach.cli import app
from tribrach.cli import simulate as simulations
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.scan.scan import Field
from tribrach.simulate.twins import build

RUN = CliRunner()
#: a scan of 40 x 30 directions at a pose 100 m away, written as PTX
SHIFT = np.array([100.0, 200.0, 5.0])
RADIUS = 0.1
CENTER = np.array([3.0, 1.0, 0.2])


def invoke(*arguments: object) -> Result:
    return RUN.invoke(app, [str(a) for a in arguments])


def works(*arguments: object) -> str:
    result = invoke(*arguments)
    assert result.exit_code == 0, result.output
    return result.stdout


def fails(*arguments: object) -> str:
    """Standard error, on one line, of a call that must end with 2 and leave nothing."""
    result = invoke(*arguments)
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    words = result.stderr.replace("│", " ").split()
    assert words
    return " ".join(words)


def ptx(path: Path, scans: int = 1) -> np.ndarray:
    """Scans of one cloud of points, each placed another 100 m further; the points."""
    rng = np.random.default_rng(5)
    xyz = np.round(rng.uniform(-20, 20, (60, 3)), 4)
    text = ""
    for k in range(1, scans + 1):
        x, y, z = k * SHIFT
        text += (
            f"10\n6\n{x} {y} {z}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{x} {y} {z} 1\n"
        )
        text += "".join(f"{a} {b} {c} 0.5\n" for a, b, c in xyz)
    path.write_text(text)
    return xyz


def coordinates(path: Path) -> np.ndarray:
    """Points of a LAS file in a canonical order."""
    xyz = np.array(laspy.read(path).xyz)
    return xyz[np.lexsort(xyz.T)]


def ordered(xyz: np.ndarray) -> np.ndarray:
    return xyz[np.lexsort(xyz.T)]


class TestConvert:
    @pytest.mark.parametrize("suffix", [".las", ".laz", ".copc.laz"])
    def test_points_as_they_are_or_placed(self, tmp_path: Path, suffix: str) -> None:
        xyz = ptx(tmp_path / "a.ptx")
        said = works("convert", tmp_path / "a.ptx", tmp_path / f"b{suffix}")
        assert f"b{suffix}: 60 points" in said
        assert coordinates(tmp_path / f"b{suffix}") == pytest.approx(ordered(xyz), abs=0.51e-4)
        works("convert", tmp_path / "a.ptx", tmp_path / f"c{suffix}", "--placed")
        found = coordinates(tmp_path / f"c{suffix}")
        assert found == pytest.approx(ordered(xyz + SHIFT), abs=0.51e-4)

    def test_several_scans_and_the_step(self, tmp_path: Path) -> None:
        xyz = ptx(tmp_path / "a.ptx", scans=2)
        said = works("convert", tmp_path / "a.ptx", tmp_path / "b.las", "--step-mm", "10")
        assert said.count("60 points") == 2
        for number in (1, 2):
            with laspy.open(tmp_path / f"b-{number}.las") as file:
                assert file.header.scales == pytest.approx([0.01] * 3)
            found = laspy.read(tmp_path / f"b-{number}.las").xyz
            assert np.array(found) == pytest.approx(xyz, abs=0.00501)
            assert np.abs(found - xyz).max() > 1e-3

    @pytest.mark.parametrize("option", ["--quiet", "-q"])
    def test_quiet(self, tmp_path: Path, option: str) -> None:
        ptx(tmp_path / "a.ptx")
        assert invoke("convert", tmp_path / "a.ptx", tmp_path / "b.ply", option).output == ""
        assert (tmp_path / "b.ply").is_file()

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("absent.las", "b.laz"), "there is no such file"),
            (("a.ptx", "b.xyzzy"), "no cloud is written with the suffix '.xyzzy'"),
            (("a.ptx", "b"), "no cloud is written"),
            (("a.ptx", "file/b.laz"), "cannot be written"),
            (("a.ptx", "folder.laz"), "this is a folder"),
            (("a.las", "a.las"), "take the place of a file that is read"),
            (("a.las", "b.laz", "--placed"), "scan a has no pose to be placed by"),
            (("empty.las", "b.laz"), "the file is empty"),
            (("cut.las", "b.laz"), "cut.las"),
            (("cut.ptx", "b.laz"), "cut.ptx"),
            (("a.ptx", "b.laz", "--step-mm", "0"), "--step-mm"),
            (("a.ptx", "b.laz", "--step-mm", "-1"), "--step-mm"),
            (("a.ptx", "b.laz", "--step-mm", "nan"), "--step-mm"),
            (("a.ptx", "b.laz", "--step-mm", "11"), "--step-mm"),
            (("a.ptx", "b.laz", "--step-mm", "fine"), "--step-mm"),
            (("far.ptx", "b.laz", "--step-mm", "0.001"), "do not fit steps"),
            (("a.ptx",), "Missing argument"),
            (("a.ptx", "b.laz", "--fast"), "No such option"),
        ],
    )
    def test_bad_input(
        self,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        arguments: tuple[str, ...],
        words: str,
    ) -> None:
        monkeypatch.chdir(tmp_path)
        ptx(Path("a.ptx"))
        Path("cut.ptx").write_text(Path("a.ptx").read_text()[:500])
        Path("far.ptx").write_text(Path("a.ptx").read_text().replace("\n-", "\n-9999"))
        works("convert", "a.ptx", "a.las", "-q")
        Path("cut.las").write_bytes(Path("a.las").read_bytes()[:-100])
        Path("empty.las").touch()
        Path("file").touch()
        Path("folder.laz").mkdir()
        before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
        assert words in fails("convert", *arguments)
        assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before

    def test_ctrl_c(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        def interrupted(*arguments: object, **options: object) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr("tribrach.questions.convert.convert_scans", interrupted)
        ptx(tmp_path / "a.ptx")
        result = invoke("convert", tmp_path / "a.ptx", tmp_path / "b.laz")
        assert result.exit_code == 130
        assert not (tmp_path / "b.laz").exists()


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sphere of 0.1 m before a wall, 0.5 mm of noise in range."""
    rng = np.random.default_rng(3)
    turn, rise = np.meshgrid(np.linspace(-0.2, 0.8, 500), np.linspace(-0.3, 0.4, 350))
    ray = np.stack(
        [np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)], axis=-1
    ).reshape(-1, 3)
    along = ray @ CENTER
    miss = CENTER @ CENTER - along**2
    hits = miss < RADIUS**2
    wall = 6.0 / ray[:, 0]
    range_ = np.where(hits, along - np.sqrt(np.where(hits, RADIUS**2 - miss, 0)), wall)
    range_ += rng.normal(scale=0.5e-3, size=len(range_))
    intensity = np.where(hits, 0.9, 0.4) + rng.normal(scale=0.01, size=len(range_))
    path = tmp_path_factory.mktemp("ball") / "ball.las"
    fields = (Field("intensity", "float32", 0.0, 1.0),)
    with create(path, CloudHeader("ball", fields, 1e-5)) as writer:
        writer.write(ray * range_[:, None], {"intensity": intensity.astype(np.float32)})
    return path


class TestTargets:
    def test_a_sphere_is_found_and_written(self, ball: Path, tmp_path: Path) -> None:
        made = tmp_path / "found.json", tmp_path / "found.png"
        said = works("targets", ball, "--sphere", RADIUS, "--json", made[0], "--png", made[1])
        assert "ball: 175000 points, 1 targets" in said
        data = json.loads(made[0].read_text())
        assert set(data) == {"tribrach", "schema", "targets", "rejected"}
        (found,) = data["targets"]
        keys = [
            "kind",
            "scan",
            "center",
            "covariance",
            "radius",
            "rms",
            "points",
            "range",
            "incidence",
        ]
        assert set(keys) <= set(found)
        assert (found["kind"], found["scan"]) == ("sphere", "ball")
        assert np.linalg.norm(np.array(found["center"]) - CENTER) < 3e-4
        assert found["range"] == pytest.approx(np.linalg.norm(CENTER), abs=1e-3)
        assert np.linalg.eigvalsh(found["covariance"]).min() > 0
        assert made[1].read_bytes().startswith(b"\x89PNG")

    def test_several_sizes_and_kinds(self, ball: Path, tmp_path: Path) -> None:
        made = tmp_path / "found.json"
        sizes = ("--sphere", 0.3, "--sphere", RADIUS, "--checkerboard", 0.3, "--disc", 0.05)
        assert invoke("targets", ball, *sizes, "--json", made, "-q").output == ""
        radii = [t["radius"] for t in json.loads(made.read_text())["targets"]]
        assert radii == pytest.approx([RADIUS], abs=1e-6)

    def test_nothing_found_is_a_result(self, ball: Path) -> None:
        assert "0 targets" in works("targets", ball, "--checkerboard", 0.3)

    def test_a_board_cut_out_of_a_scan_is_measured_from_its_scanner(self, tmp_path: Path) -> None:
        """Its scanner is far outside its points: said with zeros, in its own or any coordinates."""
        center, xyz, light, _ = alone("board", 40.0, 0.3, 0.3, 8e-3, 1)
        part = np.linalg.norm(xyz - center, axis=1) < 0.3
        at = np.array([650.0, -410.0, 30.0])
        fields = (Field("intensity", "float32", 0.0, 1.0),)
        for name, shift in (("own", np.zeros(3)), ("placed", at)):
            with create(tmp_path / f"{name}.las", CloudHeader(name, fields, 1e-5)) as writer:
                writer.write(xyz[part] + shift, {"intensity": light[part]})
        asked = "targets", tmp_path / "own.las", "--checkerboard", 0.3
        assert "or --origin 0 0 0 if those of the file are the scanner's own" in fails(*asked)
        for file, origin in (("own", np.zeros(3)), ("placed", at)):
            made = tmp_path / f"{file}.json"
            place = ("--checkerboard", 0.3, "--origin", *origin, "--json", made)
            works("targets", tmp_path / f"{file}.las", *place)
            (found,) = json.loads(made.read_text())["targets"]
            error = np.array(found["center"]) - center - origin
            assert error @ np.linalg.solve(found["covariance"], error) < 16.3  # 99.9 %
            assert found["range"] == pytest.approx(40.0, abs=0.02)
        far = "targets", tmp_path / "own.las", "--checkerboard", 0.3, "--origin"
        assert "if these are the scanner's own" in fails(*far, 400, 0, 0)
        with create(tmp_path / "map.las", CloudHeader("map", fields, 1e-5)) as writer:
            writer.write(xyz[part] + [5e3, 9e3, 0], {"intensity": light[part]})
        zero = "targets", tmp_path / "map.las", "--checkerboard", 0.3, "--origin", 0, 0, 0
        assert "these are not the scanner's own coordinates" in fails(*zero)

    def test_pictures_of_several_scans_are_numbered(self, tmp_path: Path) -> None:
        ptx(tmp_path / "a.ptx", scans=2)
        works("targets", tmp_path / "a.ptx", "--sphere", 0.1, "--png", tmp_path / "p.png", "-q")
        assert {p.name for p in tmp_path.glob("*.png")} == {"p-1.png", "p-2.png"}

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("ball.las",), "give --sphere, --checkerboard or --disc"),
            (("ball.las", "--sphere", "0"), "--sphere"),
            (("ball.las", "--sphere", "-0.1"), "--sphere"),
            (("ball.las", "--sphere", "nan"), "--sphere"),
            (("ball.las", "--sphere", "145"), "--sphere"),
            (("ball.las", "--checkerboard", "11"), "--checkerboard"),
            (("ball.las", "--disc", "wide"), "--disc"),
            (("absent.las", "--sphere", "0.1"), "there is no such file"),
            (("empty.las", "--sphere", "0.1"), "the file is empty"),
            (("none.las", "--sphere", "0.1"), "none.las"),
            (("cut.las", "--sphere", "0.1"), "cut.las"),
            (("ball.las", "--sphere", "0.1", "--json", "cut.las/x.json"), "cannot be written"),
            (("ball.las", "--sphere", "0.1", "--png", "cut.las/x.png"), "cannot be written"),
        ],
    )
    def test_bad_input(
        self,
        ball: Path,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        arguments: tuple[str, ...],
        words: str,
    ) -> None:
        monkeypatch.chdir(tmp_path)
        Path("ball.las").symlink_to(ball)
        Path("cut.las").write_bytes(ball.read_bytes()[:-100_000])
        Path("empty.las").touch()
        with create(Path("none.las"), CloudHeader("none")):
            pass
        before = sorted(tmp_path.iterdir())
        assert words in fails("targets", *arguments)
        assert sorted(tmp_path.iterdir()) == before


class TestSimulate:
    @pytest.fixture
    def asked(self, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int, int]]:
        """What twin was asked for; a small one is made of it."""
        heard = []

        def small(name: str, points: int, seed: int) -> object:
            heard.append((name, points, seed))
            return build(name, 10_000, seed)

        monkeypatch.setattr(simulations, "build", small)
        return heard

    def test_a_project_is_written(self, tmp_path: Path, asked: list[tuple[str, int, int]]) -> None:
        said = works("simulate", "newcastle-lab", "--out", tmp_path / "new" / "lab")
        assert asked == [("newcastle-lab", 1_000_000, 1)]
        path = tmp_path / "new" / "lab" / "newcastle-lab.toml"
        assert said.splitlines() == [str(path), f"now: tribrach run {path}"]
        assert (path.parent / "truth" / "truth.json").is_file()
        assert len(list((path.parent / "scans").iterdir())) == 4

    def test_points_and_seed(self, tmp_path: Path, asked: list[tuple[str, int, int]]) -> None:
        def simulated(folder: str, *more: object) -> dict[str, bytes]:
            out = tmp_path / folder
            assert invoke("simulate", "sphere-courtyard", "--out", out, "-q", *more).output == ""
            paths = [out / "scans" / "S1.laz", out / "gnss.csv"]
            return {path.name: path.read_bytes() for path in paths}

        first = simulated("a", "--seed", 3, "--points", 20_000)
        again = simulated("b", "--seed", 3, "--points", 20_000)
        other = simulated("c", "--seed", 4, "--points", 20_000)
        assert asked == [("sphere-courtyard", 20_000, seed) for seed in (3, 3, 4)]
        assert first == again
        assert all(first[name] != other[name] for name in first)

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("atlantis", "--out", "x"), "there is no twin 'atlantis'; choose from hanoi-facade"),
            (("newcastle-lab",), "--out"),
            (("newcastle-lab", "--out", "x", "--points", "9999"), "--points"),
            (("newcastle-lab", "--out", "x", "--points", "1e6"), "--points"),
            (("newcastle-lab", "--out", "x", "--points", "200000001"), "--points"),
            (("newcastle-lab", "--out", "x", "--seed", "-1"), "--seed"),
            (("newcastle-lab", "--out", "file", "--points", "10000"), "cannot be written"),
        ],
    )
    def test_bad_input(
        self,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        arguments: tuple[str, ...],
        words: str,
    ) -> None:
        monkeypatch.chdir(tmp_path)
        Path("file").touch()
        assert words in fails("simulate", *arguments)
        assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("command", ["convert", "targets", "simulate", "info"])
def test_help_names_every_option(command: str) -> None:
    text = works(command, "--help").replace("_", "-")
    if command != "info":
        assert "--quiet" in text
