"""No residual is printed without its operator and what limits it.

Four differences of 12.0, 2.6, 2.9 and 12.7 mm and a limit of 3.0 mm are 2.75 mm to whoever takes
the mean of what is within the limit, and 8.9 mm to whoever takes the root mean square of all. A
figure that a reader cannot compute again says nothing, so every sentence and every table with a
residual names the operator, and the limit beyond which values were left out or are refused.
"""

import ast
import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "tribrach"
#: what is a residual in words
WORD = re.compile(
    r"\bresiduals?\b|\brmse?\b|\bscatters? (by|of)\b|\bdeparts? from\b", re.IGNORECASE
)
OPERATOR = re.compile(
    r"root mean square|\brmse?\b|\blargest\b|\bmedian\b|\bmean\b|standard deviation|sum of squares",
    re.IGNORECASE,
)
LIMIT = re.compile(
    r"\blimits?\b|\bleft out\b|\bwithin\b|\bbeyond\b|\ballows\b|\bmore than\b", re.IGNORECASE
)
#: a residual whose figure, written @, follows in the same part of a sentence
FIGURE = re.compile(rf"(?:{WORD.pattern})[^.;]{{0,60}}@", re.IGNORECASE)
#: where a template of a sentence is filled in
PLACE = re.compile(r"\{[a-z_@][^{}]*\}")
#: the residual of one value with its test value, what residuals are the reason for, an axis
OTHERS = (": @, residual @, w @, @", "The residuals call for @", "residual of @ [@]")


def _other(text: str) -> bool:
    return any(text == other or (len(other) > 20 and other in text) for other in OTHERS)


def texts(tree: ast.AST) -> list[tuple[int, str]]:
    """Every text of a module that is filled in, with @ for each figure."""
    out = []
    formats = {id(n.format_spec) for n in ast.walk(tree) if isinstance(n, ast.FormattedValue)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr) and id(node) not in formats:
            parts = [part.value if isinstance(part, ast.Constant) else "@" for part in node.values]
            out.append((node.lineno, PLACE.sub("@", "".join(map(str, parts)))))
        elif isinstance(node, ast.Constant) and PLACE.search(str(node.value)):
            out.append((node.lineno, PLACE.sub("@", str(node.value))))
    return out


def tables(tree: ast.AST) -> list[tuple[str, list[str], str]]:
    """Functions that make a table: name, heads of columns, and every other text in them."""
    out = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef):
            continue
        heads, calls = [], set()
        for call in ast.walk(node):
            name = getattr(getattr(call, "func", None), "attr", None) or getattr(
                getattr(call, "func", None), "id", ""
            )
            if isinstance(call, ast.Call) and name in _HEADS and call.args:
                first = call.args[0]
                if isinstance(first, ast.Constant) and isinstance(first.value, str):
                    heads.append(first.value)
                    calls.add(id(first))
        words = [
            part.value
            for part in ast.walk(node)
            if isinstance(part, ast.Constant)
            and isinstance(part.value, str)
            and id(part) not in calls
        ]
        if heads:
            out.append((node.name, heads, " ".join(words)))
    return out


_HEADS = {"ColumnHead", "mm", "small_angle", "plain", "_mm", "metres"}


def module_texts(tree: ast.Module) -> str:
    """Notes that stand at the head of a module."""
    return " ".join(
        part.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        for part in ast.walk(node)
        if isinstance(part, ast.Constant) and isinstance(part.value, str)
    )


FILES = sorted(SOURCE.rglob("*.py"))


def test_the_rule_itself() -> None:
    """It finds what it is for."""
    bad = ast.parse('say(f"residuals of {x:.1f} mm")')
    ((_, text),) = texts(bad)
    assert FIGURE.search(text)
    assert not OPERATOR.search(text)
    assert not LIMIT.search(text)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_residuals_have_operator_and_limit(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for line, text in texts(tree):
        if FIGURE.search(text) and not _other(text):
            assert OPERATOR.search(text), f"{path.name}:{line} names no operator: {text}"
            assert LIMIT.search(text), f"{path.name}:{line} names no limit: {text}"
    notes = module_texts(tree)
    for function, heads, words in tables(tree):
        for head in heads:
            if WORD.search(head):
                whole = f"{head} {words} {notes}"
                assert OPERATOR.search(whole), f"{path.name} {function}: {head} has no operator"
                assert LIMIT.search(whole), f"{path.name} {function}: {head} has no limit"
