"""Run many cases: ``python -m tests.algorithms --first 0 --cases 10000``."""

from __future__ import annotations

import argparse
import sys
import time

from tests.algorithms.cases import bounded, findings


def main() -> int:
    """Print each finding, and how many there are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int, default=10_000)
    given = parser.parse_args()
    bounded()
    began, count = time.monotonic(), 0
    for found in findings(given.first, given.cases):
        count += 1
        print(f"{found}\n", flush=True)
    print(f"{given.cases} cases, {count} findings, {time.monotonic() - began:.0f} s")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
