import numpy as np

from tribrach.targets.detection import with_floor


def test_floor_adds_in_every_direction():
    np.testing.assert_allclose(with_floor(np.diag([1.0, 4, 9]), 2.0), np.diag([5.0, 8, 13]))
