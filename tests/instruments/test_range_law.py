"""The law of the noise of ranges: its values, its ends, and what is refused."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise

LAW = RangeLaw(0.8, -0.75, 0.0004, 200.0, 40_000.0)


def test_the_law_is_its_formula_and_constant_far_beyond_its_intensities() -> None:
    light = np.array([256.0, 10_000.0, 1.0, -5.0, 65_535.0, np.nan])
    sigma = LAW.sigma(light)
    # 256^-0.75 = 1/64 and 10000^-0.75 = 1/1000, by hand
    assert sigma[:2] == pytest.approx([0.8 / 64 + 0.0004, 0.0008 + 0.0004], rel=1e-12)
    # weaker light has more noise, down to a tenth of the least intensity: 20^-0.75 = 0.105737
    assert sigma[2] == sigma[3] == pytest.approx(0.8 * 0.105737 + 0.0004, rel=1e-5)
    assert LAW.sigma(np.array([81.0]))[0] == pytest.approx(0.8 / 27 + 0.0004, rel=1e-12)
    assert LAW.limits[1] == pytest.approx(0.8 * 200**-0.75 + 0.0004)
    assert sigma[4] == pytest.approx(LAW.limits[0])
    assert np.isnan(sigma[5])
    assert LAW.outside(light) == 4
    whole = LAW.sigma(np.array([256, 10_000], dtype=np.uint16))
    assert whole == pytest.approx(sigma[:2], rel=1e-12)


def test_where_an_intensity_is_known_the_law_takes_the_place_of_range_and_incidence() -> None:
    noise = ScanNoise(0.002, 1e-5, 1e-5, 1e-5, law=LAW)
    length, cosine = np.array([10.0, 100.0, 100.0]), np.array([1.0, 0.5, 0.5])
    sigma = noise.range_sigma(length, cosine, np.array([256.0, 256.0, np.nan]))
    assert sigma == pytest.approx([0.0129, 0.0129, 0.006], rel=1e-12)
    assert noise.range_sigma(length, cosine) == pytest.approx([0.0021, 0.006, 0.006], rel=1e-12)
    assert noise.random.law is LAW


@pytest.mark.parametrize(
    "figures",
    [
        (-1e-3, -1.0, 0.001, 1.0, 2.0),
        (1e-3, 0.5, 0.001, 1.0, 2.0),
        (1e-3, -1.0, -0.001, 1.0, 2.0),
        (1e-3, -1.0, 0.001, 0.0, 2.0),
        (1e-3, -1.0, 0.001, 3.0, 2.0),
        (0.0, -1.0, 0.0, 1.0, 2.0),
        (1e-3, -1.0, np.nan, 1.0, 2.0),
        (1e-3, -10.0, 0.0, 1e-300, 2.0),
    ],
)
def test_what_gives_no_sigma_is_refused(figures: tuple[float, float, float, float, float]) -> None:
    with pytest.raises(InputError, match="the law of the noise of ranges has"):
        RangeLaw(*figures)
