"""The command compare: figures as JSON, page and table; bad input is one sentence and status 2."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from lxml import html as parser

from tests.cli.test_scans_cli import fails, works
from tests.comparison.clouds import lattice_floor
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader

NOISE, OFFSET = 0.002, 0.003
SCANNERS = {"S1": (2.0, -12.0, 1.5), "S2": (6.0, -15.0, 1.8)}
FAR = np.array([505_000.0, 2_331_000.0, 0.0])
SITES = "name,x,y,z,radius\nleft,505002,2331000,1.5,0.8\nright,505004,2331000,1.5,0.8\n"


def wall(across: float, up: float, turn: float, offset: float, seed: int) -> np.ndarray:
    """A noisy wall of 6 by 3 m in UTM coordinates, its columns turned by an angle."""
    rng = np.random.default_rng(seed)
    x, z = np.meshgrid(np.arange(-4, 10, across), np.arange(-6, 9, up), indexing="ij")
    y = offset + NOISE * rng.normal(size=x.shape)
    c, s = np.cos(turn), np.sin(turn)
    points = np.stack([c * x - s * z, y, s * x + c * z], axis=-1).reshape(-1, 3)
    inside = (points[:, [0, 2]] > 0).all(axis=1) & (points[:, 0] < 6) & (points[:, 2] < 3)
    return points[inside] + FAR


def written(path: Path, points: np.ndarray, crs: str | None = None) -> Path:
    header = CloudHeader(path.stem, step=1e-4, offset=np.round(points.mean(axis=0), -2), crs=crs)
    with create(path, header) as writer:
        writer.write(points, {})
    return path


def poses(path: Path, names: dict[str, tuple[float, float, float]]) -> Path:
    rows = []
    for name, place in names.items():
        matrix = np.eye(4)
        matrix[:3, 3] = FAR + place
        rows.append({"scan": name, "file": f"{name}.ptx", "world_from_scanner": matrix.tolist()})
    path.write_text(json.dumps({"schema": 1, "scans": rows}))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two clouds of one wall with their poses, and sites on it."""
    place = tmp_path_factory.mktemp("compare")
    written(place / "S1.laz", wall(0.021, 0.023, 0.3, -OFFSET, 1))
    written(place / "S2.laz", wall(0.020, 0.025, 0.0, 0.0, 2))
    poses(place / "poses.json", SCANNERS)
    (place / "sites.csv").write_text(SITES)
    return place


def test_sites(folder: Path, tmp_path: Path) -> None:
    out, page = tmp_path / "c.json", tmp_path / "c.html"
    said = works("compare", folder / "S1.laz", folder / "S2.laz", "--sites", folder / "sites.csv",
                 "--json", out, "--html", page)  # fmt: skip
    data = json.loads(out.read_text())
    assert (data["a"], data["b"], data["limit"]) == ("S1.laz", "S2.laz", 0.2)
    left, right = data["sites"]
    assert (left["name"], right["name"]) == ("left", "right")
    for site, x in ((left, 2.0), (right, 4.0)):
        assert site["n"] == pytest.approx(np.pi * 0.8**2 / (0.021 * 0.023), rel=0.02)
        c2c, m3c2 = site["c2c"], site["m3c2"]
        floor = lattice_floor(0.020, 0.025)
        assert c2c["n"] == site["n"]
        assert (c2c["floor_mean"], c2c["floor_std"], c2c["floor_rms"]) == pytest.approx(
            (floor.mean, floor.std, floor.rms), rel=0.01
        )
        assert c2c["mean"] > c2c["floor_mean"]
        assert c2c["rms"] == pytest.approx(np.hypot(c2c["mean"], c2c["std"]))
        assert c2c["debiased_rms"] == pytest.approx(np.hypot(OFFSET, NOISE * 2**0.5), rel=0.15)
        assert c2c["median"] < c2c["q95"]
        assert c2c["pitch_a"]["across"] * c2c["pitch_a"]["up"] == pytest.approx(
            0.021 * 0.023, rel=0.01
        )
        # A lies on the side of the scanners
        assert m3c2["mean"] == pytest.approx(OFFSET, abs=3e-4)
        assert c2c["local_plane"]["mean"] == pytest.approx(OFFSET, abs=3e-4)
        assert m3c2["lod95"] == pytest.approx(1.96 * NOISE * np.sqrt(2 / 32), rel=0.3)
        assert m3c2["changed"] > 0.9
        assert site["predicted_sigma"] is None
        ranges = [np.hypot(np.hypot(p[0] - x, p[1]), p[2] - 1.5) for p in SCANNERS.values()]
        assert site["range"] == pytest.approx(max(ranges), abs=0.02)
        assert site["stations"]["a"]["range"] == pytest.approx(ranges[0], abs=0.02)
        angles = [np.arccos(abs(p[1]) / r) for p, r in zip(SCANNERS.values(), ranges, strict=True)]
        assert site["stations"]["b"]["incidence"] == pytest.approx(angles[1], abs=0.03)
    for words in ("left", "right", "floor", "debiased"):
        assert words in said
    root = parser.fromstring(page.read_text())
    assert root.findtext(".//h1") == "S1.laz against S2.laz"
    pictures = [figure.findtext("figcaption/b") for figure in root.iter("figure")]
    assert pictures == ["Distances.", "Histogram of distances."]
    assert all(figure.xpath("svg | img") for figure in root.iter("figure"))
    assert {s.get("id") for s in root.iter("section")} >= {"sites", "c2c", "m3c2"}


