"""Every network of Comp3D's test collection against the result that Comp3D stored with it.

Broken networks end with a sentence; those that Comp3D computes by leaving the broken lines out
are read with ``tolerant`` and must agree as well.
"""

import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import AdjustmentError, InputError, NoStartValues, RankDefect
from tribrach.geodesy.plumb import PlumbField, PlumbLines
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey.comp3d import reader as comp3d
from tribrach.io.survey.comp3d.assembly import Comp3dFacts, grid_axes
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.facts import facts_of
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.scanner import Inclinations
from tribrach.observations.sights import Directions, ZenithAngles
from tribrach.observations.unknowns import Layout, State
from tribrach.units import SEC

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data" / "networks" / "comp3d"

#: networks with adjusted coordinates
ADJUSTED = (
    "axe",
    "bascule",
    "centering",
    "eq_constr",
    "errors",
    "fixed_points2",
    "forbidden_pt",
    "geo_mini_L93",
    "geo_mini_NTF",
    "minimal",
    "no_redundancy",
    "photogra",
    "simple2D",
    "subfiles",
    "syntax_error1",
)
#: of these, networks with lines that Comp3D leaves out
TOLERANT = ("errors", "syntax_error1")
#: points that Comp3D cannot locate and drops, although many directions locate them
DROPPED = {"syntax_error1": ("400", "134")}
#: sentences of networks without a result, or with broken lines
BROKEN: dict[str, tuple[type[Exception], str]] = {
    "coincident_with_VD": (
        InputError,
        "obs_topo/SL412.obs:14 (and 2 more lines): points SL412 and SL413",
    ),
    "desact": (RankDefect, "nothing holds points c and d"),
    "errors": (InputError, "ex.cor:1: there is no file toto.cor"),
    "fixed_points_IC": (InputError, "coord.cor:1: point A is held"),
    "kernel": (RankDefect, "move"),
    "no_point_accepted": (InputError, "niv.cor:1: constrained point A has no sigmas"),
    "same_init_coords": (InputError, "obs.obs:1 (and 1 more line): points A and B"),
    "sigma_too_low": (InputError, "TP_G1.cor:1: sigma 1e-09 m of point 1016"),
    "syntax_error1": (InputError, "20109_t311.obs:137: the observation code is '-'"),
    "syntax_error2": (InputError, "20104_t312.obs:34: '0.00040.0000'"),
}
#: networks that are computed in another way
OTHERS = (
    "coord_sigma_neg",
    "fixed_points",
    "simple",
    "simul_IC_mini",
    "simul_MonteCarlo_mini",
)

pytestmark = [
    pytest.mark.data,
    pytest.mark.skipif(not FOLDER.is_dir(), reason="third-party data are absent"),
]


def stage(case: str, folder: Path) -> Path:
    """A writable copy of a network, with its subframe files where Comp3D expects them."""
    folder.mkdir()
    for source in (FOLDER / case).rglob("*"):
        if source.is_file():
            inside = source.relative_to(FOLDER / case)
            parts = [part for part in inside.parts if part != "origin"]
            target = folder.joinpath(*parts)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    with next(folder.glob("*.cor")).open("a") as cor:
        cor.writelines(f"\n-1 {name}" for name in DROPPED.get(case, ()))
    return folder


def survey_of(case: str, folder: Path, *, tolerant: bool = False) -> Survey:
    return comp3d.read(stage(case, folder) / "ex_ref.comp", tolerant=tolerant)


@dataclass
class Reference:
    """Comp3D's stored result."""

    document: dict[str, Any]

    @classmethod
    def load(cls, case: str) -> "Reference":
        text = (FOLDER / case / "ex_ref.comp").read_text(encoding="utf-8", errors="replace")
        body = text.partition("data=")[2].lstrip()
        return cls(json.JSONDecoder(strict=False).raw_decode(body)[0])

    @property
    def computation(self) -> dict[str, Any]:
        return self.document["computation"]

    @property
    def points(self) -> dict[str, Any]:
        return self.document["points"]

    def observations(self) -> dict[str, list[dict[str, Any]]]:
        """Active observations by file:line, without the coordinates."""
        stations = [s for p in self.points.values() for s in p["stations"] or []]
        found: dict[str, list[dict[str, Any]]] = {}
        for station in stations + (self.document["other_stations"] or []):
            for row in station["observations"]:
                if row["active"] and row["code"] > 0 and row["line"] > 0:
                    name = Path(self.document["all_data_files"][str(row["file_id"])]).name
                    found.setdefault(f"{name}:{row['line']}", []).append(row)
        return found


