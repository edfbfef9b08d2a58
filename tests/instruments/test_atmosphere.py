"""Refraction of air against other formulas and published figures."""

import numpy as np
import pytest

from tribrach.instruments.atmosphere import (
    REFERENCE,
    Air,
    first_velocity_ppm,
    refractivity,
    vapour_pressure_hpa,
)


def barrell_sears(temperature, pressure, humidity, wavelength):
    """Group refractivity of IUGG 1963 (Barrell & Sears), another set of constants."""
    dry = 287.604 + 3 * 1.6288 / wavelength**2 + 5 * 0.0136 / wavelength**4
    alpha = 1 / 273.15
    vapour = humidity / 100 * 6.1078 * 10 ** (7.5 * temperature / (237.3 + temperature))
    return (dry * pressure / 1013.25 - 0.055 * 760 / 1013.25 * vapour) / (1 + alpha * temperature)


@pytest.mark.parametrize("wavelength", [0.633, 0.658, 0.85, 0.91])
@pytest.mark.parametrize("air", [(-10, 950, 80), (12, 1013.25, 60), (30, 900, 50), (35, 1020, 90)])
def test_agrees_with_the_older_formula(air, wavelength):
    """Both hold to about 1 ppm."""
    assert refractivity(*air, wavelength) == pytest.approx(barrell_sears(*air, wavelength), abs=0.6)


def test_dry_air_at_zero_degrees():
    """By definition N is the group refractivity of the dispersion formula."""
    expected = 287.6155 + 4.88660 / 0.85**2 + 0.06800 / 0.85**4
    assert refractivity(0, 1013.25, 0, 0.85) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("temperature", "pressure", "humidity"), [(12, 1013.25, 60), (30, 950, 60), (-5, 1000, 60)]
)
def test_correction_of_an_infrared_instrument(temperature, pressure, humidity):
    """The maker's formula of an 0.85 um instrument (Leica TPS manuals), to 1 ppm."""
    alpha = 1 / 273.15
    x = 7.5 * temperature / (237.3 + temperature) + 0.7857
    maker = 281.8 - (
        0.29065 * pressure / (1 + alpha * temperature)
        - 4.126e-4 * humidity / (1 + alpha * temperature) * 10**x
    )
    ours = first_velocity_ppm(temperature, pressure, humidity, wavelength_um=0.85)
    assert ours == pytest.approx(maker, abs=1.0)


def test_nothing_to_correct_in_the_reference_air():
    found = first_velocity_ppm(REFERENCE.temperature_c, REFERENCE.pressure_hpa, 60.0)
    assert found == pytest.approx(0.0, abs=1e-12)


def test_rules_of_thumb():
    """One degree is about +1 ppm, 3.5 hPa less about +1 ppm."""
    warm = first_velocity_ppm(13.0, 1013.25, 60.0)
    low = first_velocity_ppm(12.0, 1013.25 - 3.5, 60.0)
    assert 0.9 < warm < 1.1
    assert 0.9 < low < 1.1


def test_unknown_humidity_is_that_of_the_reference():
    assert first_velocity_ppm(25.0, 980.0, np.nan) == first_velocity_ppm(25.0, 980.0, 60.0)
    assert np.isnan(first_velocity_ppm(np.nan, 980.0, 60.0))


def test_saturated_vapour():
    """Steam tables: 6.112 hPa at 0, 23.39 at 20, 42.46 at 30 degrees; Magnus holds to 0.4 %."""
    found = vapour_pressure_hpa([0.0, 20.0, 30.0], 100.0)
    np.testing.assert_allclose(found, [6.112, 23.39, 42.46], rtol=4e-3)


def test_other_reference():
    assert first_velocity_ppm(15.0, 1013.25, 0.0, reference=Air(15.0, 1013.25, 0.0)) == 0
