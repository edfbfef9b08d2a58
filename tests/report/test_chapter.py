"""Chapters that only some jobs have, in every rendering."""

import json
from dataclasses import replace

from tests.report.cases import EVIL, levelling
from tribrach.report import html, json_result, text
from tribrach.report.chapter import Chapter
from tribrach.report.chapters.gnss import GnssPart
from tribrach.report.charts import Drawing
from tribrach.report.figures import Picture
from tribrach.report.tables import ColumnHead, build_table, text_cell

TABLE = build_table(
    "loops",
    "Loops",
    "",
    ["first loop", "second loop"],
    [(ColumnHead("Loop", numeric=False), text_cell)],
)
CHAPTER = Chapter(
    "gnss",
    "Baselines",
    (f"the largest closure is 3 mm {EVIL}",),
    (Picture("map", "Map", Drawing(10.0, 10.0, (), "a map"), "where"),),
    (TABLE,),
    GnssPart(frame="ITRF2014", epoch=2010.0, baselines=(), loops=()),
)


def test_a_chapter_is_in_every_rendering() -> None:
    content = replace(levelling(), chapters=(CHAPTER,))
    page = html.render(content)
    assert 'id="chapter-gnss"' in page
    assert EVIL not in page
    assert "second loop" in page
    assert 'aria-label="a map"' in page
    words = text.render(content)
    assert "Baselines\n---------\nthe largest closure" in words
    assert "second loop" in words
    data = json.loads(json_result.dumps(content))["gnss"]
    assert data == {"frame": "ITRF2014", "epoch": 2010.0, "baselines": [], "loops": []}


def test_tables_of_chapters_end_like_others() -> None:
    assert TABLE.first(None) is TABLE
    short = TABLE.first(1)
    assert (len(short.rows), short.left_out) == (1, 1)
    page = html.render(replace(levelling(), chapters=(CHAPTER,)), row_limit=1)
    assert "second loop" not in page