def grid_of(survey: Survey) -> ProjectedGrid:
    (facts,) = facts_of(survey.facts, Comp3dFacts)
    return facts.grid


def positions(adjustment: Adjustment) -> dict[str, np.ndarray]:
    names = adjustment.layout.names
    return dict(zip(names["point"] + names["pose"], adjustment.state.positions, strict=True))


def worst_coordinate(survey: Survey, adjustment: Adjustment, reference: Reference) -> float:
    """Largest difference [m] from Comp3D's coordinates, which are its computing frame's.

    The frame has E, N on the sphere (orthographic, at height zero) and h; its stereographic
    coordinates are those of a local grid around the project's centre.
    """
    worst = 0.0
    place = positions(adjustment)
    projection = reference.computation["projection"]
    local = ProjectedGrid(projection["stereo_def"] + " +ellps=GRS80 +type=crs", 0.0, 0.0)
    radius = projection["earth_model_radius"]
    for name, point in reference.points.items():
        mine = local.from_work(place[name][None])[0]
        squeeze = 1 + (mine[0] ** 2 + mine[1] ** 2) / (4 * radius**2)
        mine[:2] /= squeeze
        for axis, letter in enumerate("xyz"):
            unknown = (point["params"] or {}).get(f"{name}_{letter}")
            if unknown is not None:
                worst = max(worst, abs(unknown["value"] - mine[axis]))
    return worst


def sources(adjustment: Adjustment) -> list[str]:
    """file:line of every active value."""
    tables = adjustment.network.observations
    rows = adjustment.rows
    return [
        str(tables[t].source[i]).rsplit("/", 1)[-1]
        for t, i in zip(rows.table, rows.item, strict=True)
    ]


def compare_rows(adjustment: Adjustment, reference: Reference) -> tuple[int, float, float]:
    """Rows compared, worst normalised residual and worst relative a-posteriori sigma."""
    sigma = np.array(
        [
            adjustment.network.observations[t].sigma[i, r]
            for t, i, r in zip(*map(np.ravel, vars_of(adjustment)), strict=True)
        ]
    )
    spread = np.sqrt(np.maximum(adjustment.cofactor.row_forms(adjustment.design), 0.0)) * sigma
    rows: dict[str, list[int]] = {}
    for k, source in enumerate(sources(adjustment)):
        rows.setdefault(source, []).append(k)
    count, worst_residual, worst_sigma = 0, 0.0, 0.0
    usual = max(1.0, reference.computation.get("sigma_0_final") or 0.0)
    for source, expected in reference.observations().items():
        mine = rows.get(source, [])
        if len(mine) != len(expected):
            continue  # a foot of an axis is a constraint here
        for k, row in zip(mine, expected, strict=True):
            unit = row["unit_factor"]
            normal = row["residual"] / row["sigma_total"]
            if row["code"] == 182:  # distances from the plane of a circle count the other way
                normal = -normal
            difference = abs(adjustment.residuals[k] / sigma[k] - normal) / max(usual, abs(normal))
            worst_residual, count = max(worst_residual, difference), count + 1
            if "sigma_a_posteriori" in row:
                ratio = spread[k] / (row["sigma_a_posteriori"] * unit)
                worst_sigma = max(worst_sigma, abs(ratio - 1))
    return count, worst_residual, worst_sigma


