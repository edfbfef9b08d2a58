"""The page in the order in which one signs: verdict, plan, figures, what stands behind them."""

import base64
import io
from dataclasses import replace

import numpy as np
import pytest
from lxml import html as parser
from PIL import Image

from tests.report.cases import levelling, mean_of_two, scanner_content
from tribrach.errors import InputError
from tribrach.io.logo import read_logo
from tribrach.job.panorama import Panorama
from tribrach.job.results import JobResults
from tribrach.project import Project
from tribrach.report import front_page as front_page_module
from tribrach.report import html, text
from tribrach.report.chapters.adjustment import Marked, marked
from tribrach.report.charts import SIGNED, Chart, DrawnMark, beside, nice_ticks, shade
from tribrach.report.front_page import front_page
from tribrach.report.names import spoken
from tribrach.report.panoramas import panorama_drawing
from tribrach.report.tables import ColumnHead, build_table, number_cell, text_cell
from tribrach.sentences import Notation, Sentence
from tribrach.units import SEC


def page(content):
    return parser.document_fromstring(html.render(content))


def test_signed_chapters_come_first_and_the_others_are_folded() -> None:
    content = scanner_content()
    tree = page(content)
    signed = [c.name for c in content.chapters if c.signed]
    assert signed == ["stations", "control", "points", "worst-observations"]
    shown = [s.get("id") for s in tree.xpath("//main/section[@class='chapter']")]
    assert shown == [f"chapter-{name}" for name in signed]
    folded = tree.xpath("//details[contains(@class, 'chapter')]")
    assert not any("open" in one.attrib for one in folded)
    assert "chapter-observations" in {one.get("id") for one in folded}
    links = [a.get("href") for a in tree.xpath("//nav[@id='contents']/a")]
    assert links[:2] == ["#summary", "#warnings" if content.warnings else "#plan"]
    assert set(links) >= {f"#{one.get('id')}" for one in folded}


def test_the_front_page_says_what_is_signed_and_by_whom() -> None:
    content = replace(scanner_content(), facts=(("Author", "A. Sample"), ("client", "City & Co")))
    tree = page(content)
    words = tree.xpath("//section[@id='summary']")[0].text_content()
    for said in ("Adjusted by", "Signature", "A. Sample", "For City & Co", "Check points"):
        assert said in words
    assert content.datum.sentence in words
    assert "Author" not in [dt.text for dt in tree.xpath("//dt")]


def test_without_redundancy_nothing_is_called_passed() -> None:
    content = levelling()
    none = replace(
        content,
        summary=replace(content.summary, test=replace(content.summary.test, accepted=None)),
    )
    assert front_page(none).sort == "none"
    assert "passed" not in front_page(none).verdict
    failed = replace(
        content,
        summary=replace(content.summary, test=replace(content.summary.test, accepted=False)),
    )
    assert front_page(failed).sort == "bad"
    passed = replace(
        content,
        grave=0,
        summary=replace(content.summary, test=replace(content.summary.test, accepted=True)),
    )
    assert front_page(passed).sort == "good"
    assert "2 things to look into" in front_page(replace(passed, grave=2)).verdict


def test_largest_sigma_and_check_points_are_those_of_the_points() -> None:
    content = scanner_content()
    lines = dict(front_page(content).lines)
    sigma = [(s, p.name) for p in content.points for s in p.sigma if s is not None]
    worst, name = max(sigma)
    assert f"Point {name} with σ {1e3 * worst:.2f} mm" in lines["Least certain"]
    checks = dict(front_page(mean_of_two()).lines)["Check points"]
    assert "agree" in checks or "judged" in checks


def test_decimal_points_stand_one_below_the_other() -> None:
    values = [0.6, 0.033, 12.0, None, 1e-5]
    words = ["0.60", "0.033", "12", "", "< 0.001"]
    columns = [
        (ColumnHead("s"), lambda k: number_cell(values[k], words[k])),
        (ColumnHead("n", numeric=False), lambda k: text_cell(f"row {k}")),
    ]
    table = build_table("t", "T", "", range(5), columns)
    assert [row.cells[0].blanks for row in table.rows] == [1, 0, 4, 0, 0]
    lines = text.table_text(table).splitlines()[3:6]
    # the digit before the point stands in one column
    assert {line.replace("12 ", "12.").index(".") for line in lines} == {lines[0].index(".")}


