import numpy as np
import pytest

from tests.comparison.planes import plane
from tribrach.comparison.cloud_parts import whole
from tribrach.comparison.m3c2 import M3C2Settings, m3c2

UTM = np.array([584_123.4, 2_326_011.7, 12.3])


@pytest.mark.parametrize("median", [False, True])
def test_distances_and_levels_of_py4dgeo(median, tmp_path) -> None:
    py4dgeo = pytest.importorskip("py4dgeo", reason="py4dgeo is not installed")
    # else it writes a log into the working directory
    py4dgeo.set_py4dgeo_logfile(str(tmp_path / "py4dgeo.log"))
    rng = np.random.default_rng(1)
    normal = np.array([0.2, -0.9, 0.3])
    a, b = (plane(rng, normal, o, 20_000, sigma=0.004, origin=UTM) for o in (0.0, 0.01))
    core = plane(rng, normal, 0.0, 200, size=1.5, origin=UTM)
    settings = M3C2Settings([0.5], 0.2, 0.05, registration=2e-3, median=median, direction=normal)
    ours = m3c2(whole(a, most=7000), whole(b), core, settings)
    peer = py4dgeo.M3C2(
        epochs=(py4dgeo.Epoch(a), py4dgeo.Epoch(b)),
        corepoints=core,
        cyl_radius=0.1,
        max_distance=0.05,
        normal_radii=[0.25],
        orientation_vector=normal,
        registration_error=2e-3,
        robust_aggr=median,
    )
    distance, uncertainty = peer.run()
    assert ours.normals.vectors == pytest.approx(peer.directions(), abs=1e-12)
    assert np.array_equal(ours.first.count, uncertainty["num_samples1"])
    assert np.array_equal(ours.second.count, uncertainty["num_samples2"])
    assert ours.distance == pytest.approx(distance, abs=1e-8)
    if not median:
        assert ours.lod95 == pytest.approx(uncertainty["lodetection"], abs=1e-8)
        assert ours.second.spread == pytest.approx(uncertainty["spread2"], abs=1e-8)
