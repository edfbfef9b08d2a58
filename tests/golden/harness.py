"""Runs the command of a case and holds what it says and writes against files of before.

A case has a text (exit status, standard output and error, text files, pages as their text and
table cells) and one JSON file for each that the command wrote. Texts are compared as they are, but
for the sign of zero. Numbers of JSON files are written to 12 significant digits; they may differ by
1e-9 of themselves or of the largest number of their list, and by 1e-12 (1e-15 in lists, which have
covariances; 1e-9 in residuals over sigmas), unless a case says otherwise. Of clouds in LAS the
range and mean of each dimension are kept. Today's date, the version, folders, durations and digests
are words of their own.
"""

from __future__ import annotations

import contextlib
import datetime
import difflib
import importlib.metadata
import json
import math
import os
import re
import shlex
import shutil
import tempfile
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from lxml import html
from threadpoolctl import threadpool_limits
from typer.testing import CliRunner

from tribrach.cli import app

__all__ = ["FILES", "Case", "Group", "Runs", "by_name", "differences", "frozen", "write"]

FILES = Path(__file__).parent / "files"
REPOSITORY = Path(__file__).resolve().parents[2]
#: of files of text, by their suffix
TEXTS = {".txt", ".csv", ".toml", ".svg", ".gkf", ".xml", ".dat", ".jsonl", ".pose"}
#: what runs keep for themselves: file names that have a place and no golden text
MACHINERY = re.compile(r"(^|/)(\.tribrach|app|work|lock|written\.json)(/|$)")
#: characters of a line of JSON that holds a whole value
_WIDE = 110
#: files of text whose long numbers are compared as those of JSON
_DATA: dict[str, Callable[[str], Any]] = {
    ".toml": tomllib.loads,
    ".jsonl": lambda text: [json.loads(line) for line in text.splitlines()],
}
#: numbers of more digits than the last of them is sure
_LONG = re.compile(r"-?\d+\.\d{8,}(e[-+]\d+)?")
_ENVIRONMENT = {
    "COLUMNS": "100",
    "LINES": "40",
    "TERM": "dumb",
    "NO_COLOR": "1",
    "TRIBRACH_COMPILE_AHEAD": "0",
}


@dataclass(frozen=True)
class Case:
    """A command line in the folder of its group; `{out}` is a folder of the case alone."""

    name: str
    words: str
    #: by which numbers of its JSON files may differ, as a share
    tolerance: float = 1e-9
    #: files of the case that are compared
    keep: str = "*"
    #: what is done in the folders of the group and of the case in place of the command
    call: Callable[[Path, Path], None] | None = None
    #: cases that must have run before in the same folder
    needs: tuple[str, ...] = ()

    def command(self) -> list[str]:
        return [word.replace("{out}", self.name) for word in shlex.split(self.words)]


@dataclass(frozen=True)
class Group:
    """Cases that share a folder of inputs."""

    name: str
    prepare: Callable[[Path], None]
    cases: tuple[Case, ...]
    #: folder of third-party data that is needed
    data: Path | None = None

    def case(self, name: str) -> Case:
        return next(case for case in self.cases if case.name == name)


@dataclass
class Runs:
    """Groups in folders, each prepared once and each case run once."""

    root: Path = field(default_factory=lambda: Path(tempfile.mkdtemp(prefix="golden-")))
    _found: dict[tuple[str, str], dict[str, str]] = field(default_factory=dict)
    _folders: dict[str, Path] = field(default_factory=dict)

    def of(self, group: Group, case: Case) -> dict[str, str]:
        """Golden files of a case by their names."""
        key = (group.name, case.name)
        if key not in self._found:
            folder = self._folder(group)
            for name in case.needs:
                self.of(group, group.case(name))
            self._found[key] = _run(case, folder)
        return self._found[key]

    def _folder(self, group: Group) -> Path:
        if group.name not in self._folders:
            folder = self.root / group.name
            folder.mkdir(parents=True)
            with _there(folder):
                group.prepare(folder)
            self._folders[group.name] = folder
        return self._folders[group.name]

    def close(self) -> None:
        shutil.rmtree(self.root, ignore_errors=True)