def test_a_suspicious_sight_is_drawn_and_rows_name_their_ends() -> None:
    content = scanner_content()
    tree = page(content)
    rows = tree.xpath("//section[@id='observations']//tr[@data-a]")
    names = {g.get("data-name") for g in tree.xpath("//figure[@class='plan']//g[@data-name]")}
    assert rows
    assert {row.get("data-a") for row in rows} <= names
    drawn = tree.xpath("//figure[@class='plan']//line[@class='suspect']")
    pairs = {(o.start, o.end) for o in content.observations if o.suspicious and o.end}
    assert len(drawn) == len(pairs)


def test_a_warning_is_in_the_unit_of_the_report() -> None:
    content = scanner_content()
    words = Sentence(
        "The targets lie within {a:°0} and turn by {b:arcsec1}.", a=np.radians(56), b=2.9 * SEC
    )
    said = replace(content, warnings=(words,))
    (shown,) = page(said).xpath("//section[@id='warnings']//li")
    # a number and its unit stay on one line of a page
    with_units = shown.text_content().replace("\N{NO-BREAK SPACE}", " ")
    assert with_units == "The targets lie within 62 gon and turn by 0.90 mgon."
    assert shown.text_content().count("\N{NO-BREAK SPACE}") == 2
    assert "within 62 gon and turn by 0.90 mgon" in text.render(said)
    settings = replace(content.settings, angle="deg")
    assert "within 56° and turn by 2.9 arcsec" in text.render(replace(said, settings=settings))


def test_a_zero_in_a_table_has_no_sign() -> None:
    shown = [
        number_cell(-1e-9, text).text for text in ("-0.0000", "-0", "-0.00 mm", "-0.001", "-1")
    ]
    assert shown == ["0.0000", "0", "0.00 mm", "-0.001", "-1"]


def test_numbers_of_cells() -> None:
    notation = Notation(",", ".")
    assert notation.cell("-412345.6789") == "-412.345,6789"
    assert notation.cell("1234.5") == "1234,5"
    assert notation.cell("1.53 mm") == "1,53 mm"
    assert notation.cell("18.2×15.3") == "18.2×15.3"
    assert notation.cell("") == ""


def test_a_project_chooses_its_decimal_sign(tmp_path) -> None:
    given = {"observations": [{"file": "a.csv"}], "output": {"decimal": ","}}
    project = Project.model_validate(given)
    content = replace(scanner_content(), job=JobResults(project))
    tree = page(content)
    cells = tree.xpath("//section[@id='points']//td[contains(@class, 'n')]")
    words = [cell.text for cell in cells if cell.text]
    assert any("," in word for word in words)
    assert not any("." in word for word in words)
    # what sorts stays a number
    assert all(float(c.get("data-k")) is not None for c in cells if c.get("data-k"))
    assert "," in text.render(content).split("Adjusted points")[1]
    with pytest.raises(ValueError, match="the same sign"):
        Project.model_validate(
            {"observations": [{"file": "a.csv"}], "output": {"decimal": ",", "thousands": ","}}
        )


def test_names_of_scans_as_one_would_say_them() -> None:
    assert spoken("S1 S1-targets") == "S1, targets"
    assert spoken("S1 S1-targets: checkerboard") == "S1, targets: checkerboard"
    assert spoken("S1") == "S1"
    assert spoken("S1 hall") == "S1 hall"
    assert spoken("S1 S10") == "S1 S10"
    assert spoken("S1 S1-") == "S1 S1-"
    assert spoken("traverse.gsi:43") == "traverse.gsi:43"


def marks_of(marks: tuple[DrawnMark, ...]) -> list[DrawnMark]:
    return [m for mark in marks for m in (mark, *marks_of(mark.inner))]


