"""The server without a browser: what it gives out, what it does not, and the static folder."""

import csv
import functools
import http.client
import http.server
import io
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from tests.workbench.browsing import PATIENCE, until
from tests.workbench.test_relative import some_point
from tribrach.errors import InputError
from tribrach.workbench.export import export_page
from tribrach.workbench.guard import Guard
from tribrach.workbench.server import application, bound_socket
from tribrach.workbench.service import Service, keep_view, read_views
from tribrach.workbench.static_files import page_files

Yard = Callable[[str], Path]
PORT = 8771


def settled(client: TestClient) -> dict:
    """The scene once all clouds are there."""

    def complete() -> dict | None:
        scene = client.get("/scene.json").json()
        return scene if scene["clouds"] and not scene["pending"] else None

    return until(complete, "the clouds")


@pytest.fixture(scope="module")
def client(yard: Yard) -> Iterator[TestClient]:
    guard = Guard(application(Service(yard("work"))), PORT)
    with TestClient(guard, base_url=f"http://127.0.0.1:{PORT}") as known:
        known.get(guard.address)
        yield known


def test_the_page_and_its_files(client: TestClient) -> None:
    page = client.get("/")
    assert page.headers["content-type"].startswith("text/html")
    assert 'src="app/main.js"' in page.text
    for name, kind in (
        ("main.js", "text/javascript"),
        ("cloud-worker.js", "text/javascript"),
        ("main.css", "text/css"),
        ("laz-perf.wasm", "application/wasm"),
    ):
        answer = client.get(f"/app/{name}")
        assert answer.headers["content-type"].startswith(kind)
        assert answer.content == page_files()[name].read_bytes()


@pytest.mark.parametrize(
    "path",
    ["/app/../scene.py", "/app/%2e%2e/schema.py", "/app/index.html", "/clouds/poses.json",
     "/clouds/../result.json", "/clouds/%2e%2e%2fresult.json", "/pictures/../workbench.json",
     "/clouds/..%5c..%5cresult.json", "/result.json", "/.tribrach/written.json", "/clouds/",
     "/tables/secrets.json", "/tables/points.xml", "/docs", "/openapi.json", "/app/"],
)  # fmt: skip
def test_nothing_but_what_is_listed(client: TestClient, path: str) -> None:
    assert client.get(path).status_code == 404


def test_clouds_are_given_by_ranges(client: TestClient) -> None:
    scene = settled(client)
    url = next(c["url"] for c in scene["clouds"] if c["name"] == "S1")
    whole = client.get(f"/{url}").content
    assert whole[:4] == b"LASF"
    assert whole[377:381] == b"copc"
    part = client.get(f"/{url}", headers={"range": "bytes=0-588"})
    assert part.status_code == 206
    assert part.content == whole[:589]
    assert client.get(f"/{url}", headers={"range": f"bytes={len(whole)}-"}).status_code == 416


