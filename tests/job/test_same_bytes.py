"""The same job gives the same bytes, and the same printed figures with any number of threads."""

import os
import re
import subprocess
import sys
from pathlib import Path

from tests.job.test_killed import copied
from tests.job.test_killed import job as job

MAIN = "from tribrach.cli import main; main()"


def left(project: Path, threads: str | None) -> dict[str, bytes]:
    """What a run leaves, by name; the environment says how many threads there are."""
    known = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
    environment = {key: value for key, value in os.environ.items() if key not in known}
    if threads is not None:
        environment |= dict.fromkeys(known, threads)
    command = [sys.executable, "-c", MAIN, "run", str(project), "--quiet"]
    subprocess.run(command, env=environment, check=True, timeout=300, capture_output=True)
    out = project.parent / "out"
    files = (path for path in out.rglob("*") if path.is_file() and ".tribrach" not in path.parts)
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


def test_same_bytes_and_same_figures(job: Path, tmp_path: Path) -> None:
    first, again, threads = (
        left(copied(job, tmp_path / name), number)
        for name, number in (("first", None), ("again", "1"), ("threads", "2"))
    )
    assert "result.json" in first
    assert first == again
    # what people read has no digit that depends on the order of a sum; the keys that a page sorts
    # by have more digits
    for name in ("report.txt", "report.html"):
        read = [re.sub(rb' data-k="[^"]*"', b"", files[name]) for files in (first, threads)]
        assert read[0] == read[1]
