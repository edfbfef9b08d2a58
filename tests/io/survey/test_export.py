"""Networks in the files of other programs: read back they give the same result, or say what not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.io.survey.exported import export
from tribrach.io.survey.formats import read_files
from tribrach.io.survey.starnet.settings import grid_of, name_of_grid
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.facts import Reference
from tribrach.network.network import Datum, Network, axes_in_use
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.base import Use
from tribrach.observations.control import Coordinate, DirectedComponents, Heights
from tribrach.observations.ellipsoidal import (
    EllipsoidArcs,
    EllipsoidChords,
    Latitudes,
    Longitudes,
)
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    Distances,
    HorizontalDistances,
    Sights,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.units import SEC

RUN = CliRunner()
SUFFIX = {"gkf": ".gkf", "dynaml": ".xml", "jsonl": ".jsonl", "starnet": ".dat"}
TRUTH = {
    "A": (0.0, 0.0, 10.0), "B": (180.0, 25.0, 12.0), "C": (160.0, 170.0, 39.0),
    "D": (-30.0, 145.0, 25.0), "E": (70.0, 80.0, 18.0),
}  # fmt: skip
NAMES = list(TRUTH)
PAIRS = [(a, b) for a in NAMES for b in NAMES if a != b]
GAMA = Path("networks") / "gama"
DYNADJUST = Path("networks") / "dynadjust"
STARNET = Path("networks") / "starnet"
SAMPLES = {
    "xml": ("gnss-networkstn.xml", "gnss-networkmsr.xml"),
    "dna": ("gnss-network.stn", "gnss-network.msr"),
    "skye": ("skye-tutorial.stn", "skye-tutorial.msr"),
}


def network_of(*paths: Path) -> Network:
    return observed_part(read_files(paths)).network()


def again(network: Network, format: str, folder: Path) -> tuple[Adjustment, Adjustment]:
    """The adjustments of a network and of what is read back from its export."""
    exported = export(network, format)
    assert exported.lost == ()
    path = folder / f"net{SUFFIX[format]}"
    for file in folder.glob("*.snproj"):
        file.unlink()
    for file, text in exported.files(path).items():
        file.write_text(text, encoding="utf-8")
    return adjust(network), adjust(network_of(path))


def places(adjustment: Adjustment, name: str) -> np.ndarray:
    """Where a point is, in the axes of the work frame or geocentric."""
    x = adjustment.state.points[adjustment.layout.index("point", name)]
    site = adjustment.network.site
    return x if isinstance(site, FlatSite) else site.to_ecef(x[None])[0]


def largest_difference(one: Adjustment, other: Adjustment) -> float:
    """Of coordinates that are part of the network [m]; those of either network, if they differ."""
    count = one.layout.count("point")
    free = one.network.free[: 3 * count].reshape(-1, 3)
    if isinstance(one.network.site, FlatSite) != isinstance(other.network.site, FlatSite):
        at = [a.state.points[a.layout.index("point", n)]
              for a in (one, other) for n in one.layout.names["point"]]  # fmt: skip
    else:
        at = [places(a, n) for a in (one, other) for n in one.layout.names["point"]]
        free = free if isinstance(one.network.site, FlatSite) else free | True
    both = np.array(at).reshape(2, count, 3)
    axes = (o.observed_axes(vars(o)) for o in one.network.observations)
    used = axes_in_use(axes, one.network.site)
    return float(np.abs(np.where(free & used, both[0] - both[1], 0.0)).max())


def assert_same(one: Adjustment, other: Adjustment) -> None:
    assert largest_difference(one, other) < 1e-9
    assert (other.dof, other.n_observations) == (one.dof, one.n_observations)
    if one.dof:
        factor = one.posterior_factor
        assert other.posterior_factor == pytest.approx(factor, rel=1e-6, abs=1e-9)
    for name in one.layout.names["point"]:
        same = one.covariance(name)
        if isinstance(one.network.site, FlatSite) == isinstance(other.network.site, FlatSite):
            found, size = other.covariance(name), np.abs(same).max()
            assert np.trace(found) == pytest.approx(np.trace(same), rel=1e-6, abs=1e-9 * size)


@pytest.mark.data
def test_every_gama_network_comes_back(shared_data: Path, tmp_path: Path) -> None:
    """All files of the collection, networks of one, two and three dimensions."""
    files = sorted((shared_data / GAMA).rglob("*.gkf"))
    assert len(files) > 40
    for file in files:
        assert_same(*again(network_of(file), "gkf", tmp_path))


@pytest.mark.data
@pytest.mark.parametrize("format", ["gkf", "dynaml", "jsonl"])
@pytest.mark.parametrize("sample", SAMPLES)
def test_dynadjust_samples_come_back(
    shared_data: Path, tmp_path: Path, sample: str, format: str
) -> None:
    """Clusters in other frames and epochs, from both formats, to both that hold vectors."""
    files = [shared_data / DYNADJUST / name for name in SAMPLES[sample]]
    assert_same(*again(network_of(*files), format, tmp_path))


@pytest.mark.data
def test_star_net_jobs_come_back(shared_data: Path, tmp_path: Path) -> None:
    """Every local job that adjusts, with curvature and refraction; the vectors of a real one."""
    folder = shared_data / STARNET
    jobs = [*sorted(folder.glob("ts_*.dat")), folder / "industry_case_leveling_input.txt"]
    # the misfit of this one is so large that it does not converge
    jobs = [job for job in jobs if job.name != "ts_all_combined.dat"]
    assert len(jobs) == 13
    for job in jobs:
        assert_same(*again(network_of(job), "starnet", tmp_path))
    campus = [folder / f"industry_case_gnss_{part}put.txt" for part in ("in", "out")]
    for format in ("gkf", "dynaml", "starnet"):
        assert_same(*again(network_of(*campus), format, tmp_path))


@pytest.mark.data
def test_a_campus_of_sights_levels_and_vectors_comes_back(
    shared_data: Path, tmp_path: Path
) -> None:
    """A real job in a grid: 313 unknowns, redundancy 1302."""
    folder = shared_data / STARNET
    campus = [folder / f"industry_case_combined_{part}put.txt" for part in ("in", "out")]
    one, other = again(network_of(*campus), "starnet", tmp_path)
    assert (one.dof, other.dof) == (1302, 1302)
    assert_same(one, other)


@pytest.mark.data
def test_gama_networks_without_inner_constraints_come_back_from_star_net(
    shared_data: Path, tmp_path: Path
) -> None:
    """What STAR*NET can hold comes back, and of the others the reason is said."""
    kept = 0
    for file in sorted((shared_data / GAMA).rglob("*.gkf")):
        network = network_of(file)
        try:
            lost = export(network, "starnet").lost
        except InputError:
            # vectors alone, which a job without a grid has not
            assert {o.kind for o in network.observations} == {"gnss_baseline"}
            continue
        if not lost:
            kept += 1
            assert_same(*again(network, "starnet", tmp_path))
        assert all("inner constraints" in each or "correlated" in each for each in lost)
    assert kept >= 30


@pytest.mark.data
def test_dynaml_obeys_the_schema_of_its_owner(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / DYNADJUST
    # the file says XML 1.1, which libxml2 does not read; nothing of that version is in it
    text = (folder / "DynaML.xsd").read_text().replace('version="1.1"', 'version="1.0"', 1)
    schema = etree.XMLSchema(etree.fromstring(text.encode()))
    for network in (network_of(*(folder / name for name in SAMPLES["xml"])), on_ellipsoid()):
        schema.assertValid(etree.fromstring(export(network, "dynaml").text.encode()))


def filled(survey: Survey, rng: np.random.Generator) -> Network:
    """The network with values that its truth would give, and errors."""
    network = survey.network()
    state = replace(network.start, points=np.array([TRUTH[n] for n in NAMES]))
    state.scalars[:] = np.linspace(0.3, 5.9, len(state.scalars))
    layout = network.start.layout
    assert layout.names["point"] == tuple(NAMES)
    tables = []
    for o in network.observations:
        sigma = np.sqrt(np.einsum("nii->ni", o.covariance))
        values = o.predict(state) + sigma * rng.normal(size=o.values.shape)
        tables.append(replace(o, values=values))
    return replace(network, observations=tuple(tables))


def add_pairs(survey: Survey, kind: type[Sights], pairs: list, sigma: float, **more: object) -> int:
    n = len(pairs)
    values = np.full(n, 100.0 if kind.units == ("m",) else 1.0)
    ends = {"start": [a for a, _ in pairs], "end": [b for _, b in pairs]}
    return survey.add(kind, values=values, sigma=np.full(n, sigma), **ends, **more)


def points(survey: Survey, held: int = 0) -> None:
    for k, (name, xyz) in enumerate(TRUTH.items()):
        survey.point(
            name, np.array(xyz) + 0.01 * (k >= held), free=(k >= held,) * 3,
            role="control" if k < held else "free",
        )  # fmt: skip


def on_a_plane() -> Network:
    """Everything that gama-local has, with whatever can be reduced; two values off."""
    rng = np.random.default_rng(3)
    survey = Survey(title="All <kinds> & more")
    points(survey, held=1)
    circles = [f"circle of {a}" for a, _ in PAIRS]
    first = add_pairs(survey, Directions, PAIRS, 3 * SEC, orientation=circles)
    add_pairs(survey, ZenithAngles, PAIRS, 5 * SEC, height_instrument=1.55, height_target=1.4)
    slope = add_pairs(survey, SlopeDistances, PAIRS[:8], 2e-3, height_instrument=1.6)
    add_pairs(survey, Distances, PAIRS[8:10], 1e-4)
    add_pairs(survey, HorizontalDistances, PAIRS[3:9], 3e-3, reduction=0.9996)
    add_pairs(survey, Azimuths, PAIRS[:2], 4 * SEC, convergence=0.01)
    survey.add(
        Angles, values=[1.0], sigma=5 * SEC, start=["E"], end=["A"], foresight=["C"],
        height_target=1.3,
    )  # fmt: skip
    survey.add(
        HeightDifferences, values=[1.0, 1.0], sigma=1e-3, start=["A", "B"], end=["B", "C"],
        height_start=0.2, geoid_start=0.03, geoid_end=0.05,
    )  # fmt: skip
    vector = survey.add(
        GnssBaselines, values=np.zeros((2, 3)), sigma=np.full((2, 3), 4e-3), start=["A", "A"],
        end=["C", "D"], height_end=1.8,
    )  # fmt: skip
    survey.add(
        GnssPositions, values=np.zeros((1, 3)), sigma=np.full((1, 3), 8e-3), position=["D"],
        antenna_height=2.0,
    )  # fmt: skip
    survey.add(
        Coordinate, values=[0.0, 0.0, 0.0], sigma=[2e-3, 3e-3, 1e-3], position=["B", "B", "C"],
        axis=[1, 0, 2],
    )  # fmt: skip
    survey.add(Heights, values=[0.0], sigma=2e-3, position=["E"])
    half = rng.normal(size=(6, 6))
    both = 1e-6 * (half @ half.T + 6 * np.eye(6))
    item, row = np.divmod(np.arange(6), 3)
    survey.correlate(np.full(6, vector), item, row, both)
    # two directions of one set, and a distance from there
    three = np.array([[9.0, 2, 0], [2, 9, 0], [0, 0, 4e-6 / SEC**2]]) * SEC**2
    three[0, 2] = three[2, 0] = 2 * SEC * 1e-3
    survey.correlate([first, first, slope], [0, 1, 0], [0, 0, 0], three)
    network = filled(survey, rng)
    zenith = next(o for o in network.observations if o.kind == "zenith")
    zenith.use[:2] = [Use.OFF, Use.CHECK]
    return network


def on_ellipsoid() -> Network:
    """Everything that DynaML has, on a site in the Alps; a station held in height alone."""
    rng = np.random.default_rng(4)
    site = EllipsoidSite(np.radians(46.5), np.radians(7.9), 560.0)
    survey = Survey(site=site)
    survey.reference = Reference(frame="ETRS89", epoch=2020.0)
    points(survey, held=1)
    up = site.axes(np.array([TRUTH["C"]]))[0, 2]
    x = np.array(TRUTH["C"]) + 0.01
    survey.add(
        DirectedComponents, values=[up @ x], position=["C"], direction=up[None], sigma=1.0,
        hard=True,
    )  # fmt: skip
    circles = [f"circle of {a}" for a, _ in PAIRS]
    add_pairs(survey, Directions, PAIRS, 3 * SEC, orientation=circles)
    add_pairs(survey, ZenithAngles, PAIRS, 5 * SEC, height_instrument=1.55, height_target=1.4)
    add_pairs(survey, SlopeDistances, PAIRS[:8], 2e-3, height_instrument=1.6, height_target=0.1)
    add_pairs(survey, Azimuths, PAIRS[:2], 4 * SEC)
    survey.add(Angles, values=[1.0], sigma=5 * SEC, start=["E"], end=["A"], foresight=["C"])
    survey.add(
        HeightDifferences, values=[1.0], sigma=1e-3, start=["A"], end=["B"], height_start=0.2
    )
    survey.add(Heights, values=[1.0], sigma=2e-3, position=["E"])
    survey.add(Latitudes, values=[0.8], sigma=1e-9, position=["D"])
    survey.add(Longitudes, values=[0.1], sigma=1e-9, position=["E"])
    for kind in (EllipsoidChords, EllipsoidArcs):
        survey.add(kind, values=[100.0], sigma=2e-3, start=["B"], end=["D"])
    vector = survey.add(
        GnssBaselines, values=np.zeros((2, 3)), sigma=np.full((2, 3), 4e-3), start=["A", "A"],
        end=["C", "D"],
    )  # fmt: skip
    survey.add(GnssPositions, values=np.zeros((1, 3)), sigma=np.full((1, 3), 8e-3), position=["D"])
    half = rng.normal(size=(6, 6))
    item, row = np.divmod(np.arange(6), 3)
    both = 1e-6 * (half @ half.T + 6 * np.eye(6))
    survey.correlate(np.full(6, vector), item, row, both)
    return filled(survey, rng)


def test_all_kinds_of_a_plane_come_back(tmp_path: Path) -> None:
    network = on_a_plane()
    exported = export(network, "gkf")
    assert exported.notes == ("2 observations that are off or a check: not written",)
    one, other = again(network, "gkf", tmp_path)
    assert_same(one, other)
    assert other.network.title == "All <kinds> & more"
    assert exported.written == sum(int((o.use == Use.ACTIVE).sum()) for o in network.observations)


def test_a_plane_with_names_and_curvature_comes_back_from_star_net(tmp_path: Path) -> None:
    """Without vectors and correlations; without curvature, and with that of another Earth."""
    network = on_a_plane()
    assert {words.split(" (")[0] for words in export(network, "starnet").lost} == {
        "direction", "slope distance", "GNSS baseline",
    }  # fmt: skip
    for radius in (None, 6.38e6):
        site = FlatSite(radius)
        tables = tuple(
            replace(o, site=site) if isinstance(o, Sights) else o
            for o in network.observations
            if o.kind != "gnss_baseline"
        )
        zenith = next(o for o in tables if o.kind == "zenith")
        zenith.refraction[:] = np.linspace(0.1, 0.2, len(zenith))
        plain = replace(network, observations=tables, joint=(), site=site)
        one, other = again(plain, "starnet", tmp_path)
        assert_same(one, other)


@pytest.mark.parametrize("format", ["dynaml", "jsonl"])
def test_all_kinds_of_the_ellipsoid_come_back(tmp_path: Path, format: str) -> None:
    one, other = again(on_ellipsoid(), format, tmp_path)
    # geocentric coordinates have a rounding of 1e-9 m
    assert largest_difference(one, other) < 3e-9
    assert (other.dof, other.n_observations) == (one.dof, one.n_observations)
    assert other.vtpv == pytest.approx(one.vtpv, rel=1e-6)
    for name in NAMES:
        trace = np.trace(one.covariance(name))
        assert np.trace(other.covariance(name)) == pytest.approx(trace, rel=1e-6, abs=1e-15)


def test_a_changed_value_would_be_seen(tmp_path: Path) -> None:
    """The comparison notices a tenth of a millimetre."""
    network = on_a_plane()
    path = tmp_path / "net.gkf"
    text = export(network, "gkf").text
    distance = next(o for o in network.observations if o.kind == "distance").values[0, 0]
    assert text.count(repr(float(distance))) == 1
    path.write_text(text.replace(repr(float(distance)), repr(float(distance) + 1e-4)))
    assert largest_difference(adjust(network), adjust(network_of(path))) > 1e-6


@pytest.mark.parametrize("names", [(), ("A", "B", "D")])
def test_inner_constraints_come_back(tmp_path: Path, names: tuple[str, ...]) -> None:
    network = on_a_plane().with_datum(Datum("free", names))
    absolute = ("gnss_position", "height", "coordinate")
    kept = tuple(o for o in network.observations if o.kind not in absolute)
    numbers = {id(o): k for k, o in enumerate(kept)}
    joint = tuple(
        replace(j, table=np.array([numbers[id(network.observations[t])] for t in j.table]))
        for j in network.joint
    )
    network = replace(network, observations=kept, joint=joint)
    assert_same(*again(network, "gkf", tmp_path))


def test_names_that_have_the_separator(tmp_path: Path) -> None:
    survey = Survey()
    names = ["A-1", "B:2", "C;3"]
    for name, xyz in zip(names, TRUTH.values(), strict=False):
        held = name != "C;3"
        survey.point(name, xyz, free=(not held,) * 3, role="control" if held else "free")
    pairs = [("A-1", "C;3"), ("B:2", "C;3"), ("A-1", "B:2")]
    add_pairs(survey, SlopeDistances, pairs, 2e-3, height_instrument=1.5)
    add_pairs(survey, ZenithAngles, pairs, 5 * SEC)
    add_pairs(survey, Azimuths, pairs[:2], 5 * SEC)
    network = survey.network()
    tables = tuple(replace(o, values=o.predict(network.start)) for o in network.observations)
    network = replace(network, observations=tables)
    assert ".SEPARATOR |" in export(network, "starnet").text
    assert_same(*again(network, "starnet", tmp_path))
    survey.point("D 4", (0, 0, 0))
    with pytest.raises(InputError, match="'D 4' is no name for STAR"):
        export(survey.network(), "starnet")


GRID_JOB = """
.3D
.ORDER EN
C A 500100 5200200 450 ! ! !
C B 500900 5200300 470 ! ! *
C C 500700 5200900 480 0.004 0.005 0.01
C D 500200 5200800 430
C E 500500 5200500 450 * * 0.003
B A-D 5-00-00 4 1.5/1.6
B C-D 280-00-00 4
D A-B 800 0.003 1.5/1.6
D A-C 900 0.003 1.5/0.2
.DELTA ON
D B-C 600 0.004
.DELTA OFF
V A-D 90-00-00 4 1.5/1.6
.REFRACTION 0.09
V B-E 90-00-00 4 1.5/1.6
V C-E 91-00-00 4
A E-A-B 90-00-00 3 1.5/1.6
DB D
DN A 0-00-00 3
DN C 100-00-00 3
DN E 50-00-00 3 1.5/1.6
DE
L A-E 2.0 500 0.002
L E-D -1.0 400 0.002
.GPS ADDHIHT 1.2 1.7
G1 A-D 1 2 3
G2 1e-5 2e-5 1e-5
G3 1e-6 -2e-6 1e-6
"""


def in_a_grid(folder: Path) -> Network:
    """A job in UTM 32 with everything that a job in a grid has, and values that fit."""
    (folder / "grid.dat").write_text(GRID_JOB)
    (folder / "grid.snproj").write_text(
        "[Adjustment]\nadjustment_type 3D\nlocal_or_grid_adjustment 1\n"
        "coordinate_system_name UTM84-32\n"
    )
    network = network_of(folder / "grid.dat", folder / "grid.snproj")
    rng, tables = np.random.default_rng(2), []
    state = network.start
    state.scalars[:] = 0.7
    for o in network.observations:
        sigma = np.sqrt(np.einsum("nii->ni", o.covariance))
        tables.append(replace(o, values=o.predict(state) + sigma * rng.normal(size=o.values.shape)))
    return replace(network, observations=tuple(tables))


def test_a_job_in_a_grid_comes_back_with_its_project(tmp_path: Path) -> None:
    """Held, partly held and weighted points, bearings, refraction, antennas over marks."""
    network = in_a_grid(tmp_path)
    exported = export(network, "starnet")
    assert "UTM84-32" in exported.beside[".snproj"]
    assert '"net.dat"' in exported.files(tmp_path / "net.dat")[tmp_path / "net.snproj"]
    one, other = again(network, "starnet", tmp_path)
    assert one.dof > 4
    # northings of 5,200 km have a rounding of 1e-9 m
    assert largest_difference(one, other) < 3e-9
    assert (other.dof, other.n_unknowns) == (one.dof, one.n_unknowns)
    assert other.posterior_factor == pytest.approx(one.posterior_factor, rel=1e-5)


@pytest.mark.parametrize(
    ("crs", "name"),
    [("EPSG:2953", "NEWBRUNSWICK83"), ("EPSG:26919", "UTM83-19"), ("EPSG:32632", "UTM84-32"),
     ("EPSG:32188", "MTM83-8"), ("EPSG:2154", "EPSG:2154")],
)  # fmt: skip
def test_grids_go_by_the_names_of_star_net(crs: str, name: str) -> None:
    assert name_of_grid(crs) == name
    assert grid_of(name) == crs


def scanned() -> Network:
    survey = Survey()
    points(survey, held=3)
    survey.station("S")
    target = np.array([TRUTH[n] for n in NAMES])
    survey.add(
        TargetCentres, values=target, covariance=np.tile(1e-6 * np.eye(3), (5, 1, 1)),
        station=["S"] * 5, target=NAMES,
    )  # fmt: skip
    add_pairs(survey, SlopeDistances, PAIRS[:12], 2e-3)
    return filled(survey, np.random.default_rng(1))


def test_what_a_format_cannot_hold_is_named_with_counts() -> None:
    lost = export(scanned(), "gkf").lost
    assert lost == ("target centre (5): gama-local has no such observations",)
    bent = replace(on_a_plane(), site=FlatSite(6.37e6))
    assert "zenith (18): with curvature and refraction" in export(bent, "gkf").lost[0]
    words = export(on_ellipsoid(), "gkf").lost
    assert any(w.startswith("direction (20): its plumb lines are not parallel") for w in words)
    with pytest.raises(InputError, match="computed in a grid, and this network is in none"):
        export(on_ellipsoid(), "starnet")
    with pytest.raises(InputError, match="the site of this network is flat"):
        export(on_a_plane(), "dynaml")
    alone = replace(on_a_plane(), observations=())
    with pytest.raises(InputError, match="can hold none of the observations"):
        export(replace(alone, joint=()), "gkf")


def test_refraction_and_unknown_scales_are_not_dropped_silently() -> None:
    survey = Survey(site=on_ellipsoid().site)
    survey.reference = Reference(frame="ETRS89", epoch=2020.0)
    points(survey, held=2)
    add_pairs(survey, ZenithAngles, PAIRS, 5 * SEC, refraction=0.13)
    add_pairs(survey, SlopeDistances, PAIRS, 2e-3, scale=["m"] * len(PAIRS))
    add_pairs(survey, Azimuths, PAIRS, 2e-5)
    lost = export(filled(survey, np.random.default_rng(1)), "dynaml").lost
    assert set(lost) == {
        "zenith (20): with refraction",
        "slope distance (20): with an unknown scale",
    }


def test_the_command(tmp_path: Path) -> None:
    source = tmp_path / "net.gkf"
    source.write_text(export(on_a_plane(), "gkf").text)
    done = RUN.invoke(app, ["export", str(source), "--to", "gkf"])
    assert done.exit_code == 0, done.output
    written = tmp_path / "net-export.gkf"
    assert_same(adjust(network_of(source)), adjust(network_of(written)))
    assert "observations" in done.output
    refused = RUN.invoke(app, ["export", str(source), "--to", "dynaml"])
    assert refused.exit_code == 2
    assert "is flat" in refused.output
    assert not (tmp_path / "net.xml").exists()


def test_the_command_refuses_half_a_network_unless_it_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(
        "point,e_m,n_m,u_m,role\nA,0,0,0,fixed\nB,100,0,1,fixed\nC,50,80,2,approximate\n"
    )
    (tmp_path / "t.csv").write_text(
        "from,to,slope_distance_m,zenith_gon,sigma_distance_mm,sigma_zenith_arcsec\n"
        "A,B,100.005,99.3634,2,10\nA,C,94.361,98.6507,2,10\nB,C,94.345,99.325,2,10\n"
    )
    (tmp_path / "net.toml").write_text(
        "[site]\ncurvature_radius_m = 6370000.0\n[[points]]\nfile = 'c.csv'\n"
        "[[observations]]\nfile = 't.csv'\n"
    )
    words = ["export", str(tmp_path / "net.toml"), "--to", "gkf", "-o", str(tmp_path / "n.gkf")]
    refused = RUN.invoke(app, words)
    assert refused.exit_code == 2
    assert "zenith (3): with curvature and refraction" in refused.output
    assert "--partial" in refused.output
    assert not (tmp_path / "n.gkf").exists()
    done = RUN.invoke(app, [*words, "--partial"])
    assert done.exit_code == 0, done.output
    assert "3 observations" in done.output
    assert (tmp_path / "n.gkf").is_file()