def differences(group: Group, case: Case, runs: Runs) -> list[str]:
    """What a case says and writes other than its golden files do, a line each."""
    new, old = runs.of(group, case), _stored(group, case)
    out = []
    for name in sorted(new.keys() | old.keys()):
        if name not in new or name not in old:
            out.append(f"{name}: {'is not written any more' if name not in new else 'is new'}")
        elif name.endswith(".json"):
            pairs = _unlike(json.loads(old[name]), json.loads(new[name]), case.tolerance)
            out += [f"{name}: {line}" for line in pairs]
        else:
            lines = difflib.unified_diff(
                old[name].splitlines(), new[name].splitlines(), "old", "new", n=1, lineterm=""
            )
            out += [f"{name}: {line}" for line in lines]
    return out


def write(group: Group, case: Case, runs: Runs) -> bool:
    """Write the golden files of a case where they differ; whether they do."""
    if not differences(group, case, runs):
        return False
    for name in _stored(group, case):
        (FILES / group.name / name).unlink()
    for name, text in runs.of(group, case).items():
        path = FILES / group.name / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return True


def _stored(group: Group, case: Case) -> dict[str, str]:
    folder = FILES / group.name
    paths = [folder / f"{case.name}.txt", *sorted(folder.glob(f"{case.name}.*.json"))]
    return {p.name: p.read_text(encoding="utf-8") for p in paths if p.is_file()}


# one case


@contextlib.contextmanager
def _there(folder: Path) -> Iterator[None]:
    """In a folder, with an environment that texts do not depend on."""
    before = dict(os.environ)
    os.environ.update(_ENVIRONMENT)
    try:
        with contextlib.chdir(folder), threadpool_limits(1), warnings.catch_warnings():
            warnings.simplefilter("error")
            yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _run(case: Case, folder: Path) -> dict[str, str]:
    words = case.command()
    out = folder / case.name
    if case.call is not None or "{out}" in case.words:
        out.mkdir(exist_ok=True)
    days = {datetime.date.today()}
    with _there(folder):
        if case.call is not None:
            case.call(folder, out)
        result = CliRunner().invoke(app, words if case.call is None else ["--version"])
    days.add(datetime.date.today())
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise AssertionError(f"{shlex.join(words)}: {result.output}") from result.exception

    def plain(text: str) -> str:
        return _normalised(text, folder, days)

    parts = [f"$ tribrach {case.words}", f"exit status {result.exit_code}"]
    files: dict[str, str] = {}
    for head, text in (("stdout", plain(result.stdout)), ("stderr", plain(result.stderr))):
        parts += [f"===== {head}", text.rstrip("\n")] if text.strip() else []
    for path in sorted(p for p in out.rglob("*") if p.is_file()) if out.is_dir() else ():
        name = path.relative_to(out).as_posix()
        if MACHINERY.search(name) or not fnmatch(name, case.keep):
            continue
        if path.suffix in (".json", ".geojson"):
            data = json.loads(plain(path.read_text(encoding="utf-8")))
            files[f"{case.name}.{name.replace('/', '-').removesuffix('.json')}.json"] = _json(data)
        elif path.suffix == ".html":
            page = plain(path.read_text(encoding="utf-8"))
            parts += [f"===== page {name}", "\n".join(_page(page))]
        elif path.suffix in TEXTS:
            text = plain(path.read_text(encoding="utf-8"))
            lines = _drawing(html.fromstring(text.encode())) if path.suffix == ".svg" else [text]
            parts += [f"===== {name}", _LONG.sub(_shorter, "\n".join(lines).rstrip("\n"))]
            if path.suffix in _DATA:
                data = _DATA[path.suffix](path.read_text(encoding="utf-8"))
                known = json.loads(plain(json.dumps(data, default=str, ensure_ascii=False)))
                files[f"{case.name}.{name.replace('/', '-')}.json"] = _json(known)
        else:
            parts += [f"===== {name} is written"]
            if path.suffix in (".las", ".laz"):
                files[f"{case.name}.{name.replace('/', '-')}.json"] = _json(_cloud(path))
    lines = "\n".join(parts).splitlines()
    files[f"{case.name}.txt"] = "\n".join(line.rstrip() for line in lines) + "\n"
    return files


def _shorter(number: re.Match[str]) -> str:
    """To a micrometre or six digits, and nothing of what is zero but for rounding."""
    value = float(number.group())
    if abs(value) < 1e-10:
        return "0.0"
    return f"{value:.6f}" if abs(value) > 1 else f"{value:.6g}"