def test_azimuths_of_a_panorama_are_those_of_its_targets() -> None:
    """A target at the horizontal angle h is seen at the azimuth heading - h (y is left of x)."""
    heading, h = np.radians(70.0), np.radians(-50.0)
    grey = np.zeros((10, 400), dtype=np.uint8)
    column = (np.pi - h) / (2 * np.pi) * 400 - 0.5
    view = Panorama(grey, np.array([[column, 5.0]]), ("sphere",), (1000, 200), (np.pi, -np.pi))
    drawn = marks_of(panorama_drawing(view, ["T1"], heading, "deg").marks)
    ring = next(dict(m.attributes) for m in drawn if m.tag == "circle")
    ticks = {
        m.text: float(dict(m.attributes)["x"])
        for m in drawn
        if m.tag == "text" and m.text.isdigit()
    }
    # azimuth 120 degrees, by its tick or between two of them
    assert float(ring["cx"]) == pytest.approx(
        np.interp(
            120.0,
            *np.array(sorted((float(k), x) for k, x in ticks.items() if 60 < float(k) < 200)).T,
        ),
        abs=0.5,
    )
    assert "T1" in [m.text for m in drawn]


def test_ticks_are_round_and_inside() -> None:
    assert nice_ticks(0.0, 1.0, 5) == pytest.approx([0, 0.2, 0.4, 0.6, 0.8, 1.0])
    assert nice_ticks(1960.0, 2070.0, 6) == [1960, 1980, 2000, 2020, 2040, 2060]
    assert nice_ticks(3.0, 3.0) == [3.0]


def test_ticks_of_an_axis_do_not_overprint() -> None:
    chart = Chart((1.2, 31.0), (0, 1), ("sigma", "n"), (300.0, 200.0), log="x")
    drawing = beside([[chart]], "words")
    at = sorted(
        float(dict(m.attributes)["x"])
        for m in marks_of(drawing.marks)
        if m.tag == "text"
        and dict(m.attributes).get("class") == "tick"
        and m.text not in ("sigma", "n")
    )
    assert len(at) >= 3
    assert np.diff(at).min() > 10


def test_places_of_marks_are_linear_in_their_values() -> None:
    chart = Chart((0, 10), (0, 4), ("x", "y"), (400.0, 300.0))
    assert chart.across(5) == pytest.approx((chart.across(0) + chart.across(10)) / 2, abs=0.01)
    assert chart.up(1) - chart.up(2) == pytest.approx(chart.up(3) - chart.up(4), abs=0.02)
    same = Chart((0, 100), (0, 10), ("x", "y"), (500.0, 400.0), equal=True)
    scale = (same.across(10) - same.across(0)) / 10
    assert (same.up(0) - same.up(10)) / 10 == pytest.approx(scale, rel=0.01)


def test_a_logarithmic_axis_upwards_is_even_in_ratios() -> None:
    chart = Chart((0, 1), (0.1, 100.0), ("x", "y"), (400.0, 300.0), log="y")
    assert chart.up(1) - chart.up(10) == pytest.approx(chart.up(0.1) - chart.up(1), abs=0.02)
    words = {m.text for m in marks_of(beside([[chart]], "w").marks) if m.tag == "text"}
    assert {"0.1", "1", "10", "100"} <= words


def test_cells_stand_where_their_names_are_and_say_their_numbers() -> None:
    values = np.array([[1.0, -0.8, np.nan], [0.2, 1.0, 0.5]])
    names, rows = ["a", "b", "c"], ["p", "q"]
    chart = Chart((-0.5, 2.5), (-0.5, 1.5), ("", ""), (400.0, 200.0), names=names, rows=rows)
    chart.cells(values, -1.0, 1.0, 0.7)
    marks = list(marks_of(beside([[chart]], "w").marks))
    cells = {m.title: dict(m.attributes) for m in marks if m.tag == "rect"}
    assert set(cells) == {"p, a: 1.00", "p, b: -0.80", "q, a: 0.20", "q, b: 1.00", "q, c: 0.50"}
    assert cells["p, a: 1.00"]["fill"] == shade(1.0, SIGNED)
    assert float(cells["p, a: 1.00"]["y"]) < float(cells["q, a: 0.20"]["y"])
    written = [m.text for m in marks if dict(m.attributes).get("class", "").startswith("on-cell")]
    assert written == ["1.00", "-0.80", "1.00"]
    labels = {m.text: dict(m.attributes) for m in marks if m.text in ("p", "q")}
    middle = float(cells["p, a: 1.00"]["y"]) + float(cells["p, a: 1.00"]["height"]) / 2
    assert float(labels["p"]["y"]) == pytest.approx(middle + 4, abs=0.1)


