"""A static baseline from RINEX, files checked and staged, against the bare program rnx2rtkp.

Both run the same engine with the same options; the ratio is what checking, staging and the
process of the wheel cost. Needs files of your own and rnx2rtkp on the path.
Run: ``python -m benchmarks.gnss_baseline BASE.obs ROVER.obs NAV ... --base-xyz X,Y,Z``.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.figures import Figure, cost_of, in_words
from tribrach.gnss.baseline import Processing, compute_baseline
from tribrach.gnss.engine import engines, run_engine
from tribrach.io.gnss.rinex_file import read_rinex

REPEATS = 5


def main() -> None:
    """Each engine against the program alone."""
    parser = argparse.ArgumentParser()
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--base-xyz", required=True)
    call = parser.parse_args()
    base, rover, *orbits = call.files
    place = np.array([float(word) for word in call.base_xyz.split(",")])
    options: dict[str, object] = dict.fromkeys(("pos1-ionoopt", "pos1-tropopt", "pos2-armode"), 1)
    options |= {"pos1-posmode": 3, "pos1-frequency": 2, "pos1-elmask": 15}
    options |= {"out-solformat": 1, "ant2-postype": 1}
    options |= {f"ant2-pos{k + 1}": v for k, v in enumerate(place)}
    with tempfile.TemporaryDirectory() as name:
        folder, plain = Path(name), []
        for k, path in enumerate((rover, base, *orbits)):
            plain.append(folder / f"{k}.rnx")
            plain[-1].write_bytes(read_rinex(path))
        if "rnx2rtkp" not in engines():
            raise SystemExit("rnx2rtkp is not on the path")

        def alone() -> object:
            return run_engine(options, plain, folder, engine="rnx2rtkp")

        bare = cost_of(alone, REPEATS)[1]
    for engine in engines():
        wish = Processing(engine=engine)

        def ours(wish: Processing = wish) -> object:
            return compute_baseline(base, rover, orbits, place, wish)

        cost = cost_of(ours, REPEATS)[1]
        print(in_words(Figure(f"baseline by {engine}", base.name, cost, "rnx2rtkp alone", bare)))


if __name__ == "__main__":
    main()
