"""KISS-Matcher from nothing but the scans, then small_gicp; no covariance of its own."""

import contextlib
import os
from importlib.metadata import version

import kiss_matcher
import numpy as np

from benchmarks.coverage.programs import Found
from benchmarks.coverage.programs.small_gicp import fitted
from benchmarks.coverage.scenes import Scene

SETTINGS = (
    f"KISS-Matcher {version('kiss-matcher')} with voxels of 0.3 m, no approximate poses, then "
    f"small_gicp {version('small_gicp')}"
)


def register(scene: Scene) -> dict[str, Found | str]:
    """Each scan by itself."""
    first, out = scene.points(scene.scans[0]), dict[str, Found | str]()
    for scan in scene.scans[1:]:
        points = scene.points(scan)
        matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(0.3))
        with open(os.devnull, "w") as quiet, contextlib.redirect_stdout(quiet):
            found = matcher.estimate(points.astype("f4"), first.astype("f4"))
        if not found.valid:
            out[scan] = "its solution is not valid"
            continue
        start = np.eye(4)
        start[:3, :3], start[:3, 3] = np.array(found.rotation), np.array(found.translation).ravel()
        fine = fitted(first, points, start)
        out[scan] = fine if isinstance(fine, str) else Found(fine.matrix)
    return out
