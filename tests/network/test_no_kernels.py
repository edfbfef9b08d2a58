"""A network of 400 points is adjusted by LAPACK alone: nothing is compiled for it."""

import subprocess
import sys
from pathlib import Path

from benchmarks.network_files import write_grid


def test_a_network_of_400_points_loads_no_compiler(tmp_path: Path) -> None:
    write_grid(20, tmp_path / "grid.gkf")
    code = (
        "import sys; from tribrach import adjust\n"
        "a = adjust(sys.argv[1]); a.points['P7'].sigma\n"
        "assert a.layout.size > 1500\n"
        "print('numba' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "grid.gkf")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.strip() == "False", done.stderr
