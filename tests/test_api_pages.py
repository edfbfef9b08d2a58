"""The reference of the API follows the packages of the sources; nothing in it is listed by hand."""

import re
import runpy
from pathlib import Path

import tribrach

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = runpy.run_path(str(DOCS / "api_pages.py"))
as_markdown = runpy.run_path(str(DOCS / "docstrings.py"))["as_markdown"]
PACKAGE = PAGES["PACKAGE"]
ROOMS = list(PAGES["rooms"](PACKAGE))


def test_every_public_module_has_its_place_on_one_page() -> None:
    shown = [
        name
        for room in ROOMS
        for name in re.findall(r"^::: (\S+)$", PAGES["page_text"](room), re.MULTILINE)
    ]
    assert len(set(shown)) == len(shown)
    outside = [path for path in PACKAGE.rglob("*.py") if "cli" not in path.parts]
    modules = {
        PAGES["dotted"](path)
        for path in outside
        if path.name != "__init__.py" and PAGES["public_names"](path)
    }
    assert len(modules) > 100
    assert modules <= set(shown)


def test_every_page_is_in_the_contents() -> None:
    def leaves(entry: object) -> list[str]:
        if isinstance(entry, str):
            return [entry]
        inner = entry.values() if isinstance(entry, dict) else entry
        return [leaf for part in inner for leaf in leaves(part)]

    listed = leaves(PAGES["contents"](PACKAGE))
    assert sorted(listed) == sorted(PAGES["page_name"](room) for room in ROOMS)
    assert {room.name for room in ROOMS} >= {"network", "targets", "registration", "geodesy"}
    assert not any("cli" in room.parts for room in ROOMS)


def test_every_name_of_the_package_is_on_its_page() -> None:
    text = PAGES["page_text"](PACKAGE)
    for name in tribrach.__all__:
        assert f"* `tribrach.{name}`: [tribrach." in text or f"::: tribrach.{name}\n" in text, name


def test_units_and_roles_of_docstrings_in_markdown() -> None:
    assert as_markdown("V in [0, pi] [rad] of") == r"V in [0, pi] \[rad] of"
    assert as_markdown("lengths [m](n, 3)") == r"lengths [m]\(n, 3)"
    assert as_markdown("`a[i] [j]` of :class:`~tribrach.a.Block`") == "`a[i] [j]` of `Block`"
    assert as_markdown("see :func:`fit`, [m], (n, 3)") == "see `fit`, [m], (n, 3)"
