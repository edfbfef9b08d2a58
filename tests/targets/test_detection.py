import json

import numpy as np

from tribrach.targets.detection import Detection, Rejected, with_floor


def test_json_has_the_promised_keys():
    d = Detection(
        "sphere", "S1", np.array([1.0, 2, 3]), np.eye(3) * 1e-6, 0.07, 1e-3, 500, 400, 3.7,
        float("nan"), 0.9, {"s0": 1.0}, ("odd",),
    )  # fmt: skip
    text = json.loads(json.dumps(d.to_dict()))
    keys = ["kind", "scan", "center", "covariance", "radius", "rms", "points", "range", "incidence"]
    assert set(keys) <= text.keys()
    assert text["center"] == [1.0, 2.0, 3.0]
    assert text["covariance"][1] == [0.0, 1e-6, 0.0]
    assert text["incidence"] is None
    np.testing.assert_allclose(d.sigmas, 1e-3)
    again = Detection.from_dict(text)
    assert np.isnan(again.incidence)
    assert again.to_dict() == d.to_dict()
    rejected = Rejected("disc", np.zeros(3), "too small").to_dict()
    assert rejected == {"kind": "disc", "center": [0.0, 0.0, 0.0], "reason": "too small"}


def test_floor_adds_in_every_direction():
    np.testing.assert_allclose(with_floor(np.diag([1.0, 4, 9]), 2.0), np.diag([5.0, 8, 13]))
