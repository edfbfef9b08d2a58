"""Compiled loops are numba's from their first call on, and no moment earlier."""

import ast
import os
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread, get_ident

import numba
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from tribrach import kernels
from tribrach._types import Array
from tribrach.kernels import Kernel, blas_in_one_thread, njit


@njit(cache=True)
def _square(x):
    return x * x


@njit(nogil=True)
def _sum_of_squares(values):
    """A kernel that calls another, and itself for the first half."""
    total = 0.0
    for n in range(len(values)):
        total += _square(values[n])
    return total


@njit()
def _factorial(n):
    return 1 if n <= 1 else n * _factorial(n - 1)


def test_kernels_call_each_other_and_themselves() -> None:
    assert isinstance(_sum_of_squares, Kernel)
    assert _sum_of_squares(np.arange(5.0)) == 30.0
    # the names in its code are those of numba now
    assert not isinstance(_square, Kernel)
    assert _square(3.0) == 9.0
    assert _factorial(5) == 120


def test_a_kernel_says_what_it_is() -> None:
    kernel = njit(cache=True)(lambda x: x)
    assert kernel.options == {"cache": True}
    assert _factorial.__module__ == __name__
    assert kernel.py_func(3) == 3


def test_threads_that_call_first_at_the_same_time_get_the_same() -> None:
    @njit(nogil=True)
    def twice(x):
        return 2 * x

    found = []
    threads = [Thread(target=lambda n=n: found.append(twice(n))) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(found) == [0, 2, 4, 6, 8, 10, 12, 14]
    assert len(twice.declared().signatures) == 1


def test_modules_with_kernels_load_without_numba() -> None:
    code = (
        "import sys, tribrach.targets.planes, tribrach.comparison.c2c, tribrach.network.linear\n"
        "print('numba' in sys.modules)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "False"


_STORED = """
import sys
import numpy as np
from tribrach.kernels import njit

@njit(cache=True)
def sums(matrix, vector):
    out = np.zeros(len(matrix))  # memory of its own, and the products of another library
    out += np.dot(matrix, vector)
    return out, out.sum()

@njit(cache=True)
def outer(matrix, vector):
    return sums(matrix, vector)[1] + 1.0

values, total = sums(np.eye(3) * 2, np.arange(3.0))
assert values.tolist() == [0.0, 2.0, 4.0] and total == 6.0
print("numba.np.polynomial.polynomial_core" in sys.modules)
# compiled after one that was loaded, for the process that finds none stored
assert outer(np.eye(3), np.arange(3.0)) == 4.0
assert sums(np.eye(3, dtype=np.float32), np.arange(3.0, dtype=np.float32))[1] == 3.0
if len(sys.argv) > 1:
    assert outer(np.eye(3, dtype=np.float32), np.arange(3.0, dtype=np.float32)) == 4.0
"""


def test_a_stored_kernel_is_loaded_without_the_compiler(tmp_path: Path) -> None:
    """The one that compiles needs it, and one that has to compile after loading gets it."""
    script = tmp_path / "stored.py"
    script.write_text(_STORED)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}

    def compiler_loaded(*words: str) -> str:
        command = [sys.executable, str(script), *words]
        out = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        return out.stdout.strip()

    assert compiler_loaded() == "True"
    assert compiler_loaded() == "False"
    assert compiler_loaded("another type") == "False"


def test_no_kernel_has_what_a_stored_one_could_not_load() -> None:
    """Sets, dictionaries and hashes need symbols that are not there without the compiler."""
    hashed = (ast.Set, ast.SetComp, ast.Dict, ast.DictComp)
    seen = 0
    for file in sorted(Path(kernels.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef):
                continue
            if not any("njit" in ast.unparse(one) for one in node.decorator_list):
                continue
            seen += 1
            for one in (each for part in node.body for each in ast.walk(part)):
                where = f"{file.name}, {node.name}"
                assert not isinstance(one, hashed), where
                assert not (isinstance(one, ast.Name) and one.id in ("set", "dict", "hash")), where
    assert seen > 20


@njit(nogil=True)
def _squares(first, last, values, out):
    for n in range(first, last):
        out[n] = values[n] * values[n]


@pytest.mark.parametrize("rounds", [0, 1, 7, 8, 9, 100, 101])
def test_rounds_shared_among_threads_are_all_done_once(
    monkeypatch: pytest.MonkeyPatch, rounds: int
) -> None:
    parts: list[tuple[int, int, int]] = []

    def kernel(first: int, last: int, values: Array, out: Array) -> None:
        parts.append((first, last, get_ident()))
        _squares(first, last, values, out)

    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 3)
    values, out = np.arange(float(rounds)), np.full(rounds, -1.0)
    kernels.in_threads(kernel, rounds, values, out, least=4)
    assert np.array_equal(out, values**2)
    done = sorted(n for first, last, _ in parts for n in range(first, last))
    assert done == list(range(rounds))
    # few rounds are done where they are wanted, many nowhere else than in threads of their own
    assert ({thread for *_, thread in parts} == {get_ident()}) == (rounds < 8)
    assert rounds < 8 or min(last - first for first, last, _ in parts) >= 4


def test_what_goes_wrong_in_a_thread_is_raised() -> None:
    def kernel(first: int, last: int) -> None:
        raise ValueError(f"{first} to {last}")

    with pytest.raises(ValueError, match="to"):
        kernels.in_threads(kernel, 100, least=1)


def test_products_are_computed_by_one_thread_and_then_by_as_many_as_before() -> None:
    def threads() -> list[int]:
        return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]

    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with blas_in_one_thread():
            assert set(threads()) == {1}
        assert threads() == before


