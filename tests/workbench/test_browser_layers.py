"""What lies in the picture besides the clouds of a run, and what hands do there."""

import io
import json
import shutil
from base64 import b64decode
from collections.abc import Callable
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from PIL import Image

from tests.workbench.browsing import (
    Watched,
    decide,
    folder_server,
    program,
    served,
    settled_tests,
    until,
    where,
    with_budget,
)
from tests.workbench.twins import COLOURS, KINDS, of_kind
from tribrach import pipeline
from tribrach.errors import InputError
from tribrach.questions.epochs.chapters import FORM
from tribrach.workbench.relative import relative
from tribrach.workbench.result_folder import read_result
from tribrach.workbench.service import Service

#: no names, no lines, no shading: what the clouds alone look like
LAYERS = ("points", "stations", "names", "ellipsoids", "rays", "edges", "planes", "moves")
BARE = "edl=0&" + "&".join(f"hide={name}" for name in (*LAYERS, "rejected", "comparisons"))


def picture(page: Watched) -> np.ndarray:
    """The drawn pixels (h, w, 3), without what lies over them."""
    page("tribrach.share()")
    url = page("document.querySelector('canvas.picture').toDataURL('image/png')")
    image = Image.open(io.BytesIO(b64decode(url.split(",")[1]))).convert("RGB")
    return np.asarray(image, dtype=int)


def test_clouds_have_their_own_colours(page: Watched, seen: str) -> None:
    page.open(f"{with_budget(seen)}#colour=rgb&{BARE}")
    page("tribrach.view({eye: [-30, -30, 20], at: [4, 6, 3]})")
    page.settle()
    pixels = picture(page)
    for colour in COLOURS:
        near = (abs(pixels - colour) <= 3).all(axis=2)
        assert near.sum() > 50
    # and no others than the background: nothing is shaded, nothing else is drawn
    drawn = (abs(pixels - pixels[0, 0]) > 12).any(axis=2)
    known = np.any([(abs(pixels - c) <= 3).all(axis=2) for c in COLOURS], axis=0)
    # edges of round points are smoothed against what is behind them
    assert known[drawn].mean() > 0.5
    page.fine()


