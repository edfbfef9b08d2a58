"""No name of a file, point, station, scan, site or column becomes markup in any page."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest
from lxml import html as parser
from typer.testing import CliRunner

import tribrach
from tests.report.hostile import HOSTILE, harmless, hostile
from tests.report.pages import PAGES, network_report
from tribrach.cli import app
from tribrach.report import text
from tribrach.report.characters import visible
from tribrach.report.environment import render_page
from tribrach.report.findings import Finding
from tribrach.report.page import FrontPage

SOURCE = Path(tribrach.__file__).parent
TEMPLATES = sorted((SOURCE / "report" / "templates").glob("*.j2"))
#: attributes that hold words, and pictures in which they are drawn
WORDS = {"alt", "aria-label", "src", "data-name", "data-a", "data-b"}
#: words for the head of printed pages in a style: letters, digits and numbers of characters alone
RUNNING = re.compile(r'(--top-(left|right): "([A-Za-z0-9]|\\[0-9a-f]+ )*"(; )?){2}')


def skeleton(page: str) -> Counter[tuple[str, frozenset[tuple[str, str]]]]:
    """Every element with its attributes, without the words in them; scripts and styles whole."""
    out: Counter[tuple[str, frozenset[tuple[str, str]]]] = Counter()
    for element in parser.document_fromstring(page).iter():
        if not isinstance(element.tag, str):
            out["comment", frozenset()] += 1
            continue
        kept = {(k, _plain(k, v)) for k, v in element.attrib.items()}
        if element.tag in ("script", "style"):
            kept.add(("content", element.text or ""))
        out[element.tag, frozenset(kept)] += 1
    return out


def _plain(attribute: str, value: str) -> str:
    """The value of an attribute without names, and drawings without their order."""
    if attribute in WORDS:
        return ""
    if attribute == "style" and value.startswith("--top-left"):
        assert RUNNING.fullmatch(value), value
        return ""
    if attribute == "data-k":
        # a number, whose last digits may depend on the order of the names
        assert float(value) == float(value)
        return ""
    if attribute in ("id", "href"):
        assert re.fullmatch(r"#?[\w-]+", value) or value.startswith("data:"), value
        return re.sub(r"-.*", "", value)
    return " ".join(sorted(re.split(r"[ ML]", value))) if attribute == "d" else value


@pytest.mark.parametrize("which", PAGES)
def test_names_are_text_and_nothing_else(which: str, monkeypatch: pytest.MonkeyPatch) -> None:
    used: set[int] = set()

    def named(k: int) -> str:
        # networks refuse characters that no text has
        return (
            "".join(filter(str.isprintable, hostile(k)))
            if which == "questions.check"
            else hostile(k)
        )

    def naming(k: int) -> str:
        used.add(k)
        return named(k)

    page = PAGES[which](naming)
    plain = PAGES[which](harmless)
    tree, other = skeleton(page), skeleton(plain)
    assert tree - other == Counter()
    assert other - tree == Counter()
    # every name that is somewhere with harmless names is there, whole, with hostile ones
    said = "\n".join(words_of(page))
    expected = "\n".join(words_of(plain))
    shown = {k for k in used if harmless(k) in expected}
    assert len(shown) >= 3
    for k in shown:
        assert visible(named(k)) in said, hostile(k)
    for character in "\x00\x07\x1b\x7f\x85\u202e\u2066":
        assert character not in page


def words_of(page: str) -> list[str]:
    """Texts of elements and words in attributes, as the parser gives them."""
    root = parser.document_fromstring(page)
    inside = [t for e in root.iter() if e.tag not in ("script", "style") for t in (e.text, e.tail)]
    return [t for t in (*inside, *root.xpath("//@alt"), *root.xpath("//@aria-label")) if t]


def test_every_page_has_a_test_with_hostile_names() -> None:
    """Functions that call ``render_page``, ``page`` or ``html.render``, and answers."""
    makers = set()
    for path in (SOURCE / "report").rglob("*.py"):
        module = ".".join(path.relative_to(SOURCE / "report").with_suffix("").parts)
        tree = ast.parse(path.read_text())
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and module not in ("page", "environment"):
                called = {
                    getattr(c.func, "id", "") for c in ast.walk(node) if isinstance(c, ast.Call)
                }
                if called & {"render_page", "page"}:
                    makers.add(f"{module}.{node.name}")
    for path in (SOURCE / "questions").glob("*/*.py"):
        if "FrontPage(" in path.read_text():
            makers.add(f"questions.{path.parent.name}")
    assert makers == set(PAGES)
    elsewhere = [
        path.relative_to(SOURCE)
        for path in SOURCE.rglob("*.py")
        if "report" not in path.relative_to(SOURCE).parts
        and re.search(r"<html|<!DOCTYPE html|render_page|jinja2", path.read_text())
    ]
    assert elsewhere == []


def test_nothing_goes_round_the_escaping() -> None:
    for path in SOURCE.rglob("*.py"):
        assert "Markup" not in path.read_text(), path.name
    for path in TEMPLATES:
        words = path.read_text()
        assert not re.search(r"\|\s*safe|autoescape|\bmarkup", words, re.IGNORECASE), path.name
        # a value without quotes could begin an attribute, one in a script or style is not escaped
        assert not re.search(r"[\w-]=\{\{", words), path.name
        for inner in re.findall(r"<(script|style)[^>]*>(.*?)</\1>", words, re.DOTALL):
            assert re.sub(r'\{% include "[\w.]+" %\}', "", inner[1]).strip() == "", path.name
    for name in ("report.js.j2", "report.css.j2"):
        (path,) = [p for p in TEMPLATES if p.name == name]
        words = path.read_text()
        assert "{{" not in words
        for unsafe in ("innerHTML", "outerHTML", "insertAdjacent", "document.write", "eval("):
            assert unsafe not in words


def test_templates_are_no_templates_of_names() -> None:
    page = render_page(
        "page.html.j2", kind="k", title="{{7*7919}}", running="", map=None, pictures=[], first=[],
        front=FrontPage("none", "{{7*7919}}", ""), findings=[Finding("{% include 'x' %}")],
        tables=[], footer="",
    )  # fmt: skip
    assert "55433" not in page
    assert "{{7*7919}}" in page


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_visible_is_as_long_and_steers_nothing(name: str) -> None:
    assert len(visible(name)) == len(name)
    assert visible(visible(name)) == visible(name)
    assert all(c.isprintable() for c in visible(name))


def test_the_text_report_steers_no_terminal() -> None:
    content = network_report(hostile)
    for words in (text.render(content), text.brief(content)):
        assert all(c.isprintable() or c == "\n" for c in words)
        assert visible(hostile(9)) in text.render(content)


def test_no_command_prints_names_as_they_are() -> None:
    """Commands print with ``say``, and with rich what is visible."""
    for path in sorted((SOURCE / "cli").glob("*.py")):
        words = path.read_text()
        if path.name not in ("shell.py", "commands.py"):
            assert "typer.echo" not in words, path.name
        for printed in re.findall(r"console\.print\((.*)\)$", words, re.MULTILINE):
            safe = r"visible\(|printed\(|table\)?$|f\"\{table\.left_out\} more rows"
            assert re.match(safe, printed), (path.name, printed)


def test_a_command_steers_no_terminal(tmp_path: Path) -> None:
    rows = ["scan,point,set,face,range_m,horizontal_deg,zenith_deg"]
    for face in ("1", "-1"):
        for k, name in enumerate(("bell\x07\x1b[2J", "right\u202eleft", "P3", "P4")):
            rows.append(f"S\x1b[1m,{name},1,{face},{10 + k},{40 * k}.0,{80 + 5 * k}.0")
    table = tmp_path / "t.csv"
    table.write_text("\n".join([*rows, ""]), encoding="utf-8")
    call = ["check", str(table), "--range-mm", "1.2", "--angle-arcsec", "8"]
    result = CliRunner().invoke(app, call)
    assert result.exit_code in (0, 2), result.output
    assert result.output
    assert all(c.isprintable() or c == "\n" for c in result.output)
