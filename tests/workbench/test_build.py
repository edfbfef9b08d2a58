"""The committed page is that of the committed sources; a forgotten build is seen without node."""

import hashlib
import json
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STATIC = ROOT / "src" / "tribrach" / "workbench" / "static"
WEB = ROOT / "web"
BUILD = json.loads((STATIC / "BUILD.json").read_text())
#: beside what lies in src and licences
ALONE = ("package.json", "package-lock.json", ".npmrc", "build.mjs")


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_page_was_built_from_the_sources_that_are_here() -> None:
    paths = [WEB / name for name in ALONE]
    paths += [p for folder in ("src", "licences") for p in (WEB / folder).rglob("*") if p.is_file()]
    now = {p.relative_to(WEB).as_posix(): digest(p) for p in paths}
    assert BUILD["sources"] == now, "run npm ci && npm run build in web/"


def test_the_page_is_what_the_build_wrote() -> None:
    files = {p.name: digest(p) for p in STATIC.iterdir() if p.name != "BUILD.json"}
    assert BUILD["files"] == files
    assert all(p.is_file() and not p.is_symlink() for p in STATIC.iterdir())


def test_the_lock_names_no_host() -> None:
    """Whoever builds takes the packages from the registry that is his."""
    lock = json.loads((WEB / "package-lock.json").read_text())
    packages = [p for name, p in lock["packages"].items() if name]
    assert packages
    assert all("resolved" not in p for p in packages)
    assert all(p.get("integrity") for p in packages if not p.get("link"))


def test_the_page_asks_no_other_host() -> None:
    """Addresses in the bundle are names of standards and of sources, and none is asked for."""
    page = (STATIC / "index.html").read_text()
    assert "http" not in page
    for line in (STATIC / "main.css").read_text().split("}"):
        assert "url(" not in line or "url(data:" in line
        assert "@import" not in line


def test_licences_of_what_is_bundled_are_there() -> None:
    text = (STATIC / "THIRD_PARTY.txt").read_text()
    packages = json.loads((WEB / "package.json").read_text())["dependencies"]
    assert [name for name in packages if name not in text] == []
