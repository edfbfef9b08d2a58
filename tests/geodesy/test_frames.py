"""Reference frames by name, and transformations between them."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geodesy import frames

#: Alice Springs in GDA94, GDA2020 and ITRF2014 at 2018.0 (ICSM, GDA2020 Technical Manual)
GDA94 = np.array([[-4052051.7643, 4212836.2017, -2545106.0245]])
GDA2020 = np.array([[-4052052.7379, 4212835.9897, -2545104.5898]])
ITRF2014 = np.array([[-4052052.6588, 4212835.9938, -2545104.6946]])
ITRF2014_IN_GDA2020 = np.array([[-4052052.7373, 4212835.9835, -2545104.5867]])


def test_published_examples():
    got, accuracy = frames.transform(GDA94, "GDA94", "GDA2020", 2020.0)
    np.testing.assert_allclose(got, GDA2020, atol=1e-4)
    assert accuracy == pytest.approx(0.01)
    got, _ = frames.transform(ITRF2014, "ITRF2014", "GDA2020", 2018.0)
    np.testing.assert_allclose(got, ITRF2014_IN_GDA2020, atol=1e-4)


@pytest.mark.parametrize("name", frames.ICSM)
def test_published_parameters_agree_with_the_epsg_chain(name):
    """Two routes from an older ITRF to GDA2020: EPSG's through ITRF2014 and the owner's."""
    through, _ = frames.transform(ITRF2014, name, "ITRF2014", 2004.0)
    expected, _ = frames.transform(through, "ITRF2014", "GDA2020", 2004.0)
    got, accuracy = frames.transform(ITRF2014, name, "GDA2020", 2004.0)
    assert np.abs(got - expected).max() < (0.06 if name == "ITRF96" else 0.01)
    assert accuracy == frames.ICSM_ACCURACY


def test_same_frame_is_left_alone():
    got, accuracy = frames.transform(GDA94, "WGS 84", "wgs84", 2000.0)
    assert got is GDA94
    assert accuracy == 0.0


def test_epoch_per_point():
    both, _ = frames.transform(
        np.repeat(ITRF2014, 2, axis=0), "ITRF2014", "GDA2020", np.array([2018.0, 2020.0])
    )
    np.testing.assert_allclose(both[0], ITRF2014_IN_GDA2020[0], atol=1e-4)
    np.testing.assert_allclose(both[1], ITRF2014[0], atol=1e-6)


def test_names_and_kinds():
    assert frames.frame("itrf 2014").to_epsg() == 7789
    assert frames.frame("ITRF1997") == frames.frame("ITRF97")
    assert frames.is_dynamic("ITRF2014")
    assert not frames.is_dynamic("GDA2020")
    a, f = frames.ellipsoid("GDA2020")
    assert (a, round(1 / f, 9)) == (6378137.0, 298.257222101)


def test_unknown_frames_and_ways():
    with pytest.raises(InputError, match="'XYZ99' is not known"):
        frames.frame("XYZ99")
    with pytest.raises(InputError, match="no transformation from ETRS89 to GDA2020"):
        frames.transform(GDA94, "ETRS89", "GDA2020", 2020.0)


def test_decimal_years():
    assert frames.decimal_year("01.01.2020") == 2020.0
    assert frames.decimal_year("02.07.2019") == pytest.approx(2019 + 182 / 365)
    assert frames.decimal_year("2019.5") == 2019.5
    for text in ("31.02.2020", "yesterday", "1.2.3.4", ""):
        with pytest.raises(InputError, match="is not a date"):
            frames.decimal_year(text)
