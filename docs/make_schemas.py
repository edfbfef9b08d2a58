"""Writes the JSON Schemas of all documents into ``docs/schema``."""

import json
import pkgutil
from importlib import import_module
from pathlib import Path

from pydantic._internal._docs_extraction import extract_docstrings_from_cls

from tribrach import questions
from tribrach.answers import Form, described
from tribrach.io.epoch_files import FORM as EPOCH
from tribrach.report import json_result
from tribrach.report.schema.base import Document, DocumentPart
from tribrach.report.schema.scans import ScansDocument
from tribrach.report.workbench_parts import FORM as WORKBENCH
from tribrach.workbench.schema import FORM as SCENE

FOLDER = Path(__file__).parent / "schema"


def documents() -> dict[str, type[Document] | Form]:
    """The model of each document by the command that writes it."""
    found: dict[str, type[Document] | Form] = {
        "result": json_result.form(),
        "epoch": EPOCH,
        "info": ScansDocument,
        "scene": SCENE,
        "workbench": WORKBENCH,
    }
    with described():
        describe()
    for module in pkgutil.walk_packages(questions.__path__, "tribrach.questions."):
        import_module(module.name)
    return found | Form.every


def describe() -> None:
    """Give every key of every part the words that stand below its attribute.

    Pydantic does so by itself where it is told to (``use_attribute_docstrings``), but for each
    model whenever it is loaded.
    """
    parts = [DocumentPart]
    for part in parts:
        words = extract_docstrings_from_cls(part, use_inspect=True)
        for name, field in part.model_fields.items():
            above = [base for base in part.__bases__ if issubclass(base, DocumentPart)]
            inherited = [base.model_fields[name] for base in above if name in base.model_fields]
            said = [words.get(name), field.description, *(one.description for one in inherited)]
            field.description = next(filter(None, said), None)
        parts += [kind for kind in part.__subclasses__() if kind not in parts]
    for part in parts:
        part.model_rebuild(force=True)


def schema_text(model: type[Document] | Form) -> str:
    """The JSON Schema of a document (draft 2020-12)."""
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    if isinstance(model, Form):
        schema |= model.json_schema()
    else:
        schema |= model.model_json_schema(by_alias=True, mode="serialization")
    return json.dumps(schema, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def main() -> None:
    """Write all of them."""
    FOLDER.mkdir(exist_ok=True)
    for name, model in documents().items():
        (FOLDER / f"{name}.json").write_text(schema_text(model), encoding="utf-8")


if __name__ == "__main__":
    main()
