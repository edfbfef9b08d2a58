"""The commands transform fit and transform apply: figures, files, clouds, sentences."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.geometry import rotation
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.point_list import read_point_list
from tribrach.io.scans.formats import read_scans
from tribrach.io.transformation_file import read_transformation
from tribrach.scan.scan import Field
from tribrach.transformation.carrying import Carrier
from tribrach.transformation.fit import fit_transformation

RUN = CliRunner()
MODEL = """point,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm
1,1094.883,820.085,109.821,7,8,5
2,503.891,1598.698,117.685,11,8,9
3,2349.343,207.658,151.387,6,5,7
4,1395.320,1348.853,215.261,5,8,9
5,265.346,1003.470,78.609,7,8,7
"""
GROUND = """point,easting_m,northing_m,height_m,sigma_easting_cm,sigma_northing_cm,sigma_height_cm
1,10037.81,5262.09,772.04,5,6,5
2,10956.68,5128.17,783.00,4,6,9
4,10185.80,4700.21,851.32,3,5,3
3,8780.08,4840.29,782.62,2,4,2
9,0,0,0,1,1,1
"""


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str, Path]:
    (tmp_path / "a.csv").write_text(MODEL)
    (tmp_path / "b.csv").write_text(GROUND)
    return str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), tmp_path


def run(*words: str) -> str:
    result = RUN.invoke(app, ["transform", *words])
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


def refused(*words: str) -> str:
    result = RUN.invoke(app, ["transform", *words])
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    return " ".join(result.output.split())


def test_fit_prints_and_writes(files: tuple[str, str, Path]) -> None:
    """AC-36 through the command, rows in any order and columns by any of their names."""
    a, b, folder = files
    out = run("fit", a, b, "--json", str(folder / "f.json"))
    assert "0.949954935" in out
    assert "The global test passes" in out
    assert "Only in a.csv: 5" in out
    assert "Only in b.csv: 9" in out
    assert "and no accuracy" in " ".join(out.split())
    data = json.loads((folder / "f.json").read_text())
    assert data["shift_at_origin"] == pytest.approx([10233.8542, 6549.9641, 720.8663], abs=1e-4)
    assert data["sigma0"]["posterior"] == pytest.approx(1.288, abs=5e-4)
    assert data["scale_test"]["needed"]
    assert [p["name"] for p in data["points"]] == ["1", "2", "3", "4"]
    assert [m["count"] for m in data["models"]] == [3, 4, 6, 7, 9, 12]


def test_check_points_and_models(files: tuple[str, str, Path]) -> None:
    a, b, folder = files
    out = run("fit", a, b, "--check", "2", "--json", str(folder / "f.json"))
    assert "oot mean square error of check points (1)" in " ".join(out.split())
    data = json.loads((folder / "f.json").read_text())
    assert {p["name"]: p["use"] for p in data["points"]}["2"] == "check"
    assert data["check_rmse"] is not None
    assert "affine" in run("fit", a, b, "--model", "12").lower()
    assert run("fit", a, b, "-q") == ""


def test_points_go_there_and_back(files: tuple[str, str, Path]) -> None:
    """C_b = M C_a M^T + J Q J^T in the table, and the way back."""
    a, b, folder = files
    fit = str(folder / "f.json")
    run("fit", a, b, "--json", fit, "-q")
    there, back = folder / "there.csv", folder / "back.csv"
    assert "common to all points" in run("apply", fit, a, str(there))
    given, moved = read_point_list(Path(a)), read_point_list(there)
    stored = read_transformation(Path(fit))
    t = stored.transformation
    assert moved.xyz == pytest.approx(t(given.xyz), abs=1e-5)
    lever = t.jacobian(given.xyz)
    expected = t.matrix @ given.covariance @ t.matrix.T
    expected = expected + lever @ stored.covariance @ lever.transpose(0, 2, 1)
    assert moved.covariance == pytest.approx(expected, rel=1e-5, abs=1e-12)
    run("apply", fit, str(there), str(back), "--inverse")
    assert read_point_list(back).xyz == pytest.approx(given.xyz, abs=3e-5)


def test_covariances_backwards_by_monte_carlo() -> None:
    """The transformation drawn from its covariance, the points carried back."""
    rng = np.random.default_rng(1)
    stored_a = np.array([[10.0, 2, 1], [-8, 5, 2], [3, -9, 4], [0, 6, -3], [7, 7, 5]])
    turn = rotation.exp(np.array([0.2, -0.3, 1.0]))
    c = np.tile(1e-4 * np.eye(3), (5, 1, 1))
    fit = fit_transformation(stored_a, stored_a @ turn.T * 1.2 + 5, 7, covariance_b=c)
    x = np.array([[30.0, -20, 10]])
    carrier = Carrier(fit.transformation, fit.covariance, True)
    root = np.linalg.cholesky(fit.covariance)
    draws = [fit.transformation.moved(root @ rng.normal(size=7)).back(x)[0] for _ in range(4000)]
    sample = np.cov(np.array(draws).T)
    assert sample == pytest.approx(carrier.covariances(x)[0], abs=0.12 * np.abs(sample).max())


def cloud(path: Path, fields: tuple[Field, ...], values: dict[str, np.ndarray]) -> np.ndarray:
    xyz = np.random.default_rng(2).uniform(-30, 30, (500, 3)) + np.array([1000.0, 900, 120])
    with create(
        path, CloudHeader("c", fields, step=1e-4, offset=np.array([1000.0, 900, 100]))
    ) as w:
        w.write(xyz, values)
    return xyz


def test_clouds_carry_their_sigmas(files: tuple[str, str, Path]) -> None:
    a, b, folder = files
    fit = str(folder / "f.json")
    run("fit", a, b, "--json", fit, "-q")
    names = ("intensity", "sigma_x", "sigma_y", "sigma_z")
    sigma = np.random.default_rng(3).uniform(0.001, 0.004, (500, 3)).astype(np.float32)
    values = {"intensity": np.linspace(0, 1, 500, dtype=np.float32)}
    values |= dict(zip(names[1:], sigma.T, strict=True))
    source, target = folder / "c.laz", folder / "d.laz"
    xyz = cloud(source, tuple(Field(n, "float32") for n in names), values)
    assert "500 points" in run("apply", fit, str(source), str(target))
    stored = read_transformation(Path(fit))
    chunk = next(read_scans(target)[0].chunks())
    assert chunk.xyz == pytest.approx(stored.transformation(xyz), abs=3e-4)
    carrier = Carrier(stored.transformation, stored.covariance)
    own = sigma[:, :, None].astype(float) ** 2 * np.eye(3)
    expected = np.sqrt(np.einsum("nii->ni", carrier.covariances(xyz, own)))
    for k, name in enumerate(names[1:]):
        assert np.asarray(chunk.values[name]) == pytest.approx(expected[:, k], rel=1e-3)


def test_clouds_without_sigmas_get_those_of_the_transformation(
    files: tuple[str, str, Path],
) -> None:
    a, b, folder = files
    fit = str(folder / "f.json")
    run("fit", a, b, "--json", fit, "-q")
    source, target = folder / "c.ply", folder / "d.ply"
    cloud(source, (Field("intensity", "float32"),), {"intensity": np.ones(500, dtype=np.float32)})
    out = run("apply", fit, str(source), str(target), "--inverse")
    assert "those written are of the transformation alone" in out
    assert {"sigma_x", "intensity"} <= set(read_scans(target)[0].names)


def test_plane_transformations_leave_heights(tmp_path: Path) -> None:
    plane = "\n".join(",".join(line.split(",")[:3]) for line in MODEL.splitlines())
    (tmp_path / "a.csv").write_text(plane)
    (tmp_path / "b.csv").write_text(plane.replace("x_m,y_m", "e_m,n_m"))
    (tmp_path / "p.csv").write_text(MODEL)
    fit = str(tmp_path / "f.json")
    assert "in the plane" in run(
        "fit", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "--json", fit
    )
    run("apply", fit, str(tmp_path / "p.csv"), str(tmp_path / "q.csv"))
    one, two = (read_point_list(tmp_path / name) for name in ("p.csv", "q.csv"))
    assert two.xyz == pytest.approx(one.xyz, abs=1e-5)
    assert two.covariance[:, 2, 2] == pytest.approx(one.covariance[:, 2, 2], rel=1e-6)


def test_exchanged_columns_are_said(files: tuple[str, str, Path]) -> None:
    _, b, folder = files
    (folder / "s.csv").write_text(MODEL.replace("x_m,y_m", "y_m,x_m"))
    out = run("fit", str(folder / "s.csv"), b)
    assert "look exchanged" in out


def test_what_is_wrong_is_said(files: tuple[str, str, Path]) -> None:
    a, b, folder = files
    strange, bad = folder / "x.csv", folder / "bad.json"
    strange.write_text("point,x_m,y_m,z_m\nQ,1,2,3\n")
    bad.write_text("{}")
    fit = str(folder / "f.json")
    run("fit", a, b, "--json", fit, "-q")
    assert "no point has a name that is also in b.csv" in refused("fit", str(strange), b)
    assert "there is no transformation with 8 parameters" in refused("fit", a, b, "--model", "8")
    assert "check point Z is not in both files" in refused("fit", a, b, "--check", "Z")
    strange.write_text("point,x_m,y_m,z_m\n1,1,2,3\n1,1,2,4\n")
    assert "point 1 is there twice" in refused("fit", str(strange), b)
    strange.write_text("point,latitude_deg,longitude_deg\n1,1,2\n")
    assert "latitude and longitude are no metres" in refused("fit", str(strange), b)
    strange.write_text("point,x_m,y_m\n1,1,2\n2,3,4\n")
    assert "have no heights" in refused("fit", str(strange), b)
    assert "have no heights" in refused("apply", fit, str(strange), str(folder / "o.csv"))
    assert "this is no transformation" in refused("apply", str(bad), a, str(folder / "o.csv"))
    assert "take the place of a file that is read" in refused("apply", fit, a, a)
    data = json.loads(Path(fit).read_text())
    for key, value in (("matrix", [[1, 0, 0]] * 3), ("centre", [1]), ("covariance", "x")):
        bad.write_text(json.dumps(data | {key: value}))
        refused("apply", str(bad), a, str(folder / "o.csv"))
    assert not (folder / "o.csv").exists()


def test_points_that_fit_exactly(tmp_path: Path) -> None:
    """Round numbers that somebody tries first: no scatter, no nan, and the file can be applied."""
    rows = [(k * 7 % 11, k * 5 % 13, k * 3 % 7) for k in range(8)]
    for name, (x, y, z) in {"a": (0, 0, 0), "b": (100, 200, 30)}.items():
        text = "".join(f"P{k},{r[0] + x},{r[1] + y},{r[2] + z}\n" for k, r in enumerate(rows))
        (tmp_path / f"{name}.csv").write_text("point,x_m,y_m,z_m\n" + text)
    a, b, fit, out = (str(tmp_path / n) for n in ("a.csv", "b.csv", "fit.json", "out.csv"))
    said = run("fit", a, b, "--json", fit)
    assert "nan" not in said
    assert "6 parameters are enough" in said
    run("apply", fit, a, out)
    moved, ground = read_point_list(Path(out)), read_point_list(Path(b))
    np.testing.assert_allclose(moved.xyz, ground.xyz, atol=1e-4)


def test_points_know_how_few_residuals_their_sigmas_rest_on(tmp_path: Path) -> None:
    """Without sigmas of the points: 12 values, 7 parameters, t of 5 degrees of freedom."""
    rng = np.random.default_rng(8)
    a = rng.uniform(0, 100, (4, 3))
    for name, xyz in (("a", a), ("b", a + 3 + rng.normal(0, 0.01, a.shape))):
        rows = ["point,x_m,y_m,z_m"]
        rows += [f"{k},{x:.4f},{y:.4f},{z:.4f}" for k, (x, y, z) in enumerate(xyz)]
        (tmp_path / f"{name}.csv").write_text("\n".join(rows) + "\n")
    fit = str(tmp_path / "f.json")
    run("fit", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "--json", fit, "-q")
    assert read_transformation(Path(fit)).freedom == 5
    said = run("apply", fit, str(tmp_path / "a.csv"), str(tmp_path / "c.csv"))
    assert "2.57" in said