#: for processes on a busy machine [s]
WAIT = 300.0
LOOPS = """
import sys, time
from numba.core import event
from tribrach import kernels

@kernels.njit(cache=True)
def inner(x):
    return x + 1

@kernels.njit(cache=True)
def outer(x):
    return 2 * inner(x)
"""
#: compiles for a type that is named, and says how many kernels that were
CALLED = """
import numpy
kernels._Turn.patience = float(sys.argv[2])
with event.install_recorder("numba:compile") as seen:
    result = loops.outer(getattr(numpy, sys.argv[1])(3))
own = [e for _, e in seen.buffer if e.is_end and e.data["dispatcher"].py_func.__module__ == "loops"]
print(result, len(own))
"""
#: takes the turn of a kernel and keeps it
KEPT = """
inner = loops.inner.declared()
inner._cache.turn.take()
print("taken", flush=True)
time.sleep(300)
"""


@pytest.fixture
def loops(tmp_path: Path) -> Path:
    (tmp_path / "loops.py").write_text(LOOPS)
    return tmp_path


def start(folder: Path, code: str, *words: object) -> subprocess.Popen[str]:
    code = f"import sys, loops\nfrom loops import *\n{code}"
    places = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    environment = {"NUMBA_CACHE_DIR": str(folder / "kernels"), "PYTHONPATH": places}
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, words)],
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def said(process: subprocess.Popen[str]) -> list[str]:
    out, problem = process.communicate(timeout=WAIT)
    assert process.returncode == 0, problem
    return out.split()


def test_two_that_need_the_same_compile_it_once(loops: Path) -> None:
    both = [start(loops, CALLED, "int64", WAIT) for _ in range(2)]
    told = [said(one) for one in both]
    assert [result for result, _ in told] == ["8", "8"]
    # each of the two kernels by one of the two processes
    assert sum(int(count) for _, count in told) == 2


def test_two_that_need_it_for_different_types_store_both(loops: Path) -> None:
    both = [start(loops, CALLED, name, WAIT) for name in ("int64", "float64", "float32")]
    assert [said(one)[0] for one in both] == ["8", "8.0", "8.0"]
    for name, result in (("float64", "8.0"), ("int64", "8"), ("float32", "8.0")):
        assert said(start(loops, CALLED, name, 60)) == [result, "0"]


def test_one_that_hangs_is_not_waited_for_without_end_and_one_that_is_killed_not_at_all(
    loops: Path,
) -> None:
    with start(loops, KEPT) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "taken\n"
        # compiled without it; what the other may be about to store is left to it
        assert said(start(loops, CALLED, "int64", 0.2)) == ["8", "2"]
        assert [path.name[:11] for path in loops.rglob("*.nbc")] == ["loops.outer"]
        # it would wait for longer than this test does
        waiting = start(loops, CALLED, "float64", 10 * WAIT)
        time.sleep(2.0)
        holder.kill()
        assert said(waiting) == ["8.0", "2"]
    assert said(start(loops, CALLED, "float64", 0)) == ["8.0", "0"]


def test_kernels_are_stored_where_files_cannot_be_locked(loops: Path) -> None:
    code = "import filelock\ndef no(self): raise NotImplementedError\n"
    code += "filelock.FileLock._acquire = no\n" + CALLED
    assert said(start(loops, code, "int64", 60)) == ["8", "2"]
    assert said(start(loops, CALLED, "int64", 60)) == ["8", "0"]
