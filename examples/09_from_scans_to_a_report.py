"""A whole project: scans, raw readings and control to a georeferenced cloud and its report.

Simulates the survey of two facades with few points first: ``python 09_from_scans_to_a_report.py
FOLDER`` keeps what it makes.
"""

import sys
import tempfile
from pathlib import Path

import tribrach as tb
from tribrach.demo import write_project


def main(folder: Path) -> None:
    """Simulate, run, and look at what came out."""
    project = write_project(folder, points=10_000)
    report = tb.run(project)
    print(report.adjustment)
    for name, station in report.adjustment.stations.items():
        print(name, station)
    print("written:", *sorted(path.name for path in tb.Project.load(project).results.iterdir()))


if len(sys.argv) > 1:
    main(Path(sys.argv[1]))
else:
    with tempfile.TemporaryDirectory() as folder:
        main(Path(folder))
