"""The error budget of a station: regions, sums, chart and table; the sample is taken once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.network.facade import facade
from tribrach.cloud.placement import Placement
from tribrach.geometry.pose import Pose
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.formats import read_scans
from tribrach.job.budget import error_budget
from tribrach.job.scans import StationScan
from tribrach.job.shared import shared_part
from tribrach.job.state import Remembered
from tribrach.job.surface_samples import SurfaceSamples
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.report.chapters.error_budget import budget_charts, budget_table
from tribrach.report.columns import ColumnSet
from tribrach.report.numbers import Style
from tribrach.scan.surface_sample import surface_sample
from tribrach.units import SEC

NOISE = ScanNoise(1.2e-3, 10e-6, 8 * SEC, 8 * SEC, 4e-3, 0.3e-3)


def samples(folder: Path) -> SurfaceSamples:
    return SurfaceSamples(Remembered(folder), lambda *_: None)


@pytest.fixture(scope="module")
def adjustment() -> Adjustment:
    return adjust(facade().network())


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> StationScan:
    """A wall at 15 m in front of S1, 30 m wide: straight in the middle, slanted at its ends."""
    y, z = np.meshgrid(np.linspace(-15, 15, 300), np.linspace(-2, 2, 60), indexing="ij")
    path = tmp_path_factory.mktemp("scan") / "S1.xyz"
    np.savetxt(path, np.stack([np.full(y.size, 15.0), y.ravel(), z.ravel()], axis=1), fmt="%.4f")
    one = replace(read_scans(path)[0], origin="stated")
    return StationScan("S1", "S1", one, NOISE, True, {})


def test_regions_add_up(adjustment: Adjustment, scan: StationScan, tmp_path: Path) -> None:
    (where,) = shared_part([scan], adjustment).scans.values()
    rows = error_budget([scan], {"S1": where}, adjustment, samples(tmp_path))
    assert [row.region for row in rows] == ["10 to 20 m, 0 to 30°", "10 to 20 m, 30 to 45°",
                                            "20 to 30 m, 30 to 45°"]  # fmt: skip
    assert sum(row.share for row in rows) == pytest.approx(1, abs=0.1)
    names = [part.name for part in rows[0].parts]
    assert names == ["control", "total station", "own targets", "targets of others", "levelling",
                     "other", "range", "incidence", "horizontal angle", "vertical angle",
                     "beam width"]  # fmt: skip
    for row in rows:
        assert row.normal is not None
        assert row.tangential is not None
        assert row.normal + row.tangential == pytest.approx(row.variance)
        for part in row.parts:
            assert -1e-15 <= part.normal <= part.variance
    # the normal of the wall is the scanner's x: control moves it as the network says
    turned = where.pose.rotation.T @ where.covariance[:3, :3] @ where.pose.rotation
    station = sum(p.normal for p in rows[0].parts[:6])
    assert station == pytest.approx(turned[0, 0], rel=0.3)
    assert rows[0].part("range") == pytest.approx(1.36e-3**2, rel=0.05)


def test_sample_is_taken_once(
    adjustment: Adjustment, scan: StationScan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    where = shared_part([scan], adjustment).scans
    first = error_budget([scan], where, adjustment, samples(tmp_path))

    def fail(scan: object) -> None:
        raise AssertionError("sampled twice")

    monkeypatch.setattr("tribrach.job.surface_samples.surface_sample", fail)
    assert error_budget([scan], where, adjustment, samples(tmp_path)) == first


def test_posterior_factor_scales_the_station_only(
    adjustment: Adjustment, scan: StationScan, tmp_path: Path
) -> None:
    state = samples(tmp_path)
    before = error_budget([scan], shared_part([scan], adjustment).scans, adjustment, state)[0]
    twice = error_budget(
        [scan], shared_part([scan], adjustment, 4.0).scans, adjustment, state, 4.0
    )[0]
    assert twice.part("control") == pytest.approx(4 * before.part("control"))
    assert twice.part("range") == pytest.approx(before.part("range"))


def test_scans_without_noise_have_no_budget(
    adjustment: Adjustment, scan: StationScan, tmp_path: Path
) -> None:
    where = Placement("S1", Pose(np.eye(3), np.zeros(3)), adjustment.covariance("S1"), None)
    assert error_budget([scan], {"S1": where}, adjustment, samples(tmp_path)) == []


def test_table_and_chart(adjustment: Adjustment, scan: StationScan, tmp_path: Path) -> None:
    rows = error_budget(
        [scan], shared_part([scan], adjustment).scans, adjustment, samples(tmp_path)
    )
    table = budget_table(rows, ColumnSet(Style()))
    heads = [column.head for column in table.columns]
    assert {"control", "range", "angles", "3D σ", "σ along the normal"} <= set(heads)
    first = {head: cell.key for head, cell in zip(heads, table.rows[0].cells, strict=True)}
    parts = heads[3 : heads.index("own σ")]
    assert sum(first[name] ** 2 for name in parts) == pytest.approx(first["3D σ"] ** 2)
    both = first["own σ"] ** 2 + first["shared σ"] ** 2
    assert both == pytest.approx(first["3D σ"] ** 2)
    charts = budget_charts(rows, ColumnSet(Style()))
    assert [chart.name for chart in charts] == ["budget-S1"]
    drawing = charts[0].drawing
    assert drawing is not None
    panels = [mark for mark in drawing.marks if mark.inner]
    blocks = [inner for panel in panels for inner in panel.inner if inner.tag == "rect"]
    assert any("range" in block.title and "mm²" in block.title for block in blocks)
    assert "Largest parts along the normal" in charts[0].caption


def test_samples_know_the_wall(scan: StationScan) -> None:
    normals = surface_sample(scan.scan).normals
    assert normals[:, 0] == pytest.approx(-1, abs=1e-6)


def lit(scan: StationScan, folder: Path, noise: ScanNoise) -> StationScan:
    """The wall again with intensities that fall off along it."""
    table = np.loadtxt(scan.scan.path)
    light = np.rint(4000 * (1 - np.abs(table[:, 1]) / 16))
    path = folder / "S1.xyz"
    head = "x y z intensity"
    np.savetxt(path, np.column_stack([table, light]), "%.4f", header=head, comments="")
    one = replace(read_scans(path)[0], origin="stated")
    return StationScan("S1", "S1", one, noise, True, {})


def test_own_neighbours_and_shared_add_up_by_intensity(
    adjustment: Adjustment, scan: StationScan, tmp_path: Path
) -> None:
    law = RangeLaw(0.2, -0.75, 0.0003, 100.0, 5000.0)
    noise = replace(NOISE, law=law, shared_share=0.4, systematic=5 * SEC)
    one = lit(scan, tmp_path, noise)
    rows = error_budget([one], shared_part([one], adjustment).scans, adjustment, samples(tmp_path))
    by_light = [row for row in rows if row.by == "intensity"]
    assert len(by_light) == 4
    assert sum(row.share for row in by_light) == pytest.approx(1, abs=0.02)
    for row in rows:
        assert row.neighbours is not None
        assert row.own + row.neighbours + row.shared == pytest.approx(row.variance)
        systematic = row.part("systematic angles")
        assert systematic is not None
        ranges = row.part("range", "incidence")
        assert ranges is not None
        assert row.neighbours == pytest.approx(0.4 * ranges + systematic)
        assert row.part("incidence") == pytest.approx(0, abs=1e-15)
    dark, *_, bright = by_light
    for row in (dark, bright):
        low, high = (float(word) for word in row.region.split()[1::2])
        ranges = row.part("range")
        assert ranges is not None
        assert law.sigma([high])[0] ** 2 < ranges < law.sigma([low])[0] ** 2
    assert len({round(1e9 * row.shared) for row in rows}) > 1
    charts = budget_charts(rows, ColumnSet(Style()))
    assert [chart.name for chart in charts] == ["budget-S1"]
