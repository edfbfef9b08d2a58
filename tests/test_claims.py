"""What the project says of itself: where it says so, what that rests on, and words too large."""

import ast
import importlib.util
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
SOURCE = ROOT / "src" / "tribrach"


def script() -> ModuleType:
    """``docs/claims_table.py``, which is no package."""
    spec = importlib.util.spec_from_file_location("claims_table", DOCS / "claims_table.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TABLE = script()
REGISTER: dict[str, Any] = TABLE.register()
CLAIMS: list[dict[str, Any]] = REGISTER["claims"]
EVERY = pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim["id"])
#: what a test has to hold to be evidence of its kind
SIGNS = {
    "monte carlo": r"chi2|binom|coverage|norm\.ppf|Monte Carlo|students_distribution|/ runs",
    "real data": r"shared_data|mark\.data|parents\[\d\].*shared",
    "simulation": r"simulate|scenes|twin|rng|lab\(",
}
#: what a piece of evidence has to name besides
NAMED = {"other program": "program", "published": "table", "real data": "data"}


def plain(text: str) -> str:
    return " ".join(text.split())


@cache
def words_of_code(path: Path) -> str:
    """Texts of a module that somebody reads: docstrings of commands, options, sentences."""
    tree = ast.parse(path.read_text())
    skipped = set[int]()
    if "cli" not in path.parts:
        # docstrings are for whoever changes the code
        for node in ast.walk(tree):
            body = getattr(node, "body", None)
            if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
                skipped.add(id(body[0].value))
    return " . ".join(
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and id(node) not in skipped
    )


@cache
def texts() -> dict[str, str]:
    """README, docs, examples, templates and sentences of reports, help of commands."""
    pages = [*ROOT.glob("*.md"), *DOCS.rglob("*.md"), *(ROOT / "benchmarks").glob("*.md")]
    pages += sorted((SOURCE / "report" / "templates").glob("*.j2"))
    out = {str(p.relative_to(ROOT)): plain(p.read_text()) for p in pages}
    for folder in ("cli", "report"):
        for path in sorted((SOURCE / folder).rglob("*.py")):
            out[str(path.relative_to(ROOT))] = plain(words_of_code(path))
    del out["docs/method/references.md"]  # titles of others
    out["docs/trust.md"] += TABLE.tables()
    return out


