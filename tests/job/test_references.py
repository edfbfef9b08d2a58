"""Scans of a project on references: in the one network, with what else places them."""

from pathlib import Path

import laspy
import numpy as np
import pytest
from scipy.stats import chi2

import tribrach as tb
from tests.registration.clouds.airborne import airborne
from tests.registration.clouds.scenes import points_of, yard
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp, log
from tribrach.report.chapters.registration import RegistrationPart
from tribrach.report.content import Report
from tribrach.simulate.setups import levelled

ORIGIN = np.array([500_000.0, 5_000_000.0, 300.0])
OFFSET = np.array([0.02, -0.03, 0.04])
SHARED = 0.03


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Pose]:
    """An airborne cloud, a scan with a rough pose, and where it truly stood."""
    folder, rng = tmp_path_factory.mktemp("town"), np.random.default_rng(5)
    header = laspy.LasHeader(point_format=0)
    header.offsets, header.scales = ORIGIN, np.full(3, 0.001)
    las = laspy.LasData(header)
    las.x, las.y, las.z = (airborne(yard(), rng) + ORIGIN + OFFSET).T
    las.write(str(folder / "air.las"))
    pose = levelled((-4.0, 3.0, 1.6), 0.3, 5e-5, rng)
    np.savetxt(folder / "S1.xyz", points_of(yard(), pose, 50_000, 1), fmt="%.4f")
    true = Pose(pose.rotation, pose.translation + ORIGIN)
    turned = exp(rng.normal(0, np.radians(1.0), 3) * [0.2, 0.2, 1.0]) @ pose.rotation
    near = Pose(turned, true.translation + np.array([0.2, -0.3, 0.1]))
    np.savetxt(folder / "S1.pose.txt", near.matrix)
    return folder, true


def ran(town: Path, more: str = "") -> Report:
    """A run of a project with these files; what was matched before is remembered."""
    lines = '[reference]\nfile = "air.las"\nshared_mm = 30\n[cloud]\nwrite = false\n'
    lines += '[registration]\nby = ["clouds"]\nposes = ["S1.pose.txt"]\n'
    lines += '[[scans]]\nfile = "S1.xyz"\norigin = "scanner"\n'
    (town / "job.toml").write_text(lines + more)
    return tb.run(town / "job.toml", town / "out")


def square(report: Report, true: Pose) -> float:
    """Squared error of the pose over its covariance (6)."""
    adjustment = report.adjustment
    at = adjustment.layout.index("pose", "S1")
    off = adjustment.state.pose_t[at] - true.translation
    turn = log(adjustment.state.pose_r[at] @ true.rotation.T)
    error = np.concatenate([off, turn])
    return float(error @ np.linalg.solve(adjustment.covariance("S1"), error))


def of_references(report: Report) -> RegistrationPart:
    chapter = report.chapter("registration")
    assert chapter is not None
    assert isinstance(chapter.data, RegistrationPart)
    return chapter.data


def test_a_reference_alone_places_a_scan(town: tuple[Path, Pose]) -> None:
    folder, true = town
    report = ran(folder)
    assert square(report, true) < chi2.ppf(0.999, 6)
    sigma = np.sqrt(np.diag(report.adjustment.covariance("S1")))[:3]
    assert np.allclose(sigma, SHARED, rtol=0.02)
    part = of_references(report)
    (offset,) = part.offsets
    assert offset.fits is None
    (placed,) = part.placed_on
    assert placed.agrees > 0.7


@pytest.mark.parametrize("wrong", [0.0, 0.15])
def test_control_and_a_reference_hold_each_other(town: tuple[Path, Pose], wrong: float) -> None:
    folder, true = town
    figures = ",".join(f"{value:.4f}" for value in true.translation + np.array([wrong, 0, 0]))
    head = "point,easting,northing,height,sigma_e_mm,sigma_n_mm,sigma_h_mm\n"
    (folder / "gnss.csv").write_text(f"{head}M1,{figures},5,5,5\n")
    more = '[[points]]\nfile = "gnss.csv"\n[stations.S1]\noccupies = "M1"\ninstrument = "p40"\n'
    more += '[instruments.p40]\nsheet = "Leica ScanStation P40"\ncentring_mm = 1\nheight_mm = 1\n'
    report = ran(folder, more)
    (offset,) = of_references(report).offsets
    assert offset.fits is (wrong == 0)
    if not wrong:
        assert square(report, true) < chi2.ppf(0.999, 6)
        assert np.all(np.abs(-OFFSET - offset.offset) < 4 * np.array(offset.sigma))
        assert max(offset.sigma) < 0.01


def test_a_reference_that_is_not_there_is_named_by_its_line(
    town: tuple[Path, Pose], tmp_path: Path
) -> None:
    folder, _ = town
    project = folder / "lost.toml"
    project.write_text('[[scans]]\nfile = "S1.xyz"\n[[reference]]\nfile = "lost.las"\n')
    with pytest.raises(InputError) as refused:
        tb.run(project, tmp_path / "lost")
    assert refused.value.line == 4
