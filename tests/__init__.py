"""Tests of the program, and simulators and inputs that they share."""

import os
import platform
from pathlib import Path

# Sums are taken in the same order whatever processor the tests run on: golden files were written
# with these kernels. It has to be said before numpy is loaded.
_CPU = Path("/proc/cpuinfo")
if platform.machine() == "x86_64" and _CPU.is_file() and "avx2" in _CPU.read_text():
    os.environ.setdefault("OPENBLAS_CORETYPE", "Haswell")
