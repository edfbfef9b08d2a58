"""Cases of epochs, series, transform, regress and baseline."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np

from tests.cli.test_transform_cli import GROUND, MODEL
from tests.epochs.test_series import control, readings
from tests.gnss.rinex_samples import navigation, rinex_2
from tests.golden.harness import REPOSITORY, Case, Group
from tests.golden.networks import PLACES, rows, yard
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader

JSON, PAGE = "--json {out}/result.json", "--html {out}/page.html"


# epochs


def epochs(folder: Path) -> None:
    """Three epochs of the yard; T3 moves, then B too."""
    third = PLACES | {"T3": (95.012, 30.0, 8.994), "B": (81.0, 4.015, 1.2)}
    for name, seed, places in (
        ("e1", 1, PLACES),
        ("e2", 2, PLACES | {"T3": third["T3"]}),
        ("e3", 3, third),
    ):
        (folder / name).mkdir()
        yard(folder / name, seed, places)
    rows(folder / "a.csv", "point,e_m,n_m,u_m,sigma_u_mm", ["P1,,,10.000,1", "P2,,,11.000,1"])
    seeds = REPOSITORY / "fuzz" / "seeds" / "epochs"
    for path in seeds.iterdir():
        shutil.copy(path, folder)
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"
    for name, step in (("one", 0.0), ("two", 0.02)):
        lines = [
            f"{p},{e:.4f},{n:.4f},{u + step * (p == 'T1'):.4f},2,2,2"
            for p, (e, n, u) in PLACES.items()
        ]
        rows(folder / f"{name}.csv", head, lines)
    text = (folder / "e2" / "gon.toml").read_text()
    against = '[[epochs]]\nagainst = ["../e1/yard.toml"]\nreferences = ["A", "B", "C"]\n'
    (folder / "e2" / "since.toml").write_text(text.replace("-blunder", "") + against)
    comma = text.replace("-blunder", "").replace("[output]", '[output]\ndecimal = ","')
    (folder / "e2" / "since-comma.toml").write_text(comma + against)


EPOCHS = (
    Case("two", f"epochs e1/yard.toml e2/yard.toml {JSON} {PAGE} --map {{out}}/map.svg"),
    Case(
        "three",
        f"epochs e1/yard.toml e2/yard.toml e3/yard.toml --reference A --reference B "
        f"--reference C --reference D {JSON} {PAGE}",
    ),
    Case("previous", f"epochs e1/yard.toml e2/yard.toml e3/yard.toml --previous --together {JSON}"),
    Case("control", "epochs e1/yard.toml e2/yard.toml --datum control --posterior --angle deg"),
    Case("plan", "epochs e1/yard.toml e3/yard.toml --coordinates plan --free scale --free turn"),
    Case("heights", "epochs e1/yard.toml e3/yard.toml --coordinates heights --confidence 0.99"),
    Case(
        "systematic",
        f"epochs e1/yard.toml e3/yard.toml --systematic-mm 2 "
        f"--systematic-up-mm 5 --angle deg {JSON} {PAGE}",
    ),
    Case("lists", f"epochs one.csv two.csv {JSON}"),
    Case("kept", "epochs heights.json heights.json"),
    Case("since", "adjust e2/since.toml --json {out}/result.json --text {out}/r.txt"),
    Case("since-comma", "adjust e2/since-comma.toml --angle deg --html {out}/page.html"),
    Case("no-file", "epochs e1/yard.toml e4/yard.toml"),
    Case("alone", "epochs e1/yard.toml"),
    Case("no-point", "epochs e1/yard.toml e2/yard.toml --reference Z"),
)


# series


def series(folder: Path) -> None:
    control(folder)
    few = readings(folder, 24, "few.csv")
    readings(folder, 42, "readings.csv")
    assert few.is_file()


SIGMAS = (
    "--points points.csv --sigma-direction-arcsec 0.49 --sigma-zenith-arcsec 0.49 "
    "--sigma-distance-mm 0.5 --sigma-ppm 0"
)
SERIES = (
    Case("few", f"series few.csv {SIGMAS} {JSON} {PAGE} --alarms {{out}}/alarms.jsonl"),
    Case(
        "resumed",
        f"series readings.csv {SIGMAS} --resume few/result.json {PAGE} "
        "--alarms {out}/alarms.jsonl",
        needs=("few",),
    ),
    Case("scale", f"series few.csv {SIGMAS} --scale --as-stated --baseline 4 --threshold-mm 3"),
    Case("no-points", "series few.csv --points nowhere.csv"),
    Case("no-reference", f"series few.csv {SIGMAS} --reference Z"),
)


# transformations and regressions


def common_points(folder: Path) -> None:
    (folder / "a.csv").write_text(MODEL)
    (folder / "b.csv").write_text(GROUND)
    rng = np.random.default_rng(4)
    with create(folder / "cloud.laz", CloudHeader("cloud")) as writer:
        writer.write(rng.uniform(0, 100, (200, 3)), {})
    rows(folder / "latitudes.csv", "point,latitude_deg,longitude_deg,height_m", ["1,50,8,100"])
    rows(folder / "flat.csv", "point,e_m,n_m", ["1,5,8", "2,6,7"])


TRANSFORM = (
    Case("fit", f"transform fit a.csv b.csv {JSON}"),
    *(Case(f"fit-{n}", f"transform fit a.csv b.csv --model {n} {JSON}") for n in (3, 4, 6)),
    Case("fit-9", "transform fit a.csv b.csv --model 9"),
    Case("check", f"transform fit a.csv b.csv --check 2 {JSON}"),
    Case("apply", "transform apply fit/result.json a.csv {out}/there.csv", needs=("fit",)),
    Case(
        "back",
        "transform apply fit/result.json apply/there.csv {out}/back.csv --inverse",
        needs=("apply",),
    ),
    Case("cloud", "transform apply fit/result.json cloud.laz {out}/there.laz", needs=("fit",)),
    Case("no-model", "transform fit a.csv b.csv --model 8"),
    Case("no-heights", "transform fit flat.csv b.csv"),
    Case("degrees", "transform fit latitudes.csv b.csv"),
    Case("itself", "transform apply fit/result.json a.csv a.csv", needs=("fit",)),
)


def sites(folder: Path) -> None:
    table = REPOSITORY / "tests" / "comparison" / "sixteen_sites.csv"
    shutil.copy(table, folder / "table.csv")
    lines = [line.split(",") for line in table.read_text().splitlines() if line[:1].isdigit()]
    found = [
        {
            "name": f"site {name}",
            "range": float(length),
            "incidence": math.radians(float(angle)) if k != 3 else None,
            "c2c": {"mean": float(mean) / 1e3, "std": float(std) / 1e3},
            "m3c2": {"mean": 0.5e-3 * k, "std": None},
        }
        for k, (name, length, angle, mean, std) in enumerate(lines)
    ]
    (folder / "compare.json").write_text(json.dumps({"schema": 1, "sites": found}))
    rows(folder / "small.csv", "d,rms", ["1,2", "2,3.1", "3,4.3", "4,4.9", "5,6.2"])


REGRESS = (
    Case("table", f"regress table.csv {JSON} {PAGE}"),
    Case("comparison", f"regress compare.json --y m3c2.mean,c2c.mean {JSON}"),
    Case("columns", "regress small.csv --x d --y rms --confidence 0.9"),
    Case("no-column", "regress small.csv"),
)


# baselines

GNSS = REPOSITORY.parent / "shared" / "data" / "gnss" / "geonet_0759_3040"


def receivers(folder: Path) -> None:
    for path in GNSS.iterdir():
        shutil.copy(path, folder)


def handmade(folder: Path) -> None:
    (folder / "base.obs").write_text(rinex_2())
    (folder / "rover.obs").write_text(rinex_2().replace("20000000.123", "20000321.987"))
    (folder / "day.nav").write_text(navigation())


AT = "--base-xyz=-3978241.958,3382840.234,3649900.853"
HERE = "--base-xyz=4157177.0658,671230.4766,4774767.0311"
BASELINE = (
    Case("real", f"baseline 30400920.05o 07590920.05o 30400920.05n {AT} {JSON}"),
    Case(
        "gps",
        f"baseline 30400920.05o 07590920.05o 30400920.05n {AT} --systems G "
        f"--frequencies 1 --no-pieces --sigma-factor 2 {JSON}",
    ),
)
HANDMADE = (
    Case("short", f"baseline base.obs rover.obs day.nav {HERE}"),
    Case("no-place", "baseline base.obs rover.obs day.nav --base-xyz 1,2"),
    Case("no-orbits", f"baseline base.obs rover.obs rover.obs {HERE}"),
)

GROUPS = (
    Group("epochs", epochs, EPOCHS),
    Group("series", series, SERIES),
    Group("transform", common_points, TRANSFORM),
    Group("regress", sites, REGRESS),
    Group("baseline", receivers, BASELINE, GNSS),
    Group("rinex", handmade, HANDMADE),
)
