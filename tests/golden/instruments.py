"""Cases of instruments and plans: check, calibrate, noise, plan."""

from __future__ import annotations

import itertools
import shutil
from pathlib import Path

import numpy as np

from tests.cli.test_calibrate import FIVE, HEAD, table
from tests.cli.test_check_cli import coordinate_table, polar_table, xyz_table
from tests.cli.test_noise_cli import written
from tests.golden.harness import REPOSITORY, Case, Group
from tests.golden.networks import rows
from tests.instruments.field_surveys import TARGETS, readings
from tests.job.plan_jobs import laboratory
from tests.network.lab import TRUTH, lab, measured
from tests.test_planning_pages import files
from tribrach.simulate.twins.newcastle_lab import MISALIGNMENTS

JSON, PAGE, TEXT = "--json {out}/result.json", "--html {out}/page.html", "--text {out}/report.txt"
COMMA = '[output]\nangle = "{}"\ndecimal = ","\nthousands = "."\n'

# field checks

THREE = ("1", "2", "3")
YARD = 'title = "Yard"\n[instruments.scanner]\nrange_mm = 1.2\nscan_angle_arcsec = 8.25\n'


def field(folder: Path) -> None:
    """Readings of a good scanner, of a bad one, in one face, in parts, against known lengths."""

    def drawn(seed: int = 3) -> np.random.Generator:
        return np.random.default_rng(seed)

    bad = {"x6": 2e-4, "x10": 6e-3}
    inside = {"inside": np.zeros(3)}
    for name, given in {
        "good": readings(drawn(), series=THREE),
        "bad": readings(drawn(), bad, series=THREE),
        "two": readings(drawn(), series=("1", "2")),
        "single": readings(drawn()),
        "front": readings(drawn(), faces=(1.0,)),
        "faces": readings(drawn(), {"x6": 2e-4}, stations=inside),
        "scaled": readings(drawn(), series=THREE, scale=2e-4),
        "swept": readings(drawn(), {"x6": 1e-4}, faces=(1.0,), swept=True),
    }.items():
        (folder / f"{name}.csv").write_text(polar_table(given))
    many = {"A": np.zeros(3), "B": np.array([30.0, 2, 0]), "C": np.array([-3.0, 30, 1])}
    targets = drawn(5).uniform(-20, 20, size=(10, 3))
    long = readings(drawn(5), targets=targets, stations=many)
    (folder / "long.csv").write_text(polar_table(long))
    (folder / "xyz.csv").write_text(xyz_table(readings(drawn(), series=THREE)))
    lengths = [
        f"T{i},T{j},{np.linalg.norm(TARGETS[i] - TARGETS[j]):.6f},0.3"
        for i, j in itertools.combinations(range(4), 2)
    ]
    rows(folder / "lengths.csv", "from,to,distance_m,sigma_mm", lengths)
    (folder / "points.csv").write_text(coordinate_table("0.2"))
    (folder / "unsure.csv").write_text(coordinate_table(""))
    for name, end in {"job": "", "comma": COMMA.format("gon"), "deg": COMMA.format("deg")}.items():
        text = '[[points]]\nfile = "points.csv"\n[[observations]]\nfile = "bad.csv"\n'
        (folder / f"{name}.toml").write_text(YARD + text + end)


SIGMAS = "--range-mm 1.2 --angle-arcsec 8.25"
CHECK = (
    Case("good", f"check good.csv {SIGMAS} {JSON} {PAGE}"),
    Case(
        "bad", f"check bad.csv {SIGMAS} --earlier good/result.json {JSON} {PAGE}", needs=("good",)
    ),
    Case("sheet", 'check xyz.csv --sheet "Leica ScanStation P40" --alpha 0.01'),
    Case("two", f"check two.csv {SIGMAS} --range-ppm 10"),
    Case("single", f"check single.csv {SIGMAS} {JSON}"),
    Case("front", f"check front.csv {SIGMAS}"),
    Case("faces", f"check faces.csv {SIGMAS} {JSON} {PAGE}"),
    Case("swept", f"check swept.csv {SIGMAS}"),
    Case("long", f"check long.csv {SIGMAS}"),
    Case("lengths", f"check scaled.csv {SIGMAS} --lengths lengths.csv {JSON} {PAGE}"),
    Case("points", f"check scaled.csv {SIGMAS} --lengths points.csv {JSON}"),
    Case("job", f"check job.toml {JSON}"),
    Case("comma", f"check comma.toml {PAGE}"),
    Case("deg", "check deg.toml"),
    Case("no-sigmas", "check good.csv"),
    Case("no-lengths", f"check good.csv {SIGMAS} --lengths unsure.csv"),
    Case("no-sheet", 'check good.csv --sheet "Nobody 5"'),
    Case("no-earlier", f"check good.csv {SIGMAS} --earlier lengths.csv"),
)


# calibrations


def laboratories(folder: Path) -> None:
    five = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    other = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS) | {"x10": 0.004}, 8)
    for name, network in (
        ("targets", five),
        ("again", other),
        ("all", measured(lab(tuple(TRUTH)), TRUTH, 7)),
    ):
        (folder / f"{name}.csv").write_text(table(network))
    for name, text in {
        "five": HEAD + FIVE,
        "again": (HEAD + FIVE).replace("targets.csv", "again.csv"),
        "all": HEAD.replace("targets.csv", "all.csv"),
        "station": HEAD + FIVE + 'per = "station"\n',
        "hybrid": HEAD + FIVE + 'scanner = "hybrid"\n',
        "lichti": HEAD.replace("nist", "lichti")
        + 'parameters = ["A0", "B6", "B7", "C0"]\n'
        + COMMA.format("deg"),
        "unknown": HEAD + 'parameters = ["x99"]\n',
        "none": HEAD.split("[calibration]")[0],
    }.items():
        (folder / f"{name}.toml").write_text(text)
    shutil.copytree(REPOSITORY / "examples" / "paper-network", folder / "paper")


