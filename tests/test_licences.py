"""Whoever installs the program gets packages under licences that let it be used and passed on."""

import re
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution

import pytest
from packaging.requirements import Requirement

#: words of licences that ask for no more than their notice
FREE = re.compile(
    r"\b(MIT|BSD|0BSD|Apache|ISC|PSF|Python Software Foundation|Zlib|CC0|Unlicense|MPL)\b"
)
#: words of licences that would be those of the whole program
BINDING = re.compile(
    r"\b(A?GPL|GNU (Affero )?General Public|SSPL|BUSL|Commons Clause)", re.IGNORECASE
)
#: what these packages do not say, or ask for, and why they may be used
KNOWN = {
    "pykdtree": "LGPL-3.0: imported as it is, and can be exchanged by whoever has it",
    "pyrtklib": "BSD-2-Clause, as its repository and RTKLIB say; its metadata name none",
}


def normal(name: str) -> str:
    """A name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def required(name: str, extras: frozenset[str], seen: set[tuple[str, str]]) -> Iterator[str]:
    """The packages that a package brings, itself included."""
    yield normal(name)
    for text in distribution(name).requires or ():
        one = Requirement(text)
        wanted = one.marker is None or any(
            one.marker.evaluate({"extra": extra}) for extra in {"", *extras}
        )
        key = (normal(one.name), ",".join(sorted(one.extras)))
        if wanted and key not in seen:
            seen.add(key)
            try:
                yield from required(one.name, frozenset(one.extras), seen)
            except PackageNotFoundError:
                continue


def licence(name: str) -> str:
    """All that a package says of its licence in a line each."""
    about = distribution(name).metadata
    words = [about.get("License-Expression") or "", *(about.get_all("Classifier") or [])]
    words = [word for word in words if word and ("::" not in word or word.startswith("License"))]
    return "; ".join([*words, (about.get("License") or "").split("\n")[0][:80]])


@pytest.mark.parametrize("name", sorted(set(required("tribrach", frozenset(), set()))))
def test_what_is_installed_may_be_used(name: str) -> None:
    said = licence(name)
    if name in KNOWN:
        return
    assert FREE.search(said), f"{name}: {said}"
    assert not BINDING.search(said), f"{name}: {said}"
