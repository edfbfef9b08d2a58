"""Cases of networks: adjust, run without scans, diff, export."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from tests.golden.harness import Case, Group

INPUTS = Path(__file__).parent / "inputs"
SEEDS = Path(__file__).resolve().parents[2] / "fuzz" / "seeds"

JSON, PAGE, TEXT = "--json {out}/result.json", "--html {out}/page.html", "--text {out}/report.txt"
ALL = f"{JSON} {PAGE} {TEXT}"

# a yard: two total stations, a scanner and a levelled line, coordinates of seven digits

ORIGIN = np.array([3_485_200.0, 5_412_300.0, 312.0])
PLACES = {
    "A": (0.0, 0.0, 0.0),
    "B": (81.0, 4.0, 1.2),
    "C": (85.0, 62.0, 0.4),
    "D": (3.0, 58.0, -0.8),
    "S1": (22.0, 25.0, 0.3),
    "S2": (60.0, 33.0, 0.6),
    "T1": (35.0, 70.0, 6.0),
    "T2": (50.0, -9.0, 4.0),
    "T3": (95.0, 30.0, 9.0),
}
INSTRUMENTS = """
[instruments.tps]
direction_arcsec = 3.0
zenith_arcsec = 3.0
distance_mm = 1.5
distance_ppm = 2.0
centring_mm = 0.5
height_mm = 1.0

[instruments.level]
levelling_mm_per_sqrt_km = 1.0

[instruments.scanner]
range_mm = 2.0
scan_angle_arcsec = 10.0
levelling_arcsec = 10.0
"""
YARD = """
title = "Yard"
[facts]
Client = "Nobody"
[site]
kind = "flat"
curvature_radius_m = 6371000.0
{top}
[[points]]
file = "control.csv"
[[observations]]
file = "sights{sights}.csv"
instrument = "tps"
[[observations]]
file = "levels.csv"
instrument = "level"
[[observations]]
file = "targets.csv"
instrument = "scanner"
[stations.L1]
levelled = true
instrument = "scanner"
"""
EDITS = """
[[edit]]
observation = "slope_distance:S1:T2:sights-blunder.csv:1"
use = "off"
reason = "prism tilted by 12.5 degrees"
by = "AB"
at = 2026-05-11T09:30:00

[[edit]]
observation = "levels.csv:4"
use = "check"
reason = "soft ground"

