"""All benchmarks, or some: ``python -m benchmarks [NAME ...]``.

    python -m benchmarks                       all, with their full sizes
    python -m benchmarks m3c2 --sizes 0.5      one, with sizes of your own
    python -m benchmarks --write               and write docs/benchmarks.md
    python -m benchmarks --small --guard       small sizes; fails where a ratio has grown

Each runs in a process of its own and is paired with its peer there; peers that are not installed
are said (``pip install 'tribrach[peers]'``). With --write each is kept in build/benchmarks.jsonl
and the page written after it, so that a run that ends early, or one by name, does not cost the
others: the page has what was measured last of each, on this machine with these libraries.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from benchmarks.figures import ROOT, Figure, Growth, from_line, in_words
from benchmarks.guard import grown
from benchmarks.page import write_page
from benchmarks.record import Machine, Watch, keep, kept

#: modules of this folder that measure, in the order of the page
NAMES = (
    "grid_network",
    "scanner_network",
    "network_reading",
    "start_values",
    "self_calibration",
    "planning",
    "workbench",
    "first_points",
    "page_of_cloud",
    "start_up",
    "workers",
    "whole_run",
    "georeferencing",
    "point_covariance",
    "e57_reading",
    "scan_loading",
    "target_search",
    "plane_registration",
    "registration",
    "many_scans",
    "cloud_distances",
    "m3c2",
    "ray_casting",
)


#: what was measured with --write
KEPT = ROOT / "build" / "benchmarks.jsonl"


def main() -> int:
    """Run what the command line asks for; 1 where the guard found something."""
    asked = _arguments()
    found: dict[str, list[Figure | Growth]] = {}
    failed = []
    for name in asked.names or NAMES:
        found[name] = []
        watch = Watch()
        words = [sys.executable, "-m", f"benchmarks.{name}"]
        words += ["--small"] if asked.small else [str(size) for size in asked.sizes]
        with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            for line in child.stdout:
                found[name].append(from_line(line))
                print(in_words(found[name][-1]), flush=True)
        if child.returncode:
            failed.append(name)
            print(f"{name} ended with status {child.returncode}", file=sys.stderr)
        elif asked.write is not None:
            where = Machine.here()
            measured = kept(KEPT, where)
            sizes = "small" if asked.small else " ".join(f"{s:g}" for s in asked.sizes) or "full"
            measured[name] = watch.measured(name, sizes, found[name])
            keep(KEPT, measured.values())
            write_page(asked.write, where, measured, NAMES)
    told = grown(found) if asked.guard else []
    for sentence in told:
        print(sentence, file=sys.stderr)
    return 1 if failed or told else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--sizes", nargs="+", type=float, default=[], help="of the one named")
    parser.add_argument("--small", action="store_true", help="sizes of a minute in all")
    parser.add_argument("--guard", action="store_true", help="compare with benchmarks/guard.toml")
    parser.add_argument(
        "--write", nargs="?", type=Path, const=ROOT / "docs" / "benchmarks.md", help="the page"
    )
    asked = parser.parse_args()
    for name in set(asked.names) - set(NAMES):
        parser.error(f"there is no benchmark {name!r}; there are {', '.join(NAMES)}")
    if asked.sizes and len(asked.names) != 1:
        parser.error("--sizes goes with the name of one benchmark")
    return asked


if __name__ == "__main__":
    sys.exit(main())
