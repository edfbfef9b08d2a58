"""Writes the JSON Schemas of all documents into ``docs/schema``."""

import json
import pkgutil
from importlib import import_module
from pathlib import Path

from tribrach import questions
from tribrach.answers import Form
from tribrach.report import json_result

#: modules beside the questions that write a document
_OTHERS = ("io.epoch_files", "report.workbench_parts", "workbench.schema")
FOLDER = Path(__file__).parent / "schema"


def documents() -> dict[str, Form]:
    """The form of each document by its name."""
    found = {"result": json_result.form()}
    for module in pkgutil.walk_packages(questions.__path__, "tribrach.questions."):
        import_module(module.name)
    for name in _OTHERS:
        import_module(f"tribrach.{name}")
    return found | Form.every


def schema_text(form: Form) -> str:
    """The JSON Schema of a document (draft 2020-12)."""
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema"} | form.json_schema()
    return json.dumps(schema, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def main() -> None:
    """Write all of them."""
    FOLDER.mkdir(exist_ok=True)
    for name, model in documents().items():
        (FOLDER / f"{name}.json").write_text(schema_text(model), encoding="utf-8")


if __name__ == "__main__":
    main()
