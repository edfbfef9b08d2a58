"""JSON, text and HTML of the same content."""

import json
import re

import numpy as np
import pytest
from lxml import html as parser

from tests.network.networks import trilateration
from tests.report.cases import EVIL, levelling, mean_of_two, scanner, scanner_content
from tribrach.geodesy.site import EllipsoidSite
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.quality import assess
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssBaselines
from tribrach.report import html, json_result, text
from tribrach.report.build import build
from tribrach.report.content import Report
from tribrach.report.map import network_map, round_down
from tribrach.report.tables import ColumnHead, Worst, build_table, number_cell


def refuse(constant: str) -> float:
    """NaN and infinities are no JSON."""
    raise AssertionError(constant)


def parsed(content: Report) -> dict[str, object]:
    """JSON of a content, read strictly."""
    return json.loads(json_result.dumps(content), parse_constant=refuse)  # type: ignore[no-any-return]


@pytest.mark.parametrize("make", [levelling, mean_of_two, scanner_content])
def test_json_is_strict_and_has_every_key_of_the_schema(make) -> None:
    data = parsed(make())
    keys = "tribrach schema datum sigma0 points stations calibrations lever_arms planes"
    assert {*keys.split(), "observations", "warnings"} <= set(data)
    assert data["schema"] == 2
    assert {"prior", "posterior", "dof", "global_test", "covariances"} <= set(data["sigma0"])
    names = "id kind from to value sigma residual redundancy w mdb state source"
    for row in data["observations"]:
        assert set(names.split()) <= set(row)
        assert row["state"] in ("active", "check", "off")
    for point in data["points"].values():
        assert np.shape(point["xyz"]) == (3,)
        assert np.shape(point["covariance"]) == (3, 3)
        assert point["role"] in ("control", "free", "check")


def test_json_numbers_are_metres_radians_and_unshifted() -> None:
    adjustment = scanner()
    data = parsed(build(adjustment, assess(adjustment)))
    for i, name in enumerate(adjustment.layout.names["point"]):
        assert data["points"][name]["xyz"] == pytest.approx(adjustment.state.points[i], abs=1e-12)
        assert data["points"][name]["covariance"] == pytest.approx(adjustment.covariance(name))
    pose = np.array(data["stations"]["S1"]["world_from_scanner"])
    assert pose[:3, :3] == pytest.approx(adjustment.state.pose_r[1])
    assert pose[:3, 3] == pytest.approx(adjustment.state.pose_t[1])
    assert pose[3] == pytest.approx([0, 0, 0, 1])
    assert data["stations"]["S1"]["covariance"] == pytest.approx(adjustment.covariance("S1"))
    assert data["stations"]["T0"]["orientation"]["circle T0"]["value"] == pytest.approx(
        0.5, abs=1e-3
    )


def test_json_says_what_scales_covariances() -> None:
    prior, posterior = parsed(levelling()), parsed(levelling(posterior=True))
    assert prior["sigma0"]["covariances"] == "prior"
    assert posterior["sigma0"]["covariances"] == "posterior"
    ratio = posterior["points"]["B"]["covariance"][2][2] / prior["points"]["B"]["covariance"][2][2]
    assert ratio == pytest.approx(3.0)


def test_json_has_geodetic_coordinates_where_the_site_knows_them() -> None:
    site = EllipsoidSite(0.35, 1.85, 20.0)
    survey = Survey(site=site)
    survey.point("A", (0.0, 0.0, 0.0), free=(False, False, False))
    for value in ([300.0, 400.0, 1.0], [300.002, 400.0, 1.0]):
        survey.add(GnssBaselines, values=[value], sigma=0.003, start=["A"], end=["B"])
    adjustment = adjust(survey.network())
    data = parsed(build(adjustment, assess(adjustment)))
    assert data["points"]["A"]["geodetic"] == pytest.approx([0.35, 1.85, 20.0], abs=1e-9)
    assert "geodetic" not in parsed(mean_of_two())["points"]["P"]


def test_text_has_datum_sigma_origin_and_sources() -> None:
    content = scanner_content()
    printed = text.render(content)
    flat = " ".join(printed.split())
    assert " ".join(content.datum.sentence.split()) in flat
    assert content.sigma_origin in flat
    assert "tps.csv:9" in printed
    assert "x slope distance" in printed
    for warning in content.warnings:
        assert warning in flat


def test_text_lists_the_worst_first() -> None:
    content = scanner_content()
    lines = text.render(content).split("Observations, worst first")[1].splitlines()
    order = [line for line in lines if re.search(r"(scan\d\.txt|tps\.csv|control\.csv):\d+$", line)]
    assert len(order) == len(content.observations)
    worst = max((o for o in content.observations if o.w == o.w), key=lambda o: abs(o.w))
    assert order[0].endswith(worst.source)
    assert order[-1].endswith("tps.csv:9")


def test_brief_is_short() -> None:
    lines = text.brief(scanner_content()).splitlines()
    assert len(lines) < 30
    assert any("redundancy" in line for line in lines)


def test_html_is_well_formed_and_needs_nothing_else() -> None:
    page = html.render(scanner_content())
    tree = parser.document_fromstring(page)
    assert next(e.text for e in tree.iter("title")).startswith("Site ")
    assert "http" not in page
    assert not tree.xpath("//*[@src or self::link or self::iframe or self::object]")
    assert not re.search(r"url\((?!#)", page)
    ids = tree.xpath("//@id")
    assert len(ids) == len(set(ids))
    links = [h[1:] for h in tree.xpath("//a/@href")]
    assert set(links) <= set(ids)


