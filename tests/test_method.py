"""Every citation of the method, wherever it stands, leads to one heading of docs/method.

Citations are "method section 2.3", "method sections 1.2 and 2.0", "method 8.4", "method table 4.3",
and in comments and docstrings the short forms "(section 8.2)", "(equation 2.0)", "(6.4)" and "(the
floor, 6.3)".
"""

import re
import runpy
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FILLED = runpy.run_path(str(ROOT / "docs" / "inserts.py"))["filled"]
PAGES = {
    path.stem: FILLED(path.read_text()) for path in sorted((ROOT / "docs" / "method").glob("*.md"))
}

WHOLE = r"\d{1,2}(?:\.\d{1,2})?(?![\d.]*\d)"
PART = r"(?:[1-9]|1[0-2])\.\d{1,2}(?![\d.]*\d)"
MORE = rf"(?:(?:,\s+and|,|\s+and|\s+or|\s+to)\s+{PART})*"
#: forms that are citations wherever they stand
FULL = (
    re.compile(rf"\bmethod,?\s+sections?\s+({WHOLE}{MORE})", re.IGNORECASE),
    re.compile(rf"\bmethod\s+(?:table\s+)?({PART}{MORE})", re.IGNORECASE),
)
#: forms that are citations in comments and docstrings of this project
SHORT = (
    re.compile(rf"\((?:section|equation)\s+({PART})\)"),
    re.compile(rf"(?<=[a-z])[,;]?\s\(({PART})\)"),
    re.compile(rf"(?<=[a-z]),\s({PART})\)"),
)
#: form within the pages of the method
OWN = (re.compile(rf"(?<!`)\bsections?\s+({WHOLE}{MORE})"),)


def cited(text: str, forms: tuple[re.Pattern[str], ...]) -> list[str]:
    """Numbers that a text cites in any of the forms."""
    plain = " ".join(text.split())
    return [n for form in forms for m in form.finditer(plain) for n in re.findall(WHOLE, m[1])]


def prose(path: Path) -> Iterator[tuple[int, str]]:
    """Docstrings and comments of a Python file with their lines; a block of comments is one."""
    start, last, words = 0, -1, ""
    with path.open("rb") as file:
        for token in tokenize.tokenize(file.readline):
            line = token.start[0]
            if token.type == tokenize.COMMENT:
                if line > last + 1 and words:
                    yield start, words
                    words = ""
                start = start if words else line
                words, last = f"{words} {token.string.lstrip('#: ')}", line
            elif token.type == tokenize.STRING and re.match(r'[rR]?"""', token.string):
                yield line, token.string
    if words:
        yield start, words


@cache
def citations(path: Path) -> list[tuple[str, str]]:
    """Where a file cites the method, and which section."""
    name = path.relative_to(ROOT)
    text = path.read_text()
    if path.suffix != ".py":
        own = OWN if path.parent.name == "method" else ()
        return [(str(name), n) for n in cited(text, (*FULL, *own))]
    places = [(f"{name}:{line}", n) for line, words in prose(path) for n in cited(words, SHORT)]
    text = re.sub(r"\n\s*#:?", " ", text)
    return [*((str(name), n) for n in cited(text, FULL)), *places]


def headings() -> dict[str, list[str]]:
    """Pages by the numbers of their headings."""
    found: dict[str, list[str]] = {}
    for page, text in PAGES.items():
        for number in re.findall(r"^##? (\d+(?:\.\d+)?) \S", text, re.MULTILINE):
            found.setdefault(number, []).append(page)
    return found


FILES = [
    path
    for folder in ("src", "tests", "docs", "benchmarks", "examples")
    for suffix in ("py", "md", "toml")
    for path in sorted((ROOT / folder).rglob(f"*.{suffix}"))
    if path != Path(__file__).resolve()
] + sorted(ROOT.glob("*.md"))


def test_every_citation_leads_to_one_heading() -> None:
    known = headings()
    places = [(place, n) for path in FILES for place, n in citations(path)]
    dead = [f"{place} cites {n}" for place, n in places if len(known.get(n, ())) != 1]
    assert dead == []


def test_citations_are_there() -> None:
    """The forms still find what they are for."""
    everything = [n for path in FILES if path.suffix == ".py" for _, n in citations(path)]
    assert len(everything) > 150
    assert {"2", "1.3", "2.13", "4.4", "6.4", "9.3", "11.5"} <= set(everything)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("Inclinometer (method section 2.9). Where", ["2.9"]),
        ("Method sections 2.0 to 2.2.", ["2.0", "2.2"]),
        ("(method sections 1.2, 2.0,\n2.1)", ["1.2", "2.0", "2.1"]),
        ("method sections 4 and 5.1)", ["4", "5.1"]),
        ("(method 3.2, 3.3).", ["3.2", "3.3"]),
        ("Method 1.1: 1.1, 1.5, 2.7 mm", ["1.1"]),
        ("method section 4.1, 18 parameters", ["4.1"]),
        ("column of method table 4.3, to the digits", ["4.3"]),
        ("why the others are none (6.4).", ["6.4"]),
        ("of the board (section 8.2).", ["8.2"]),
        ("off the poles (equation 2.0)", ["2.0"]),
        ("(the target-type floor, 6.3)", ["6.3"]),
        ("Leroux and Wasle 2008, GNSS, section 6.3); over", []),
        ("Huber (c 1.345), IGG III (1.5, 4)", []),
        ("half of it (0.5) or `most` (2.5 m)", []),
        ("the method 2 of three, method 10 times as fast", []),
    ],
)
def test_forms_of_citations(text: str, numbers: list[str]) -> None:
    assert cited(text, (*FULL, *SHORT)) == numbers


def test_numbers_of_headings_are_in_order() -> None:
    """Each section stands once, on the page of its number, without gaps."""
    for page, text in PAGES.items():
        if page == "index":
            continue
        (chapter,) = re.findall(r"^# (\d+) ", text, re.MULTILINE)
        sections = re.findall(r"^## (\S+) ", text, re.MULTILINE)
        assert all(number.startswith(f"{chapter}.") for number in sections), page
        parts = [int(number.split(".")[1]) for number in sections]
        assert parts == list(range(parts[0], parts[0] + len(parts))) if parts else True, page
    assert sorted(map(int, (n for n in headings() if "." not in n))) == list(range(1, 14))
    assert all(len(pages) == 1 for pages in headings().values())


def test_contents_list_every_section() -> None:
    listed = re.findall(r"\[(\d+(?:\.\d+)?) [^\]]*\]\((\w+)\.md", PAGES["index"])
    assert dict(listed) == {number: pages[0] for number, pages in headings().items()}
    navigation = (ROOT / "mkdocs.yml").read_text()
    assert all(f"method/{page}.md" in navigation for page in PAGES)
