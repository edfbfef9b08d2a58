"""Names beside their symbols, so that they do not cover each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

#: size of a letter and of a symbol in pixels
LETTER, LETTER_HEIGHT, SYMBOL = 6.4, 11.0, 6.0
_FIRST = {"control": 0, "station": 1, "check": 2}
_CELL = 48.0

Box = tuple[float, float, float, float]
#: x, y, name, sort, radius of what is drawn there, in pixels
Item = tuple[float, float, str, str, float]


@dataclass(frozen=True)
class Label:
    """A name at the left end of its base line, in pixels."""

    x: float
    y: float
    text: str
    sort: str


class _Occupied:
    """Boxes already taken, in a grid of cells so that each question looks at few."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], list[Box]] = {}

    @staticmethod
    def _keys(box: Box) -> list[tuple[int, int]]:
        left, top, right, bottom = (int(v // _CELL) for v in box)
        return [(i, j) for i in range(left, right + 1) for j in range(top, bottom + 1)]

    def add(self, box: Box) -> None:
        """Take a box."""
        for key in self._keys(box):
            self._cells.setdefault(key, []).append(box)

    def hit(self, box: Box) -> bool:
        """True if a box overlaps one that is taken."""
        return any(
            box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3]
            for key in self._keys(box)
            for b in self._cells.get(key, ())
        )


def place_labels(items: Sequence[Item], width: float, height: float) -> tuple[Label, ...]:
    """Labels of symbols ``(x, y, name, sort, radius)``, each beside its symbol and its ellipse.

    Control, stations and check points choose first; names without room are left out, except
    those three sorts while there are few of them.
    """
    taken = _Occupied()
    for x, y, *_ in items:
        taken.add((x - SYMBOL, y - SYMBOL, x + SYMBOL, y + SYMBOL))
    important = sum(item[3] in _FIRST for item in items)
    out = []
    for x, y, name, sort, radius in sorted(items, key=lambda item: _FIRST.get(item[3], 3)):
        boxes = _label_boxes(x, y, name, radius)
        box = _free_box(boxes, taken, width, height)
        if box is None and sort in _FIRST and important <= 40:
            box = boxes[0]
        if box is not None:
            taken.add(box)
            out.append(Label(round(box[0], 1), round(box[3] - 2.5, 1), name, sort))
    return tuple(out)


def _free_box(boxes: list[Box], taken: _Occupied, width: float, height: float) -> Box | None:
    """The first candidate inside the drawing that overlaps nothing."""
    for box in boxes:
        inside = box[0] >= 0 and box[1] >= 0 and box[2] <= width and box[3] <= height
        if inside and not taken.hit(box):
            return box
    return None


def _label_boxes(x: float, y: float, name: str, radius: float) -> list[Box]:
    """Boxes around an ellipse of that radius: right above first, then corners, sides, farther."""
    w, gap = LETTER * len(name) + 2, max(SYMBOL, radius) + 1.0
    near, h = max(SYMBOL, 0.7 * radius) + 1.0, LETTER_HEIGHT
    corners = [
        (x + near, y - 0.7 * near - h / 2),
        (x + near, y + 0.7 * near - h / 2),
        (x - near - w, y - 0.7 * near - h / 2),
        (x - near - w, y + 0.7 * near - h / 2),
        (x + gap, y - h / 2),
        (x - gap - w, y - h / 2),
        (x - w / 2, y - gap - h),
        (x - w / 2, y + gap),
        (x + SYMBOL + 1, y - h),
        (x - SYMBOL - 1 - w, y),
    ]
    return [(left, top, left + w, top + h) for left, top in corners]