[[role]]
point = "D"
role = "control"
reason = "no reason to hold it back"
"""


def rows(path: Path, head: str, lines: Iterable[str]) -> None:
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")


Places = Mapping[str, tuple[float, float, float]]


def sights(rng: np.random.Generator, places: Places, wrong: Mapping[str, float]) -> list[str]:
    """Readings of both stations in one face, with mistakes of some readings by their names."""
    lines = []
    for station, height in (("S1", 1.55), ("S2", 1.62)):
        turn = float(rng.uniform(0, 400))
        for target in places:
            if target == station:
                continue
            tall = 0.0 if target.startswith("T") else 1.5
            e, n, u = np.subtract(places[target], places[station])
            u += tall - height
            flat = float(np.hypot(e, n))
            u -= flat**2 * (1 - 0.13) / (2 * 6_371_000)
            direction, zenith, distance = rng.normal(0, 1, 3) * (9e-4, 9e-4, 1.5e-3)
            name = f"{station}-{target}"
            direction += wrong.get(f"{name} direction", 0.0)
            distance += wrong.get(f"{name} distance", 0.0)
            direction += np.arctan2(e, n) * 200 / np.pi + turn
            high = height + wrong.get(f"{station} height", 0.0)
            zenith += np.arctan2(flat, u) * 200 / np.pi
            lines.append(
                f"{station},{target},{direction % 400:.5f},{zenith:.5f},"
                f"{np.hypot(flat, u) + distance:.4f},{high:.3f},{tall:.3f}"
            )
    return lines


def yard(folder: Path, seed: int = 32, places: Places = PLACES) -> None:
    """Its files, with several mistakes, and projects that read them."""
    rng = np.random.default_rng(seed)
    head = "from,to,direction_gon,zenith_gon,slope_distance_m,height_instrument_m,height_target_m"
    state = rng.bit_generator.state
    mistakes: dict[str, dict[str, float]] = {
        "": {},
        "-blunder": {"S1-T2 distance": 0.05, "S2-C direction": 0.03},
        "-height": {"S2 height": 0.1},
        "-metre": {"S1-C distance": 1.0},
        "-turned": {"S1-B direction": 200.0, "S1-C distance": 1.0},
        "-circle": {"S2-T2 direction": 100.0},
        "-feet": {"S2-T1 distance": 44.81 * (1 / 0.3048 - 1)},
        "-two": {"S1-T1 direction": 0.05, "S1-T2 direction": -0.04, "S2-T3 distance": 0.03},
    }
    for name, wrong in mistakes.items():
        rng.bit_generator.state = state
        rows(folder / f"sights{name}.csv", head, sights(rng, places, wrong))
    lines = [
        f"{name},{e:.4f},{n:.4f},{u:.4f},2,2,3,{'check' if name == 'D' else 'control'}"
        for name in "ABCD"
        for e, n, u in [ORIGIN + places[name] + rng.normal(0, 1, 3) * (0.002, 0.002, 0.003)]
    ]
    rows(folder / "control.csv", "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role", lines)
    line = []
    for a, b in ("AB", "BC", "CD", "DA"):
        length = float(np.linalg.norm(np.subtract(places[b], places[a])[:2])) / 1000
        step = places[b][2] - places[a][2] + rng.normal(0, 1e-3 * length**0.5)
        line.append(f"{a},{b},{step:.5f},{length:.5f}")
    rows(folder / "levels.csv", "from,to,height_difference_m,length_km", line)
    turn, place = 0.7, np.array([40.0, 22.0, 1.9])
    c, s = np.cos(turn), np.sin(turn)
    line = []
    for name in ("A", "C", "T1", "T2", "T3"):
        e, n, u = np.subtract(places[name], place)
        x, y, z = np.array([c * e + s * n, c * n - s * e, u]) + rng.normal(0, 1e-3, 3)
        line.append(f"L1,{name},{x:.5f},{y:.5f},{z:.5f}")
    rows(folder / "targets.csv", "scan,point,x_m,y_m,z_m", line)
    line[2], line[3] = line[2].replace("T1", "T2"), line[3].replace("T2", "T1")
    rows(folder / "targets-swapped.csv", "scan,point,x_m,y_m,z_m", line)
    comma = '[output]\nangle = "{}"\ndecimal = ","\nthousands = "."\n'
    free = '[datum]\nkind = "free"\npoints = ["A", "B", "C"]\n'
    projects = {
        "yard": ("", ""),
        "deg": ('[output]\nangle = "deg"\n', "-blunder"),
        "gon": ('[output]\nangle = "gon"\nepoch = true\n', "-blunder"),
        "comma": (comma.format("gon"), "-blunder"),
        "comma-deg": (comma.format("deg"), "-height"),
        "free": (free, ""),
        "height": ("", "-height"),
        "metre": ("", "-metre"),
        "turned": ("", "-turned"),
        "circle": ("", "-circle"),
        "feet": ("", "-feet"),
        "two": ("", "-two"),
    }
    for name, (top, which) in projects.items():
        text = YARD.format(top=top, sights=which) + INSTRUMENTS
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    text = YARD.format(top="", sights="").replace("targets.csv", "targets-swapped.csv")
    (folder / "swapped.toml").write_text(text + INSTRUMENTS, encoding="utf-8")
    plain = YARD.format(top="", sights="")
    typed = (folder / "control.csv").read_text().splitlines()
    east, north = typed[2].split(",")[1:3]
    for name, line in {
        "typed": typed[2].replace(north, f"{float(north) + 0.2:.4f}"),
        "placeholder": typed[2].replace(east, "0.0").replace(north, "0.0"),
    }.items():
        rows(folder / f"control-{name}.csv", typed[0], [typed[1], line, *typed[3:]])
        text = plain.replace("control.csv", f"control-{name}.csv") + INSTRUMENTS
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    coarse = INSTRUMENTS.replace("distance_mm = 1.5", "distance_mm = 15000")
    (folder / "coarse.toml").write_text(plain + coarse, encoding="utf-8")
    one = plain.replace("control.csv", "control-one.csv") + INSTRUMENTS
    rows(folder / "control-one.csv", typed[0], [typed[1]])
    (folder / "one.toml").write_text(one, encoding="utf-8")
    top = '[output]\nangle = "gon"\nepoch = true\ndecimal = ","\n'
    (folder / "edited.toml").write_text(
        'edits = "off.toml"\n' + YARD.format(top=top, sights="-blunder") + INSTRUMENTS,
        encoding="utf-8",
    )
    (folder / "off.toml").write_text(EDITS, encoding="utf-8")
    (folder / "none.toml").write_text(EDITS.replace("S1:T2", "S1:T9"), encoding="utf-8")
    (folder / "no-edit.toml").write_text(
        (folder / "edited.toml").read_text().replace("off.toml", "none.toml"), encoding="utf-8"
    )


YARD_CASES = (
    Case("control", f"adjust yard.toml {ALL}"),
    Case("free", f"adjust free.toml {JSON} {PAGE} --epoch {{out}}/epoch.json"),
    Case("fixed", f"adjust yard.toml --datum fixed:A,B,C {TEXT}"),
    Case("free-all", f"adjust yard.toml --datum free --posterior --confidence 0.99 {TEXT}"),
    Case("blunders", f"adjust gon.toml {JSON} {TEXT}"),
    Case("snoop", f"adjust gon.toml --snoop {ALL}"),
    Case("robust", "adjust gon.toml --robust danish"),
    Case("huber", "adjust gon.toml --robust huber"),
    Case("vce", f"adjust yard.toml --vce {JSON}"),
    Case("deg", f"adjust deg.toml {PAGE} {TEXT}"),
    Case("gon-as-deg", "adjust gon.toml --angle deg"),
    Case("comma", f"adjust comma.toml --snoop {PAGE} {TEXT}"),
    Case("comma-deg", f"adjust comma-deg.toml {PAGE} {TEXT}"),
    Case("height", f"adjust height.toml {TEXT}"),
    Case("metre", f"adjust metre.toml {PAGE}"),
    Case("turned", "adjust turned.toml"),
    Case("swapped", f"adjust swapped.toml {TEXT}"),
    *(
        Case(name, f"adjust {name}.toml")
        for name in ("circle", "feet", "two", "typed", "placeholder", "coarse", "one")
    ),
    Case("quiet", "adjust yard.toml -q"),
    Case("no-option", "adjust yard.toml --confidence 2"),
    Case("no-datum", "adjust yard.toml --datum fixed:A,Z"),
    Case("taken", "adjust yard.toml --json control.csv"),
    Case("one-name", "adjust yard.toml --json new.json --text new.json"),
    Case("no-edit", "adjust no-edit.toml"),
    Case("check-project", "check-project gon.toml"),
    Case("run", "run edited.toml --out {out}"),
    Case("run-dry", "run gon.toml --dry-run"),
    Case("export-gkf", "export yard.toml --to gkf --partial --out {out}/yard.gkf"),
    Case("export-starnet", "export yard.toml --to starnet --partial --out {out}/yard.dat"),
    Case("export-dynaml", "export yard.toml --to dynaml --out {out}/yard.xml"),
    Case(
        "diff",
        "diff control/result.json snoop/result.json --json {out}/d.json",
        needs=("control", "snoop"),
    ),
    Case(
        "diff-deg",
        "diff blunders/result.json snoop/result.json --angle deg --confidence 0.99",
        needs=("blunders", "snoop"),
    ),
    Case(
        "diff-datum",
        "diff control/result.json free/result.json --json {out}/d.json",
        needs=("control", "free"),
    ),
    Case("diff-run", "diff snoop/result.json run", needs=("snoop", "run")),
    Case("diff-same", "diff control/result.json control/result.json", needs=("control",)),
)


# the traverse of the demonstration, and files of other programs


def files(folder: Path) -> None:
    for path in INPUTS.iterdir():
        shutil.copy(path, folder)
    for kind in ("gama", "starnet", "gvx", "ski", "sinex", "landxml", "gsi", "sdr"):
        shutil.copytree(SEEDS / kind, folder / kind)
    (folder / "README.md").write_text("# No network\n")
    (folder / "facade.toml").write_text(
        'title = "Traverse"\n[[points]]\nfile = "control.csv"\n'
        '[[points]]\nfile = "check.csv"\nrole = "check"\n'
        '[[observations]]\nfile = "traverse.gsi"\ninstrument = "tps"\n'
        '[[observations]]\nfile = "levelling.csv"\ninstrument = "level"\n' + INSTRUMENTS,
        encoding="utf-8",
    )
    rows(
        folder / "loop.csv",
        "from,to,height_difference_m,sigma_height_difference_mm",
        ["A,B,1.001,1", "B,C,1.001,1", "C,A,-1.999,1"],
    )
    rows(folder / "held.csv", "point,e_m,n_m,u_m,role", ["A,0,0,10,fixed"])


FILE_CASES = (
    Case("facade", f"adjust facade.toml {ALL}"),
    Case("raw", "adjust control.csv traverse.gsi"),
    Case("loop", "adjust loop.csv"),
    Case("loop-held", f"adjust loop.csv held.csv {ALL}"),
    *(Case(f"gama-{name}", f"adjust gama/{name}.gkf {TEXT}") for name in "acdefgh"),
    *(Case(f"starnet-{name}", f"adjust starnet/{name}.dat {TEXT}") for name in "abcefgh"),
    *(
        Case(name.replace("/", "-").partition(".")[0], f"adjust {name}")
        for name in ("ski/a.asc", "sinex/a.snx", "gsi/a.gsi", "sdr/a.raw")
    ),
    Case("gvx-a", f"adjust gvx/a.gvx {JSON} {TEXT}"),
    Case("absent", "adjust absent.gsi"),
    Case("unknown", "adjust README.md"),
)

# what every command says of itself

COMMANDS = (
    *("init", "check-project", "run", "demo", "adjust", "export", "plan", "baseline", "transform"),
    *("transform fit", "transform apply", "epochs", "series", "diff", "view", "workbench"),
    *("targets", "register", "info", "convert", "calibrate", "check", "noise", "compare"),
    *("regress", "complete", "simulate", "doctor", "leave-out", "pdf", "seal", "verify", "pick"),
)
HELP = (
    Case("tribrach", "--help"),
    Case("version", "--version"),
    Case("no-command", "adjst yard.toml"),
    *(Case(words.replace(" ", "-"), f"{words} --help") for words in COMMANDS),
)

GROUPS = (
    Group("yard", yard, YARD_CASES),
    Group("files", files, FILE_CASES),
    Group("help", lambda folder: None, HELP),
)
