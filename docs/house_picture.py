"""Draws the rooms of the house for the page on its architecture: ``python docs/house_picture.py``.

The floors are the import layers of ``pyproject.toml``, the words the first lines of the packages.
"""

from __future__ import annotations

import ast
import tomllib
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "pictures" / "house.svg"
#: width of the picture, of its column of names, height of a floor, space between floors [px]
WIDTH, NAMES, FLOOR, GAP = 900, 170, 30, 4
FONT = "font-family: system-ui, sans-serif; font-size: 13px"


def floors() -> list[list[str]]:
    """Modules of each layer from the top down, without the name of the package."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    return [
        [name.strip().removeprefix("tribrach.") for name in layer.split(":")] for layer in layers
    ]


def words(module: str) -> str:
    """First line of what a module or package says of itself."""
    place = ROOT / "src" / "tribrach" / module
    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    said = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return said.splitlines()[0].rstrip(".")


def picture() -> str:
    """The picture as SVG."""
    rows = floors()
    height = len(rows) * (FLOOR + GAP) + GAP
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img">',
        "<title>The rooms of Tribrach; each imports only from those below it</title>",
    ]
    for row, names in enumerate(rows):
        top = GAP + row * (FLOOR + GAP)
        shade = 92 - 40 * row // len(rows)
        text = words(names[0]) if len(names) == 1 else "what everything stands on"
        parts += [
            f'<rect x="0" y="{top}" width="{WIDTH}" height="{FLOOR}" rx="3"'
            f' fill="hsl(205, 45%, {shade}%)"/>',
            f'<text x="10" y="{top + 20}" style="{FONT}; font-weight: 600">'
            f"{escape(', '.join(names) if len(names) > 1 else names[0])}</text>",
        ]
        indent = NAMES if len(names) == 1 else 540
        parts.append(f'<text x="{indent}" y="{top + 20}" style="{FONT}">{escape(text)}</text>')
    return "\n".join([*parts, "</svg>", ""])


if __name__ == "__main__":
    PICTURE.parent.mkdir(exist_ok=True)
    PICTURE.write_text(picture(), encoding="utf-8")
