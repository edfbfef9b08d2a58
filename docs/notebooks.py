"""Pages of docs/notebooks as Jupyter notebooks beside them; a hook of mkdocs.

Their code runs when the site is built; the notebook holds the same text and code for whoever wants
to go on from there.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

__all__ = ["cells", "notebook", "on_files"]

FOLDER = Path(__file__).resolve().parent / "notebooks"
_CODE = re.compile(r"^```python[^\n]*\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def cells(page: str) -> list[tuple[str, str]]:
    """Kind, ``markdown`` or ``code``, and text of the parts of a page in their order."""
    parts = _CODE.split(page)
    kinds = ["markdown", "code"] * len(parts)
    return [(kind, part.strip()) for kind, part in zip(kinds, parts, strict=False) if part.strip()]


def notebook(page: str) -> str:
    """The text of a notebook of format 4.5 with the parts of a page."""
    made: list[dict[str, Any]] = []
    for k, (kind, text) in enumerate(cells(page)):
        name = hashlib.sha256(f"{k}{text}".encode()).hexdigest()[:8]
        cell = {"cell_type": kind, "id": name, "metadata": {}, "source": text.splitlines(True)}
        made.append(cell | ({"execution_count": None, "outputs": []} if kind == "code" else {}))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    whole = {
        "cells": made,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


def on_files(files: Any, config: Any) -> Any:
    """Put a notebook beside each of the pages."""
    from mkdocs.structure.files import File

    for path in sorted(FOLDER.glob("*.md")):
        name = f"notebooks/{path.stem}.ipynb"
        files.append(File.generated(config, name, content=notebook(path.read_text())))
    return files
