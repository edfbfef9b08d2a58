"""Names that would do something in a page that did not escape them, and harmless ones as long."""

from __future__ import annotations

from collections.abc import Callable

#: markup, attributes, templates, scripts, comments, formulas; what steers terminals and writing
HOSTILE = (
    "<img src=x onerror=alert(1)>",
    '"><script>alert(1)</script>',
    "{{7*7}}{% raw %}",
    "</script><b>",
    "' onmouseover='x",
    "</title></style><svg onload=alert(1)>",
    "--><i>&lt;u&gt;",
    "$\\frac{$ ${7*7}",
    "right\u202eleft\u2066",
    "bell\x07\x1b[2J\x7f\x85",
    "nul\x00end",
    "javascript:alert(1)",
)

Naming = Callable[[int], str]


def hostile(k: int) -> str:
    """The k-th hostile name; all are different."""
    return f"{HOSTILE[k % len(HOSTILE)]}{k}"


def harmless(k: int) -> str:
    """A name as long as the k-th hostile one, of a letter and the number."""
    length = len(HOSTILE[k % len(HOSTILE)])
    return f"{'n' * length}{k}"
