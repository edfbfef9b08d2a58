"""Workflows, classifiers, citation and changes say the same of the project as pyproject.toml."""

import re
import tomllib
from pathlib import Path
from typing import Any

import yaml

from tribrach import __version__

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def read(path: str) -> dict[str, Any]:
    return yaml.safe_load((ROOT / path).read_text())


def test_every_python_of_the_classifiers_is_checked() -> None:
    pattern = r"Programming Language :: Python :: (3\.\d+)"
    named = re.findall(pattern, "\n".join(PROJECT["classifiers"]))
    job = read(".github/workflows/check.yml")["jobs"]["check"]
    assert job["strategy"]["matrix"]["python"] == named
    assert PROJECT["requires-python"] == f">={named[0]}"
    # the check of GitHub is the one that runs here
    assert "bash .ci/check" in [step.get("run") for step in job["steps"]]


def test_a_release_is_checked_and_holds_what_was_built() -> None:
    jobs = read(".github/workflows/release.yml")["jobs"]
    assert jobs["publish"]["needs"] == "check"
    assert (ROOT / jobs["check"]["uses"]).is_file()
    built = read(".github/workflows/check.yml")["jobs"]["wheel"]["steps"]
    (kept,) = [step["with"]["name"] for step in built if "upload" in step.get("uses", "")]
    taken = [step["with"]["name"] for step in jobs["publish"]["steps"] if "with" in step]
    assert taken == [kept]


def test_the_citation_is_that_of_the_project() -> None:
    citation = read("CITATION.cff")
    assert citation["authors"] == PROJECT["authors"]
    assert citation["license"] == PROJECT["license"]
    assert citation["keywords"] == PROJECT["keywords"]
    assert citation["abstract"] == PROJECT["description"]
    # the version stands in one place only
    assert "version" not in citation


def test_the_newest_changes_are_those_of_this_version() -> None:
    heading = re.search(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert heading is not None
    assert heading[1].split()[0] == __version__


def test_the_conda_recipe_asks_for_what_the_project_asks_for() -> None:
    recipe = read("conda/recipe.yaml")
    (default,) = re.findall(r'default="(.+?)"', recipe["context"]["version"])
    assert default == __version__
    asked = {
        line.split(" ", 1)[0]: line.split(" ", 1)[1:] for line in recipe["requirements"]["run"]
    }
    assert asked.pop("python") == [PROJECT["requires-python"]]
    # the reader of LAZ is an extra of laspy there
    assert asked.pop("lazrs-python") == []
    names = {"qdldl": "qdldl-python"}
    wanted = {}
    for line in PROJECT["dependencies"]:
        name, bound = re.fullmatch(r"([\w-]+)(?:\[\w+\])?(>=[\d.]+)(?:;.*)?", line).groups()
        wanted[names.get(name, name)] = [bound]
    del wanted["pyrtklib"]
    assert asked == wanted
    (entry,) = recipe["build"]["python"]["entry_points"]
    assert entry == f"tribrach = {PROJECT['scripts']['tribrach']}"
    assert recipe["about"]["summary"] == PROJECT["description"]