def test_a_link_that_takes_the_place_of_a_cloud_is_not_followed(yard: Yard, tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("secret")
    service = Service(yard("work"))
    found = next(iter(page_files().values()))
    link = tmp_path / "S1.copc.laz"
    link.symlink_to(secret)
    from tribrach.workbench.clouds import SceneCloudFile

    service._clouds = {  # what a conversion would leave
        "S1.copc.laz": SceneCloudFile("S1", "S1.copc.laz", link, "S1.laz"),
        "a.laz": SceneCloudFile("a", "a.laz", found, "a.laz"),
    }
    assert service.cloud("S1.copc.laz") is None
    assert service.cloud("a.laz") == found


def test_tables_are_json_and_csv(client: TestClient) -> None:
    scene = settled(client)
    rows = client.get("/tables/observations.json").json()
    assert [row["id"] for row in rows] == scene["observations"]["id"]
    text = client.get("/tables/points.csv")
    assert text.headers["content-type"].startswith("text/csv")
    table = list(csv.DictReader(io.StringIO(text.text)))
    assert [row["name"] for row in table] == scene["points"]["name"]
    assert [float(row["x"]) for row in table] == [p[0] for p in scene["points"]["xyz"]]
    assert float(table[0]["covariance_z_y"]) == scene["points"]["covariance"][0][2][1]
    for name in ("stations", "targets", "rejected", "planes"):
        for kind in ("json", "csv"):
            assert client.get(f"/tables/{name}.{kind}").status_code == 200


def test_queries_answer_in_words_and_numbers(client: TestClient, yard: Yard) -> None:
    settled(client)
    answer = client.get("/api/relative", params={"a": "BASE", "b": "T1"}).json()
    assert answer["sigma"] > 0
    assert answer["words"]["sigma"].endswith(" mm")
    text, _ = some_point(yard("work"), "S1", 5)
    name, _, place = text.partition(":")
    x, y, z = place.split(",")
    answer = client.get("/api/point", params={"cloud": name, "x": x, "y": y, "z": z}).json()
    assert answer["station"] == "S1"
    for query, words in (
        ({"a": "T1"}, "Say b."),
        ({"a": "T1", "b": "<script>"}, "<script>"),
        ({"a": "T1", "b": "T1"}, "one place"),
    ):
        refused = client.get("/api/relative", params=query)
        assert refused.status_code == 422
        assert words in refused.json()["sentence"]


def test_results_alone_have_no_session(client: TestClient) -> None:
    assert client.get("/api/session").status_code == 404
    assert client.get("/api/views").json() == {}
    for name in ("undo", "redo", "save", "run", "views"):
        assert client.post(f"/api/{name}", json={"revision": 1}).status_code == 404
    refused = client.post("/api/edits", json={"revision": 1, "changes": []})
    assert "tribrach workbench" in refused.json()["sentence"]
    for body in (b"[]", b"{", b"[" * 100_000, b'"x"'):
        kind = {"content-type": "application/json"}
        assert client.post("/api/edits", content=body, headers=kind).status_code == 422


def test_events_are_told_to_who_listens(yard: Yard) -> None:
    service = Service(yard("work"))
    heard: list[tuple[str, dict]] = []
    leave = service.listen(lambda event, content: heard.append((event, dict(content))))
    service.start()
    until(lambda: sum(event == "clouds" for event, _ in heard) == 2, "both clouds")
    until(lambda: not service.scene.pending, "the end")
    leave()
    assert sum(event == "clouds" for event, _ in heard) == 2
    service.stop()
    assert service.stopped


def test_a_cloud_that_is_damaged_keeps_none_of_the_others(yard: Yard, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    shutil.copytree(yard("work"), folder, ignore=shutil.ignore_patterns(".tribrach"))
    (folder / "clouds" / "S1.laz").write_bytes(b"LASF" + bytes(100))
    service, heard = Service(folder), []
    service.listen(lambda event, content: heard.append((event, dict(content))))
    service.start()
    until(lambda: any(event == "failed" for event, _ in heard), "what is wrong")
    until(lambda: service.scene.clouds and not service.scene.pending, "the other cloud")
    assert [cloud.name for cloud in service.scene.clouds] == ["S2"]
    (told,) = (content["sentence"] for event, content in heard if event == "failed")
    assert "S1.laz" in told
    service.stop()


def test_the_command_prints_an_address_and_ends_in_order(yard: Yard) -> None:
    """The whole way: command, token, cookie, scene, events, Ctrl-C; no token in what is printed."""
    command = [sys.executable, "-m", "tribrach", "view", str(yard("work")), "--no-browser"]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        address = program.stdout.readline().strip()
        port = int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=[\w-]{20,}", address)[1])
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
        connection.request("GET", address[address.index("/?") :])
        entered = connection.getresponse()
        entered.read()
        cookie = {"cookie": entered.getheader("set-cookie").split(";")[0]}
        connection.request("GET", "/scene.json", headers=cookie)
        scene = json.loads(connection.getresponse().read())
        assert scene["title"] == "Yard <b>&"
        events = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
        events.request("GET", "/api/events", headers=cookie)
        told = events.getresponse()
        assert told.readline().startswith(b":")
        with socket.socket(socket.AF_INET6) as other:
            assert other.connect_ex(("::1", port)) != 0
        program.send_signal(signal.SIGINT)
        printed = program.communicate(timeout=PATIENCE)
        told.close()
        for one in (connection, events):
            one.close()
    finally:
        program.kill()
    assert program.returncode == 0
    assert printed == ("", "")


def test_a_port_of_somebody_else_is_refused() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match="--port"):
            bound_socket(taken.getsockname()[1])


def test_an_exported_folder_is_the_same_page(yard: Yard, tmp_path: Path) -> None:
    """Served by Python's own server, which has no ranges and no session."""
    out = tmp_path / "page"
    count = export_page(yard("work"), out, lambda *_: None)
    files = [p for p in out.rglob("*") if p.is_file() and ".tribrach" not in p.parts]
    assert len(files) == count
    assert {p.name for p in out.iterdir()} >= {"index.html", "app", "scene.json", "README.txt"}
    assert not any(p.is_symlink() for p in files)

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    handler = functools.partial(Quiet, directory=str(out))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        connection = http.client.HTTPConnection(*server.server_address, timeout=PATIENCE)

        def get(path: str) -> tuple[int, bytes]:
            connection.request("GET", path, headers={"range": "bytes=0-3"})
            answer = connection.getresponse()
            return answer.status, answer.read()

        status, page = get("/")
        assert status == 200
        for name in re.findall(rb'(?:src|href)="([^"]+)"', page):
            assert get(f"/{name.decode()}")[0] == 200
        scene = json.loads(get("/scene.json")[1])
        assert scene["session"] is False
        for cloud in scene["clouds"]:
            status, content = get(f"/{cloud['url']}")
            assert (status, content[:4]) == (200, b"LASF")
            assert len(content) > 589
        assert get("/api/session")[0] == 404
        connection.close()
        server.shutdown()
    # a second time the same bytes, and what somebody else put there stays
    before = (out / "scene.json").read_bytes()
    export_page(yard("work"), out, lambda *_: None)
    assert (out / "scene.json").read_bytes() == before
    (out / "index.html").write_text("mine")
    with pytest.raises(InputError, match="changed"):
        export_page(yard("work"), out, lambda *_: None)
    assert (out / "index.html").read_text() == "mine"
    with pytest.raises(InputError, match="among the results"):
        export_page(yard("work"), yard("work"), lambda *_: None)


def test_views_are_kept_by_name(tmp_path: Path) -> None:
    path = tmp_path / "views.toml"
    assert read_views(path) == {}
    state = 'c=1,2,3&l="a\\b"\n\x00ü'
    assert keep_view(path, ' From "above" ', state) == {'From "above"': state}
    keep_view(path, "b", "x")
    assert read_views(path) == {'From "above"': state, "b": "x"}
    assert keep_view(path, "b", None) == {'From "above"': state}
    for name, place in (("", "x"), ("n" * 101, "x"), ("n", "x" * 20_001)):
        with pytest.raises(InputError, match="view"):
            keep_view(path, name, place)
    path.write_text("[[view]]\nname = 3\n")
    with pytest.raises(InputError, match=r"views\.toml"):
        read_views(path)


def test_a_folder_that_cannot_be_written_is_looked_at(yard: Yard, tmp_path: Path) -> None:
    """Copies of clouds go elsewhere then."""
    service = Service(yard("projected"), scratch=tmp_path)
    service.start()
    until(lambda: service.scene.clouds and not service.scene.pending, "the clouds")
    assert {p.name for p in (tmp_path / ".tribrach").glob("*.laz")} == {
        "copc-S1.copc.laz",
        "copc-S2.copc.laz",
    }
    service.stop()
    assert os.access(tmp_path, os.W_OK)
