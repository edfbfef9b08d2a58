"""Where targets were sought and none was found: sizes, densities, candidates, units, and files."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from tests.cli.scan_jobs import SPHERES, cloud, points, project
from tests.targets.prints import alone, told
from tribrach.cli import app
from tribrach.errors import NothingFound
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.pipeline import run
from tribrach.scan.scan import Field
from tribrach.targets.checkerboards.search import find_checkerboards
from tribrach.targets.discs.search import find_discs
from tribrach.targets.sampling import LEAST, Sampling

RUN = CliRunner()
LIGHT = (Field("intensity", "float32", 0.0, 1.0),)


def stopped(job: Path) -> str:
    """What a run says that must be refused, on one line."""
    result = RUN.invoke(app, ["run", str(job)])
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    return " ".join(result.stderr.split())


def looked(path: Path, *arguments: object) -> str:
    """What the command targets says of a file, on one line."""
    result: Result = RUN.invoke(app, ["targets", str(path), *map(str, arguments)])
    assert result.exit_code == 0, result.output
    return " ".join(result.stdout.split())


@pytest.fixture(scope="module")
def balls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan with five spheres of 0.1 m."""
    return cloud(tmp_path_factory.mktemp("balls") / "S1.las", points())


@pytest.fixture
def job(balls: Path, tmp_path: Path) -> Path:
    """Their project."""
    (tmp_path / "S1.las").write_bytes(balls.read_bytes())
    return project(tmp_path, "S1.las")


def of_size(job: Path, size: float) -> None:
    """Look for spheres of another radius."""
    job.write_text(
        job.read_text().replace("sphere_radius_m = [0.1]", f"sphere_radius_m = [{size}]")
    )


class TestARunThatFindsNothing:
    def test_the_diameter_was_given(self, job: Path) -> None:
        of_size(job, 0.2)
        said = stopped(job)
        assert "there are no observations" not in said
        assert "no target was found in the scans of S1, and nothing else places this" in said
        assert "sought: sphere of radius 0.2 m; searched: S1" in said
        assert "is the radius of the sphere in metres, and the radius?" in said
        assert "5 of 0.1 m (as the diameter) in S1" in said

    @pytest.mark.parametrize(("size", "unit"), [(100.0, "millimetres"), (10.0, "centimetres")])
    def test_another_unit(self, job: Path, size: float, unit: str) -> None:
        of_size(job, size)
        said = stopped(job)
        assert f"{size:g} m is no usual size of one" in said
        assert f"5 of 0.1 m (in {unit}) in S1" in said

    def test_candidates_and_panoramas_are_there(self, job: Path) -> None:
        of_size(job, 0.08)
        said = stopped(job)
        assert re.search(r"candidates that were rejected \(\d+ for a sphere\)", said)
        assert "mm wide" in said or "own radius" in said or "residuals" in said
        place = job.parent / "out" / "targets"
        assert f"panoramas of the scans are in {place}" in said
        listed = json.loads((place / "targets.json").read_text())
        assert listed["targets"] == []
        centers = np.array([r["center"] for r in listed["rejected"]])
        gaps = np.linalg.norm(centers[:, None] - SPHERES, axis=2)
        assert (gaps.min(axis=0) < 0.1).all()  # all five were looked at
        assert (place / "1-S1.png").read_bytes().startswith(b"\x89PNG")
        assert {p.name for p in (job.parent / "out").iterdir()} == {".tribrach", "targets"}
        # what an earlier stop left does not outlive the run that finds them
        of_size(job, 0.08)
        job.write_text(job.read_text().replace("[0.08]", "[0.1]"))
        assert RUN.invoke(app, ["run", str(job), "-q"]).exit_code == 0
        assert len(json.loads((place / "targets.json").read_text())["targets"]) == 5

    def test_a_station_that_shows_none_beside_one_that_does(self, job: Path) -> None:
        bare = points(SPHERES, seed=2)
        near = np.linalg.norm(bare[:, None] - SPHERES, axis=2).min(axis=1) < 0.25
        cloud(job.parent / "S2.las", bare[~near])
        job.write_text(job.read_text() + '[[scans]]\nfile = "S2.las"\norigin = "scanner"\n')
        with pytest.raises(NothingFound, match="in the scans of S2, and nothing else") as caught:
            run(job)
        assert not any("S1" in sentence for sentence in caught.value.sentences)
        assert "points per degree" in str(caught.value)
        assert (job.parent / "out" / "targets" / "2-S2.png").is_file()

    def test_a_file_of_others_is_not_replaced(self, job: Path) -> None:
        of_size(job, 0.2)
        place = job.parent / "out" / "targets" / "targets.json"
        place.parent.mkdir(parents=True)
        place.write_text("mine")
        assert "Targets and candidates could not be written" in stopped(job)
        assert place.read_text() == "mine"


