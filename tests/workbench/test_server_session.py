"""The server with a session: what it answers is what adjusting and running say."""

import json
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.workbench.browsing import until
from tests.workbench.test_server import settled
from tribrach import pipeline
from tribrach.workbench.frame import SceneFrame
from tribrach.workbench.guard import Guard
from tribrach.workbench.result_folder import ResultFolder
from tribrach.workbench.server import application
from tribrach.workbench.service import Service
from tribrach.workbench.session import Session

Yard = Callable[[str], Path]
PORT = 8772


class Heard(list):
    """Events as they came."""

    def wait(self, name: str, seconds: float = 240.0) -> dict:
        """The first event of a name; what could not be done ends the wait."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for event, content in list(self):
                if event == name:
                    return content
                assert event != "failed" or name == "failed", content
            time.sleep(0.02)
        raise AssertionError(f"{name} never came: {[event for event, _ in self]}")


@pytest.fixture
def at(yard: Yard, tmp_path: Path) -> Iterator[Callable[[str], tuple[TestClient, Heard, Path]]]:
    """A client of a session on a copy of the yard in a frame, events, and the project file."""
    open_clients = []

    def opened(kind: str) -> tuple[TestClient, Heard, Path]:
        folder = tmp_path / kind
        shutil.copytree(yard(kind).parent, folder)
        project = folder / "yard.toml"
        session = Session.open(project, author="a test")
        service, heard = Service(session.folder, session), Heard()
        service.listen(lambda event, content: heard.append((event, dict(content))))
        guard = Guard(application(service), PORT)
        client = TestClient(guard, base_url=f"http://127.0.0.1:{PORT}")
        client.__enter__()
        open_clients.append(client)
        client.get(guard.address)
        return client, heard, project

    yield opened
    for client in open_clients:
        client.__exit__(None, None, None)


def off(observation: str, use: str = "off") -> dict:
    return {"do": "use", "observation": observation, "use": use, "reason": "prism tilted"}


@pytest.mark.parametrize("kind", ["work", "ecef"])
def test_switching_off_is_what_a_run_with_the_same_decisions_says(at, kind: str) -> None:
    client, heard, project = at(kind)
    scene = client.get("/scene.json").json()
    assert scene["session"] is True
    state = client.get("/api/session").json()
    one = next(i for i in scene["observations"]["id"] if i.startswith("target_centre:S1:T3"))
    body = {"revision": state["revision"], "changes": [off(one)]}
    adjusted = client.post("/api/edits", json=body).json()
    assert adjusted["revision"] > state["revision"]
    tested = heard.wait("tested")
    assert tested["revision"] == adjusted["revision"]
    again = client.get("/scene.json").json()
    rows = [k for k, i in enumerate(again["observations"]["id"]) if i == one]
    assert {again["observations"]["state"][k] for k in rows} == {"off"}
    assert len(again["edits"]) == 1
    saved = client.post("/api/save", json={}).json()
    assert saved["file"] == "edits.toml"
    assert saved["state"]["saved"] is True
    # the other way: the command, once nobody reads the clouds any more
    settled(client)
    report = pipeline.run(project)
    assert adjusted["sigma0"]["posterior"] == pytest.approx(report.summary.sigma0_posterior)
    assert adjusted["sigma0"]["dof"] == report.summary.dof
    frame = ResultFolder.beside(project.parent / "out").frame
    points = {p.name: {"xyz": p.xyz, "covariance": p.covariance} for p in report.points}
    xyz, covariance = frame.of_points(points)
    told = {p["name"]: p for p in adjusted["points"]}
    for name, place, block in zip(points, xyz, covariance, strict=True):
        assert told[name]["xyz"] == pytest.approx(place, abs=2e-6)
        assert np.array(told[name]["covariance"]) == pytest.approx(np.array(block), rel=1e-5)
        before = dict(zip(scene["points"]["name"], scene["points"]["xyz"], strict=True))[name]
        assert told[name]["moved"] == pytest.approx(np.subtract(place, before), abs=5e-6)
    json.dumps(adjusted, allow_nan=False)


def test_an_old_revision_a_defect_and_the_way_back(at) -> None:
    client, heard, _ = at("work")
    scene = client.get("/scene.json").json()
    ids = list(dict.fromkeys(scene["observations"]["id"]))
    first = client.get("/api/session").json()
    late = {"revision": first["revision"] - 1, "changes": [off(ids[-1])]}
    conflict = client.post("/api/edits", json=late)
    assert conflict.status_code == 409
    assert conflict.json()["state"]["revision"] == first["revision"]
    every = [off(i) for i in ids if i.startswith(("target_centre:S2", "target_center:S2"))]
    assert every
    refused = client.post("/api/edits", json={"revision": first["revision"], "changes": every})
    assert refused.status_code == 422
    assert refused.json()["defect"]
    assert heard.wait("defect")["sentences"] == refused.json()["defect"]
    state = client.get("/api/session").json()
    assert state["edits"] == []
    one = next(i for i in ids if i.startswith("target_centre:S1"))
    changed = client.post("/api/edits", json={"revision": state["revision"], "changes": [off(one)]})
    assert changed.status_code == 200
    undone = client.post("/api/undo", json={"revision": changed.json()["revision"]}).json()
    before = state["adjusted"]["sigma0"]
    assert undone["sigma0"]["dof"] == before["dof"]
    assert undone["sigma0"]["posterior"] == pytest.approx(before["posterior"], rel=1e-6)
    redone = client.post("/api/redo", json={"revision": undone["revision"]}).json()
    assert redone["sigma0"]["dof"] == changed.json()["sigma0"]["dof"]
    what = client.get("/api/what-if", params={"observation": ids[0]})
    assert what.status_code == 200
    compared = client.get("/api/compare", params={"a": "run", "b": str(redone["revision"])}).json()
    assert len(compared["points"]) == len(scene["points"]["name"])
    for body in ({}, {"revision": "1"}, {"revision": True}, {"revision": 1, "changes": {}}):
        assert client.post("/api/edits", json=body).status_code == 422
    bad = {"revision": redone["revision"], "changes": [{**off(one), "reason": " "}]}
    assert client.post("/api/edits", json=bad).status_code == 422
    assert client.get("/api/what-if", params={"observation": "none"}).status_code == 422


def test_a_run_from_the_page_tells_its_progress_and_its_end(at) -> None:
    client, heard, project = at("work")
    scene = client.get("/scene.json").json()
    state = client.get("/api/session").json()
    one = next(i for i in scene["observations"]["id"] if i.startswith("target_centre:S1:T3"))
    client.post("/api/edits", json={"revision": state["revision"], "changes": [off(one)]})
    assert client.post("/api/run", json={}).json() == {"running": True}
    again = client.post("/api/run", json={})
    assert again.status_code in (200, 409)
    heard.wait("ran", 180)
    assert any(event == "progress" for event, _ in heard)
    assert (project.parent / "edits.toml").is_file()
    written = json.loads((project.parent / "out" / "result.json").read_text())
    assert [edit["id"] for edit in written["edits"]] == [one]
    # everything is counted from the new run now
    moved = client.get("/api/session").json()["adjusted"]["largest"]
    assert moved is None or moved["moved"] < 1e-6


def test_a_run_can_be_stopped_and_goes_on_later(at) -> None:
    client, heard, project = at("work")
    settled(client)
    for record in (project.parent / "out" / ".tribrach").glob("cloud-*.json"):
        record.unlink()
    heard.clear()
    assert client.post("/api/cancel", json={}).json() == {"running": False}
    client.post("/api/run", json={})
    heard.wait("progress")
    client.post("/api/cancel", json={})
    # it may have been at its end already
    until(lambda: "ran" in dict(heard) or "stopped" in str(heard), "the end of the run")
    assert client.get("/api/session").json()["running"] is False


def test_views_are_saved_beside_the_project(at) -> None:
    client, _, project = at("work")
    kept = client.post("/api/views", json={"name": "From above", "hash": "c=1"}).json()
    assert kept == client.get("/api/views").json() == {"From above": "c=1"}
    assert (project.parent / "views.toml").is_file()
    assert client.post("/api/views", json={"name": "From above", "hash": ""}).json() == {}
    assert client.post("/api/views", json={"name": 3, "hash": "x"}).status_code == 422


def test_a_frame_of_the_work_frame_changes_nothing() -> None:
    row = {"name": "P", "xyz": [1.0, None, 2.0], "moved": None, "covariance": [[0.0] * 3] * 3}
    same = {"points": [row], "stations": []}
    assert SceneFrame().of_adjusted(same) == same
