"""Cases of scans and clouds: run, view, workbench, info, targets, register, compare, complete."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from starlette.testclient import TestClient

from tests.cli import scan_jobs
from tests.cli.test_compare import FAR, SCANNERS, SITES, poses, wall, written
from tests.cli.test_complete_cli import cloud, sigmas
from tests.cli.test_scans_cli import ptx
from tests.comparison import test_completeness
from tests.demo_twin import few_boards
from tests.golden.harness import REPOSITORY, Case, Group
from tests.golden.networks import rows
from tests.io.models.test_triangle_files import binary
from tests.io.survey.riscan_files import Rsp, Scan
from tests.io.survey.riscan_files import write as riscan
from tests.io.survey.test_riscan_links import control as riscan_control
from tests.io.survey.test_riscan_links import seen, sop
from tests.registration.clouds.scenes import points_of
from tests.registration.clouds.scenes import yard as bare_yard
from tests.scan.in_memory import shell
from tests.test_tutorials import courtyard
from tests.workbench import twins
from tests.workbench.test_server import PORT, settled
from tribrach.geometry.pose import Pose
from tribrach.io.twins import write_twin
from tribrach.simulate.setups import levelled
from tribrach.simulate.twins import build
from tribrach.workbench.guard import Guard
from tribrach.workbench.server import application
from tribrach.workbench.service import Service
from tribrach.workbench.session import Session

#: of runs and of registrations, whose iterations carry the last digits of another processor on
RUNS, ITERATED = 1e-6, 1e-4
JSON, PAGE = "--json {out}/result.json", "--html {out}/page.html"
SEEDS = REPOSITORY / "fuzz" / "seeds"


# spheres seen from two stations


def spheres(folder: Path) -> None:
    """Projects of two scans: as they are, with a decimal comma and degrees, with mistakes."""
    world = scan_jobs.POSE @ scan_jobs.SPHERES
    second = Pose(Rotation.from_euler("z", -1.9).as_matrix(), np.array([1000.8, 1999.2, 50.4]))
    scan_jobs.cloud(folder / "S1.laz", scan_jobs.points(seed=1))
    scan_jobs.cloud(folder / "S2.laz", scan_jobs.points(second.inverse @ world, seed=2))
    end = '[output]\nangle = "deg"\ndecimal = ","\nthousands = " "\n'
    end += '[[comparison]]\na = "S1"\nb = "S2"\n'
    path = scan_jobs.project(folder, "S1.laz", "S2.laz")
    text = path.read_text()
    (folder / "comma.toml").write_text(text.replace('format = "las"', 'format = "las"\n' + end))
    (folder / "wrong.toml").write_text(
        text.replace("range_mm", "range_m").replace("S2.laz", "S3.laz") + "[outptu]\n"
    )
    (folder / "missing.toml").write_text(text.replace("S2.laz", "S3.laz"))
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"
    rows(folder / "others.csv", head, ["A,0,0,0,1,1,1", "B,3,0,0,1,1,1", "C,0,9,1,1,1,1"])
    (folder / "others.toml").write_text(text.replace("control.csv", "others.csv"))
    for job in ("init", "init-guess"):
        (folder / job).mkdir()
        for name in ("S1.laz", "S2.laz", "control.csv"):
            shutil.copy(folder / name, folder / job)


SPHERES = (
    Case("run", "run job.toml --out {out}", RUNS),
    Case("comma", "run comma.toml --out {out}", keep="report.*"),
    Case("check-project", "check-project job.toml"),
    Case("check-wrong", "check-project wrong.toml"),
    Case("check-missing", "check-project missing.toml"),
    Case("wrong", "run wrong.toml"),
    Case("missing", "run missing.toml"),
    Case("others", "run others.toml --out {out}"),
    Case("adjust", "adjust job.toml"),
    Case("info", f"info S1.laz S2.laz run/clouds/S1.las {JSON}", needs=("run",)),
    Case("targets", f"targets S1.laz --sphere 0.1 --origin 0 0 0 {JSON}"),
    Case("no-targets", "targets S1.laz --checkerboard 0.3 --origin 0 0 0"),
    Case("no-kind", "targets S1.laz"),
    Case("no-view", "view init --export {out}"),
    Case("diff", "diff run comma --json {out}/d.json", needs=("run", "comma")),
    Case("init", "init {out} --yes --target sphere:0.1", keep="*.toml"),
    Case("init-guess", 'init {out} --yes --scanner "Leica P40"', keep="*.toml"),
    Case("init-none", "init nowhere --yes"),
)


# twins: boards of a facade against the truth, a courtyard with GNSS, a wall that moved


def demo(folder: Path) -> None:
    write_twin(few_boards("hanoi-facade", 10_000, 1), folder, truth=500)


def court(folder: Path) -> None:
    path = courtyard(folder, ("S2", "S3"), 10_000, 2)
    path.rename(folder / "job.toml")
    recipe = '\n[adjustment]\nheights = "recipe"\nheight_mark = "M2"\n'
    text = (folder / "job.toml").read_text() + recipe
    text = text.replace('angle = "gon"', 'angle = "deg"\ndecimal = ","\nthousands = "."')
    (folder / "recipe.toml").write_text(text)


def campaigns(folder: Path) -> None:
    """Both campaigns at the wall from one of the stations; not compared with their truth."""
    twin = build("retaining-wall", 20_000, 1)
    one, two = (
        replace(
            campaign,
            stations=[s for s in campaign.stations if s.name == "S2"],
            scans=[s for s in campaign.scans if s.station == "S2"],
        )
        for campaign in (twin, *twin.later)
    )
    write_twin(replace(one, later=(two,)), folder, lambda *what: None)
    for name in ("epoch1", "epoch2"):
        path = folder / f"{name}.toml"
        lines = [line for line in path.read_text().splitlines() if not line.startswith("truth =")]
        path.write_text("\n".join(lines))


WALL = (
    Case("first", "run epoch1.toml -q"),
    Case("second", "run epoch2.toml --out {out}", RUNS, needs=("first",), keep="[er]*.*"),
    Case(
        "epochs",
        f"epochs out/epoch1/epoch.json second/epoch.json --reference R1 --reference R2 "
        f"--reference R3 --reference R4 --reference R5 {JSON}",
        RUNS,
        needs=("second",),
    ),
    Case(
        "moved",
        "compare second/clouds/S2.laz out/epoch1/clouds/S2.laz --method m3c2 --moved "
        f"--distances {{out}}/moved.laz {JSON} {PAGE}",
        RUNS,
        needs=("second",),
    ),
    Case(
        "view",
        "view second --export {out} --cloud moved/moved.laz --epochs epochs/result.json",
        RUNS,
        needs=("moved", "epochs"),
        keep="scene.json",
    ),
)


# the workbench of a small job


def workbench(folder: Path) -> None:
    twins.results(folder / "yard", "work")
    for kind in ("projected", "ecef"):
        (folder / kind).mkdir()
        twins.write(folder / kind, kind)


def asked(folder: Path, out: Path) -> None:
    """What the server of a session answers: scene, tables, what if, an edit, a comparison."""
    project = folder / "yard" / "yard.toml"
    session = Session.open(project, author="a test")
    guard = Guard(application(Service(session.folder, session)), PORT)
    with TestClient(guard, base_url=f"http://127.0.0.1:{PORT}") as client:
        client.get(guard.address)
        scene = settled(client)

        def kept(name: str, answer: object) -> None:
            (out / f"{name}.json").write_text(json.dumps(answer))

        kept("scene", scene)
        for table in ("points", "stations", "observations"):
            kept(f"table-{table}", client.get(f"/tables/{table}.json").json())
            (out / f"{table}.csv").write_text(client.get(f"/tables/{table}.csv").text)
        state = client.get("/api/session").json()
        kept("session", state)
        one = next(i for i in scene["observations"]["id"] if i.startswith("target_centre:S1:T3"))
        kept("what-if", client.get("/api/what-if", params={"observation": one}).json())
        kept("relative", client.get("/api/relative", params={"a": "T1", "b": "TOP"}).json())
        change = {"do": "use", "observation": one, "use": "off", "reason": "prism tilted"}
        body = {"revision": state["revision"], "changes": [change]}
        edited = client.post("/api/edits", json=body).json()
        edited.pop("seconds", None)
        kept("edited", edited)
        pair = {"a": "run", "b": str(edited["revision"])}
        kept("compared", client.get("/api/compare", params=pair).json())
        none = client.get("/api/what-if", params={"observation": "none"})
        kept("refused", {"status": none.status_code, "answer": none.json()})


WORKBENCH = (
    Case("asked", "workbench yard/yard.toml, by its server", call=asked),
    Case("view", "view yard/out --export {out}"),
    Case("projected", "run projected/yard.toml --out {out}", RUNS, keep="[cr]*.[jt]*"),
    Case("ecef", "run ecef/yard.toml --out {out}", RUNS, keep="[cr]*.[jt]*"),
)


# files of scans


def scans(folder: Path) -> None:
    links = {f"tp00{k}": f"/test/TPL (GLCS)/CP{k}" for k in range(1, 6)}
    taken = [
        Scan("S1", seen("S1", lambda n: n.replace("CP", "tp00")), sop("S1"), links=links),
        Scan("S2", seen("S2", lambda n: n.replace("CP", "x")), registered=False, inactive=("x1",)),
    ]
    riscan(Rsp(taken, glcs=riscan_control(0.9996), crs="EPSG:32633"), folder / "project.rsp")
    ptx(folder / "a.ptx", scans=2)
    for kind in ("las", "laz", "e57", "ply", "pcd", "pts", "ptx", "copc"):
        shutil.copytree(SEEDS / kind, folder / kind)
    (folder / "cut.ptx").write_text((folder / "a.ptx").read_text()[:500])
    (folder / "empty.las").touch()


FILES = (
    Case("info", f"info a.ptx pts/a.pts {JSON}"),
    Case(
        "seeds",
        "info las/a.las las/b.las laz/a.laz laz/b.laz ply/a.ply ply/b.ply pcd/a.pcd pcd/b.pcd "
        f"ptx/a.ptx e57/a.e57 e57/b.e57 copc/a.copc.laz {JSON}",
    ),
    Case("riscan", f"info project.rsp {JSON}"),
    Case("info-bad", "info a.ptx cut.ptx empty.las absent.e57"),
    Case("convert", "convert a.ptx {out}/b.laz"),
    Case("placed", "convert a.ptx {out}/b.las --placed --step-mm 1"),
    Case("no-suffix", "convert a.ptx b.xyzzy"),
    Case("cut", "convert cut.ptx b.laz"),
    Case("no-twin", "simulate atlantis --out x"),
    Case("simulate", "simulate newcastle-lab --out lab --points 10000"),
)


# registration by clouds


def setups(folder: Path) -> None:
    rng = np.random.default_rng(1)
    for k, (x, y, heading) in enumerate(((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5), (2.0, 8.0, -1.4))):
        pose = levelled((x, y, 1.6), heading, 5e-5, rng)
        np.savetxt(folder / f"S{k + 1}.xyz", points_of(bare_yard(), pose, 30_000, k), fmt="%.4f")
    (folder / "alone").mkdir()
    for k in (1, 2, 3):
        shutil.copy(folder / f"S{k}.xyz", folder / "alone")
    flat = rng.uniform((-3, -3, -1.5), (3, 3, -1.5), (20_000, 3))
    np.savetxt(folder / "lone.xyz", flat, fmt="%.4f")
    away = np.loadtxt(folder / "S2.xyz")[:2000] + np.array([5000.0, 7000.0, 100.0])
    np.savetxt(folder / "away.xyz", away, fmt="%.3f")


REGISTER = (
    Case(
        "three",
        f"register S1.xyz S2.xyz S3.xyz --out {{out}} {JSON} {PAGE}",
        ITERATED,
        keep="*.[jh]*",
    ),
    Case(
        "pair",
        "register S1.xyz S2.xyz --clouds las --merged --floor-mm 2 --out {out}",
        ITERATED,
        keep="*.[jl]*",
    ),
    Case("init", "init alone --yes"),
    Case("run", "run alone/project.toml --out {out}", ITERATED, needs=("init",), keep="re*.[jt]*"),
    Case("lone", "register S1.xyz lone.xyz"),
    Case("one", "register S1.xyz"),
    Case("away", "register S1.xyz away.xyz"),
)


# clouds compared


def pairs(folder: Path) -> None:
    written(folder / "S1.laz", wall(0.021, 0.023, 0.3, -0.003, 1))
    written(folder / "S2.laz", wall(0.020, 0.025, 0.0, 0.0, 2))
    poses(folder / "known.json", SCANNERS)
    (folder / "sites.csv").write_text(SITES)
    written(folder / "away.laz", wall(0.2, 0.2, 0.0, 0.0, 3) + 500.0)
    rows(folder / "bad.csv", "name,x,y,z,radius", ["A,1,2,3,0"])
    moved = wall(0.020, 0.025, 0.2, 0.0, 4)
    right = moved[:, 0] - FAR[0] > 3.5
    moved[right, 1] -= 0.02
    written(folder / "moved.laz", moved)
    rng = np.random.default_rng(3)
    plane = np.column_stack([np.full(3000, 5.0), rng.uniform(-3, 3, (3000, 2))])
    for name, shift in (("a", 0.02), ("b", 0.0)):
        points = np.concatenate([plane + np.array([shift, 0, 0]), shell(300, 40.0)])
        np.savetxt(folder / f"{name}.xyz", points, "%.6f", header="x y z", comments="")


COMPARE = (
    Case("sites", f"compare S1.laz S2.laz --sites sites.csv --poses known.json {JSON} {PAGE}"),
    Case("whole", f"compare S1.laz S2.laz --limit-m 0.05 {JSON} {PAGE}"),
    Case("distances", "compare S1.laz S2.laz --distances {out}/d.laz"),
    Case("c2c", "compare S1.laz S2.laz --method c2c --sites sites.csv --html {out}/page.html"),
    Case("m3c2", "compare S1.laz S2.laz --method m3c2 --sites sites.csv"),
    Case("moved", f"compare moved.laz S2.laz --moved --method m3c2 {JSON} {PAGE}"),
    Case("beams", f"compare a.xyz b.xyz --method c2c {JSON}"),
    Case("no-file", "compare S1.laz absent.laz"),
    Case("away", "compare S1.laz away.laz"),
    Case("bad-sites", "compare S1.laz S2.laz --sites bad.csv"),
    Case("regress", "regress sites/result.json --y c2c.mean,m3c2.mean", needs=("sites",)),
)


def surfaces(folder: Path) -> None:
    for name, part, total in (("A", (0, 6), 0.006), ("B", (4, 10), 0.004)):
        xyz = test_completeness.wall(*part)
        cloud(folder / f"{name}.txt", xyz, **sigmas(len(xyz), total))
        cloud(folder / f"{name}-bare.txt", xyz)
    corners = [[[0, 0.05, 0], [10, 0.05, 0], [10, 0.05, 2]],
               [[0, 0.05, 0], [10, 0.05, 2], [0, 0.05, 2]]]  # fmt: skip
    (folder / "wall.stl").write_bytes(binary(np.array(corners)))
    (folder / "bad.stl").write_bytes(b"no mesh at all")


COMPLETE = (
    Case("union", f"complete A-bare.txt B-bare.txt {JSON} {PAGE}"),
    Case("sigmas", f"complete A.txt B.txt --sigma-mm 5 --cell-m 0.2 {JSON}"),
    Case("model", f"complete A.txt --model wall.stl --sigma-mm 5 {PAGE}"),
    Case("no-sigmas", "complete A-bare.txt --sigma-mm 5"),
    Case("no-mesh", "complete A.txt --model bad.stl"),
    Case("twice", "complete A.txt A.txt"),
)

OF_RUNS = (
    Group("spheres", spheres, SPHERES),
    Group("demo", demo, (Case("run", "run hanoi-facade.toml --out {out}", RUNS),)),
    Group(
        "courtyard",
        court,
        (
            Case("run", "run job.toml --out {out}", RUNS),
            Case("recipe", "run recipe.toml --out {out}", RUNS, needs=("run",), keep="report.txt"),
        ),
    ),
    Group("wall", campaigns, WALL),
    Group("workbench", workbench, WORKBENCH),
)
OF_CLOUDS = (
    Group("scans", scans, FILES),
    Group("register", setups, REGISTER),
    Group("compare", pairs, COMPARE),
    Group("complete", surfaces, COMPLETE),
)
GROUPS = (*OF_RUNS, *OF_CLOUDS)
