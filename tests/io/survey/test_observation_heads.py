"""Heads of tables of observations as other programs and offices write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.errors import InputError, Refusals
from tribrach.io.survey.csv.file import read_table
from tribrach.io.survey.csv.headings import letters
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.quality import assess
from tribrach.network.survey import observed_part
from tribrach.report.build import build
from tribrach.report.text import brief

#: of levelling lines, sights and angles: from, to, height difference, length; direction, zenith,
#: slope distance; at, angle
LANGUAGES = {
    "English": (
        ("From", "To", "Height difference [m]", "Length [km]"),
        ("Direction [gon]", "Zenith angle [gon]", "Slope distance [m]"),
        ("At", "Angle [gon]"),
    ),
    "German": (
        ("Von", "Nach", "Höhenunterschied [m]", "Länge [km]"),
        ("Richtung [gon]", "Zenitwinkel [gon]", "Schrägstrecke [m]"),
        ("Standpunkt", "Winkel [gon]"),
    ),
    "French": (
        ("De", "À", "Dénivelée (m)", "Longueur (km)"),
        ("Direction (gon)", "Angle zénithal (gon)", "Distance inclinée (m)"),
        ("Sommet", "Angle (gon)"),
    ),
    "Spanish": (
        ("Desde", "Hasta", "Desnivel [m]", "Longitud [km]"),
        ("Dirección [gon]", "Ángulo cenital [gon]", "Distancia inclinada [m]"),
        ("Vértice", "Ángulo [gon]"),
    ),
    "Italian": (
        ("Da", "A", "Dislivello [m]", "Lunghezza [km]"),
        ("Direzione [gon]", "Angolo zenitale [gon]", "Distanza inclinata [m]"),
        ("Stazione", "Angolo [gon]"),
    ),
    "Portuguese": (
        ("De", "Para", "Desnível [m]", "Comprimento [km]"),
        ("Direção [gon]", "Ângulo zenital [gon]", "Distância inclinada [m]"),
        ("Estação", "Ângulo [gon]"),
    ),
    "Dutch": (
        ("Van", "Naar", "Hoogteverschil [m]", "Lengte [km]"),
        ("Richting [gon]", "Zenithoek [gon]", "Schuine afstand [m]"),
        ("Standplaats", "Hoek [gon]"),
    ),
    "Czech": (
        ("Od", "Do", "Převýšení [m]", "Délka [km]"),
        ("Směr [gon]", "Zenitový úhel [gon]", "Šikmá délka [m]"),
        ("Stanovisko", "Úhel [gon]"),
    ),
    "Polish": (
        ("Od", "Do", "Przewyższenie [m]", "Długość [km]"),
        ("Kierunek [gon]", "Kąt zenitalny [gon]", "Odległość skośna [m]"),
        ("Stanowisko", "Kąt [gon]"),
    ),
}


def table(folder: Path, head: tuple[str, ...], rows: str, separator: str = ";"):
    path = folder / "table.csv"
    path.write_text(separator.join(head) + "\n" + rows.replace(";", separator), encoding="utf-8")
    return read_table(path)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("separator", [";", "\t", "|"])
def test_heads_of_nine_languages(tmp_path: Path, language: str, separator: str) -> None:
    level, sights, angles = LANGUAGES[language]
    found = table(tmp_path, level, "A;B;1.25;0.5\nB;C;-0.75;1.5\n", separator)
    assert found.words["from"] == ["A", "B"]
    assert found.words["to"] == ["B", "C"]
    np.testing.assert_allclose(found.number("height_difference"), [1.25, -0.75])
    np.testing.assert_allclose(found.number("length"), [500.0, 1500.0])
    found = table(tmp_path, (*level[:2], *sights), "A;B;100;50;12.5\n", separator)
    np.testing.assert_allclose(
        found.columns("direction", "zenith", "slope_distance"), [[np.pi / 2, np.pi / 4, 12.5]]
    )
    found = table(tmp_path, (angles[0], *level[:2], angles[1]), "S;A;B;100\n", separator)
    assert [found.words[key] for key in ("at", "from", "to")] == [["S"], ["A"], ["B"]]
    np.testing.assert_allclose(found.number("angle"), [np.pi / 2])
    # what a head means is told
    assert "are taken as follows" in " ".join(found.remarks)


def test_heads_of_angles_by_their_sights(tmp_path: Path) -> None:
    head = ("Stn", "Backsight Point", "Foresight Point", "Angle (dms)", "Std (sec)")
    found = table(tmp_path, head, "P;A;B;30-15-15;2\n")
    assert [found.words[key] for key in ("at", "from", "to")] == [["P"], ["A"], ["B"]]
    np.testing.assert_allclose(np.degrees(found.number("angle")), [30 + 15 / 60 + 15 / 3600])
    np.testing.assert_allclose(found.number("sigma"), [2 * np.pi / 648000])


def test_how_a_table_was_read_is_said_with_its_result(tmp_path: Path) -> None:
    (tmp_path / "lev.csv").write_text(
        "Von;Nach;Höhenunterschied [m];Länge [km];s [mm]\nA;B;1,2345;0,8;1\nB;A;-1,2341;0,8;1\n"
    )
    (tmp_path / "list.csv").write_text("point,height_m,role\nA,100,fixed\n")
    solved = adjust(observed_part(read_files(sorted(tmp_path.glob("*.csv")))).network())
    report = build(solved, assess(solved))
    (said,) = report.readings
    assert said.startswith("lev.csv: heads are taken as follows")
    assert "lev.csv: heads are taken" in " ".join(brief(report).split())


@given(st.permutations(range(4)), st.sampled_from(sorted(LANGUAGES)))
def test_columns_may_stand_in_any_order(
    tmp_path_factory: pytest.TempPathFactory, order: list[int], language: str
) -> None:
    head, row = LANGUAGES[language][0], ("A", "B", "1.25", "0.5")
    found = table(
        tmp_path_factory.mktemp("heads"),
        tuple(head[k] for k in order),
        ";".join(row[k] for k in order) + "\n",
    )
    assert (found.words["from"], found.words["to"]) == (["A"], ["B"])
    np.testing.assert_allclose(found.number("length"), [500.0])


@pytest.mark.parametrize("head", ["Winkel", "Angle", "Angolo", "Kąt", "Hoek"])
def test_the_unit_of_an_angle_is_asked_for(tmp_path: Path, head: str) -> None:
    with pytest.raises(InputError) as refused:
        table(tmp_path, ("Stand", "Von", "Nach", head)[1:], "A;B;100\n")
    assert refused.value.line == 1
    assert "angle_gon" in str(refused.value)


def test_a_distance_that_may_be_two_things_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="horizontal_distance_m or slope_distance_m"):
        table(tmp_path, ("Von", "Nach", "Strecke [m]"), "A;B;100\n")
    # beside a height difference it is the length of the line
    found = table(tmp_path, ("Von", "Nach", "Strecke [m]", "dh [mm]"), "A;B;100;5\n")
    assert found.number("length").tolist() == [100.0]
    np.testing.assert_allclose(found.number("height_difference"), [0.005])


def test_east_of_a_vector_is_not_the_french_from(tmp_path: Path) -> None:
    head = ("De", "A", "dN", "dE", "dH")
    with pytest.raises(InputError):
        # two columns say the same thing
        table(tmp_path, head, "A;B;1;2;3\n")
    found = table(tmp_path, ("Von", "Nach", "dN", "dE", "dH"), "A;B;1;2;3\n")
    np.testing.assert_allclose(found.columns("de", "dn", "du"), [[2, 1, 3]])


@pytest.mark.parametrize("names", ["cov_EE", "CEE", "VarE_E", "qee"])
def test_covariances_of_vectors(tmp_path: Path, names: str) -> None:
    pairs = ("EE", "EN", "EH", "NN", "NH", "HH")
    heads = [names.replace("E_E", "EE").replace("EE", p).replace("ee", p.lower()) for p in pairs]
    if names == "VarE_E":
        heads = [f"cov {p.lower()} [mm2]" for p in pairs]
    found = table(tmp_path, ("from", "to", "dE", "dN", "dH", *heads), "A;B;1;2;3;1;2;3;4;5;6\n")
    scale = 1e-6 if names == "VarE_E" else 1.0
    np.testing.assert_allclose(
        found.columns("cee", "cen", "ceu", "cnn", "cnu", "cuu"),
        scale * np.array([[1, 2, 3, 4, 5, 6]]),
    )


def test_tables_of_a_plugin(shared_data: Path) -> None:
    folder = shared_data / "faults" / "networks2" / "25-csv-heads"
    if not folder.is_dir():
        pytest.skip(f"third-party data are not in {folder}")
    vectors = read_table(folder / "3d_gnss" / "baselines.csv")
    assert vectors.words["from"][0] == "BASE"
    np.testing.assert_allclose(vectors.number("cee")[:2], 1.6e-5)
    np.testing.assert_allclose(vectors.number("du")[0], 5.2035)
    for name, open_ in (
        ("angles", {"angle_deg", "sigma_arcsec"}),
        ("directions", {"direction_deg", "sigma_arcsec"}),
        ("distances", {"horizontal_distance_m", "sigma_mm"}),
    ):
        with pytest.raises(InputError) as refused:
            read_table(folder / "2d_traverse" / f"{name}.csv")
        assert not isinstance(refused.value, Refusals)
        assert all(word in str(refused.value) for word in open_)
    # which coordinates are held must not be left out
    with pytest.raises(InputError, match="fixed_e, fixed_n, fixed_h"):
        read_table(folder / "3d_gnss" / "points.csv")


@pytest.mark.parametrize("head", ["sigm_slope_distance_mm", "Genauigkeit [mm]", "Gewicht"])
def test_nothing_that_may_count_is_left_out(tmp_path: Path, head: str) -> None:
    for keys in (("from", "to", "slope_distance_m"), ("Von", "Nach", "Schrägstrecke [m]")):
        with pytest.raises(InputError):
            table(tmp_path, (*keys, head), "A;B;10;5\n")
    found = table(tmp_path, ("Nr", "Von", "Nach", "Schrägstrecke [m]", "Datum"), "1;A;B;10;5.5.\n")
    assert "columns that are left out: Nr, Datum" in found.remarks


def test_letters_of_all_languages() -> None:
    assert letters("Převýšení") == "prevyseni"
    assert letters("Długość") == "dlugosc"
    assert letters("Höhenunterschied") == "hohenunterschied"


def test_heads_of_a_total_station(tmp_path: Path) -> None:
    """Hz, V, SD, hi and ht of station and target are readings; units are asked for."""
    rows = "A,B,0,100,100,1.5,1.5\nA,P,50,100,70.711,1.5,1.5\n"
    path = tmp_path / "sights.csv"
    path.write_text("Station,Target,Hz,V,SD,hi,ht\n" + rows)
    with pytest.raises(InputError, match="V zenith_gon or zenith_deg"):
        read_files([path])
    path.write_text("Station,Target,Hz [gon],V [gon],SD,hi,ht\n" + rows)
    kinds = {table.kind.kind for table in read_files([path]).tables()}
    assert {"direction", "zenith", "slope_distance"} <= kinds