def test_html_escapes_names() -> None:
    page = html.render(scanner_content(evil=True))
    assert EVIL not in page
    assert "&lt;script&gt;alert(1)" in page
    tree = parser.document_fromstring(page)
    assert len(tree.xpath("//script")) == 1
    assert EVIL in "".join(tree.xpath("//section[@id='points']//td//text()"))


def test_html_keeps_switched_off_observations_greyed_with_reason() -> None:
    tree = parser.document_fromstring(html.render(scanner_content()))
    rows = tree.xpath("//section[@id='observations']//tr[contains(@class, 'off')]")
    assert len(rows) == 1
    words = rows[0].text_content()
    assert 'prism <moved> & "back"' in words
    assert "tps.csv:9" in words


def test_html_marks_checks_and_has_warnings_on_top() -> None:
    content = mean_of_two()
    page = html.render(content)
    tree = parser.document_fromstring(page)
    assert len(tree.xpath("//section[@id='observations']//tr[@class='check']")) == 3
    shown = [li.text_content() for li in tree.xpath("//section[@id='warnings']//li")]
    assert shown == list(content.warnings)
    assert [s.get("id") for s in tree.xpath("//main/section")[:3]] == [
        "summary",
        "warnings",
        "plan",
    ]


def test_html_limits_rows_and_says_so() -> None:
    content = scanner_content()
    tree = parser.document_fromstring(html.render(content, row_limit=10))
    assert len(tree.xpath("//section[@id='observations']//tbody/tr")) == 10
    note = tree.xpath("//section[@id='observations']//p[contains(@class,'cut')]")[0]
    count = len(content.observations)
    assert note.text_content() == (
        f"10 of {count} rows are shown, those with the largest w; {count - 10} are left out: the "
        "JSON result has all of them."
    )


def test_text_limits_rows_and_says_so() -> None:
    content = scanner_content()
    printed = " ".join(text.render(content, row_limit=3).split())
    count = len(content.observations)
    assert f"3 of {count} rows are shown, those with the largest w; {count - 3} are" in printed
    points = len(content.points)
    assert f"3 of {points} rows are shown, those of the points with the largest sigma;" in printed
    assert "left out" not in text.render(content)


def test_the_worst_rows_are_shown_in_the_order_of_the_table() -> None:
    """By hand: sizes 3, 1, none, 4, 1, 5; the two ones stay in their order."""
    sizes = [3.0, 1.0, float("nan"), 4.0, 1.0, 5.0]
    columns = [(ColumnHead("size"), lambda k: number_cell(sizes[k], f"{sizes[k]:g}"))]
    worst = Worst("the largest", lambda k: sizes[k])
    table = build_table("t", "T", "", range(6), columns, worst=worst)
    assert list(table.first(3).items) == [0, 3, 5]
    assert list(table.first(4).items) == [0, 1, 3, 5]
    assert list(table.first(6).items) == list(range(6))
    assert table.first(4).first(2).left_out == 4
    assert table.cut == ""
    assert table.first(2).cut.startswith("2 of 6 rows are shown, the largest; 4 are left out")


def test_angles_are_written_in_the_chosen_unit() -> None:
    gon, deg = text.render(scanner_content()), text.render(scanner_content(angle="deg"))
    # the orientation 0.5 rad is 31.83 gon or 28 deg 38 min
    assert re.search(r"circle T0 .* 31\.8\d+ gon .*mgon", gon)
    assert re.search(r"circle T0 .* 28-3[89]-\d\d\.\d .*″", deg)


def test_plan_needs_two_positions_in_plan() -> None:
    assert network_map(levelling()) is None
    assert "no plan coordinates" in html.render(levelling())


def test_plan_keeps_distances_and_directions() -> None:
    adjustment = adjust(trilateration(Datum("free")).network())
    content = build(adjustment, assess(adjustment))
    drawn = network_map(content)
    assert drawn is not None
    place = {s.name: np.array([s.x, s.y]) for s in drawn.symbols}
    true = {p.name: np.array(p.xyz[:2]) for p in content.points}
    scale = drawn.bar / drawn.bar_metres
    for a, b in (("P", "1"), ("2", "3"), ("1", "2")):
        pixels, metres = place[b] - place[a], true[b] - true[a]
        assert pixels * [1, -1] / scale == pytest.approx(metres, abs=0.02)
    ellipses = {e.words.split(":")[0]: e for e in drawn.ellipses}
    for point in content.points:
        assert point.ellipse is not None
        size = ellipses[point.name].rx / scale / drawn.exaggeration
        assert size == pytest.approx(point.ellipse.major, rel=0.01)
    assert drawn.ellipse_bar_metres * scale * drawn.exaggeration == pytest.approx(drawn.ellipse_bar)
    boxes = [(label.x, label.y) for label in drawn.labels]
    assert len(set(boxes)) == len(content.points)


@pytest.mark.parametrize(
    ("value", "round_value"), [(1, 1), (4.99, 2), (5, 5), (0.07, 0.05), (1999, 1000)]
)
def test_round_numbers_of_scale_bars(value: float, round_value: float) -> None:
    assert round_down(value) == pytest.approx(round_value)
