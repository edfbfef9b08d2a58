"""Verifying a sealed job: digests, signature, and the run again from its inputs alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tribrach._types import Progress
from tribrach.answers import Form, Number, Result
from tribrach.errors import InputError, TribrachError
from tribrach.io.bag import SIGNATURE, SIGNED, Bag, copied, digest_of, opened_bag
from tribrach.io.json_file import read_json
from tribrach.io.json_text import json_text
from tribrach.questions.seal.sealing import Run, again, versions
from tribrach.questions.seal.signature import Signature, read_signature
from tribrach.scratch import scratch_folder

#: figures that are read from a result
_RESULT = "result.json"


@dataclass(frozen=True)
class DifferentFile(Result):
    """A file of a seal that is not what it was."""

    name: str
    what: Literal["changed", "missing", "not listed", "not reproduced", "not made again"]


@dataclass(frozen=True)
class DifferentFigure(Result):
    """A figure or word of the result that comes out otherwise."""

    #: its keys in the result
    place: str
    sealed: str
    now: str
    #: difference over the sigma of the coordinate; null where none is known
    sigmas: Number = math.nan
    verdict: bool = False  #: is it a verdict, such as that of a test?


@dataclass(frozen=True)
class Verification(Result):
    """What became of a seal."""

    file: str
    title: str
    files: tuple[DifferentFile, ...]  #: files that are not what the seal says
    signature: Signature | None  #: None if it is not signed
    #: was the job run again? why not, if it was not
    run_again: bool
    why_not: str
    #: results that come out otherwise, and what differs in the figures
    reproduced: tuple[DifferentFile, ...]
    figures: tuple[DifferentFigure, ...]
    versions: dict[str, tuple[str, str]]  #: versions that are others here, then and now, by name

    @property
    def whole(self) -> bool:
        """Is every file what the seal says, and the signature, if there is one, of it?"""
        return not self.files and (self.signature is None or self.signature.valid)

    @property
    def holds(self) -> bool:
        """Is it whole, and did a run give the same results?"""
        return self.whole and self.run_again and not self.reproduced


FORM = Form("verification", Verification, 1, sentences=list[str], whole=bool, holds=bool)


def verify_seal(
    path: Path,
    *,
    inputs: Path | None = None,
    trusted: Sequence[Path] = (),
    run: Run | None,
    progress: Progress,
) -> Verification:
    """Test a sealed job.

    inputs : folder of the inputs that are not inside.
    trusted : certificates of authorities.
    run : runs the job again.

    ``inputs`` is a folder of those that are not inside, ``trusted`` certificates of authorities.
    """
    with opened_bag(path) as bag:
        progress("digests", 0, 1)
        wrong = [DifferentFile(name, what) for name, what in sorted(bag.differing().items())]
        progress("digests", 1, 1)
        data, of = bag.read(SIGNATURE), bag.read(SIGNED)
        signature = None if data is None or of is None else read_signature(data, of, trusted)
        about = _about(path, bag.about)
        then, now = about["versions"], versions()
        others = {
            name: (then.get(name, ""), now.get(name, ""))
            for name in sorted(then.keys() | now.keys())
            if then.get(name) != now.get(name)
        }
        lost = [
            name
            for name in about["inputs"]
            if not bag.holds(name) and (inputs is None or not (inputs / name).is_file())
        ]
        beside = () if inputs is None else sorted(name for name in bag.absent if name not in lost)
        for name in beside:
            assert inputs is not None
            if digest_of(inputs / name) != bag.payload[name]:
                wrong.append(DifferentFile(name, "changed"))
        why = "it was not asked for" if run is None else ""
        if {one.name.removeprefix("data/") for one in wrong} & set(about["inputs"]):
            why = "an input is not the one that was sealed"
        if lost:
            why = f"{', '.join(lost[:3])} {'is' if len(lost) == 1 else 'are'} not inside"
        reproduced, figures = list[DifferentFile](), list[DifferentFigure]()
        if run is not None and not why:
            try:
                reproduced, figures = _again(bag, about, inputs, run, progress)
            except TribrachError as error:
                why = f"the run stopped: {str(error).rstrip('.')}"
        title = str(about.get("title", ""))
    return Verification(
        path.name,
        title,
        tuple(wrong),
        signature,
        not why,
        why,
        tuple(reproduced),
        tuple(figures),
        others,
    )


def _about(path: Path, about: Mapping[str, Any]) -> dict[str, Any]:
    """What a seal says of itself, once its keys are what they must be."""
    names = ("inputs", "results", "by_reference")
    sound = (
        isinstance(about.get("versions"), dict)
        and all(isinstance(text, str) for pair in about["versions"].items() for text in pair)
        and all(isinstance(about.get(key), list) for key in names)
        and all(isinstance(name, str) for key in names for name in about[key])
        and all(isinstance(about.get(key), str) for key in ("project", "results_folder"))
    )
    if about.get("seal") != 1 or not sound:
        raise InputError(
            "its seal.json says nothing that this version understands",
            file=path,
            cure="take the version of the program that sealed it",
        )
    if about["project"] not in about["inputs"]:
        raise InputError("its seal.json names no project among the inputs", file=path)
    for name in (*about["inputs"], about["project"], about["results_folder"], *about["results"]):
        if Path(name).is_absolute() or ".." in name.split("/") or "\\" in name:
            raise InputError("a name in its seal.json leads out of its folder", file=path)
    return dict(about)


def _again(
    bag: Bag, about: Mapping[str, Any], inputs: Path | None, run: Run, progress: Progress
) -> tuple[list[DifferentFile], list[DifferentFigure]]:
    """Run the inputs; the results that come out otherwise, and their figures."""
    with scratch_folder() as place:
        for name in about["inputs"]:
            target = place / name
            if bag.holds(name):
                bag.unpack(name, target)
            else:
                assert inputs is not None
                copied(inputs / name, target, bag.payload.get(name, ""))
        out = about["results_folder"]
        made = again(place, about["project"], out, run, progress)
        differing = list[DifferentFile]()
        figures = list[DifferentFigure]()
        # all that is no input is a result, whatever seal.json says
        for name in sorted(bag.payload.keys() - set(about["inputs"])):
            own = name.removeprefix(f"{out}/")
            if own not in made:
                differing.append(DifferentFile(name, "not made again"))
                continue
            if digest_of(made[own]) != bag.payload.get(name):
                differing.append(DifferentFile(name, "not reproduced"))
                if own == _RESULT and bag.holds(name):
                    bag.unpack(name, place / "sealed" / _RESULT)
                    figures = differences(_read(place / "sealed" / _RESULT), _read(made[own]))
    return differing, figures


def _read(path: Path) -> Any:
    """A result, None where it cannot be read."""
    try:
        return read_json(path)
    except (InputError, ValueError):
        return None


def differences(sealed: Any, now: Any) -> list[DifferentFigure]:
    """Every figure and word that differs; coordinates are measured by their sigmas."""
    found = list[DifferentFigure]()
    for keys, one, other in _leaves((), sealed, now):
        numbers = [
            v for v in (one, other) if isinstance(v, int | float) and not isinstance(v, bool)
        ]
        sigmas = math.nan
        if len(numbers) == 2 and (sigma := _sigma(sealed, keys)) > 0:
            sigmas = abs(other - one) / sigma
        place = "/".join(map(str, keys))
        was, now_is = (json_text(value)[:200] for value in (one, other))
        found.append(DifferentFigure(place, was, now_is, sigmas, len(numbers) < 2))
    return found


def _leaves(keys: tuple[str | int, ...], one: Any, other: Any) -> Iterator[tuple[Any, Any, Any]]:
    """Values of two documents that are not the same, with their keys."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in [*one, *(k for k in other if k not in one)]:
            if key != "tribrach":
                yield from _leaves((*keys, key), one.get(key), other.get(key))
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for k, pair in enumerate(zip(one, other, strict=True)):
            yield from _leaves((*keys, k), *pair)
    elif one != other:
        yield keys, one, other


def _sigma(data: Any, keys: tuple[str | int, ...]) -> float:
    """Sigma of a coordinate or of a shift of a pose, 0 where none is stated beside it."""
    try:
        point = keys[0] == "points" and keys[2] == "xyz"
        shift = keys[0] == "stations" and keys[2] == "world_from_scanner" and keys[4] == 3
        if not (point or shift):
            return 0.0
        k = int(keys[3])
        return math.sqrt(data[keys[0]][keys[1]]["covariance"][k][k])
    except (KeyError, IndexError, TypeError, ValueError):
        return 0.0