def _normalised(text: str, folder: Path, days: set[datetime.date]) -> str:
    """Without what differs from day to day and from machine to machine."""
    # stages that took long enough to be told: "  name, 12: 3.4 s (after 0:05)"
    text = re.sub(r"^  .*: \d+\.\d s \(after \d+:\d\d\)\n", "", text, flags=re.M)
    # zero has no sign, and what is zero but for rounding no size
    text = re.sub(r"(?<![\d.,])-(0[.,]0+)(?!\d)", r"\1", text)
    text = re.sub(r"\bsingular values \S+e-1\d ", "singular values SMALL ", text)
    for path, word in ((folder, "FOLDER"), (REPOSITORY, "REPOSITORY")):
        text = text.replace(str(path), word).replace(str(path.resolve()), word)
    version = importlib.metadata.version("tribrach")
    text = re.sub(rf"(?i)(tribrach\W{{1,6}}){re.escape(version)}", r"\1VERSION", text)
    for day in days:
        text = text.replace(day.isoformat(), "DATE")
    text = re.sub(r"DATE[T ]\d\d:\d\d:\d\d(\.\d+)?([+-]\d\d:\d\d|Z)?", "DATE-TIME", text)
    return re.sub(r"\b[0-9a-f]{32,64}\b", "DIGEST", text)


def _cloud(path: Path) -> dict[str, Any]:
    """Least, mean and greatest of every dimension of a LAS file, and how many points it has."""
    las = laspy.read(path)
    columns = {
        name: np.asarray(las[name], dtype=float) for name in las.point_format.dimension_names
    }
    columns |= dict(zip("xyz", las.xyz.T, strict=True))
    figures = {
        name: [float(f(values)) for f in (np.nanmin, np.nanmean, np.nanmax)]
        for name, values in columns.items()
        if name not in "XYZ" and np.isfinite(values).any()
    }
    return {"points": len(las.points), "dimensions": figures}


# JSON


def _json(data: Any) -> str:
    return "".join(_written(_rounded(data), "")) + "\n"


def _rounded(data: Any) -> Any:
    if isinstance(data, float):
        return float(f"{data:.12g}")
    if isinstance(data, dict):
        return {key: _rounded(value) for key, value in data.items()}
    return [_rounded(value) for value in data] if isinstance(data, list) else data


def _written(data: Any, indent: str) -> Iterator[str]:
    """A value on one line where it fits, else a line for each of its parts."""
    line = json.dumps(data, ensure_ascii=False)
    if not isinstance(data, dict | list) or len(indent) + len(line) <= _WIDE:
        yield line
        return
    inner = indent + " "
    brackets = "{}" if isinstance(data, dict) else "[]"
    items = data.items() if isinstance(data, dict) else ((None, value) for value in data)
    yield brackets[0]
    for k, (key, value) in enumerate(items):
        yield ",\n" if k else "\n"
        yield inner if key is None else f"{inner}{json.dumps(key, ensure_ascii=False)}: "
        yield from _written(value, inner)
    yield f"\n{indent}{brackets[1]}"