def test_a_large_table_is_one_image_of_its_cells() -> None:
    chart = Chart((-0.5, 99.5), (-0.5, 19.5), ("", ""), (900.0, 300.0))
    chart.cells(np.random.default_rng(0).uniform(-1, 1, (20, 100)), -1.0, 1.0)
    (image,) = (m for m in marks_of(beside([[chart]], "w").marks) if m.tag == "image")
    data = dict(image.attributes)["href"].split(",")[1]
    assert Image.open(io.BytesIO(base64.b64decode(data))).size == (100, 20)


def test_names_of_places_do_not_cover_each_other() -> None:
    chart = Chart((0, 1), (0, 1), ("x", "y"), (400.0, 300.0))
    for k in range(5):
        chart.place(0.1 + 0.15 * k, 0.5, f"station {k}", "station")
    chart.dots([0.5, 3.0], [0.5, 0.5], "s0")
    marks = list(marks_of(beside([[chart]], "w").marks))
    boxes = [
        (float(a["x"]), float(a["y"]), 6.4 * len(m.text))
        for m in marks
        if (a := dict(m.attributes)).get("class") == "label station"
    ]
    assert len(boxes) == 5
    for i, (x, y, w) in enumerate(boxes):
        for u, v, z in boxes[i + 1 :]:
            assert x + w <= u or u + z <= x or abs(y - v) >= 11
    # what lies beyond the axes is not drawn
    (dots,) = (m for m in marks if dict(m.attributes).get("class") == "dots s0")
    assert dict(dots.attributes)["d"].count("M") == 1


def test_the_verdict_names_what_is_marked_and_counts_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    content = scanner_content()
    assert not marked(content).names
    assert "Marked" not in dict(front_page(content).lines)
    passed = replace(
        content,
        grave=3,
        summary=replace(content.summary, test=replace(content.summary.test, accepted=True)),
    )
    names = ("direction C to E6", "target centre S1 to E3", "distance A to B")
    found = Marked(names, "3 of 65 tests are beyond the limit, 0.1 would be by chance", True)
    monkeypatch.setattr(front_page_module, "marked", lambda content: found)
    front = front_page(passed)
    assert front.sort == "look"
    assert front.verdict == (
        "Global test passed; before you sign look at direction C to E6, target centre S1 to E3 "
        "and 1 more and at 2 other things"
    )
    assert (
        "Direction C to E6, target centre S1 to E3 and distance A to B (3 of 65"
        in (dict(front.lines)["Marked"])
    )
    # by chance: told, but nothing to look into
    monkeypatch.setattr(front_page_module, "marked", lambda content: replace(found, act=False))
    calm = front_page(replace(passed, grave=0))
    assert (calm.sort, calm.verdict) == ("good", "Global test passed")
    assert "no more than chance" in dict(calm.lines)["Marked"]


def test_what_is_to_be_done_and_what_is_to_be_known_have_their_own_headings() -> None:
    content = replace(scanner_content(), warnings=("Do this.", "Know that."), grave=1)
    warnings = page(content).xpath("//section[@id='warnings']")[0]
    assert [h.text for h in warnings.xpath("h2")] == ["To look into before you sign", "To be known"]
    assert [ul.xpath("li")[0].text for ul in warnings.xpath("ul")] == ["Do this.", "Know that."]
    calm = page(replace(content, grave=0)).xpath("//section[@id='warnings']")[0]
    assert [h.text for h in calm.xpath("h2")] == ["To be known"]
    assert "grave" not in calm.get("class")


def test_a_logo_is_a_picture(tmp_path) -> None:
    logo = tmp_path / "logo.png"
    logo.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(20))
    assert read_logo(logo).startswith("data:image/png;base64,")
    logo.write_text("<html>")
    with pytest.raises(InputError, match="no PNG, JPEG or SVG"):
        read_logo(logo)
    logo.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(1_000_001))
    with pytest.raises(InputError, match="larger than 1 MB"):
        read_logo(logo)
    with pytest.raises(InputError, match="cannot be read"):
        read_logo(tmp_path / "none.png")
    content = replace(scanner_content(), job=JobResults(logo="data:image/png;base64,QUJD"))
    assert page(content).xpath("//img[@class='logo']/@src") == ["data:image/png;base64,QUJD"]
