"""``docs/coverage.md``, written from scores."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.coverage.score import HEADS, Score
from benchmarks.coverage.sites import SITES
from benchmarks.coverage.submission import Submission

__all__ = ["table", "write_page"]

HEAD = """# Does the stated uncertainty hold?

Programs that place scans may say how well. This page holds what they say against the truth of
simulated scenes. The scenes come from a generator that shares no code with the finders or the
simulator of this program: seven sorts of sites, three scanners, speckle, beams on two surfaces,
glass, people who walk, cars that were moved, tripods that turn while they scan. The folder
`benchmarks/coverage` holds generator, scorer and programs; its README says how another program is
added, and `python -m benchmarks.coverage page FOLDER` writes this page.

A pose is *inside 95 %* if the truth lies in the region of its covariance that is to hold 95 %; in
brackets the 95 % interval of that share, binomial for poses, over scenes for points, since points
of a scene share its pose. *Wrong and sure* are poses whose truth is less likely than five sigma of
a normal quantity. *Sigma* is the geometric mean along the axes of the region, and *error* the
length of what the pose was off by, both as medians. What a program refuses is not held against it,
and shows in *poses stated*. All programs but `tribrach` and `kiss_matcher` start at approximate
poses that are off by 0.25 m and 1.25 degrees (sigma) along each axis. Rows with *constant* have one
covariance for all poses, such that 95 % of the poses of scenes with other seeds are inside.

"""


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] + ["--:"] * (len(heads) - 1), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def write_page(
    file: Path, folder: Path, submissions: Sequence[Submission], scores: Sequence[Score]
) -> None:
    """Write the page of some scores.

    Parameters
    ----------
    file, folder : Path
        Of the page, and of the benchmark.
    submissions, scores : sequence
        In one order.
    """
    asked = scores[0].asked
    scenes = len(list((folder / "truth").glob("*.json")))
    parts = [HEAD, f"## All {scenes} scenes, {asked} poses\n\n"]
    parts.append(table(HEADS, [s.cells() for s in scores]))
    parts.append("\n" + "".join(f"* `{s.program}`: {s.settings}.\n" for s in submissions))
    for one in [s for s in scores if s.program.startswith("tribrach")]:
        parts += [f"\n## `{one.program}` by sites\n\n", _by_sites(one), *_wrong(one)]
    parts += ["\n## Where we lose\n\n", *_losses(scores)]
    file.write_text("".join(parts), encoding="utf-8")


def _by_sites(one: Score) -> str:
    rows = [(sort, *one.of(sort).cells()[1:-1]) for sort in SITES]
    return table(("site", *HEADS[1:-1]), rows)


def _wrong(one: Score) -> list[str]:
    """Every pose that is wrong and sure, by scene."""
    wrong = [r for r in one.poses if r.sure]
    if not wrong:
        return ["\nNo pose is wrong and sure.\n"]
    rows = [
        (
            r.scene,
            r.name,
            f"{1e3 * np.linalg.norm(r.error[:3]):.1f}",
            f"{np.degrees(np.linalg.norm(r.error[3:])) * 3600:.0f}",
            f"{np.sqrt(r.square):.1f}",
        )
        for r in wrong
    ]
    heads = ("wrong and sure", "scan", "off [mm]", 'off ["]', "length of the error in sigmas")
    return ["\n", table(heads, rows)]


def _losses(scores: Sequence[Score]) -> list[str]:
    """What another program does better, by the figures alone."""
    ours = [s for s in scores if s.program.startswith("tribrach")]
    peers = [s for s in scores if not s.program.startswith("tribrach")]
    out = []
    for one in ours:
        name = f"`{one.program}`"
        share = np.mean([r.inside for r in one.poses])
        low, high = 0.94, 0.96
        if not low <= share <= high:
            out.append(
                f"* {name}: {100 * share:.1f} % of the poses are inside where 95 % should be.\n"
            )
        points = np.mean([r.inside for r in one.points])
        if not low <= points <= high:
            out.append(
                f"* {name}: {100 * points:.1f} % of the points are inside where 95 % should be.\n"
            )
        if one.refused:
            out.append(f"* {name} refuses {len(one.refused)} of {one.asked} poses.\n")
        for peer in peers:
            if peer.seconds < one.seconds and "constant" not in peer.program:
                times = one.seconds / peer.seconds
                out.append(
                    f"* `{peer.program}` takes less time than {name} by a factor of {times:.1f}.\n"
                )
            both = {(r.scene, r.name): r for r in peer.poses}
            pairs = [(r, both[r.scene, r.name]) for r in one.poses if (r.scene, r.name) in both]
            nearer = sum(
                np.linalg.norm(q.error[:3]) < np.linalg.norm(r.error[:3]) for r, q in pairs
            )
            if nearer and "constant" not in peer.program:
                out.append(
                    f"* The pose of `{peer.program}` is nearer to the truth than that of {name} in "
                    f"{nearer} of {len(pairs)} cases in which both state one.\n"
                )
    return out or ["Nowhere in these figures.\n"]
