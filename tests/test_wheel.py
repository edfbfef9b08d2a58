"""The wheel in an environment of its own, away from the sources: all of it is there and works."""

import json
import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
#: the command line with the demonstration made as small as the other tests have it
SMALL = f"""
import runpy
from tribrach import demo
from tribrach.cli import main
demo.build = runpy.run_path({str(ROOT / "tests" / "demo_twin.py")!r})["few_boards"]
main()
"""


class Installed:
    """An environment with the wheel, and a folder to work in.

    The dependencies are those of the environment that runs the tests: its folder is on the path
    of the new one behind the wheel, and the links of editable installations in it are not followed.
    """

    def __init__(self, wheel: Path, folder: Path) -> None:
        self.folder = folder
        self.environment = folder / "environment"
        run([sys.executable, "-m", "venv", "--without-pip", self.environment], folder)
        self.python = self.environment / "bin" / "python"
        pip = [sys.executable, "-m", "pip", "--python", self.python, "--disable-pip-version-check"]
        run([*pip, "install", "--quiet", "--no-index", "--no-deps", wheel], folder)
        where = "import sysconfig; print(sysconfig.get_path('purelib'))"
        own = Path(run([self.python, "-c", where], folder).strip())
        others = dict.fromkeys(sysconfig.get_path(name) for name in ("purelib", "platlib"))
        (own / "dependencies.pth").write_text("\n".join(others) + "\n")

    def tribrach(self, *arguments: str) -> str:
        """Output of the program as its script starts it."""
        return run([self.environment / "bin" / "tribrach", *arguments], self.folder)

    def run(self, *arguments: str) -> str:
        """Output of the environment's Python."""
        return run([self.python, *arguments], self.folder)


def run(command: list[str | Path], folder: Path) -> str:
    """Output of a command that must succeed, without the variables that lead to the sources."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "NUMBA_"))}
    result = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        env={**clean, "PYTHONNOUSERSITE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel as it is published: built from the source distribution."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder]
    run([*build, ROOT], folder)
    assert len(list(folder.glob("*.tar.gz"))) == 1
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    return Installed(wheel, tmp_path_factory.mktemp("away"))


@pytest.fixture(scope="module")
def small(installed: Installed) -> Path:
    """The demonstration in small, as the installed program makes it."""
    installed.run("-c", SMALL, "demo", "--out", "small", "--quiet")
    return installed.folder / "small"


def test_every_file_of_the_package_is_in_the_wheel(wheel: Path) -> None:
    source = ROOT / "src"
    files = {
        path.relative_to(source).as_posix()
        for path in (source / "tribrach").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert packed == files
    # templates, data sheets, the mark of typed packages
    assert {Path(name).suffix for name in packed} >= {".py", ".j2", ".toml", ".typed"}


def test_the_program_is_that_of_the_wheel(installed: Installed) -> None:
    file = installed.run("-c", "import tribrach; print(tribrach.__file__)").strip()
    assert Path(file).is_relative_to(installed.environment)
    from tribrach import __version__

    assert installed.tribrach("--version") == f"tribrach {__version__}\n"
    assert installed.run("-m", "tribrach", "--version") == f"tribrach {__version__}\n"


#: asks a server of the installed page for what a browser asks first, on the small demonstration
FIRST = """
import sys
from pathlib import Path
from starlette.testclient import TestClient
from tribrach.workbench.guard import Guard
from tribrach.workbench.server import application
from tribrach.workbench.service import Service
guard = Guard(application(Service(Path(sys.argv[1]))), 9)
with TestClient(guard, base_url="http://127.0.0.1:9") as client:
    assert client.get(guard.address).status_code == 200
    for name in sys.argv[2:]:
        answer = client.get(f"/app/{name}")
        assert answer.status_code == 200, name
        print(name, hashlib.sha256(answer.content).hexdigest())
    assert client.get("/scene.json").json()["schema"] == 1
"""


def test_the_installed_program_serves_its_page_without_node(
    installed: Installed, small: Path
) -> None:
    """What is served away from the sources is what the build committed."""
    static = ROOT / "src" / "tribrach" / "workbench" / "static"
    files = json.loads((static / "BUILD.json").read_text())["files"]
    names = sorted(name for name in files if name != "index.html")
    out = installed.run("-c", f"import hashlib{FIRST}", str(small / "out"), *names)
    assert dict(line.split() for line in out.splitlines()) == {n: files[n] for n in names}
    assert {"main.js", "cloud-worker.js", "laz-perf.wasm", "THIRD_PARTY.txt"} <= set(names)


def contradicted(folder: Path) -> list[str]:
    """Where a demonstration contradicts its truth; everything that a run leaves must be there."""
    for name in ("hanoi-facade.toml", "truth/truth.json", "out/result.json", "out/report.html"):
        assert (folder / name).stat().st_size > 0, name
    assert list((folder / "out" / "clouds").glob("*.laz"))
    table = (folder / "out" / "report.txt").read_text().split("Against the truth\n", 1)[1]
    lines = table.split("\n\n", 1)[0].splitlines()
    assert sum("as stated" in line for line in lines) > 10
    return [line.strip() for line in lines if "not so" in line]


def test_the_demonstration_in_small(small: Path) -> None:
    assert contradicted(small) == []


@pytest.mark.slow
def test_the_demonstration(installed: Installed) -> None:
    installed.tribrach("demo", "--out", "demo", "--points", "10000", "--quiet")
    # of so few points the noise of the overview scans is 4 to 6 % larger than stated
    wrong = contradicted(installed.folder / "demo")
    assert [line for line in wrong if not line.startswith("points of")] == []
