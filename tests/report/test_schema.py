"""The JSON Schemas in the docs are those of the program, and what it writes follows them."""

import importlib.util
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from jsonschema import Draft202012Validator, ValidationError
from pydantic_core import to_json

from tests.report.cases import levelling, mean_of_two, scanner_content
from tribrach.job.opened import open_job
from tribrach.network.observation_rows import observation_rows
from tribrach.project import Project
from tribrach.report import json_result
from tribrach.report.content import Report
from tribrach.simulate.twins import build
from tribrach.solution import AdjustmentSettings, report, solve

DOCS = Path(__file__).resolve().parents[2] / "docs"


def script() -> ModuleType:
    """``docs/make_schemas.py``, which is no package."""
    spec = importlib.util.spec_from_file_location("make_schemas", DOCS / "make_schemas.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


NAMES = sorted(path.stem for path in (DOCS / "schema").glob("*.json"))
RESULT = Draft202012Validator(json.loads((DOCS / "schema" / "result.json").read_text()))


@pytest.fixture(scope="module")
def schemas() -> dict[str, str]:
    """The text of each schema as the models are now."""
    module = script()
    return {name: module.schema_text(model) for name, model in module.documents().items()}


@pytest.mark.parametrize("name", NAMES)
def test_published_schemas_are_current(name: str, schemas: dict[str, str]) -> None:
    published = (DOCS / "schema" / f"{name}.json").read_text()
    assert published == schemas[name], "run docs/make_schemas.py"
    Draft202012Validator.check_schema(json.loads(published))


def test_every_document_has_its_schema_and_none_is_left_over(schemas: dict[str, str]) -> None:
    assert sorted(schemas) == NAMES


@pytest.mark.parametrize("make", [levelling, mean_of_two, scanner_content])
def test_results_follow_the_schema(make) -> None:
    RESULT.validate(json.loads(json_result.dumps(make())))


@pytest.mark.parametrize("part", [1, 2, 5000])
@pytest.mark.parametrize("make", [levelling, mean_of_two, scanner_content])
def test_pieces_are_the_text_of_the_whole_document(
    make: Callable[[], Report], part: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is streamed in parts is, byte for byte, the whole."""
    monkeypatch.setattr(json_result, "_PART", part)
    content = make()
    pieces = list(json_result.pieces(content))
    assert "".join(pieces) == to_json(json_result.network(content), indent=1).decode() + "\n"
    assert max(map(len, pieces)) < len("".join(pieces)) or part > 2


def test_a_value_that_is_no_number_is_not_written() -> None:
    content = levelling()
    content.adjustment.network.observations[0].values[1] = np.nan
    spoilt = replace(content, observations=observation_rows(content.adjustment, content.quality))
    with pytest.raises(ValueError, match="value of an observation is not a number"):
        json_result.dumps(spoilt)


def test_the_schema_refuses_other_keys_and_states() -> None:
    data = json.loads(json_result.dumps(levelling()))
    for change in ({"further": 1}, {"observations": [data["observations"][0] | {"state": "odd"}]}):
        with pytest.raises(ValidationError):
            RESULT.validate(data | change)


def test_observations_have_their_ids() -> None:
    rows = json.loads(json_result.dumps(levelling()))["observations"]
    assert [row["id"] for row in rows] == [
        "height_difference:A:B:loop.csv:1",
        "height_difference:B:C:loop.csv:1",
        "height_difference:C:A:loop.csv:1",
    ]


@pytest.mark.parametrize("name", ["hanoi-facade", "sphere-courtyard", "konya-building"])
def test_surveys_of_twins_follow_the_schema(name: str, tmp_path: Path) -> None:
    """Without their scans; ``tests/test_twins.py`` holds results with scans against the schema."""
    twin = build(name, 2_000, 1)
    for file, text in (twin.files | {"p.toml": twin.project}).items():
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    network = open_job(Project.load(tmp_path / "p.toml")).network()
    settings = AdjustmentSettings()
    content = report(solve(network, settings), settings)
    data = json.loads(json_result.dumps(content))
    RESULT.validate(data)
    assert len(data["observations"]) == network.count()