def vars_of(adjustment: Adjustment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return adjustment.rows.table, adjustment.rows.item, adjustment.rows.row


def test_every_network_has_its_test() -> None:
    tested = {*ADJUSTED, *BROKEN, *OTHERS}
    assert tested == {path.name for path in FOLDER.iterdir() if path.is_dir()}


@pytest.mark.parametrize("case", ADJUSTED)
def test_adjusted_network_agrees(case: str, tmp_path: Path) -> None:
    """Coordinates to 0.1 mm, sigma0 to 1e-3, redundancy, residuals and sigmas of observations."""
    reference = Reference.load(case)
    survey = survey_of(case, tmp_path / case, tolerant=case in TOLERANT)
    adjustment = adjust(survey.network())
    worst = worst_coordinate(survey, adjustment, reference)
    expected = reference.computation.get("sigma_0_final")
    count, residual, sigma = compare_rows(adjustment, reference)
    print(
        f"\n{case:14s} points {worst * 1e3:8.5f} mm  sigma0 {adjustment.sigma0_posterior:11.6f} "
        f"(Comp3D {expected}) dof {adjustment.dof:4d}  {count:4d} residuals {residual:.1e} "
        f"sigmas {sigma:.1e}"
    )
    assert worst < 1e-4
    assert adjustment.dof == reference.computation["chi2_test"]["DOF"]
    if case == "bascule":  # Comp3D tilts the levelled frames wrongly: see the next test
        return
    if expected is not None:
        assert abs(adjustment.sigma0_posterior - expected) < 1e-3 * max(1.0, expected)
    assert residual < 0.02
    assert sigma < 0.01


@dataclass(frozen=True)
class DegreesAsArc(EllipsoidSite):
    """Verticals as Comp3D levels its subframes: differences of longitude taken as arcs."""

    def axes(self, x: np.ndarray) -> np.ndarray:
        plain = super().axes(x)
        geodetic = self.geodetic(x)
        east, north = geodetic[:, 1] - self.longitude, geodetic[:, 0] - self.latitude
        up = np.stack([np.sin(east), np.sin(north) * np.cos(east), np.cos(north) * np.cos(east)], 1)
        return np.concatenate([plain[:, :2], up[:, None]], axis=1)


def test_bascule_differs_by_comp3d_levelling(tmp_path: Path) -> None:
    """At (1000, 0) m Comp3D tilts a level by 2.4e-4 instead of 1.6e-4: 8 mm at 100 m.

    Its own matrix shows it. With levels tilted in the same way sigma0 is Comp3D's.
    """
    reference = Reference.load("bascule")
    station = reference.points["6"]["stations"][0]
    tilt = -station["params_rot"]["R_global2instr"][2]
    radius = reference.computation["projection"]["earth_model_radius"]
    assert tilt == pytest.approx(1000 / radius / np.cos(np.radians(48.8)), rel=3e-3)
    survey = survey_of("bascule", tmp_path / "bascule")
    network = survey.network()
    right = adjust(network)
    assert right.sigma0_posterior == pytest.approx(462.241, abs=1e-3)
    site = grid_of(survey).site
    tilted = DegreesAsArc(site.latitude, site.longitude, 0.0, curvature_radius=radius)
    levels = tuple(
        replace(c, observations=replace(c.observations, site=tilted))
        if isinstance(c.observations, Inclinations)
        else c
        for c in network.constraints
    )
    as_comp3d = adjust(replace(network, constraints=levels))
    expected = reference.computation["sigma_0_final"]
    assert as_comp3d.sigma0_posterior == pytest.approx(expected, abs=1e-3)


def test_sigmas_that_grow_with_distance_settle(tmp_path: Path) -> None:
    """With approximate coordinates from a first adjustment sigma0 agrees to 1e-3 too."""
    first = comp3d.read(stage("syntax_error1", tmp_path / "a") / "ex_ref.comp", tolerant=True)
    adjustment = adjust(first.network())
    grid = grid_of(first)
    folder = stage("syntax_error1", tmp_path / "b")
    with (folder / "cor.cor").open("w") as cor:
        for name, x in zip(adjustment.layout.names["point"], adjustment.state.points, strict=True):
            if name == "1":
                cor.write("1 1 100 100 50 0.00001 0.00001 0.00001\n")
            else:
                cor.write(f"0 {name} " + " ".join(f"{v:.9f}" for v in grid.from_work(x[None])[0]))
                cor.write("\n")
        cor.writelines(f"-1 {name}\n" for name in DROPPED["syntax_error1"])
    for path in folder.glob("*.obs"):  # without distances the coordinates tell them
        text = path.read_text(encoding="latin-1")
        lines = [
            f"*{line}" if line.split()[:1] in (["-3"], ["3"]) and _off(line) else line
            for line in text.splitlines()
        ]
        path.write_text("\n".join(lines), encoding="latin-1")
    second = adjust(comp3d.read(folder / "ex_ref.comp", tolerant=True).network())
    expected = Reference.load("syntax_error1").computation["sigma_0_final"]
    assert second.sigma0_posterior == pytest.approx(expected, abs=1e-3)


def _off(line: str) -> bool:
    fields = line.split()
    return fields[0].startswith("-") or (len(fields) > 4 and fields[4].startswith("-"))


@pytest.mark.parametrize("case", sorted(BROKEN))
def test_broken_network_ends_with_a_sentence(case: str, tmp_path: Path) -> None:
    error, sentence = BROKEN[case]
    with pytest.raises(error) as caught:
        adjust(survey_of(case, tmp_path / case).network())
    print(f"\n{case:20s} {caught.value}")
    assert sentence in str(caught.value)


@pytest.mark.parametrize("case", sorted(BROKEN))
def test_broken_network_exits_with_two(case: str, tmp_path: Path) -> None:
    path = stage(case, tmp_path / case) / "ex_ref.comp"
    result = CliRunner().invoke(app, ["adjust", str(path)])
    assert result.exit_code == 2, result.output


def test_tolerant_reading_still_finds_the_defect(tmp_path: Path) -> None:
    """Without its broken lines syntax_error2 leaves the heights of 100 and 200 open."""
    survey = survey_of("syntax_error2", tmp_path / "case", tolerant=True)
    left_out = [w for w in survey.warnings if "the line is left out" in w]
    assert len(left_out) > 10
    assert "20104_t312.obs:34" in left_out[0]
    with pytest.raises((RankDefect, NoStartValues)) as caught:
        adjust(survey.network())
    assert "104_4" in str(caught.value)


@pytest.mark.parametrize("case", ["sigma_too_low", "no_point_accepted", "coincident_with_VD"])
def test_tolerant_reading_has_limits(case: str, tmp_path: Path) -> None:
    with pytest.raises((InputError, AdjustmentError)):
        adjust(survey_of(case, tmp_path / case, tolerant=True).network())


@pytest.mark.parametrize("case", ["coord_sigma_neg", "subfiles"])
def test_covariances_of_points_agree(case: str, tmp_path: Path) -> None:
    """3x3 covariances in the grid's axes to 1 % of the largest variance."""
    reference = Reference.load(case)
    survey = survey_of(case, tmp_path / case)
    adjustment = adjust(survey.network())
    site = grid_of(survey).site
    for name, point in reference.points.items():
        xx, xy, xz, yy, yz, zz = point["ellips"]["matrix"]
        expected = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        axes = grid_axes(positions(adjustment)[name], site)
        mine = axes @ adjustment.covariance(name) @ axes.T
        assert np.sqrt(np.diag(mine)) == pytest.approx(np.sqrt(np.diag(expected)), rel=0.01)
        assert np.abs(mine - expected).max() < 0.01 * expected.max()


def test_fixed_points_only_check(tmp_path: Path) -> None:
    """Two held points 50 km apart: no unknowns, one check."""
    adjustment = adjust(survey_of("fixed_points", tmp_path / "case").network())
    assert (adjustment.n_unknowns, adjustment.dof) == (0, 1)
    expected = Reference.load("fixed_points").computation["sigma_0_final"]
    assert adjustment.sigma0_posterior == pytest.approx(expected, abs=1e-3)


def test_files_without_project(tmp_path: Path) -> None:
    """No reference exists: the given coordinates fit the observations exactly."""
    folder = stage("simple", tmp_path / "case")
    survey = comp3d.read([folder / "toto.obs", folder / "toto.cor"])
    adjustment = adjust(survey.network())
    assert adjustment.dof == 0
    enh = grid_of(survey).from_work(adjustment.state.points)
    length = np.linalg.norm(adjustment.state.points[1:] - adjustment.state.points[0], axis=1)
    assert length == pytest.approx([10, 10], abs=1e-9)
    # azimuth zero to B, a tenth of a right angle further to C
    assert enh[1] == pytest.approx([10, 20, 10], abs=1e-4)
    angle = np.pi / 20
    assert enh[2] == pytest.approx([10 + 10 * np.sin(angle), 10 + 10 * np.cos(angle), 10], abs=1e-4)


def test_simulation_with_inner_constraints(tmp_path: Path) -> None:
    """Zenith angle and distance keep their own sigmas: nothing checks them."""
    survey = survey_of("simul_IC_mini", tmp_path / "case")
    adjustment = adjust(survey.network())
    assert (adjustment.dof, adjustment.defect) == (0, 4)
    count, residual, sigma = compare_rows(adjustment, Reference.load("simul_IC_mini"))
    assert count == 2
    assert residual < 1e-9
    assert sigma < 0.01
    off = [o for t in adjustment.network.observations for o in t.reason[t.use == Use.OFF]]
    assert "the project uses inner constraints" in off


def test_monte_carlo_simulation(tmp_path: Path) -> None:
    """Comp3D's 20 random shifts are a sample of our covariance (chi-square, 99.9 %)."""
    adjustment = adjust(survey_of("simul_MonteCarlo_mini", tmp_path / "case").network())
    reference = Reference.load("simul_MonteCarlo_mini")
    n = reference.document["config"]["max_iterations"]
    low, high = chi2.ppf([0.0005, 0.9995], n)
    for name, point in reference.points.items():
        variance = np.diag(adjustment.covariance(name))
        sample = np.square(point["MC_shift_sq_average"]) * n / variance
        assert ((sample > low) & (sample < high)).all()


def test_deflections_do_to_readings_what_comp3d_says(tmp_path: Path) -> None:
    """Its corrections of 230 levelled lines, directions and zenith angles by 12 arcsec.

    The network itself has no result, yet Comp3D lists geometry and correction of each reading:
    readings and corrections together are along the ellipsoid's normal.
    """
    reference = Reference.load("coincident_with_VD")
    lean: dict[str, list[float]] = {}
    for line in (FOLDER / "coincident_with_VD" / "total2022.cor").read_text("latin1").splitlines():
        words = line.split("*")[0].split()
        if len(words) in (7, 10):
            eta, xi = map(float, words[-2:])
            lean[words[1]] = [xi * SEC, eta * SEC]
    compared = dict.fromkeys((4, 5, 6, 7), 0)
    for point in reference.points.values():
        for station in point["stations"]:
            for row in station.get("observations", []):
                code, stated = row["code"], row.get("deflection_correction", 0.0)
                ends = [lean.get(row[key]) for key in ("from", "to")]
                far = row.get("obs_length", 0.0) > 1.0
                if code not in compared or not stated or not far or None in ends:
                    continue
                mine = correction(code, row, np.array(ends))
                # of a height difference Comp3D takes the place of the end for that of the middle
                assert mine == pytest.approx(stated, rel=2e-3, abs=5e-7), (code, row)
                compared[code] += 1
    assert sum(compared.values()) > 150
    assert min(compared[4], compared[5], compared[6]) > 40


def correction(code: int, row: dict[str, Any], lean: np.ndarray) -> float:
    """Value along the normal less value along the plumb line, in Comp3D's metres and gon."""
    azimuth, zenith, length = row["obs_azim"], row["obs_zen"], row["obs_length"]
    flat = length * np.sin(zenith)
    state = State.blank(Layout(points=["a", "b"], scalars=["o"]))
    state.points[0] = 0.0
    state.points[1] = flat * np.sin(azimuth), flat * np.cos(azimuth), length * np.cos(zenith)
    state.scalars[0] = 0.0
    columns: dict[str, Any] = {"start": [0], "end": [1], "values": [[0.0]]}
    columns["covariance"] = [[[1.0]]]
    if code in (5, 7):
        columns["orientation"] = [0]
    kind = {4: HeightDifferences, 5: Directions, 6: ZenithAngles, 7: Directions}[code]
    plain = kind(**columns).predict(state)
    leaning = kind(**columns, plumb=PlumbLines(PlumbField(), lean)).predict(state)
    difference = float((plain - leaning)[0, 0])
    return difference if code == 4 else difference * 200 / np.pi
