"""CloudCompare without its window, from the approximate poses; it has no covariance."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.coverage.programs import Found, moved
from benchmarks.coverage.scenes import Scene

_COMMAND = shutil.which("CloudCompare") or shutil.which("cloudcompare.CloudCompare")
if _COMMAND is None:
    raise ImportError("there is no command CloudCompare")
SETTINGS = "CloudCompare -ICP with 60 % overlap, from the approximate poses"


def register(scene: Scene) -> dict[str, Found | str]:
    """Each scan by itself; the matrix stands in a file beside the moved scan."""
    first, out = scene.points(scene.scans[0]), dict[str, Found | str]()
    for scan in scene.scans[1:]:
        start = scene.approximate(scan)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            np.savetxt(folder / "first.xyz", first, "%.6f")
            np.savetxt(folder / "other.xyz", moved(scene.points(scan), start), "%.6f")
            words = [_COMMAND, "-SILENT", "-AUTO_SAVE", "OFF", "-O", "other.xyz", "-O", "first.xyz"]
            words += ["-ICP", "-ITER", "100", "-OVERLAP", "60"]
            quiet = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
            subprocess.run(words, cwd=folder, env=quiet, check=False, capture_output=True)
            files = list(folder.glob("*REGISTRATION_MATRIX*"))
            out[scan] = Found(np.loadtxt(files[0]) @ start) if files else "no matrix was written"
    return out