def test_whole_clouds_without_poses(folder: Path, tmp_path: Path) -> None:
    for name in ("S1", "S2"):
        (tmp_path / f"{name}.laz").symlink_to(folder / f"{name}.laz")
    out = tmp_path / "c.json"
    works("compare", tmp_path / "S1.laz", tmp_path / "S2.laz", "--json", out, "--limit-m", 0.05)
    (site,) = json.loads(out.read_text())["sites"]
    assert site["name"] == "all"
    assert site["range"] is None
    assert site["incidence"] is None
    assert site["stations"] == {"a": None, "b": None}
    assert abs(site["m3c2"]["mean"]) == pytest.approx(OFFSET, abs=2e-4)
    given = ["--poses", folder / "poses.json", "--json", out, "-q"]
    assert works("compare", tmp_path / "S1.laz", tmp_path / "S2.laz", *given) == ""
    assert json.loads(out.read_text())["sites"][0]["range"] > 12


@pytest.mark.parametrize(("method", "other"), [("c2c", "m3c2"), ("m3c2", "c2c")])
def test_one_method(folder: Path, tmp_path: Path, method: str, other: str) -> None:
    out = tmp_path / "c.json"
    said = works("compare", folder / "S1.laz", folder / "S2.laz", "--method", method,
                 "--sites", folder / "sites.csv", "--json", out,
                 "--html", tmp_path / "c.html")  # fmt: skip
    for site in json.loads(out.read_text())["sites"]:
        assert site[other] is None
        assert site[method]["mean"] is not None
    assert ("Nearest points" in said) == (method == "c2c")


def test_a_site_without_points(folder: Path, tmp_path: Path) -> None:
    sites, out = tmp_path / "s.csv", tmp_path / "c.json"
    sites.write_text(SITES + "nowhere,0,0,0,1\n")
    said = works("compare", folder / "S1.laz", folder / "S2.laz", "--sites", sites, "--json", out)
    nowhere = json.loads(out.read_text())["sites"][2]
    assert nowhere["n"] == 0
    assert nowhere["c2c"]["mean"] is None
    assert nowhere["m3c2"] is None
    assert "nowhere: no point" in " ".join(said.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("absent.laz", "S2.laz"), "there is no such file"),
        (("S1.laz", "other.laz"), "different coordinate systems"),
        (("S1.laz", "away.laz"), "no point of S1.laz is within 0.2 m of away.laz; check"),
        (("S1.laz", "S2.laz", "--sites", "none.csv"), "none.csv"),
        (("S1.laz", "S2.laz", "--sites", "bad.csv"), "bad.csv:2: the radius is 0"),
        (("S1.laz", "S2.laz", "--sites", "far.csv"), "on any site"),
        (("S1.laz", "S2.laz", "--limit-m", "0"), "--limit-m"),
        (("S1.laz", "S2.laz", "--method", "icp"), "--method"),
        (("S1.laz", "S2.laz", "--poses", "bad.csv"), "this is no file of poses"),
        (("S1.laz", "S2.laz", "--poses", "list.json"), "this is no file of poses"),
        (("S1.laz", "S2.laz", "--poses", "short.json"), "pose of S1 is not made of 4x4 numbers"),
        (("S1.laz", "S2.laz", "--poses", "words.json"), "the pose of S1 is not made of numbers"),
        (("S1.laz", "S2.laz", "--poses", "none.json"), "none.json"),
        (("S1.laz", "cut.laz"), "cut.laz"),
        (("S1.laz", "S2.laz", "--json", "S1.laz/x.json"), "cannot be written"),
    ],
)
def test_bad_input(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    small = wall(0.2, 0.2, 0.0, 0.0, 3)
    written(Path("S1.laz"), small, "EPSG:32648")
    written(Path("S2.laz"), small, "EPSG:32648")
    written(Path("other.laz"), small, "EPSG:32649")
    written(Path("away.laz"), small + 500.0)
    Path("cut.laz").write_bytes((folder / "S2.laz").read_bytes()[:-40_000])
    Path("bad.csv").write_text("name,x,y,z,radius\nA,1,2,3,0\n")
    Path("far.csv").write_text("name,x,y,z,radius\nA,1,2,3,1\n")
    Path("list.json").write_text("[1, 2]")
    for name, matrix in (("short", [[1.0]]), ("words", [["a"]])):
        row = {"scan": "S1", "file": "S1.ptx", "world_from_scanner": matrix}
        Path(f"{name}.json").write_text(json.dumps({"scans": [row]}))
    before = sorted(tmp_path.iterdir())
    said = fails("compare", *arguments)
    assert re.search(re.escape(words), said), said
    assert sorted(tmp_path.iterdir()) == before


def test_the_place_of_the_scanner_may_be_given(tmp_path: Path) -> None:
    """Clouds that do not say it have ranges and incidences then."""
    ways = [written(tmp_path / f"{n}.laz", wall(0.02, 0.02, 0.1 * n, 0.0, n)) for n in (1, 2)]
    out = tmp_path / "c.json"
    x, y, z = (FAR + np.array([3.0, -12.0, 1.5])).tolist()
    for more, away in (((), None), (("--origin", x, y, z), 12.1)):
        works("compare", *ways, *more, "--json", out, "--overwrite")
        (site,) = json.loads(out.read_text())["sites"]
        assert site["range"] == (None if away is None else pytest.approx(away, abs=0.5))
