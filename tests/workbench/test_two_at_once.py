"""Two workbenches on one folder lose no decision, and comments of a file stay."""

import threading
from pathlib import Path

import pytest

from tribrach.errors import NO_TEXT, InputError
from tribrach.io.keeping import alone
from tribrach.io.toml_model import with_comments
from tribrach.project.edits import edits_text, read_edits
from tribrach.workbench.service import keep_view, read_views
from tribrach.workbench.session import Session

NET = """\
title = "Net"
[site]
kind = "flat"
[instruments.level]
levelling_mm_per_sqrt_km = 1.0
[[points]]
file = "heights.csv"
role = "control"
[[observations]]
file = "levelling.csv"
instrument = "level"
"""
BY_HAND = """\
# Decisions of May, by the two of us.

# The rod stood on ice.
[[edit]]
observation = "{first}"  # the morning
use = "check"
reason = "ice # not rock"
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "net.toml").write_text(NET)
    (tmp_path / "heights.csv").write_text("point,u_m,sigma_u_mm\nA,10,1\nB,11,1\n")
    rows = ["A,B,1.0003,100", "B,C,0.5,100", "C,A,-1.5,100", "A,C,1.5,100", "C,B,-0.5,100"]
    (tmp_path / "levelling.csv").write_text(
        "\n".join(["from,to,height_difference_m,length_m", *rows]) + "\n"
    )
    return tmp_path / "net.toml"


def off(session: Session, number: int) -> None:
    name = [row.id for row in session.adjustment.observations if "levelling" in row.id][number]
    change = {"do": "use", "observation": name, "use": "off", "reason": f"reading {number}"}
    session.apply(session.revision, [change])


def test_of_two_that_save_together_one_is_refused(project: Path) -> None:
    for _ in range(5):
        project.with_name("edits.toml").unlink(missing_ok=True)
        sessions = [Session.open(project) for _ in range(2)]
        for number, session in enumerate(sessions):
            off(session, number)
        begin, outcome = threading.Barrier(2), list[object]()

        def save(session: Session, begin: threading.Barrier, outcome: list[object]) -> None:
            begin.wait()
            try:
                outcome.append(session.save())
            except InputError as error:
                outcome.append(error)

        threads = [threading.Thread(target=save, args=(s, begin, outcome)) for s in sessions]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sum(isinstance(one, InputError) for one in outcome) == 1
        assert len(read_edits(project.with_name("edits.toml")).edit) == 1


def test_views_of_two_are_both_there(tmp_path: Path) -> None:
    path = tmp_path / "views.toml"
    names = [f"view {number}" for number in range(16)]
    threads = [threading.Thread(target=keep_view, args=(path, name, "#x")) for name in names]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(read_views(path)) == sorted(names)


def test_a_file_that_is_being_written_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tribrach.io.keeping._PATIENCE", 0.1)
    with alone(tmp_path / "a.toml"), pytest.raises(InputError), alone(tmp_path / "a.toml"):
        pass
    with alone(tmp_path / "a.toml"):
        pass


def test_comments_of_decisions_by_hand_stay(project: Path) -> None:
    path = project.with_name("edits.toml")
    session = Session.open(project)
    first = next(r.id for r in session.adjustment.observations if "levelling" in r.id)
    by_hand = BY_HAND.format(first=first)
    path.write_text(by_hand)
    session = Session.open(project)
    off(session, 2)
    session.save()
    text = path.read_text()
    assert all(line in text for line in by_hand.splitlines())
    assert len(read_edits(path).edit) == 2
    off(session, 3)
    session.save()
    assert all(line in path.read_text() for line in by_hand.splitlines())
    assert len(read_edits(path).edit) == 3
    assert edits_text(session.edits, path.read_text()) == path.read_text()


def test_comments_of_tables_that_go_stay() -> None:
    old = "# head of mine\n\n# why\n[[view]]\nname = 'a' # this one\nhash = '#b'\n"
    new = with_comments("# Views.\n", ['[[view]]\nname = "c"\n'], old)
    assert all(words in new for words in ("# head of mine", "# why", "# this one"))
    assert with_comments("# Views.\n", ['[[view]]\nname = "c"\n'], new) == new


@pytest.mark.parametrize("text", ["\x01", "a\x00", "\ud800", "\uffff", "\x7f"])
def test_what_no_file_can_hold(text: str) -> None:
    assert NO_TEXT.search(text)
    assert not NO_TEXT.search("Gr\u00fc\u00dfe \u05d0\u05d1 \u4e2d\u6587 a\tb\nc \U0001f600")