CALIBRATE = (
    Case("five", f"calibrate five.toml {JSON} {PAGE} --out {{out}}/scanner.toml"),
    Case("against", f"calibrate again.toml --against five.toml {JSON} {PAGE}"),
    Case("all", "calibrate all.toml"),
    Case("estimable", "calibrate all.toml --estimable"),
    Case("station", "calibrate station.toml"),
    Case("hybrid", "calibrate hybrid.toml"),
    Case("lichti", f"calibrate lichti.toml {PAGE}"),
    *(
        Case(name.replace("_", "-"), f"calibrate paper/{name}.toml")
        for name in ("two_constraints", "base_length")
    ),
    Case("refused", "calibrate paper/refused.toml"),
    Case("unknown", "calibrate unknown.toml"),
    Case("none", "calibrate none.toml"),
)


# noise


def halls(folder: Path) -> None:
    written(folder / "hall.laz")
    written(folder / "coarse.las", step=0.002, light=False)
    one = "range_mm = 1.0\nscan_angle_arcsec = 8.0\nbeam_exit_mm = 3.5\n"
    scans = '[[scans]]\nfile = "S.laz"\nstation = "S"\n'
    (folder / "job.toml").write_text(f"[instruments.red]\n{one}[instruments.blue]\n{one}{scans}")
    points = np.random.default_rng(1).normal(size=(3000, 3)) * 5
    np.savetxt(folder / "cloud.xyz", points, fmt="%.4f")


NOISE = (
    Case("hall", f"noise hall.laz {JSON} {PAGE} --out {{out}}/scanner.toml"),
    Case("sheet", 'noise hall.laz --sheet "Leica ScanStation P40" --out {out}/p40.toml'),
    Case("project", f"noise hall.laz --project job.toml --name red {JSON}"),
    Case("coarse", f"noise coarse.las {JSON}"),
    Case("no-name", "noise hall.laz --project job.toml"),
    Case("no-planes", "noise cloud.xyz"),
)


# plans


def plans(folder: Path) -> None:
    """The hall of the page, a laboratory, planned sights, a lever arm."""
    files("planning", folder)
    text = (folder / "hall.toml").read_text()
    for name, unit in (("comma", "gon"), ("comma-deg", "deg")):
        (folder / f"{name}.toml").write_text(text + "\n" + COMMA.format(unit))
    (folder / "lab").mkdir()
    laboratory(folder / "lab", "longest_m = 2.0\n", targets=13)
    (folder / "lab" / "lab.toml").rename(folder / "lab" / "open.toml")
    laboratory(
        folder / "lab", 'criterion = "correlation"\nadd_targets = 1\nspacing_m = 3.0\n', targets=13
    )
    rows(
        folder / "points.csv",
        "point,e_m,n_m,u_m,role,sigma_e_mm,sigma_n_mm,sigma_u_mm",
        ["A,0,0,10,fixed,,,", "B,100,0,10,fixed,,,", "P,50,30,12,approximate,,,"],
    )
    rows(
        folder / "planned.csv",
        "from,to,kind,sigma_height_difference_mm,sigma_slope_distance_mm,repetitions",
        [
            "A,P,height_difference,1.0,,",
            "B,P,height_difference,1.0,,",
            "A,P,slope_distance,,2.0,",
            "B,P,slope_distance,,2.0,",
            "P,A,total_station,,,2",
            "P,B,total_station,,,2",
        ],
    )
    (folder / "sights.toml").write_text(
        "[instruments.ts]\ndirection_arcsec = 5\nzenith_arcsec = 5\ndistance_mm = 2\n"
        '[[points]]\nfile = "points.csv"\n[plan]\nobservations = ["planned.csv"]\n'
    )
    rows(folder / "wrong.csv", "from,to,kind", ["A,P,thinking"])
    text = (folder / "sights.toml").read_text()
    (folder / "wrong.toml").write_text(text.replace("planned.csv", "wrong.csv"))
    (folder / "none.toml").write_text(text.split("[plan]")[0])
    (folder / "arm.toml").write_text(ARM)


ARM = """
title = "Lever arm"
[instruments.scanner]
range_mm = 2.0
scan_angle_arcsec = 10.0
target_floor_mm = 1.0
[instruments.gnss]
gnss_plan_mm = 8.0
gnss_up_mm = 12.0
[lever_arms.antenna]
x_m = 0.0
y_m = 0.0
z_m = 0.329
sigma_mm = 1000
[stations.S1]
instrument = "scanner"
lever_arm = "antenna"
[plan]
instrument = "scanner"
add_targets = 3
[plan.lever_arm]
name = "antenna"
gnss = "gnss"
window_deg = 40
nearest_m = 10
farthest_m = 40
"""
PLAN = (
    Case("hall", f"plan hall.toml {JSON} {PAGE} {TEXT}"),
    Case("comma", f"plan comma.toml {PAGE}"),
    Case("comma-deg", f"plan comma-deg.toml {TEXT}"),
    Case("correlation", f"plan lab/lab.toml {JSON}", tolerance=1e-7),
    Case("open", "plan lab/open.toml"),
    Case("sights", f"plan sights.toml {JSON} {PAGE}"),
    Case("arm", f"plan arm.toml {JSON} {PAGE}"),
    Case("wrong", "plan wrong.toml"),
    Case("none", "plan none.toml"),
)

GROUPS = (
    Group("check", field, CHECK),
    Group("calibrate", laboratories, CALIBRATE),
    Group("noise", halls, NOISE),
    Group("plan", plans, PLAN),
)
