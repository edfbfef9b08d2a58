"""Coordinates of other frames and epochs: against PROJ's own pipeline and published motion."""

import numpy as np
import pytest
from pyproj import Transformer

from tribrach.errors import InputError
from tribrach.geodesy.epochs import Motion, Realisation, carry
from tribrach.geodesy.site import ecef_from_geodetic

KONYA = ecef_from_geodetic(*np.radians([37.87, 32.5]), np.float64(1020.0))[None]
ITRF96, ITRF2014 = Realisation("ITRF96", 2005.0), Realisation("ITRF2014", 2026.9)

# ITRF96 to ITRF2014 as IERS publishes it: shifts [mm], scale [ppb], turn [mas] of ITRF2014 to
# ITRF96 at 2010, with rates; turned round below
IERS_2014_TO_96 = (
    "+proj=helmert +x=0.0074 +y=-0.0005 +z=-0.0628 +s=0.0038 +rz=0.00026 +dx=0.0001 +dy=-0.0005 "
    "+dz=-0.0033 +ds=0.00012 +drz=0.00002 +t_epoch=2010 +convention=position_vector"
)


def by_pipeline(steps: str, epoch: float) -> np.ndarray:
    moved = Transformer.from_pipeline(f"+proj=pipeline {steps}").transform(*KONYA[0], epoch)
    return np.array(moved[:3])


def test_konya_on_a_plate_is_where_a_pipeline_of_proj_puts_it() -> None:
    moved, accuracy = carry(KONYA, ITRF96, ITRF2014, Motion(plate="EURA"))
    at_2005 = by_pipeline(f"+step +inv {IERS_2014_TO_96}", 2005.0)
    turn = "+proj=helmert +drx=-0.000085 +dry=-0.000531 +drz=0.000770 +convention=position_vector"
    transformer = Transformer.from_pipeline(f"{turn} +t_epoch=2005")
    expected = transformer.transform(*at_2005, 2026.9)[:3]
    np.testing.assert_allclose(moved[0], expected, atol=1e-4)
    # 22 years on the Eurasian plate: some half a metre
    assert 0.4 < np.linalg.norm(moved - KONYA) < 0.8
    assert accuracy < 0.1


def test_konya_with_a_velocity_of_its_own() -> None:
    velocity = np.array([-0.0148, -0.0012, 0.0094])
    moved, _ = carry(KONYA, ITRF96, ITRF2014, Motion(velocity=velocity))
    expected = by_pipeline(f"+step +inv {IERS_2014_TO_96}", 2005.0) + 21.9 * velocity
    np.testing.assert_allclose(moved[0], expected, atol=1e-4)


def test_there_and_back() -> None:
    for motion in (Motion(plate="NUBI"), Motion(velocity=np.array([0.01, 0.02, 0.03]))):
        there, _ = carry(KONYA, ITRF96, ITRF2014, motion)
        back, _ = carry(there, ITRF2014, ITRF96, motion)
        # frames turn against each other in the years between, plates over a moved mark
        np.testing.assert_allclose(back, KONYA, atol=0.08)


def test_mixing_epochs_without_a_velocity_is_refused() -> None:
    with pytest.raises(InputError, match=r"ITRF96 at 2005.00 and ITRF2014 at 2026.90 are not to"):
        carry(KONYA, ITRF96, ITRF2014)
    with pytest.raises(InputError, match="plate 'ANAT' is not in"):
        carry(KONYA, ITRF96, ITRF2014, Motion(plate="ANAT"))
    with pytest.raises(InputError, match="have no epoch"):
        Realisation("ITRF2014")
    with pytest.raises(InputError, match="not known"):
        Realisation("ITRF1066", 2000.0)


def test_one_epoch_needs_no_velocity() -> None:
    moved, _ = carry(KONYA, ITRF96, Realisation("ITRF2014", 2005.0))
    expected = by_pipeline(f"+step +inv {IERS_2014_TO_96}", 2005.0)
    np.testing.assert_allclose(moved[0], expected, atol=1e-4)


def test_plate_fixed_frames_hold_at_any_time() -> None:
    """GDA2020 moves with Australia: to ITRF2014 at 2020 it is the same, by its definition."""
    alice = ecef_from_geodetic(*np.radians([-23.7, 133.9]), np.float64(600.0))[None]
    same, _ = carry(alice, Realisation("GDA2020"), Realisation("ITRF2014", 2020.0))
    np.testing.assert_allclose(same, alice, atol=1e-6)
    later, _ = carry(alice, Realisation("GDA2020"), Realisation("ITRF2014", 2030.0))
    assert 0.6 < np.linalg.norm(later - alice) < 0.8
    back, _ = carry(later, Realisation("ITRF2014", 2030.0), Realisation("GDA2020"))
    np.testing.assert_allclose(back, alice, atol=1e-6)
