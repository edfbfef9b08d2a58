"""The page in a real browser: what it shows is what the program says, and it asks nobody else."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.workbench.browsing import (
    Watched,
    decide,
    folder_server,
    program,
    settled_tests,
    until,
    where,
    with_budget,
)
from tribrach.pipeline import run

HOSTILE = '<img src=x onerror="window.struck=1"><script>window.struck=1</script>'


def test_the_page_shows_cloud_network_and_tables(page: Watched, seen: str) -> None:
    page.open(with_budget(seen))
    counts = page("tribrach.counts")
    assert 0 < counts["points"] <= counts["total"]
    assert counts["failed"] == 0
    assert counts["ellipsoids"] > 0
    assert counts["rays"] > 0
    assert page("tribrach.share()") > 0.02
    # a title that looks like markup is text
    assert page.page.inner_text(".title strong") == "Yard <b>&"
    shown = " ".join(page.page.inner_text(".hud").replace("\u202f", "").split())
    assert shown == f"{counts['points']} of {counts['total']} points shown"
    assert page.page.locator(".rows .row").count() > 0
    # what cannot be changed here has no button
    assert page("tribrach.session") is None
    assert page.page.locator("button:has-text('Run')").count() == 0
    page.fine()


def test_another_colour_decodes_nothing_again(page: Watched, seen: str) -> None:
    page.open(with_budget(seen))
    before = sum("/clouds/" in url for url in page.asked)
    pictures = set()
    for name in ("station", "sigma", "sigma_x", "sigma_y", "sigma_z", "incidence", "intensity"):
        page.page.select_option("select:has(option[value='station'])", name)
        assert page("tribrach.colourOf().by") == name
        low, high = page("tribrach.colourOf().range")
        assert low < high
        pictures.add(page.page.locator(".picture").screenshot())
    assert len(pictures) > 3
    assert sum("/clouds/" in url for url in page.asked) == before
    page.fine()


def test_a_point_of_the_cloud_is_picked_with_what_the_program_knows(
    page: Watched, seen: str
) -> None:
    page.open(with_budget(seen))
    box = page.page.locator(".picture").bounding_box()
    assert box is not None
    page.page.click("button[title^='Pick points']")
    grid = [(x / 20, y / 20) for y in range(4, 14) for x in range(10, 18)]
    found = next(
        (x, y)
        for x, y in grid
        if page(f"tribrach.pick({x * box['width']}, {y * box['height']})") is not None
    )
    page.page.mouse.click(box["x"] + found[0] * box["width"], box["y"] + found[1] * box["height"])
    until(lambda: page("tribrach.selection && tribrach.selection.type === 'cloud'"), "the point")
    until(lambda: not page("tribrach.selection.point.asking"), "the program's answer")
    point = page("tribrach.selection.point")
    more = point["more"]
    sigmas = np.sqrt(np.diag(np.array(more["covariance"])))
    # what the file carries beside the point is the diagonal of what is computed for it
    assert sigmas == pytest.approx(point["sigma"], rel=0.05)
    assert more["station"] == point["station"]
    assert more["range"] == pytest.approx(point["range"], abs=0.01)
    assert [part["sigma"] > 0 for part in more["budget"]]
    words = page.page.inner_text("#panel")
    assert "Point of" in words
    page.fine()


def test_a_line_of_the_picture_is_a_row_of_the_table(page: Watched, seen: str) -> None:
    page.open(with_budget(seen))
    first = page.page.locator(".rows .row").nth(0)
    name = first.locator(".c-from").inner_text()
    first.click()
    assert page("tribrach.selection.type") == "row"
    # the link of the row leads there in a new page
    until(lambda: "select=row" in page("location.hash"), "the address")
    address = page("location.href")
    page.page.goto("about:blank")
    page.open(address)
    until(lambda: page("tribrach.selection && tribrach.selection.type === 'row'"), "the row")
    assert page.page.locator(".row.picked .c-from").nth(0).inner_text() == name
    page.fine()


@pytest.mark.parametrize("width", [1400, 420])
def test_no_number_of_the_table_is_cut(browser: Any, seen: str, width: int) -> None:
    context = browser.new_context(viewport={"width": width, "height": 800})
    watched = Watched(context.new_page())
    watched.open(with_budget(seen))
    until(lambda: watched.page.locator(".rows .c-source").count() > 5, "rows")
    cut = watched(
        "[...document.querySelectorAll('.rows .cell')].filter((c) => {"
        " const grid = document.querySelector('.grid').getBoundingClientRect();"
        " const box = c.getBoundingClientRect();"
        " return c.scrollWidth > c.clientWidth + 1 || box.right > grid.left"
        " + document.querySelector('.grid').clientWidth + 1; }).map((c) => c.textContent)"
    )
    assert cut == []
    watched.page.locator(".rows .row").nth(0).click()
    watched.page.click("#tab-selection")
    said = watched.page.inner_text("#panel")
    for word in ("Source", "targets.csv", "Minimal detectable bias", "Its largest effect"):
        assert word in said
    watched.fine()
    context.close()


def test_filters_and_the_order_of_rows(page: Watched, seen: str) -> None:
    page.open(with_budget(seen))
    everything = page("tribrach.rowsShown")
    sizes = [abs(row["w"]) for row in everything if row["w"] is not None]
    assert sizes == sorted(sizes, reverse=True)
    page.page.select_option("select[aria-label='All kinds']", "target_centre")
    until(lambda: len(page("tribrach.rowsShown")) < len(everything), "fewer rows")
    assert all(row["id"].startswith("target_centre") for row in page("tribrach.rowsShown"))
    page.page.fill("input[aria-label=Find]", "T1")
    until(lambda: all("T1" in row["words"] for row in page("tribrach.rowsShown")), "rows of T1")
    page.page.click("button:has-text('Show all')")
    until(lambda: len(page("tribrach.rowsShown")) == len(everything), "all rows")
    page.fine()


@pytest.mark.parametrize("kind", ["projected", "ecef"])
def test_the_frame_of_the_coordinates_is_not_seen(
    browser: Any, yard: Callable[[str], Path], seen: str, kind: str
) -> None:
    places = []
    with program("view", yard(kind)) as address:
        for url in (seen, address):
            context = browser.new_context(viewport={"width": 1200, "height": 760})
            watched = Watched(context.new_page()).open(with_budget(url))
            watched("tribrach.look('south')")
            watched.settle()
            names = {p["name"]: p["xyz"] for p in watched("tribrach.points")}
            screen = {
                name: watched(f"tribrach.onScreen({json.dumps(xyz)})")
                for name, xyz in names.items()
            }
            assert screen["TOP"][1] < screen["BASE"][1] - 20
            assert screen["TOP"][0] == pytest.approx(screen["BASE"][0], abs=3)
            metre = (screen["BASE"][1] - screen["TOP"][1]) / 8
            middle = np.mean(list(screen.values()), axis=0)
            places.append({n: (np.array(p) - middle) / metre for n, p in screen.items()})
            assert watched("tribrach.share()") > 0.02
            watched.fine()
            context.close()
    # grid north is not quite true north, and the box that is fitted differs a little
    for name, place in places[0].items():
        assert places[1][name] == pytest.approx(place, abs=0.25)


def test_names_are_text_and_a_long_table_is_short_in_the_page(page: Watched, seen: str) -> None:
    def other(route: Any) -> None:
        scene = route.fetch().json()
        old = scene["points"]["name"][0]
        scene["points"]["name"][0] = HOSTILE
        scene["title"] = HOSTILE
        scene["warnings"] = [HOSTILE]
        columns = scene["observations"]
        times = 20_000 // len(columns["id"]) + 1
        for name, column in columns.items():
            if name == "words":
                columns[name] = {key: values * times for key, values in column.items()}
            else:
                columns[name] = column * times
        columns["source"] = [HOSTILE] * len(columns["id"])
        columns["to"] = [HOSTILE if to == old else to for to in columns["to"]]
        route.fulfill(json=scene)

    page.page.route("**/scene.json", other)
    page.open(with_budget(seen))
    assert page("tribrach.counts.rows") >= 20_000
    assert page.page.locator(".rows .row").count() < 80
    page.page.evaluate("document.querySelector('.grid').scrollTop = 1e6")
    until(lambda: page.page.locator(".rows .row").count() > 5, "the last rows")
    for tab in ("points", "targets", "changes", "notes"):
        page.page.click(f"#tab-{tab}")
    assert HOSTILE in page.page.inner_text("#panel")
    page.page.click("#tab-points")
    page.page.click(f"#panel button.name:has-text({json.dumps(HOSTILE[:9])})")
    page.page.click("#tab-selection")
    assert HOSTILE in page.page.inner_text("#panel h2")
    assert page("window.struck") is None
    assert page.page.locator("img[src=x]").count() == 0
    page.fine()


@pytest.mark.parametrize("ranges", [True, False])
def test_a_static_folder_needs_only_a_web_server(
    page: Watched, exported: Path, ranges: bool
) -> None:
    with folder_server(exported, ranges) as address:
        page.open(with_budget(address))
        counts = page("tribrach.counts")
        assert counts["failed"] == 0
        assert 0 < counts["points"] <= counts["total"]
        assert page("tribrach.share()") > 0.02
        assert page("tribrach.session") is None
        page.fine()


def test_a_narrow_screen_and_the_dark(browser: Any, seen: str) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 800}, color_scheme="dark")
    watched = Watched(context.new_page()).open(with_budget(seen))
    assert watched("document.documentElement.dataset.theme") == "dark"
    assert watched("document.documentElement.scrollWidth") <= 390
    assert watched.page.locator(".rows .row").count() > 0
    assert watched("tribrach.share()") > 0.02
    watched.fine()
    context.close()


def test_a_row_is_switched_off_and_on_again(page: Watched, project: Path) -> None:
    with program("workbench", project) as address:
        page.open(with_budget(address))
        settled_tests(page, 1)
        first = page("tribrach.summary")
        row = page("tribrach.rowsShown")[0]
        page.page.locator(".rows .row").nth(0).locator("button.use").click()
        decide(page, "off")
        settled_tests(page, 2)
        after = page(
            "({summary: tribrach.summary, points: tribrach.points, rows: tribrach.rowsShown})"
        )
        assert after["summary"]["dof"] == first["dof"] - 3
        assert page("tribrach.counts.moves") > 0
        assert {r["state"] for r in after["rows"] if r["id"] == row["id"]} == {"off"}
        assert page.page.inner_text(".chips").count("1") >= 1
        assert "sigmas of the last run" in page.page.inner_text(".banners")
        page.page.click("button[title^='Keep the decisions']")
        until(lambda: page("tribrach.session.saved"), "the file")
        # another page sees the same state at once
        page.open(page("location.href").split("#")[0])
        settled_tests(page, 2)
        assert page("tribrach.summary.posterior") == after["summary"]["posterior"]
        page.page.click("button[title^='Undo']")
        settled_tests(page, 3)
        back = page("tribrach.summary")
        assert back["posterior"] == pytest.approx(first["posterior"], rel=1e-6)
        assert back["dof"] == first["dof"]
        page.fine()
    assert "field book, page 12" in (project.parent / "edits.toml").read_text()
    # the program with the same file says the same
    result = run(project).adjustment
    said = after["summary"]
    assert f"{result.sigma0_posterior:.6f}" == f"{said['posterior']:.6f}"
    assert result.dof == said["dof"]
    for point in after["points"]:
        named = result.points[point["name"]]
        assert point["xyz"] == pytest.approx(named.xyz.tolist(), abs=5e-6)
        assert np.array(point["covariance"]) == pytest.approx(named.covariance, rel=1e-3, abs=1e-12)
    w = {(r.id, r.component): r.w for r in result.observations}
    for shown in after["rows"]:
        if shown["w"] is not None and shown["state"] == "active":
            assert shown["w"] == pytest.approx(w[shown["id"], shown["component"]], abs=2e-3)


def test_run_writes_the_clouds_anew(page: Watched, project: Path) -> None:
    with program("workbench", project) as address:
        page.open(with_budget(address))
        page.page.locator(".rows .row").nth(0).locator("button.use").click()
        decide(page, "off")
        settled_tests(page, 2)
        before = page("tribrach.summary.posterior")
        assert page("tribrach.counts.moves") > 0
        with page.page.expect_event("load", timeout=120_000):
            page.page.click("button[title^='Run the project']")
        # the page has loaded itself again, because everything is written
        until(lambda: page("!!(window.tribrach && tribrach.ready)"), "the page after the run")
        page.settle()
        assert page("tribrach.counts.moves") == 0
        assert page("tribrach.session.saved")
        assert len(page("tribrach.session.edits")) == 1
        assert page("tribrach.summary.posterior") == pytest.approx(before, rel=1e-9)
        assert page.page.locator(".banner").count() == 0
        page.fine()


def test_a_distance_is_measured_with_its_sigma(page: Watched, seen: str) -> None:
    page.open(with_budget(seen))
    page.page.click("#tab-points")
    page.page.click("#panel button.name:text-is('BASE')")
    page.page.click("#tab-selection")
    page.page.click("button:has-text('Measure from here')")
    places = {p["name"]: p["xyz"] for p in page("tribrach.points")}
    page.page.mouse.click(*where(page, json.dumps(places["TOP"])))
    until(lambda: page("tribrach.measured && tribrach.measured.sigma"), "the distance")
    measured = page("tribrach.measured")
    gap = np.subtract(places["TOP"], places["BASE"])
    assert measured["distance"] == pytest.approx(np.linalg.norm(gap), abs=1e-6)
    along = gap / np.linalg.norm(gap)
    sigma = np.sqrt(along @ np.array(measured["covariance"]) @ along)
    assert measured["sigma"] == pytest.approx(sigma, rel=1e-6)
    assert "mm" in page.page.inner_text("#panel .inset")
    page.fine()


def test_both_ends_of_a_distance_come_from_the_list_of_points(page: Watched, seen: str) -> None:
    page.open(with_budget(seen))
    page.page.click("button[title^='Measure']")
    hint = page.page.locator(".banner.hint")
    assert "first end" in hint.inner_text()
    # it can be read: nothing lies over it
    assert page(
        "(() => { const r = document.querySelector('.banner.hint').getBoundingClientRect();"
        " return [0.05, 0.5, 0.95].every((k) => document.elementFromPoint("
        "r.left + k * r.width, r.top + r.height / 2).closest('.banner.hint')); })()"
    )
    page.page.click("#tab-points")
    for _ in range(2):
        page.page.click("#panel button.name:text-is('T1')")
    assert "other end" in hint.inner_text()
    assert page("tribrach.measured") is None
    page.page.click("#panel button.name:text-is('S2')")
    until(lambda: page("tribrach.measured && tribrach.measured.sigma"), "the distance")
    assert [page("tribrach.measured").get(key) for key in ("from", "to")] == ["T1", "S2"]
    assert hint.count() == 0
    line = page("tribrach.measuredOnScreen")
    assert np.hypot(*np.subtract(*line)) > 20
    page.fine()


def test_a_program_that_has_ended_is_said_with_what_to_do(page: Watched, project: Path) -> None:
    with program("workbench", project) as address:
        page.open(with_budget(address))
        settled_tests(page, 1)
        page.page.locator(".rows .row").nth(0).locator("button.use").click()
        decide(page, "off")
        settled_tests(page, 2)
    gone = page.page.locator(".banner.gone")
    until(lambda: gone.count() == 1, "the sentence")
    said = gone.inner_text()
    for words in ("has ended", "tribrach workbench PROJECT.toml", "address", "not saved are lost"):
        assert words in said
    # what needs the program cannot be pressed, and what was loaded can be looked at
    assert page.page.locator("button[title^='Run the project']").is_disabled()
    page("tribrach.look('plan')")
    assert page("tribrach.share()") > 0.02
    # an answer that does not come has no words of a browser
    page.page.click("#tab-points")
    page.page.click("button[title^='Measure']")
    page.page.click("#panel button.name:text-is('T1')")
    page.page.click("#panel button.name:text-is('T2')")
    until(lambda: page("tribrach.measured"), "the distance")
    page.page.wait_for_timeout(300)
    assert "fetch" not in page.page.inner_text("body")
    assert gone.count() == 1


def test_what_cannot_be_adjusted_is_said_and_changes_nothing(page: Watched, project: Path) -> None:
    with program("workbench", project) as address:
        page.open(with_budget(address))
        settled_tests(page, 1)
        before = page("tribrach.summary")
        page.page.select_option("select[aria-label='All kinds']", "coordinates")
        rows = page.page.locator(".rows .row")
        until(lambda: 0 < rows.count() < 40, "rows of coordinates")
        rows.nth(0).click()
        rows.nth(rows.count() - 1).click(modifiers=["Shift"])
        page.page.click("button:has-text('Off, check or on')")
        decide(page, "off")
        alert = page.page.locator(".banner[role=alert]")
        until(lambda: alert.count() == 1, "the sentences")
        assert "stays as it was" in alert.inner_text()
        assert page("tribrach.summary.posterior") == before["posterior"]
        # nothing was done, so nothing is to be undone
        assert alert.locator("button").inner_text() == "Close"
        alert.locator("button").click()
        until(lambda: alert.count() == 0, "the end of the message")
        assert page("tribrach.session.edits") == []
        page.errors = [error for error in page.errors if "422" not in error]
        page.fine()