@cache
def functions(path: Path) -> dict[str, str]:
    """Tests of a file by name, with their decorators."""
    text = path.read_text()
    tree = ast.parse(text)
    return {
        node.name: ast.get_source_segment(text, node) or ""
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


def anchors(path: Path) -> set[str]:
    heads = re.findall(r"^#+ (.+)$", path.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w-]+", "-", head.lower()).strip("-") for head in heads}


def wrong_with(item: dict[str, str], levels: set[str]) -> str:
    """What is wrong with a piece of evidence, nothing if it is there and of its kind."""
    kind = item["kind"]
    if kind not in levels:
        return f"no kind {kind}"
    if kind in NAMED and not item.get(NAMED[kind]):
        return f"{kind} does not say whose: {NAMED[kind]}"
    if "section" in item:
        file, _, anchor = item["section"].partition("#")
        there = (ROOT / file).is_file() and (not anchor or anchor in anchors(ROOT / file))
        return "" if there and kind == "design" else "no such section, or no evidence of this kind"
    if "benchmark" in item:
        there = (ROOT / item["benchmark"]).is_file() and kind == "benchmark"
        return "" if there else "no such benchmark, or no evidence of this kind"
    file, _, name = item["test"].partition("::")
    path = ROOT / file
    if not path.is_file() or kind in ("design", "benchmark"):
        return "no such file of tests, or a kind that tests are not"
    if name and name not in functions(path):
        return "no such test"
    sign = SIGNS.get(kind)
    return "" if sign is None or re.search(sign, path.read_text()) else f"no sign of {kind}"


@EVERY
def test_evidence_is_there_and_of_its_kind(claim: dict[str, Any]) -> None:
    levels = set(REGISTER["levels"])
    wrong = [(item, words) for item in claim["evidence"] if (words := wrong_with(item, levels))]
    assert wrong == []
    assert claim["level"] in {item["kind"] for item in claim["evidence"]}, "a level of no evidence"


@EVERY
def test_the_sentence_stands_where_it_is_said_to_stand(claim: dict[str, Any]) -> None:
    made = {} if claim["made"] == "here" else claim["made"]
    assert all(isinstance(words, str) for words in made.values()), "quote sentences with commas"
    for file, sentence in made.items():
        assert plain(sentence) in plain((ROOT / file).read_text()), (file, sentence)
    kinds = {item["kind"] for item in claim["evidence"]}
    for words in (*made.values(), claim["approved"]):
        for kind, pattern in REGISTER["words_of_levels"].items():
            assert kind in kinds or not re.search(pattern, words, re.IGNORECASE), (words, kind)


def too_far() -> Iterator[tuple[str, str]]:
    """Patterns that no text may hold, and why."""
    for rule in REGISTER["not_allowed"]:
        yield rule["words"], rule["why"]
    for claim in CLAIMS:
        yield claim["not_allowed"], f"above the level of {claim['id']}"


def test_no_text_goes_too_far() -> None:
    found = [
        (name, match.group(), why)
        for pattern, why in too_far()
        for name, text in texts().items()
        if (match := re.search(pattern, text, re.IGNORECASE))
    ]
    assert found == []


@pytest.mark.parametrize(
    "words",
    [
        "results are guaranteed",
        "the pose is always correct",
        "the world's first program",
        "an RMS of 2 mm is the accuracy",
        "float solutions are fixed",
        "it finds all blunders",
        "a network with honest sigmas",
        "the optimal design",
        "fully automatic",
    ],
)
def test_what_goes_too_far_is_seen(words: str) -> None:
    assert any(re.search(pattern, words, re.IGNORECASE) for pattern, _ in too_far())


@pytest.mark.parametrize(
    "item",
    [
        {"kind": "monte carlo", "test": "tests/test_units.py"},
        {"kind": "test", "test": "tests/test_units.py::test_of_nothing"},
        {"kind": "other program", "test": "tests/test_units.py"},
        {"kind": "real data", "data": "some", "test": "tests/test_units.py"},
        {"kind": "benchmark", "test": "tests/test_units.py"},
        {"kind": "closed form", "benchmark": "benchmarks/m3c2.py"},
        {"kind": "design", "section": "docs/project.md#of-nothing"},
    ],
)
def test_what_is_no_evidence_is_seen(item: dict[str, str]) -> None:
    assert wrong_with(item, set(REGISTER["levels"]))


def test_every_command_has_a_claim_or_makes_none() -> None:
    """The table of commands in the README promises something of each: it stands in the register."""
    rows = re.findall(r"^\| (`tribrach .+) \| (.+) \|$", (ROOT / "README.md").read_text(), re.M)
    said = [plain(s) for c in CLAIMS if c["made"] != "here" for s in c["made"].values()]
    silent = {
        re.findall(r"`tribrach (\w+)", command)[0]
        for command, words in rows
        if not any(sentence in plain(words) for sentence in said)
    }
    # what these do is told by others of the register, or is no claim of quality
    assert silent == {"run", "adjust", "plan", "info", "simulate", "doctor"}


def test_ids_are_there_once() -> None:
    names = [claim["id"] for claim in CLAIMS]
    assert len(names) == len(set(names)) > 35
    assert all(
        claim.keys() == {"id", "made", "approved", "not_allowed", "level", "evidence"}
        for claim in CLAIMS
    )


def test_the_page_shows_every_claim() -> None:
    assert "\n{insert: claims_table}\n" in (DOCS / "trust.md").read_text(encoding="utf-8")
    for claim in CLAIMS:
        assert f"**{claim['id']}**: {claim['approved']} | {claim['level']} |" in TABLE.tables()
