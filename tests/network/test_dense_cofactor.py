"""A cofactor matrix that is there as a whole answers as one behind a factor does."""

import numpy as np
import scipy.sparse as sp

from tribrach.calibration.minimum_norm import DenseCofactor


def test_blocks_and_forms_are_those_of_the_matrix() -> None:
    rng = np.random.default_rng(3)
    a = rng.normal(size=(7, 7))
    q = a @ a.T
    cofactor = DenseCofactor(q, 0)
    columns = np.array([[0, 3, 5], [2, -1, 6]])
    blocks = cofactor.blocks(columns)
    assert np.array_equal(blocks[0], q[np.ix_([0, 3, 5], [0, 3, 5])])
    assert np.array_equal(blocks[1][::2, ::2], q[np.ix_([2, 6], [2, 6])])
    assert not blocks[1][1].any()
    assert not blocks[1][:, 1].any()
    b = rng.normal(size=(7, 6)) * (rng.random((7, 6)) < 0.5)
    forms = cofactor.forms(sp.csc_array(b), 2)
    for k in range(3):
        part = b[:, 2 * k : 2 * k + 2]
        np.testing.assert_allclose(forms[k], part.T @ q @ part, atol=1e-12)