@pytest.mark.parametrize("kind", KINDS[1:])
def test_the_same_place_is_the_same_picture_in_every_frame(
    browser: Any, yard: Callable[[str], Path], seen: str, kind: str
) -> None:
    """The eye stands and looks at the same places of the earth; a mast stays a mast."""
    eye, at, beside = np.array([[-22.0, -20.0, 14.0], [6.0, 8.0, 2.0], [6.5, 8.0, 2.0]])

    def seen_in(address: str, frame: str, target: np.ndarray) -> np.ndarray:
        context = browser.new_context(viewport={"width": 1000, "height": 700})
        watched = Watched(context.new_page())
        watched.open(f"{with_budget(address)}#colour=intensity&range=100,2000&{BARE}")
        stand = {"eye": of_kind(frame, eye[None])[0], "at": of_kind(frame, target[None])[0]}
        words = json.dumps({key: place.tolist() for key, place in stand.items()})
        watched(f"tribrach.view({words})")
        watched.settle()
        pixels = picture(watched)
        watched.fine()
        context.close()
        # light over squares of 4 pixels: where a point ends is a matter of a part of a pixel
        h, w = (4 * (n // 4) for n in pixels.shape[:2])
        grey = pixels[:h, :w].mean(axis=2)
        return grey.reshape(h // 4, 4, w // 4, 4).mean(axis=(1, 3))

    one, turned = seen_in(seen, "work", at), seen_in(seen, "work", beside)
    with program("view", yard(kind)) as address:
        other = seen_in(address, kind, at)
    assert other.shape == one.shape
    # half a metre beside is seen at once; the frame is not
    apart, moved = abs(other - one).mean(), abs(turned - one).mean()
    assert apart < 0.15 * moved


def test_planes_and_sites_of_comparisons(page: Watched, seen: str) -> None:
    site = {"name": "7", "n": 1200, "range": 22.5, "incidence": 0.4, "xyz": [-18.0, -12.0, 6.0]}
    site |= {"m3c2": {"mean": 0.0012}, "prediction": None, "c2c": None}

    def other(route: Any) -> None:
        scene = route.fetch().json()
        scene["planes"] = {
            "name": ["plane 1"], "normal": [[0, -1, 0]], "offset": [-26.0],
            "centre": [[0, 26, 5]], "extent": [8.0],
        }  # fmt: skip
        scene["comparisons"] = [{"a": "S1", "b": "S2", "limit": 0.1, "sites": [site]}]
        route.fulfill(json=scene)

    page.page.route("**/scene.json", other)
    page.open(f"{with_budget(seen)}#colour=station&{BARE}")
    page("tribrach.look('south')")
    page.settle()
    without = picture(page)
    page.page.click("label.check:has-text('Planes')")
    page.settle()
    changed = (abs(picture(page) - without) > 12).any(axis=2)
    assert changed.mean() > 0.02
    # sixteen metres wide and high, about its centre
    rows, columns = np.nonzero(changed)
    corner = [page(f"tribrach.onScreen([{x}, 26, {z}])") for x, z in ((-8, 13), (8, -3))]
    assert columns.min() == pytest.approx(corner[0][0], abs=3)
    assert columns.max() == pytest.approx(corner[1][0], abs=3)
    assert rows.min() == pytest.approx(corner[0][1], abs=3)
    page.page.click("label.check:has-text('Planes')")
    # the site is a mark that tells its figures
    page.page.click("label.check:has-text('Comparisons')")
    page.settle()
    page.page.mouse.click(*where(page, "[-18, -12, 6]"))
    until(lambda: page("tribrach.selection && tribrach.selection.type === 'site'"), "the site")
    said = page.page.inner_text("#panel").lower()
    for words in ("site 7", "s1 with s2", "1.20 mm", "22.50 m"):
        assert words in said
    page.fine()


def distances(path: Path) -> Path:
    """A cloud as `compare --distances` writes it: a wall whose right half has moved by 12 mm."""
    y, z = (v.ravel() for v in np.meshgrid(np.linspace(-15, 15, 120), np.linspace(1, 9, 60)))
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-4), np.zeros(3)
    for name in ("distance", "sigma", "lod95"):
        header.add_extra_dim(laspy.ExtraBytesParams(name, "float32"))
    header.add_extra_dim(laspy.ExtraBytesParams("significant", "uint8"))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = np.full(y.size, 24.0), y, z
    cloud.distance = np.where(y > 0, 0.012, 0.0004)
    cloud.sigma, cloud.lod95 = np.full(y.size, 0.001), np.full(y.size, 0.002)
    cloud.significant = (y > 0).astype(np.uint8)
    cloud.write(path)
    return path


def test_distances_of_a_comparison_are_a_layer(
    page: Watched, yard: Callable[[str], Path], tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    shutil.copytree(yard("work"), folder)
    with program("view", folder, "--cloud", distances(tmp_path / "moved.laz")) as address:
        page.open(f"{with_budget(address)}")
        # what was given besides is what one wants to see; nothing is in the middle of the colours
        until(lambda: page("tribrach.colourOf().by") == "distance", "the colour")
        assert page("tribrach.colourOf().range") == pytest.approx([-0.012, 0.012], rel=1e-5)
        left = page.page.inner_text("aside.left")
        assert "Given besides" in left
        assert "7\u202f200" in left
        page.page.click("button[title^='Pick points']")
        page("tribrach.view({eye: [-20, 2, 5], at: [24, 2, 5]})")
        page.settle()
        for place, words in (
            ("[24, 7.05, 5]", "beyond its level of detection"),
            ("[24, -1.95, 5]", "no change can be told"),
        ):
            page.page.mouse.click(*where(page, place))
            until(lambda w=words: w in page.page.inner_text("#panel"), words)
            assert "level of detection 2.00 mm" in " ".join(
                page.page.inner_text("#panel").lower().split()
            )
        # blue and red: what moved, what did not; the clouds of the run are plain
        page.page.select_option("select:has(option[value='station'])", "significance")
        pixels = picture(page)
        red = (abs(pixels - (178, 24, 43)) <= 40).all(axis=2).mean()
        assert red > 0.02
        page.fine()


def test_a_side_of_the_slice_is_dragged(page: Watched, seen: str) -> None:
    page.open(f"{with_budget(seen)}#slice=0,0,4,12,12,3,0.3")
    page("tribrach.look('plan')")
    page.settle()
    before = page("tribrach.slice")
    box = page.page.locator("canvas.picture").bounding_box()
    assert box is not None
    face = next(f for f in page("tribrach.handles") if f["k"] == 0 and f["sign"] > 0)
    x, y = face["screen"]
    metre = np.subtract(page("tribrach.onScreen([1, 0, 0])"), page("tribrach.onScreen([0, 0, 0])"))
    along = np.array(face["axis"][:2]) * (1, -1) * np.hypot(*metre) * 3
    page.page.mouse.move(box["x"] + x, box["y"] + y)
    page.page.mouse.down()
    for share in np.linspace(0.1, 1, 10):
        page.page.mouse.move(box["x"] + x + share * along[0], box["y"] + y + share * along[1])
    page.page.mouse.up()
    after = page("tribrach.slice")
    # this side came three metres nearer to the pointer, the opposite one stayed
    assert after["half"][0] == pytest.approx(before["half"][0] + 1.5, abs=0.15)
    assert after["half"][1:] == before["half"][1:]
    gone = [f for f in page("tribrach.handles") if f["k"] == 0 and f["sign"] < 0]
    kept = np.array(before["centre"]) - np.array(face["axis"]) * before["half"][0]
    assert gone[0]["at"] == pytest.approx(kept.tolist(), abs=0.01)
    page.fine()


def test_fingers_turn_move_and_bring_nearer(browser: Any, seen: str) -> None:
    context = browser.new_context(viewport={"width": 800, "height": 700}, has_touch=True)
    page = Watched(context.new_page())
    page.open(with_budget(seen))
    box = page.page.locator("canvas.picture").bounding_box()
    assert box is not None
    middle = np.array([box["x"] + box["width"] * 0.5, box["y"] + box["height"] * 0.55])
    tell = context.new_cdp_session(page.page)

    def touch(kind: str, *places: np.ndarray) -> None:
        points = [{"x": float(x), "y": float(y), "id": k} for k, (x, y) in enumerate(places)]
        tell.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def distance() -> float:
        return float(np.linalg.norm(np.subtract(page("tribrach.camera().eye"), (0, 0, 2))))

    yaw, away = page("tribrach.camera().yaw"), distance()
    touch("touchStart", middle)
    for k in range(1, 9):
        touch("touchMove", middle + np.array([12 * k, 0]))
    touch("touchEnd")
    turned = page("tribrach.camera().yaw")
    assert abs(turned - yaw) > 0.1
    assert distance() == pytest.approx(away, rel=0.5)
    # two fingers that part bring it nearer
    away = distance()
    for k in range(9):
        spread = np.array([30 + 12 * k, 0])
        touch("touchStart" if k == 0 else "touchMove", middle - spread, middle + spread)
    touch("touchEnd")
    assert distance() < 0.8 * away
    # a tap chooses
    page("tribrach.look('plan')")
    page.settle()
    places = {p["name"]: p["xyz"] for p in page("tribrach.points")}
    page.page.touchscreen.tap(*where(page, json.dumps(places["T2"])))
    until(lambda: page("tribrach.selection") == {"type": "point", "name": "T2"}, "the point")
    page.fine()
    context.close()


@pytest.mark.parametrize("written", [False, True])
def test_a_run_is_stopped_from_the_page(
    page: Watched, project: Path, monkeypatch: pytest.MonkeyPatch, written: bool
) -> None:
    true_run, told = pipeline.run, []

    def held(project: Any, folder: Path, progress: Any) -> Any:
        """A run that goes no further than where it is held until it is stopped."""

        def waits(what: str, done: int, total: int | None) -> None:
            told.append(what)
            progress(what, done, total)
            # the first cloud is in its place once the second is begun
            if what in ("before anything", "S2"):
                until(lambda: progress(what, done, total), "somebody who stops it")

        if not written:
            waits("before anything", 0, None)
        return true_run(project, folder, waits)

    with served(project) as address:
        page.open(with_budget(address))
        settled_tests(page, 1)
        for record in (project.parent / "out" / ".tribrach").glob("cloud-*.json"):
            record.unlink()
        monkeypatch.setattr(pipeline, "run", held)
        page.page.click("button[title^='Run the project']")
        button = page.page.locator(".banner:has(progress) button")
        until(lambda: told and button.count(), "the way to stop it")
        assert page("tribrach.session.running")
        button.click()
        until(lambda: "was stopped" in page.page.inner_text("body"), "the end")
        until(lambda: not page("tribrach.session.running"), "the session")
        assert page.page.locator(".banner progress").count() == 0
        # where something was written the clouds are those of the folder, and it is said
        assert ("of two runs" in page.page.inner_text(".banners")) is written
        page.settle()
        # and the next one goes through
        monkeypatch.setattr(pipeline, "run", true_run)
        with page.page.expect_event("load", timeout=240_000):
            page.page.click("button[title^='Run the project']")
        until(lambda: page("!!(window.tribrach && tribrach.ready)"), "the page after the run")
        page.settle()
        assert "of two runs" not in page.page.inner_text("body")
        page.fine()


def test_two_states_are_compared_and_their_moves_drawn(page: Watched, project: Path) -> None:
    with served(project) as address:
        page.open(with_budget(address))
        settled_tests(page, 1)
        summaries = [page("tribrach.summary")]
        row = page("tribrach.rowsShown")[0]
        page.page.locator(".rows .row").nth(0).locator("button.use").click()
        decide(page, "off")
        settled_tests(page, 2)
        summaries.append(page("tribrach.summary"))
        moved = {p["name"]: p["moved"] for p in page("tribrach.points")}
        page.page.click("button[title^='Undo']")
        settled_tests(page, 3)
        assert page("tribrach.counts.moves") == 0
        page.page.click("#tab-changes")
        page.page.select_option("select[aria-label='First state']", "1")
        page.page.select_option("select[aria-label='Second state']", "2")
        page.page.click("#panel button:text-is('Compare')")
        until(lambda: page.page.locator("#panel .sides").count(), "the comparison")
        said = page.page.inner_text("#panel")
        assert "state 2, 1 edit" in said
        for side in summaries:
            assert f"{side['posterior']:.4f}" in said
        # the arrows are those between the two states, though the network is as it was
        far = {name for name, m in moved.items() if np.linalg.norm(m) > 5e-6}
        assert page("tribrach.counts.moves") >= len(far) > 0
        name, most = max(moved.items(), key=lambda m: float(np.linalg.norm(m[1])))
        assert f"{1000 * np.linalg.norm(most):.2f}" in page.page.inner_text(
            f"#panel tr:has(td:text-is('{name}'))"
        )
        assert "active → off" in said
        assert row["words"] in said
        assert "state 1, no edits to state 2" in page.page.inner_text(".legend")
        page.page.click("#panel button:text-is('End')")
        until(lambda: page("tribrach.counts.moves") == 0, "the end of the comparison")
        page.fine()


def test_a_project_that_was_never_run_says_so(page: Watched, project: Path) -> None:
    shutil.rmtree(project.parent / "out")
    with program("workbench", project) as address:
        page.open(with_budget(address), settled=False)
        said = page.page.inner_text(".banners")
        assert "was not run to its end" in said
        assert "press Run" in said
        assert "was not run to its end" in page.page.inner_text("aside.left")
        # the network is there: stations, points, ellipsoids and sights
        counts = page("tribrach.counts")
        assert counts["marks"] == 8
        assert counts["ellipsoids"] == 8
        assert counts["rays"] > 8
        assert page("tribrach.share()") > 0.005
        page.page.click("#tab-changes")
        assert "since the project was opened" in page.page.inner_text("#panel").lower()
        with page.page.expect_event("load", timeout=240_000):
            page.page.click("button[title^='Run the project']")
        until(lambda: page("!!(window.tribrach && tribrach.ready)"), "the page after the run")
        page.settle()
        assert page.page.locator(".banner").count() == 0
        page.fine()


def test_a_role_is_changed_and_changed_back(page: Watched, project: Path) -> None:
    with program("workbench", project) as address:
        page.open(with_budget(address))
        settled_tests(page, 1)
        first = page("tribrach.summary")
        page.page.click("#tab-points")

        def change(point: str, now: str, role: str) -> None:
            row = page.page.locator(f"#panel tr:has(button.name:text-is('{point}'))")
            assert row.locator("button.tiny").inner_text() == now
            row.locator("button.tiny").click()
            decide(page, role)

        change("T1", "control", "check")
        settled_tests(page, 2)
        after = page("tribrach.summary")
        assert after["dof"] == first["dof"] - 3
        point = next(p for p in page("tribrach.points") if p["name"] == "T1")
        assert point["role"] == "check"
        # what moved is on the list, and the decision with its reason
        page.page.click("#tab-changes")
        assert "point T1: check" in page.page.inner_text("#panel")
        assert "field book, page 12" in page.page.inner_text("#panel")
        page.page.click("button[title^='Keep the decisions']")
        until(lambda: page("tribrach.session.saved"), "the file")
        shutil.copy(project.parent / "edits.toml", project.parent / "kept.toml")
        # back: then there is no decision
        page.page.click("#tab-points")
        change("T1", "check", "control")
        settled_tests(page, 3)
        assert page("tribrach.session.edits") == []
        assert page("tribrach.summary.posterior") == pytest.approx(first["posterior"], rel=1e-9)
        # what has no given coordinates cannot be control
        change("BASE", "free", "control")
        until(lambda: "no given coordinates" in page.page.inner_text(".banners"), "the sentence")
        page.errors = [error for error in page.errors if "422" not in error]
        page.fine()
    # the program with the same file says the same
    shutil.copy(project.parent / "kept.toml", project.parent / "edits.toml")
    result = pipeline.run(project).adjustment
    assert f"{result.sigma0_posterior:.9f}" == f"{after['posterior']:.9f}"
    assert result.points["T1"].xyz == pytest.approx(point["xyz"], abs=1e-9)


@pytest.mark.parametrize("ends", [("T1", "S2"), ("S1", "S2"), ("BASE", "TOP")])
def test_a_static_folder_knows_sigmas_of_distances(
    page: Watched, yard: Callable[[str], Path], exported: Path, ends: tuple[str, str]
) -> None:
    known = relative(Service(yard("work")).sources, *ends)
    with folder_server(exported, ranges=False) as address:
        page.open(with_budget(address))
        page.page.click("#tab-points")
        page.page.click("button[title^='Measure']")
        for name in ends:
            page.page.click(f"#panel button.name:text-is('{name}')")
        until(lambda: page("tribrach.measured && tribrach.measured.sigma"), "the sigma")
        measured = page("tribrach.measured")
        assert measured["distance"] == pytest.approx(known["distance"], rel=1e-12)
        assert measured["sigma"] == pytest.approx(known["sigma"], rel=1e-9)
        assert np.array(measured["covariance"]) == pytest.approx(
            np.array(known["covariance"]), rel=1e-9, abs=1e-18
        )
        page.fine()


def epochs_file(path: Path) -> Path:
    """What `epochs --json` writes: TOP went 12 mm east and 4 mm up, T1 stayed, T2 is not known."""

    def point(
        xyz: list[float], moved: list[float], verdict: str, reference: bool
    ) -> dict[str, Any]:
        return {
            "reference": reference, "xyz": xyz, "displacement": moved,
            "covariance": (np.diag([1.0, 1.0, 4.0]) * 1e-6).tolist(), "test": 9.0, "limit": 7.8,
            "significance": 0.01, "test_least": 9.0, "test_largest": 9.0, "verdict": verdict,
            "detectable": 0.005, "detectable_easiest": 0.003,
        }  # fmt: skip

    test = {"statistic": 1.0, "dof": 3, "limit": 7.8, "significance": 0.5, "passed": True}
    comparison = {
        "first": "spring", "second": "autumn", "axes": ["E", "N", "U"], "confidence": 0.95,
        "power": 0.8, "covariances": "prior", "dof": 20, "motions": [], "systematic": [0, 0, 0],
        "stable": ["T1"], "held": [], "own": [None, None], "whole": test, "references": None,
        "precision": None, "common": [], "only_first": [], "only_second": [],
        "sentences": ["TOP <b>moved</b>."],
        "points": {
            "TOP": point([12, 9, 8.5], [0.012, 0, 0.004], "moved", False),
            "T1": point([-15, 4, 1.2], [0.0002, 0.0001, 0], "not moved", True),
            "T2": point([6, -18, 2.4], [0.003, 0, 0], "cannot tell", False),
        },
    }  # fmt: skip
    found = FORM.read({"comparisons": [comparison]})
    path.write_text(FORM.text(found))
    return path


def test_displacements_between_epochs_are_drawn_and_listed(
    page: Watched, yard: Callable[[str], Path], tmp_path: Path
) -> None:
    folder, path = tmp_path / "out", epochs_file(tmp_path / "epochs.json")
    shutil.copytree(yard("projected"), folder)
    # compared in the work frame of the projected twin, where the yard is what it is in its own
    works = read_result(folder)["points"]
    told = json.loads(path.read_text())
    for name, point in told["comparisons"][0]["points"].items():
        point["xyz"] = works[name]["xyz"]
    path.write_text(json.dumps(told))
    with program("view", folder, "--epochs", path) as address:
        page.open(with_budget(address))
        assert page("tribrach.counts.displacements") == 3
        page.page.click("#tab-changes")
        said = page.page.inner_text("#panel")
        for words in ("spring to autumn", "TOP <b>moved</b>.", "cannot tell", "12.65"):
            assert words.lower() in said.lower()
        # the arrow goes where the point went: east and up
        page("tribrach.look('south')")
        page.settle()
        with_arrows = picture(page)
        page.page.click("label.check:has-text('Displacements')")
        page.settle()
        changed = (abs(picture(page) - with_arrows) > 12).any(axis=2)
        rows, columns = np.nonzero(changed)
        top = next(p["xyz"] for p in page("tribrach.points") if p["name"] == "TOP")
        x, y = page(f"tribrach.onScreen({json.dumps(top)})")
        height = abs(rows - y) < 40
        right, left = ((sign * (columns - x) > 8) & height for sign in (1, -1))
        near = right & (columns < x + 150)
        assert near.sum() > 100
        assert near.sum() > 3 * (left & (columns > x - 150)).sum()
        assert rows[near].mean() < y
        page.fine()


def test_epochs_of_another_place_are_refused(yard: Callable[[str], Path], tmp_path: Path) -> None:
    path = epochs_file(tmp_path / "epochs.json")
    service = Service(yard("work"), epochs=path)
    assert service.scene.epochs[0].name == ["TOP", "T1", "T2"]
    assert service.scene.epochs[0].moved[0] == (0.012, 0, 0.004)
    told = json.loads(path.read_text())
    for point in told["comparisons"][0]["points"].values():
        point["xyz"][0] += 400
    path.write_text(json.dumps(told))
    with pytest.raises(InputError, match="400 m beside"):
        Service(yard("work"), epochs=path)
    path.write_text("{}")
    with pytest.raises(InputError, match="no comparison of epochs"):
        Service(yard("work"), epochs=path)
