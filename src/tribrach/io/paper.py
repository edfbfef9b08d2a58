"""A page that this program wrote, as the source of a paginated document for Typst.

Nothing is computed anew: every word and figure is taken from the page, so that both cannot differ.
What only serves the screen is left out: contents, filters, buttons.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tribrach.errors import InputError

if TYPE_CHECKING:
    from lxml.html import HtmlElement

#: left out by tag, and by class
_SKIPPED = {"nav", "script", "style", "button", "input", "svg"}
_ONLY_SCREEN = {"screen", "open", "filter", "up", "print", "paper"}
_HEADINGS = {"h1": 1, "h2": 2, "h3": 3}
#: columns with longer words share what width is left; letters that fit across the page at full size
_LONG, _LETTERS = 32, 205
#: sizes of letters in tables [pt]
_FULL, _LEAST = 7.6, 4.2
_FONTS = '("Liberation Sans", "Arial", "Helvetica Neue", "DejaVu Sans", "Libertinus Serif")'
_SVG = re.compile(r"<svg\b.*?</svg>", re.DOTALL)
_BOX = re.compile(r'viewBox="([^"]*)"')
#: size of a page, of what a caption needs at least [mm], and of a pixel of a drawing [mm]
_WIDTH, _HEIGHT, _NARROW, _SCALE = 270.0, 112.0, 90.0, 0.22
#: least height of letters on paper [mm]
_LETTER = 2.1
_VARIABLE = re.compile(r"--([\w-]+):\s*([^;}]+)")
_SEPARATE = {"div", "section", "main", "details", "summary", "figure", "header", "footer", "body"}


@dataclass
class Paper:
    """The source of a document, and its pictures by name."""

    title: str
    source: str = ""
    files: dict[str, bytes] = field(default_factory=dict)


def paper_of(page: str, attached: tuple[str, ...] = ()) -> Paper:
    """The document of a page.

    attached : names of files that the document carries.
    """
    from lxml import etree, html

    try:
        root = html.document_fromstring(page)
    except (ValueError, etree.LxmlError):
        root = html.document_fromstring("<p>")
    body, titles = root.find("body"), root.findall(".//h1")
    if body is None or "Tribrach" not in page or not titles:
        raise InputError("this is no page that tribrach wrote", cure="give a report.html")
    title = _text(titles[0])
    found = Paper(title)
    writer = _Writer(found, _style(page), iter(_SVG.findall(page)))
    text = "\n".join(writer.blocks(body))
    found.source = "\n".join([_preamble(title, attached), text])
    return found


def _preamble(title: str, attached: tuple[str, ...]) -> str:
    """Size, letters, heads and what the document carries."""
    carried = [
        f'#pdf.attach({_quoted(name)}, relationship: "data", mime-type: "application/json", '
        'description: "All figures of this document")'
        for name in attached
    ]
    return "\n".join(
        [
            f"#set document(title: {_quoted(title)})",
            '#set page(paper: "a4", flipped: true, margin: (x: 12mm, top: 14mm, bottom: 14mm), '
            f"header: text(7pt, luma(40%), {_quoted(title)}), "
            "footer: context text(7pt, luma(40%), align(center, counter(page).display("
            '"1 / 1", both: true))))',
            f'#set text(font: {_FONTS}, size: 9pt, lang: "en")',
            "#set par(justify: false, spacing: 0.7em)",
            "#set table(stroke: none, inset: (x: 3pt, y: 1.6pt))",
            "#show heading.where(level: 1): set text(17pt)",
            '#show heading.where(level: 2): set text(12pt, rgb("#1f4e79"))',
            "#show heading.where(level: 3): set text(10pt)",
            "#show figure: set block(breakable: false)",
            *carried,
        ]
    )


def _quoted(text: str) -> str:
    """A text as Typst has it between quotes."""
    plain = re.sub(r"[ \t\r\n]+", " ", text)
    return '"' + plain.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _style(page: str) -> str:
    """The style of the drawings in the light form of the page, without variables."""
    css = "".join(re.findall(r"<style>(.*?)</style>", page, re.DOTALL))
    values = dict(reversed(_VARIABLE.findall(css.split("@media")[0])))
    plain = _without_media(css)
    for _ in range(2):
        plain = re.sub(
            r"var\(--([\w-]+)(?:,[^)]*)?\)", lambda one: values.get(one[1], "1").strip(), plain
        )
    rules = re.findall(r"([^{}]+)\{([^{}]*)\}", plain)
    drawn = ("fill", "stroke", "font", "text-anchor", "opacity", "marker")
    kept = [(name, what) for name, what in rules if any(word in what for word in drawn)]
    simple = [(name, what) for name, what in kept if not re.search(r"[:@]", name)]
    own = "text { font-family: 'Liberation Sans', Arial, 'DejaVu Sans', sans-serif }"
    return own + "".join(f"{name.strip()} {{{what}}}\n" for name, what in simple)


def _without_media(css: str) -> str:
    """A style sheet without its blocks for other media."""
    out, depth, skipped = [], 0, None
    for part in re.split(r"(@media[^{]*\{|[{}])", css):
        if part.startswith("@media"):
            skipped = depth if skipped is None else skipped
            depth += 1
            continue
        if part == "{":
            depth += 1
        elif part == "}":
            depth -= 1
            if skipped is not None and depth == skipped:
                skipped = None
                continue
        if skipped is None:
            out.append(part)
    return "".join(out)


@dataclass
class _Writer:
    """Writes elements one by one; drawings come in the order of the page."""

    paper: Paper
    style: str
    drawings: Iterator[str]

    def blocks(self, element: HtmlElement) -> Iterator[str]:
        """The contents of an element as HTML."""
        loose = [_quoted(element.text)] if (element.text or "").strip() else []
        for child in element:
            if not isinstance(child.tag, str):
                continue
            words = set((child.get("class") or "").split())
            if child.tag == "svg":
                yield f"#{self.drawing(child)[0]}"
            elif child.tag in _SKIPPED or words & _ONLY_SCREEN:
                self.pass_over(child)
            elif child.tag in _HEADINGS:
                yield f"#heading(level: {_HEADINGS[child.tag]}, {_quoted(_text(child))})"
            elif child.tag in ("ul", "ol"):
                items = ", ".join(f"[{self.inline(one)}]" for one in child.findall("li"))
                yield f"#list({items})"
            elif child.tag == "dl":
                yield self.pairs(child)
            elif child.tag == "table":
                yield self.table(child)
            elif child.tag == "figure":
                yield self.figure(child)
            elif child.tag == "img":
                if name := self.picture(child.get("src") or ""):
                    yield f"#image({_quoted(name)}, height: 12mm)"
            elif child.tag in _SEPARATE:
                yield from self.blocks(child)
            elif child.tag == "p" and "line" in words:
                yield f"#par[{self.inline(child)} #box(width: 60mm, stroke: (bottom: 0.5pt))]"
            elif child.tag == "p":
                yield f"#par[{self.inline(child)}]"
            else:
                loose.append(f"[{self.inline(child)}]")
            if (child.tail or "").strip():
                loose.append(_quoted(child.tail))
        if loose:
            yield f"#par[{''.join('#' + one for one in loose)}]"

    def inline(self, element: HtmlElement) -> str:
        """Words with their emphasis."""
        parts = [f"#{_quoted(element.text)}" if element.text else ""]
        for child in element:
            words = set((child.get("class") or "").split())
            if child.tag == "svg":
                parts.append(self.sign())
            elif isinstance(child.tag, str) and child.tag not in _SKIPPED | {"br"}:
                if words & _ONLY_SCREEN:
                    self.pass_over(child)
                else:
                    own = self.inline(child)
                    strong = child.tag in ("b", "strong", "em")
                    parts.append(f"#strong[{own}]" if strong else f"#[{own}]")
                    if strong and _stands_alone(child):
                        parts.append("#linebreak()")
            elif child.tag == "br":
                parts.append("#linebreak()")
            parts.append(f"#{_quoted(child.tail)}" if child.tail else "")
        return "".join(parts)

    def pass_over(self, element: HtmlElement) -> None:
        """Leave an element out, and the drawings in it."""
        count = (element.tag == "svg") + len(element.findall(".//svg"))
        for _ in range(count):
            next(self.drawings, "")

    def drawing(self, element: HtmlElement) -> tuple[str, float]:
        """A drawing as a file of its own, and its width [mm]; its letters can be read on paper."""
        text = next(self.drawings, "<svg></svg>")
        size = (
            [float(v) for v in re.findall(r"[\d.]+", _BOX.findall(text)[0])]
            if _BOX.search(text)
            else [0.0, 0.0, 560.0, 390.0]
        )
        across, high = max(size[2], 1.0), max(size[3], 1.0)
        width = min(across * _SCALE, _WIDTH, _HEIGHT * across / high)
        letters = max(11.0, _LETTER * across / width)
        own = f".label, .tick, .count, .entry, .bar text, .head {{font-size: {letters:.1f}px}}"
        head = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
        styled = text.replace("<svg", head, 1).replace(">", f"><style>{self.style}{own}</style>", 1)
        name = f"drawing-{len(self.paper.files) + 1}.svg"
        self.paper.files[name] = styled.encode()
        alt = _quoted(element.get("aria-label") or "drawing")
        return f"image({_quoted(name)}, width: {width:.1f}mm, alt: {alt})", width

    def sign(self) -> str:
        """A sign of a legend, as high as the words beside it."""
        text = next(self.drawings, "<svg></svg>")
        head = '<svg xmlns="http://www.w3.org/2000/svg"'
        name = f"drawing-{len(self.paper.files) + 1}.svg"
        styled = text.replace("<svg", head, 1).replace(">", f"><style>{self.style}</style>", 1)
        self.paper.files[name] = styled.encode()
        return f"#box(image({_quoted(name)}, height: 0.9em))#h(0.3em)"

    def picture(self, source: str) -> str:
        """A picture that the page holds, as a file of its own; "" if it is none."""
        found = re.fullmatch(r"data:image/([\w+.-]+);base64,(.*)", source, re.DOTALL)
        if found is None:
            return ""
        kind = {"svg+xml": "svg", "jpeg": "jpg"}.get(found[1], found[1])
        name = f"picture-{len(self.paper.files) + 1}.{kind}"
        self.paper.files[name] = base64.b64decode(found[2])
        return name

    def figure(self, element: HtmlElement) -> str:
        """A drawing with what it shows; small ones stand beside each other."""
        drawn, said, width = "", "", _WIDTH
        for child in element.iter("svg", "figcaption"):
            if child.tag == "figcaption":
                said = self.inline(child)
            elif not drawn:
                drawn, width = self.drawing(child)
        caption = f"#text(8pt, luma(35%))[{said}]"
        return f"#box(width: {max(width, _NARROW):.0f}mm)[#{drawn}\\ {caption}]#h(4mm)"

    def pairs(self, element: HtmlElement) -> str:
        """Headings with what belongs to them."""
        cells = ", ".join(
            f"[{self.inline(one)}]" for one in element.iter("dt", "dd") if one.tag in ("dt", "dd")
        )
        return f"#table(columns: (auto, 1fr), {cells})"

    def table(self, element: HtmlElement) -> str:
        """All rows of a table, its head on every page."""
        heads = element.findall("./thead/tr/th")
        rows = element.findall("./tbody/tr") or element.findall("./tr")
        texts = [[_text(cell) for cell in row] for row in rows]
        count = len(heads) or max(map(len, texts), default=1)
        longest = [
            max(
                [
                    len(_text(heads[k])) // 2 if heads else 0,
                    3,
                    *(len(r[k]) for r in texts if k < len(r)),
                ]
            )
            for k in range(count)
        ]
        wide = [size > _LONG for size in longest]
        letters = sum(min(size, _LONG) + 3 for size in longest)
        size = max(min(_FULL, _FULL * _LETTERS / letters), _LEAST)
        numeric = ["n" in (head.get("class") or "").split() for head in heads] or [False] * count
        columns = ", ".join("1fr" if long else "auto" for long in wide)
        align = ", ".join("right" if one else "left" for one in numeric)
        head = ", ".join(f"[#strong[{_head(one)}]]" for one in heads)
        cells = [
            self.cell(row, k, cell) for row in rows for k, cell in enumerate(list(row)[:count])
        ]
        first = f"table.header({head}), table.hline(stroke: 0.5pt)," if heads else ""
        return (
            f"#[#set text({size:.2f}pt)\n#table(columns: ({columns},), align: ({align},), "
            f"{first}\n" + ",\n".join(cells) + ")]"
        )

    def cell(self, row: HtmlElement, k: int, cell: HtmlElement) -> str:
        """A cell; what is switched off is struck, what is marked is red."""
        text = f"#{_quoted(_text(cell))}"
        if "off" in (row.get("class") or "").split():
            text = f"#strike[{text}]"
        if "bad" in (cell.get("class") or "").split():
            text = f'#text(rgb("#a3231c"), weight: "bold")[{text}]'
        return f"[{text}]"


def _stands_alone(element: HtmlElement) -> bool:
    """Is it a heading on a line of its own, which the page makes by its style?"""
    if element.tail:
        return element.getprevious() is None and element.tail[0].isalnum()
    return element.getnext() is not None


def _head(element: HtmlElement) -> str:
    """Head of a column with its unit below."""
    unit = element.find("small")
    name = _quoted(element.text or "")
    below = "" if unit is None else f'#linebreak()#text(weight: "regular", {_quoted(_text(unit))})'
    return f"#{name}{below}"


def _text(element: HtmlElement) -> str:
    """All words of an element, a blank before units."""
    parts = [element.text or ""]
    for child in element:
        if isinstance(child.tag, str) and child.tag not in _SKIPPED:
            own = _text(child)
            parts.append(f" {own}" if child.tag in ("i", "small") and own else own)
        parts.append(child.tail or "")
    return re.sub(r"[ \t\r\n\u2007\u2008]+", " ", "".join(parts)).strip()
