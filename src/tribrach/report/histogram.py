"""The test values w as a histogram against the normal curve they should follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach.report.content import Head
from tribrach.statistics import norm

WIDTH, HEIGHT = 460.0, 260.0
LEFT, RIGHT, TOP, BOTTOM = 40.0, 12.0, 14.0, 34.0
LIMIT = 5.0


@dataclass(frozen=True)
class Bar:
    """A bar in pixels; ``words`` say its range and count; outer bars hold everything beyond."""

    x: float
    y: float
    width: float
    height: float
    outer: bool
    words: str


@dataclass(frozen=True)
class Histogram:
    """Bars, the expected curve as a path, ticks ``(x, text)``, critical lines (x), baseline y."""

    width: float
    height: float
    base: float
    top: float
    bars: tuple[Bar, ...]
    curve: str
    ticks: tuple[tuple[float, str], ...]
    highest: int
    highest_y: float
    critical: tuple[float, ...]
    count: int
    mean: float
    spread: float


def histogram(content: Head, critical: float = 3.29) -> Histogram | None:
    """Histogram of w of the values that take part; None with fewer than five."""
    w = content.observations.column("w")[content.observations.column("state") == "active"]
    w = w[np.isfinite(w)]
    if len(w) < 5:
        return None
    step = 0.5 if len(w) >= 40 else 1.0
    edges = np.arange(-LIMIT, LIMIT + step / 2, step)
    counts, _ = np.histogram(np.clip(w, -LIMIT + 1e-9, LIMIT - 1e-9), edges)
    grid = np.linspace(-LIMIT, LIMIT, 121)
    expected = len(w) * step * norm.pdf(grid)
    highest = float(max(counts.max(), expected.max()))
    base = HEIGHT - BOTTOM

    def across(value: float) -> float:
        return LEFT + (value + LIMIT) / (2 * LIMIT) * (WIDTH - LEFT - RIGHT)

    def up(value: float) -> float:
        return base - value / highest * (base - TOP)

    curve = "M" + "L".join(
        f"{across(x):.1f} {up(y):.1f}" for x, y in zip(grid, expected, strict=True)
    )
    return Histogram(
        width=WIDTH,
        height=HEIGHT,
        base=base,
        top=TOP,
        bars=tuple(
            Bar(
                x=round(across(a) + 0.5, 2),
                y=round(up(n), 2),
                width=round(across(b) - across(a) - 1, 2),
                height=round(base - up(n), 2),
                outer=bool(abs(a + b) / 2 > critical),
                words=f"{a:g} to {b:g}: {n}",
            )
            for a, b, n in zip(edges[:-1], edges[1:], counts, strict=True)
            if n
        ),
        curve=curve,
        ticks=tuple((across(v), f"{v:g}") for v in range(-4, 5, 2)),
        highest=int(counts.max()),
        highest_y=round(up(float(counts.max())), 1),
        critical=(across(-critical), across(critical)),
        count=len(w),
        mean=float(w.mean()),
        spread=float(w.std()),
    )
