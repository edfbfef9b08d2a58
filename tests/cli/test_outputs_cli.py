"""Results that would take the place of inputs, and what the operating system refuses."""

from pathlib import Path

import pytest

from tests.cli.test_bad_scans import RUN, end
from tribrach.cli import app
from tribrach.shell.flow import guarded

NETWORK = """<?xml version="1.0"?>
<gama-local xmlns="http://www.gnu.org/software/gama/gama-local"><network><points-observations>
<point id="A" z="10" fix="z"/><point id="B" adj="z"/><point id="C" adj="z"/>
<height-differences>
<dh from="A" to="B" val="1.000" stdev="1"/><dh from="B" to="C" val="2.000" stdev="1"/>
<dh from="C" to="A" val="-3.001" stdev="1"/>
</height-differences></points-observations></network></gama-local>
"""


@pytest.fixture
def network(tmp_path: Path) -> Path:
    path = tmp_path / "net.gkf"
    path.write_text(NETWORK)
    assert RUN.invoke(app, ["adjust", str(path), "-q"]).exit_code == 0
    return path


def test_inputs_stay(network: Path) -> None:
    (network.parent / "also.gkf").symlink_to(network)
    for name in ("net.gkf", "also.gkf", "../" + network.parent.name + "/net.gkf"):
        said = end("adjust", network, "--json", network.parent / name)
        assert "this result would take the place of a file that is read" in said
    assert network.read_text() == NETWORK


def test_results_have_names_of_their_own(network: Path) -> None:
    one = network.parent / "result"
    said = end("adjust", network, "--json", one, "--html", one)
    assert "two results would have this name" in said
    assert "this is a folder" in end("adjust", network, "--text", network.parent)
    assert not one.exists()


@pytest.mark.parametrize("name", ["x" * 300 + ".las", "x" * 300])
@pytest.mark.parametrize("command", ["adjust", "info", "run"])
def test_names_that_no_disk_takes(command: str, name: str) -> None:
    assert "File name too long" in end(command, name)


@pytest.mark.parametrize("place", ["", "./"])
def test_a_folder_is_no_cloud(network: Path, place: str) -> None:
    points = network.with_name("a.xyz")
    points.write_text("1 2 3\n4 5 6\n7 8 9\n")
    assert "folder" in end("convert", points, place)


def test_the_disk_and_the_memory(capsys: pytest.CaptureFixture[str]) -> None:
    def full() -> None:
        raise OSError(28, "No space left on device", "cloud.laz")

    def large() -> None:
        raise MemoryError

    for work, words in ((full, "cloud.laz: No space left on device"), (large, "memory")):
        with pytest.raises(BaseException, match="2"):
            guarded(work)
        assert words in capsys.readouterr().err
