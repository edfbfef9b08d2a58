"""Every page begins with a verdict and its contents; what it comes to is said by a test."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from lxml import html as parser

from tests.instruments.field_surveys import readings
from tests.report import pages
from tests.report.hostile import harmless
from tests.report.pages import PAGES, sites_of
from tribrach.calibration.field_check import check_readings
from tribrach.comparison.compared import CloudComparison
from tribrach.comparison.predicted import OffsetTest, Prediction
from tribrach.comparison.results import SiteResult
from tribrach.epochs.comparison import Settings, compare
from tribrach.epochs.differences import Epoch, difference
from tribrach.geodesy.site import FlatSite
from tribrach.io.epoch_files import EpochDocument
from tribrach.job.epochs import ComparedEpochs
from tribrach.questions.check.chapters import answer_of
from tribrach.questions.compare.motions import CloudMotions, MovedPart, Verdict
from tribrach.questions.compare.moved import motions_front
from tribrach.questions.epochs.chapters import answer_of as epochs_answer
from tribrach.questions.series.chapters import answer_of as series_answer
from tribrach.questions.series.cycles import Cycle, PointAt, Series, SeriesSettings
from tribrach.registration.clouds.graph import CloudEdge
from tribrach.report.comparison import comparison_findings, offsets_finding
from tribrach.report.epochs import direction_words
from tribrach.report.findings import Finding
from tribrach.report.names import numbered, some_of, told_apart
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import ColumnHead, ReportTable, build_table, text_cell

WRITTEN = [name for name in PAGES if not name.endswith("_svg")]


def front(text: str) -> tuple[str, str, str]:
    """Sort of the first section, its verdict, and all its words."""
    (section,) = parser.document_fromstring(text).xpath("//section[@id='summary']")
    (verdict,) = section.xpath(".//p[@class='verdict']/b")
    return section.get("class").split()[-1], verdict.text_content(), section.text_content()


@pytest.mark.parametrize("which", WRITTEN)
def test_a_page_begins_with_its_verdict_and_its_contents(which: str) -> None:
    tree = parser.document_fromstring(PAGES[which](harmless))
    assert tree.xpath("//main/*[1]/@id") == ["summary"]
    assert tree.xpath("//section[@id='summary']//p[@class='verdict']/b/text()")
    # contents come before everything else, and lead to what is there
    assert tree.xpath("//body/*[@id][position() <= 2]/@id") == ["top", "contents"]
    links = [a.get("href").removeprefix("#") for a in tree.xpath("//nav[@id='contents']/a")]
    assert set(links) <= set(tree.xpath("//@id"))
    assert len(links) == len(set(links)) >= 3
    assert tree.xpath("//section[@id='summary']//div[@class='sign']/p[1]/b/text()") == ["To sign"]
    sort = tree.xpath("//section[@id='summary']/@class")[0].split()[-1]
    assert sort in ("good", "look", "bad", "none")
    # nothing is said twice on the first screen
    said = [
        element.text_content().strip()
        for element in tree.xpath("//section[@id='summary']//li | //p[@class='verdict']/span")
    ]
    assert len(said) == len(set(said))
    # printed pages say whose they are
    assert "--top-left" in tree.get("style")


@pytest.mark.parametrize("which", WRITTEN)
def test_shares_in_sentences_are_written_in_one_way(which: str) -> None:
    tree = parser.document_fromstring(PAGES[which](harmless))
    for element in tree.xpath("//li | //dd | //p | //figcaption"):
        # what has a sigma beside it has its digits
        words = re.sub(r"±\s[\d.]+\s%", "", element.text_content())
        assert not re.search(r"\d%|\d\s\s%|\.\d*0\s%", words)


def test_what_the_verdict_says_is_not_said_again_and_warnings_are_marked() -> None:
    findings = ["All is well.", Finding("Look at A.", True), "B is as it should be."]
    text = page("Kind", "Title", FrontPage("good", "Well", "All is well."), findings, [], [])
    items = parser.document_fromstring(text).xpath("//ul[@class='findings']/li")
    assert [one.text for one in items] == ["Look at A.", "B is as it should be."]
    assert [one.get("class") for one in items] == ["warns", None]
    assert "To sign" not in text
    signed = page("Kind", "Title", FrontPage("good", "Well", "", (), "These figures."), [], [], [])
    assert re.search(r"To sign</b>These figures\.", signed)


def test_a_scanner_that_passes_and_one_that_does_not() -> None:
    measured = readings(np.random.default_rng(3))
    sort, verdict, words = front(answer_of(check_readings(measured, "yard")).page())
    assert (sort, verdict) == ("good", "The scanner passes")
    assert "To sign" in words
    # a range zero of 20 mm: the distances from inside and outside no longer agree
    wrong = readings(np.random.default_rng(3), {"x10": 0.02})
    sort, verdict, words = front(answer_of(check_readings(wrong, "yard")).page())
    assert (sort, verdict) == ("bad", "The scanner does not pass")
    assert "distances from inside and outside" in words


def test_a_number_that_is_not_tested_says_so_and_how_often_it_is_as_large() -> None:
    measured = readings(np.random.default_rng(3))
    # far better than stated, and far worse
    for factor, words in ((0.01, "0 of"), (100.0, "or more with less than 1 %")):
        covariance = measured.covariance / factor
        _, _, said = front(
            answer_of(check_readings(replace(measured, covariance=covariance), "yard")).page()
        )
        (sentence,) = re.findall(r"Distance statistics .*?mm\.\s", said + " ", re.DOTALL)
        assert words in " ".join(sentence.split())
        assert "limits each difference, not their number" in " ".join(sentence.split())


def test_small_tables_that_follow_each_other_stand_beside_each_other() -> None:
    def table(name: str, columns: int, rows: int) -> ReportTable:
        heads = [(ColumnHead(str(k)), lambda r: text_cell(str(r))) for k in range(columns)]
        return build_table(name, name, "", range(rows), heads)

    tables = [table("a", 3, 2), table("b", 2, 2), table("wide", 4, 2), table("c", 2, 2)]
    tables.append(table("long", 2, 16))
    front = FrontPage("none", "Done", "")
    tree = parser.document_fromstring(page("Kind", "Title", front, [], [], tables))
    grouped = [div.xpath("section/@id") for div in tree.xpath("//main/div[@class='beside']")]
    assert grouped == [["a", "b"], ["c"]]
    assert tree.xpath("//main/section[contains(@class, 'table')]/@id") == ["wide", "long"]


def two_epochs(shift: float) -> str:
    """Five points with sigmas of 1 mm, the last of which is somewhere else the second time."""
    xyz = np.array([[0.0, 0, 0], [80, 0, 1], [80, 60, 2], [0, 60, 1], [40, 90, 0]])
    one = Epoch("spring", ("A", "B", "C", "D", "P"), xyz, 1e-6 * np.eye(15))
    two = Epoch(
        "autumn", one.names, xyz + np.outer([0, 0, 0, 0, 1], [shift, 0, 0]), 1e-6 * np.eye(15)
    )
    settings = Settings(references=("A", "B", "C", "D"))
    found = compare(difference(one, two, space="plan"), settings)
    return epochs_answer([ComparedEpochs(found, ())]).page()


def test_what_moved_stands_first() -> None:
    sort, verdict, words = front(two_epochs(0.05))
    assert (sort, verdict) == ("none", "P moved")
    assert "in the datum of A, B, C and D" in words
    sort, verdict, _ = front(two_epochs(0.0))
    assert (sort, verdict) == ("good", "No displacement found")


def test_files_are_told_apart_by_as_much_of_their_paths_as_it_takes() -> None:
    one, two = Path("/a/epoch1/clouds/S2.laz"), Path("/a/epoch2/clouds/S2.laz")
    assert told_apart(one, two) == ("epoch1/clouds/S2.laz", "epoch2/clouds/S2.laz")
    assert told_apart(one, two.with_name("S3.laz")) == ("S2.laz", "S3.laz")
    assert told_apart(one, one) == ("S2.laz", "S2.laz")


def test_what_does_not_go_up_or_down_is_not_said_to() -> None:
    assert direction_words([0.0, 0.003, -0.00004], (0, 1, 2)).endswith("0.0 mm in height")
    assert direction_words([0.0, 0.003, -0.00006], (0, 1, 2)).endswith("0.1 mm down")


def test_predictions_for_a_surface_that_stood_still_are_not_said_of_one_that_moved() -> None:
    # observed is twice what was predicted, and 5 mm apart
    noise, scatter = (1e-3, 1e-3), (2e-3, 2e-3)
    predicted = Prediction(
        noise, scatter, (9000, 9000), 1e-3, 5e-3, 1e-4, (), 4e-3, 5e-3, None, 0.5
    )
    sites = tuple(replace(site, prediction=predicted) for site in sites_of(harmless))
    found = CloudComparison("A", "B", 0.2, sites, OffsetTest(len(sites), 99.0, 1.0, 5.0))
    still, moved = comparison_findings(found), comparison_findings(found, moved=True)
    (offsets,) = (one for one in still if one.key == "offsets")
    assert offsets.values["how"] == "larger than"
    assert {one.key for one in moved} == {"site_note"}
    assert set(moved) <= set(still)
    one = offsets_finding(OffsetTest(1, 99.0, 1.0, 5.0))
    assert one.words.startswith("The offset of the site is larger than")


def test_it_is_said_why_sites_are_too_far_apart_together_and_none_by_itself() -> None:
    noise = (1e-3, 1e-3)
    near, far = (
        Prediction(noise, noise, (9000, 9000), 1e-3, offset, 1e-4, (), 4e-3, 5e-3, None, 0.5)
        for offset in (2e-3, 5e-3)
    )
    sites = [replace(site, prediction=near) for site in sites_of(harmless)]
    failed = OffsetTest(16, 32.9, 6.9, 28.8)

    def said(sites: list[SiteResult], offsets: OffsetTest) -> set[str]:
        found = CloudComparison("A", "B", 0.2, tuple(sites), offsets)
        return {one.key for one in comparison_findings(found)}

    assert "together_only" in said(sites, failed)
    assert "together_only" not in said(sites, OffsetTest(16, 20.0, 6.9, 28.8))
    sites = [replace(sites[0], prediction=far), *sites[1:]]
    assert "together_only" not in said(sites, failed)


def test_a_registration_names_what_its_pairs_leave_open(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = front(PAGES["questions.register"](harmless))
    assert "3 of 4 scans are connected; 1 of 1 loop closes" in whole[1]
    assert "no pair holds" not in whole[1]
    assert "Hollow:" not in PAGES["questions.register"](harmless)
    assert "is known least, σ 3.5" in whole[2]  # of 2 mm along each axis
    made = pages._fit

    def loose(edge: CloudEdge) -> SimpleNamespace:
        fit = made(edge)
        open_ = harmless(2) in (edge.first, edge.second)
        fit.precision.rank = 5 if open_ else 6
        return fit

    monkeypatch.setattr(pages, "_fit", loose)
    text = PAGES["questions.register"](harmless)
    sort, verdict, _ = front(text)
    assert sort == "none"
    assert f"no pair holds {harmless(2)} in all directions" in verdict
    # the plan does not draw it as if it were known
    drawn = parser.document_fromstring(text).xpath("//g[@class='loose']/title/text()")
    assert drawn == [harmless(2)]
    assert f"Hollow: {harmless(2)}, whose place is not known" in text


def test_options_dates_and_standards_stay_on_one_line_and_are_copied_as_they_are() -> None:
    words = "On 2025-03-04, by ISO 17123-9: tribrach adjust <x> --snoop --no-vce."
    text = page("Kind", "title", FrontPage("good", "Passed", "All."), [words], [], [])
    (item,) = parser.document_fromstring(text).xpath("//ul[@class='findings']/li")
    assert item.text_content() == words
    whole = item.xpath("./span[@class='whole']/text()")
    assert whole == ["2025-03-04", "ISO 17123-9", "--snoop", "--no-vce"]


def series_front(cycles: Sequence[Cycle]) -> tuple[str, str, str]:
    """Of four references without points through time."""
    names = ("A", "B", "C", "D")
    zero = Epoch("zero", names, np.zeros((4, 3)), 1e-6 * np.eye(12))
    kept = EpochDocument.of(zero, FlatSite(), "zero")
    found = Series(SeriesSettings(names), kept, 1.0, tuple(cycles))
    return front(series_answer(found, "yard").page())


def test_references_are_accused_only_where_they_fail_more_often_than_chance_lets_them() -> None:
    still = [Cycle(str(k), 1.7e9 + 14400 * k, 40, "", 5.0, 9, 20.0) for k in range(100)]
    place = PointAt((0.003, 0.0, 0.0), (1e-3,) * 3, 20.0, 9.0, "moved")
    seldom = replace(still[40], test=25.0, moved=("B",), points={"B": place})
    sort, verdict, words = series_front([*still[:40], seldom, *still[41:]])
    assert (sort, verdict) == ("good", "No movement found")
    assert "fail their test in 1 cycle, no more often than expected by chance" in words
    rng = np.random.default_rng(1)
    shifts = [(0.003, *rng.normal(0, 1e-3, 2)) for _ in still[50:]]
    often = [
        replace(one, test=25.0, moved=("B",), points={"B": replace(place, displacement=shift)})
        for one, shift in zip(still[50:], shifts, strict=True)
    ]
    sort, verdict, _ = series_front([*still[:50], *often])
    assert (sort, verdict) == ("none", "Reference point B moved")
    nobody = [replace(one, test=25.0) for one in still[50:]]
    sort, verdict, _ = series_front([*still[:50], *nobody])
    assert (sort, verdict) == (
        "none",
        "The reference points fail their test, and none can be named",
    )


@pytest.mark.parametrize(
    ("verdicts", "sort", "words"),
    [
        (("moved", "no motion found"), "none", "Site a moved"),
        (("moved", "not one body"), "none", "Site a moved; Site b differs, not as one body"),
        (("no motion found", "no motion found"), "good", "No motion found"),
        (
            ("no motion found", "too few distances"),
            "none",
            "No motion found; Site b cannot be told",
        ),
    ],
)
def test_a_site_is_said_to_have_moved_only_if_its_test_says_so(
    verdicts: tuple[Verdict, Verdict], sort: str, words: str
) -> None:
    parts = [MovedPart(name, v, 1.0) for name, v in zip("ab", verdicts, strict=True)]
    stable, compared = SimpleNamespace(agrees=True), SimpleNamespace(share=0.8)
    all_of_it = SimpleNamespace(parts=parts, stable=stable, compared=compared, sites=True)
    told = motions_front(cast(CloudMotions, all_of_it))
    assert (told.sort, told.verdict) == (sort, words)


def test_completeness_says_whether_the_required_sigma_is_reached() -> None:
    sort, verdict, words = front(PAGES["questions.complete"](harmless))
    assert sort in ("good", "none")
    assert "required sigma is reached" in verdict
    assert words.count("is required (3D, of the best station") == 1


@pytest.mark.parametrize("which", ["questions.calibrate", "questions.plan", "questions.series"])
def test_what_is_signed_has_its_datum(which: str) -> None:
    (section,) = parser.document_fromstring(PAGES[which](harmless)).xpath("//div[@class='sign']")
    words = " ".join(section.text_content().split())
    assert re.search(r"Datum: |weighted by given covariances|datum of the reference points", words)


def test_a_test_that_passed_does_not_say_that_nothing_moved() -> None:
    words = PAGES["questions.epochs"](harmless)
    assert "no displacement shown" in words
    assert "not moved" not in words


def test_numbers_that_follow_each_other_are_said_by_their_ends() -> None:
    assert numbered(["1", "2", "3", "4", "7", "9", "10"]) == "1 to 4, 7, 9 and 10"
    assert numbered(["3"]) == "3"
    assert numbered(["1", "2"]) == "1 and 2"
    # names that only begin like numbers stay, and so do those with leading zeros
    assert numbered(["08", "09", "10", "wall 1", "wall 2"]) == "08, 09, 10, wall 1 and wall 2"


def test_some_names_and_how_many_more() -> None:
    assert some_of(["A"], 2) == "A"
    assert some_of(["A", "B"], 2) == "A and B"
    assert some_of(["A", "B", "C", "D"], 2) == "A, B and 2 more"
    assert some_of([], 2) == ""