def _unlike(
    old: Any, new: Any, share: float, key: str = "", size: float | None = None
) -> Iterator[str]:
    """Where two values differ by more than a share, by key, with both values.

    `size` is the largest number of the list that the values stand in.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        for name in [*old, *(n for n in new if n not in old)]:
            if name not in new:
                yield f"{key}.{name} is missing; it was {_short(old[name])}"
            elif name not in old:
                yield f"{key}.{name} is new: {_short(new[name])}"
            else:
                yield from _unlike(old[name], new[name], share, f"{key}.{name}", size)
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{key} had {len(old)} items and has {len(new)}"
        inside = max((abs(x) for x in _numbers(old)), default=None) if size is None else size
        for k, (one, other) in enumerate(zip(old, new, strict=False)):
            yield from _unlike(one, other, share, f"{key}[{k}]", inside)
    elif not _same(old, new, share, size, _rounding(key)):
        yield f"{key} was {_short(old)} and is {_short(new)}"


def _numbers(data: Any) -> Iterator[float]:
    """Numbers of lists of lists, but not of rows with names."""
    for value in data:
        if isinstance(value, list):
            yield from _numbers(value)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield value


def _rounding(key: str) -> float:
    """What numbers may be off by for rounding: lengths and angles 1e-12, over their sigmas more."""
    if key.endswith((".w", ".tau")):
        return 1e-9
    return 1e-15 if key.endswith("]") and ".xyz[" not in key else 1e-12


def _same(old: Any, new: Any, share: float, size: float | None, rounding: float) -> bool:
    if isinstance(old, bool) or isinstance(new, bool) or old is None or new is None:
        return old is new
    if isinstance(old, int | float) and isinstance(new, int | float):
        if isinstance(old, int) and isinstance(new, int):
            return old == new
        floor = rounding + share * (size or 0.0)
        return math.isclose(old, new, rel_tol=share, abs_tol=floor)
    return bool(old == new)


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 120 else text[:117] + "..."


# pages

_BLOCKS = {
    *("p", "li", "dt", "dd", "h1", "h2", "h3", "h4", "caption", "figcaption", "summary", "label"),
    *("div", "section", "nav", "main", "header", "footer", "ul", "ol", "dl", "figure", "details"),
    *("table", "thead", "tbody", "body", "a", "button", "option", "pre"),
}
_HEADINGS = {"h1": "# ", "h2": "## ", "h3": "### ", "h4": "#### "}
#: attributes that people read, or that a name is found by
_SAID = ("title", "aria-label", "alt", "placeholder", "data-name")


def _page(text: str) -> list[str]:
    """A page as lines: its text, a row of a table each, drawings as their words and parts."""
    root = html.fromstring(text)
    lines: list[str] = []
    pending: list[str] = []

    def flush(head: str = "") -> None:
        words = " ".join("".join(pending).split())
        pending.clear()
        if words:
            lines.append(head + words)

    def walk(element: Any) -> None:
        tag = element.tag
        if not isinstance(tag, str) or tag in ("script", "style", "template", "head"):
            return
        if tag == "svg":
            flush()
            lines.extend(_drawing(element))
            return
        block = tag in _BLOCKS and not (tag == "a" and element.getparent().tag in ("p", "li"))
        if block or tag == "tr":
            flush()
        said = [f"[{name}: {element.get(name)}]" for name in _SAID if element.get(name)]
        if said:
            pending.append(" ".join(said) + " ")
        if tag in ("section", "table", "figure", "details") and element.get("id"):
            lines.append(f"({tag} {element.get('id')})")
        if tag == "tr":
            lines.append(" | ".join(_cell(cell) for cell in element if isinstance(cell.tag, str)))
            return
        apart = " " if tag in ("span", "b", "time") else ""
        pending.append(apart + (element.text or ""))
        for child in element:
            walk(child)
            pending.append(child.tail or "")
        pending.append(apart)
        if block:
            flush(_HEADINGS.get(tag, ""))

    walk(root.find("body"))
    flush()
    return lines


def _cell(cell: Any) -> str:
    said = [f"[{name}: {e.get(name)}]" for e in cell.iter() for name in _SAID if e.get(name)]
    return " ".join(" ".join([*cell.itertext(), *said]).split())


def _drawing(svg: Any) -> list[str]:
    """How many parts of each kind a drawing has, and its words."""
    parts: Counter[str] = Counter()
    words: list[str] = []
    for element in svg.iter():
        tag = element.tag if isinstance(element.tag, str) else ""
        tag = tag.rpartition("}")[2]
        if tag in ("text", "title"):
            said = " ".join("".join(element.itertext()).split())
            words += [said] if said else []
        elif tag not in ("svg", "g", "defs", "tspan", ""):
            parts[tag] += 1
    label = svg.get("aria-label") or ""
    counts = ", ".join(f"{n} {tag}" for tag, n in sorted(parts.items()))
    return [f"(drawing {label}: {counts})", *([" · ".join(words)] if words else [])]


def frozen(groups: tuple[Group, ...]) -> Callable[..., None]:
    """The test of all cases of some groups."""
    cases = by_name(groups)

    @pytest.mark.parametrize("name", cases)
    def test_as_before(name: str, runs: Runs) -> None:
        group, case = cases[name]
        if group.data is not None and not group.data.exists():
            pytest.skip(f"third-party data are not in {group.data}")
        lines = differences(group, case, runs)
        assert not lines, "\n".join([f"python -m tests.golden --write {name}", *lines[:40]])

    return test_as_before


def by_name(groups: tuple[Group, ...]) -> Mapping[str, tuple[Group, Case]]:
    """Cases by `group/case`."""
    return {f"{group.name}/{case.name}": (group, case) for group in groups for case in group.cases}