class TestDensity:
    def test_least_points_are_those_of_the_searches(self) -> None:
        """40, 8 and 30 points, on a square or on the circle within it."""
        assert LEAST["checkerboard"].even == pytest.approx(np.sqrt(40))
        assert LEAST["disc"].even == pytest.approx(np.sqrt(8 * 4 / np.pi))
        assert LEAST["sphere"].even == pytest.approx(np.sqrt(30 * 4 / np.pi))

    def test_reach_by_hand(self) -> None:
        even = Sampling(1e-3, 1e-3, 8.0)
        assert even.reach("checkerboard", 0.3) == pytest.approx(0.3 / (1e-3 * np.sqrt(40)))
        uneven = Sampling(4e-3, 0.5e-3, 8.0)  # the coarser step decides
        assert uneven.reach("checkerboard", 0.3) == pytest.approx(0.3 / (4e-3 * 1.3 / 0.22))
        said = even.sentence("sphere", 0.145, 30.0)
        assert said.startswith("30.0 m, one takes 22.3 points per degree (30 on it) at least")
        assert "; 17.5 across and 17.5 down (18 on it) are there and are too few" in said
        assert said.endswith("they reach 23.5 m")

    @pytest.mark.parametrize(
        ("kind", "search", "size"),
        [("board", find_checkerboards, 0.3), ("disc", find_discs, 0.15)],
    )
    def test_nothing_is_found_beyond_the_reach(self, kind: str, search, size: float) -> None:
        """The stated density is necessary, and not far from what is enough."""
        name = "checkerboard" if kind == "board" else kind
        whole = size if kind == "board" else 2 * size
        found = {0.9: 0, 2.0: 0}
        for share in found:
            pitch = whole / LEAST[name].even / share
            for seed in range(10):
                _, xyz, light, image = alone(kind, 10.0, 0.1, size, pitch, seed)
                reach = Sampling.of(image).reach(name, whole)
                assert reach == pytest.approx(10.0 * share, rel=0.05)
                found[share] += len(search(xyz, light, image, [size], **told(search))[0])
        assert found[0.9] == 0
        assert found[2.0] >= 9


class TestTheCommand:
    def test_a_board_that_is_too_far(self, tmp_path: Path) -> None:
        _, xyz, light, _ = alone("board", 40.0, 0.1, 0.3, 0.08, 1)
        with create(tmp_path / "far.las", CloudHeader("far", LIGHT, 1e-5)) as writer:
            writer.write(xyz, {"intensity": light})
        said = looked(tmp_path / "far.las", "--checkerboard", 0.3, "--origin", 0, 0, 0)
        assert "? far: no checkerboard of side 0.3 m" in said
        assert "are too few: they reach" in said

    def test_the_diameter_of_a_sphere(self, balls: Path) -> None:
        said = looked(balls, "--sphere", 0.2, "--origin", 0, 0, 0)
        assert "5 of 0.1 m (as the diameter) in S1" in said
        assert "?" not in looked(balls, "--sphere", 0.1, "--origin", 0, 0, 0)
