"""Compares all cases, or writes their golden files anew.

python -m tests.golden [--write] [--list] [GROUP or GROUP/CASE ...]
"""

from __future__ import annotations

import argparse
import sys
import time

from tests.golden.cases import FILES_OF_CASES
from tests.golden.harness import FILES, Runs, by_name, differences, write


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.golden", description=__doc__)
    parser.add_argument("names", nargs="*", help="groups or cases; all if none is named")
    parser.add_argument("--write", action="store_true", help="write what differs")
    parser.add_argument("--list", action="store_true", help="list the cases")
    given = parser.parse_args()
    cases = by_name(tuple(group for groups in FILES_OF_CASES.values() for group in groups))
    names = given.names
    chosen = {
        name: pair
        for name, pair in cases.items()
        if not names or name in names or name.partition("/")[0] in names
    }
    if unknown := [n for n in names if not any(c == n or c.startswith(f"{n}/") for c in cases)]:
        parser.error(f"there is no case {', '.join(unknown)}")
    runs, unlike = Runs(), 0
    try:
        for name, (group, case) in chosen.items():
            if given.list:
                print(f"{name}: tribrach {case.words}")
                continue
            if group.data is not None and not group.data.exists():
                print(f"{name}: its data are not in {group.data}")
                continue
            begun = time.perf_counter()
            lines = differences(group, case, runs)
            if given.write:
                write(group, case, runs)
            unlike += bool(lines)
            took = time.perf_counter() - begun
            said = "as before" if not lines else "written" if given.write else "differs"
            print(f"{name}: {said} ({took:.1f} s)", flush=True)
            for line in lines if not given.write else lines[:3]:
                print(f"  {line}")
    finally:
        runs.close()
    if given.write and not names:
        kept = {
            FILES / group.name / file
            for group, case in cases.values()
            for file in runs.of(group, case)
        }
        for path in FILES.rglob("*"):
            if path.is_file() and path not in kept:
                path.unlink()
                print(f"{path} belongs to no case and is removed")
    return 1 if unlike and not given.write else 0


if __name__ == "__main__":
    sys.exit(main())
