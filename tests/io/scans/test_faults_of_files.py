"""Sound files of others that were misread, each with what is right."""

from pathlib import Path

import numpy as np
import pytest

from tests.io.scans.scan_files import whole
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import describe


@pytest.fixture
def faults(shared_data: Path) -> Path:
    folder = shared_data / "faults" / "scans2"
    if not folder.is_dir():
        pytest.skip(f"there is no {folder}")
    return folder


def test_feet(faults: Path) -> None:
    earlier, later = (
        read_scans(faults / "03-feet" / f"{name}.las")[0] for name in ("earlier", "later")
    )
    one, two = whole(earlier, 30000).xyz, whole(later, 30000).xyz
    assert np.ptp(one, axis=0)[:2] == pytest.approx([10.05, 10.05], abs=0.01)
    assert two[:, 2].mean() - one[:, 2].mean() == pytest.approx(0.1 * 1200 / 3937, abs=5e-5)


def test_millimetres(faults: Path) -> None:
    (stated,) = read_scans(faults / "17-millimetres" / "m.ply")
    assert np.ptp(whole(stated, 40000).xyz, axis=0).max() == pytest.approx(18.0, abs=0.01)
    (silent,) = read_scans(faults / "17-millimetres" / "m.xyz")
    assert describe(silent).steep > 300
