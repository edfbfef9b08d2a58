"""``docs/coverage.md``, written from scores."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.coverage.score import HEADS, Score
from benchmarks.coverage.sites import SITES
from benchmarks.coverage.submission import Submission
from benchmarks.page import table

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
LOSSES = "Poses and points outside their regions, and refusals, are in the tables above."


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
    parts.append(table(file, "coverage", HEADS, [s.cells() for s in scores]))
    settings = [(f"`{s.program}`", s.settings) for s in submissions]
    parts += ["\n", table(file, "programs", ("program", "settings"), settings)]
    for one in [s for s in scores if s.program.startswith("tribrach")]:
        parts += [f"\n## `{one.program}` by sites\n\n", _by_sites(file, one), *_wrong(file, one)]
    heads = ("program", "peer", "times faster", "poses nearer to the truth, of those both state")
    parts += [f"\n## Where we lose\n\n{LOSSES}\n\n", table(file, "losses", heads, _losses(scores))]
    file.write_text("".join(parts), encoding="utf-8")


def _by_sites(file: Path, one: Score) -> str:
    rows = [(sort, *one.of(sort).cells()[1:-1]) for sort in SITES]
    return table(file, f"coverage_{one.program}", ("site", *HEADS[1:-1]), rows)


def _wrong(file: Path, one: Score) -> list[str]:
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
    return ["\n", table(file, f"wrong_{one.program}", heads, rows)]


def _losses(scores: Sequence[Score]) -> list[tuple[str, ...]]:
    """Peers that are faster, or whose pose is nearer to the truth."""
    named = [s for s in scores if "constant" not in s.program]
    rows = []
    for one in (s for s in named if s.program.startswith("tribrach")):
        for peer in (s for s in named if not s.program.startswith("tribrach")):
            both = {(r.scene, r.name): r for r in peer.poses}
            pairs = [(r, both[r.scene, r.name]) for r in one.poses if (r.scene, r.name) in both]
            nearer = sum(
                np.linalg.norm(q.error[:3]) < np.linalg.norm(r.error[:3]) for r, q in pairs
            )
            faster = one.seconds / peer.seconds
            if faster > 1 or nearer:
                times = f"{faster:.1f}" if faster > 1 else ""
                rows.append((one.program, peer.program, times, f"{nearer} of {len(pairs)}"))
    return rows
