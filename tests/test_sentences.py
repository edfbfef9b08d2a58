"""Sentences keep their figures: one text in the notation of a project, without reading English."""

import math
import pickle

import pytest

from tribrach.sentences import Notation, Sentence, capital, joined, scaled, written
from tribrach.units import SEC

TURN = Sentence("turned by {v:arcsec1~} ± {s:arcsec1}", v=12.3 * SEC, s=0.4 * SEC)
COMMA = Notation(",", " ")


def test_both_figures_of_an_angle_turn_with_their_unit() -> None:
    """12.3 ± 0.4 arcsec are 3.80 ± 0.12 mgon, and not 12.3 ± 0.12 mgon."""
    assert str(TURN) == "turned by 12.3 ± 0.4 arcsec"
    assert TURN.written(Notation(angle="deg")) == str(TURN)
    assert TURN.written(Notation(angle="gon")) == "turned by 3.80 ± 0.12 mgon"


@pytest.mark.parametrize(
    ("spec", "value", "plain", "comma"),
    [
        ("mm2", 0.00123, "1.23 mm", "1,23 mm"),
        ("mm2~", 0.00123, "1.23", "1,23"),
        ("m3", 12345.6789, "12345.679 m", "12 345,679 m"),
        ("2,", 12345.6789, "12,345.68", "12 345,68"),
        (",", 12345, "12,345", "12 345"),
        ("ppm1", 3.04e-5, "30.4 ppm", "30,4 ppm"),
        ("%1", 0.0512, "5.1 %", "5,1 %"),
        ("g3", 0.012345, "0.0123", "0,0123"),
        ("+1", 2.0, "+2.0", "+2,0"),
        ("°0", math.pi / 3, "60°", "60°"),
        ("gon1", math.pi / 2, "100.0 gon", "100,0 gon"),
    ],
)
def test_quantities_by_their_spec(spec: str, value: float, plain: str, comma: str) -> None:
    assert written(value, spec) == plain
    assert written(value, spec, COMMA) == comma


def test_names_that_look_like_numbers_stay() -> None:
    said = Sentence("{name} and 4.5 moved {by:mm1}", name="12345.6", by=0.0032)
    assert said.written(COMMA) == "12345.6 and 4.5 moved 3,2 mm"


def test_figures_can_be_asked_for() -> None:
    zero = {"value": 1e-3}
    said = Sentence("zero {z[value]:mm1} of {n}", z=zero, n=3)
    assert said.values == {"z[value]": 1e-3, "n": 3}


def test_sentences_are_put_together_with_their_figures() -> None:
    whole = capital(joined("; ", [TURN, "as given"])) + "."
    assert whole == "Turned by 12.3 ± 0.4 arcsec; as given."
    assert Notation(angle="gon").words(whole) == "Turned by 3.80 ± 0.12 mgon; as given."
    assert COMMA.words("so: " + TURN) == "so: turned by 12,3 ± 0,4 arcsec"
    assert pickle.loads(pickle.dumps(whole)).written(COMMA).startswith("Turned by 12,3")


def test_a_spec_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="furlong"):
        written(1.0, "furlong2")


def test_scaled_is_the_number_that_is_written() -> None:
    assert scaled(0.0123, "mm1") == pytest.approx(12.3)


def test_a_unit_stays_on_the_line_of_its_number() -> None:
    page = Notation(space="_")
    assert page.words(TURN) == "turned by 12.3_±_0.4_arcsec"
    assert page.cell("5.1 %") == "5.1_%"


def test_no_number_has_a_power_of_ten_that_is_none() -> None:
    assert written(4.1302, "mmg3") == "4130 mm"
    assert written(2.5, "g") == "2.5"
    assert written(0.95, "%g") == "95 %"
