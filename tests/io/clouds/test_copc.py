"""COPC out and in again: the same points as LAS, in a tree that keeps its promises."""

import struct
from pathlib import Path

import laspy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laspy.copc import Bounds, CopcReader

from tests.io.clouds.test_las import FIELDS, UTM, points
from tribrach.errors import InputError
from tribrach.io.clouds import copc
from tribrach.io.clouds import copc as point_spool
from tribrach.io.clouds.copc import Cube, subtree
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans

HEADER = CloudHeader("S1", FIELDS, 1e-4, UTM, crs="EPSG:32648", epoch=2020.5)
#: integers that the format has for coordinates
MOST = 2**31 - 1


def room(n: int, seed: int = 1) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Points on the walls of a room as a scanner near its middle sees them, some in a corner."""
    _, values = points(n, seed)
    rng = np.random.default_rng(seed)
    rays = rng.normal(size=(n, 3))
    walls = np.min(np.array([11.0, 7.0, 2.0]) / np.abs(rays), axis=1)
    xyz = rays * walls[:, None]
    xyz[: n // 3] = rng.normal([10.0, -3.0, 1.0], 0.05, (n // 3, 3))
    return UTM + xyz[rng.permutation(n)], values


def write(path: Path, parts: list[tuple[np.ndarray, dict[str, np.ndarray]]]) -> Path:
    with create(path, HEADER) as writer:
        for xyz, values in parts:
            writer.write(xyz, values)
    return path


def records(path: Path) -> np.ndarray:
    """The points of a file, read without regard to the tree, in the order of their bytes."""
    with laspy.open(path) as file:
        array = file.read().points.array
    return np.sort(array.view(f"V{array.itemsize}"))


def tree(path: Path) -> tuple[dict[tuple[int, ...], np.ndarray], laspy.LasHeader]:
    """Integer coordinates (n, 3) of the points of each node, read by the node's chunk."""
    out = {}
    with CopcReader.open(path) as reader, laspy.open(path) as file:
        chunks = sorted(reader.root_page.entries.values(), key=lambda entry: entry.offset)
        for entry in chunks:
            p = file.read_points(entry.point_count)
            key = entry.key
            out[key.level, key.x, key.y, key.z] = np.column_stack([p.X, p.Y, p.Z]).astype(int)
        assert file.read_points(1).X.size == 0
        return out, file.header


def check_tree(path: Path) -> dict[tuple[int, ...], np.ndarray]:
    """Each node in its cube, its parent there; no point below a node whose cell was free there."""
    nodes, header = tree(path)
    everything = np.concatenate(list(nodes.values()))
    low = everything.min(axis=0)
    side = int((everything.max(axis=0) - low).max())
    assert len(everything) == header.point_count

    def cells(xyz: np.ndarray, level: int) -> np.ndarray:
        return np.minimum((xyz - low) * 2**level // side, 2**level - 1)

    below: dict[tuple[int, ...], list[np.ndarray]] = {}
    for (level, *place), xyz in nodes.items():
        assert len(xyz)
        assert (cells(xyz, level) == place).all()
        for up in range(1, level + 1):
            parent = (level - up, *(k >> up for k in place))
            assert parent in nodes
            below.setdefault(parent, []).append(xyz)
    assert below, "a single node tests nothing"
    for key, deeper in below.items():
        code = 1 << 20 * np.arange(3)
        own = np.unique(cells(nodes[key], key[0] + 7) @ code)
        assert len(own) >= len(nodes[key]) - 8 * 9999
        assert np.isin(cells(np.concatenate(deeper), key[0] + 7) @ code, own).all()
    return nodes


@pytest.fixture(scope="module")
def cloud(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """300,000 points with every kind of field, in chunks."""
    folder = tmp_path_factory.mktemp("copc")
    parts = [room(140_000, 1), room(1, 2), points(0, 3), room(159_999, 4)]
    write(folder / "cloud.las", parts)
    return write(folder / "cloud.copc.laz", parts)


def test_every_point_is_there_with_everything(cloud: Path) -> None:
    assert (records(cloud) == records(cloud.with_name("cloud.las"))).all()
    with laspy.open(cloud) as ours, laspy.open(cloud.with_name("cloud.las")) as plain:
        assert (ours.header.mins == plain.header.mins).all()
        assert (ours.header.maxs == plain.header.maxs).all()
        returns = ours.header.number_of_points_by_return
        assert (returns == plain.header.number_of_points_by_return).all()
        assert ours.header.parse_crs() == plain.header.parse_crs()
        names = list(ours.header.point_format.extra_dimension_names)
        assert names == ["row", "sigma_x", "intensity_as_measured"]
    (scan,) = read_scans(cloud)
    assert sum(len(chunk) for chunk in scan.chunks()) == 300_000


def test_layout_of_the_format(cloud: Path) -> None:
    data = cloud.read_bytes()
    assert data[:4] == b"LASF"
    assert data[104] & 0x3F == 7
    assert data[377:393].rstrip(b"\0") == b"copc"
    assert struct.unpack_from("<HH", data, 393) == (1, 160)
    *_, spacing, root, size = struct.unpack_from("<5d2Q", data, 429)
    first, last = struct.unpack_from("<2d", data, 429 + 56)
    assert not any(data[429 + 72 : 429 + 160])
    with laspy.open(cloud.with_name("cloud.las")) as file:
        times = file.read().gps_time
        span = np.ptp([file.header.mins, file.header.maxs], axis=0).max()
    assert (first, last) == (times.min(), times.max())
    assert spacing == pytest.approx(span / 128, rel=1e-9)
    (extended,) = struct.unpack_from("<Q", data, 235)
    assert data[extended + 2 : extended + 6] == b"copc"
    assert struct.unpack_from("<HQ", data, extended + 18) == (1000, size)
    assert extended + 60 == root
    assert root + size == len(data)
    laszip = data.index(b"laszip encoded")
    assert struct.unpack_from("<I", data, laszip + 16 + 36 + 12) == (0xFFFFFFFF,)
    assert not any(data[90:94])


def test_the_tree(cloud: Path) -> None:
    nodes = check_tree(cloud)
    assert max(level for level, *_ in nodes) >= 2


def test_nodes_hold_what_viewers_like(cloud: Path) -> None:
    """30,000 to 50,000 points on the average, none more than is loaded in one go."""
    nodes, header = tree(cloud)
    assert 30_000 <= header.point_count / len(nodes) <= 50_000
    assert max(len(xyz) for xyz in nodes.values()) <= 130_000


def test_the_hierarchy_is_paged(
    cloud: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Small pages: laspy finds the same points in them, by level and by box."""
    monkeypatch.setattr(copc, "_PAGE", 6)
    parts = [room(140_000, 1), room(1, 2), points(0, 3), room(159_999, 4)]
    path = write(tmp_path / "paged.copc.laz", parts)
    box = Bounds(UTM + np.array([9.7, -3.5, 0.8]), UTM + np.array([10.1, -2.9, 1.3]))
    with CopcReader.open(path) as paged, CopcReader.open(cloud) as whole:
        assert any(entry.point_count == -1 for entry in paged.root_page.entries.values())
        assert all(entry.point_count >= 0 for entry in whole.root_page.entries.values())
        for wish in ({"level": 0}, {"level": 2}, {"bounds": box}, {}):
            ours, plain = paged.query(**wish), whole.query(**wish)
            assert len(ours) == len(plain) > 0
            assert np.array_equal(np.sort(ours.gps_time), np.sort(plain.gps_time))


def test_pages_of_a_large_tree() -> None:
    """Every node once, every page small, every reference to the page of its node."""
    rng = np.random.default_rng(1)
    leaves = rng.integers(0, 256, (4000, 3))
    keys = {(8 - up, *(k >> up for k in leaf)) for leaf in leaves.tolist() for up in range(9)}
    entries = np.zeros(len(keys), dtype=copc._ENTRY)
    entries["key"] = sorted(keys)
    entries["points"] = 1
    data, size = copc.paged_hierarchy(entries, 1000, 100)
    pending, found, pages = [(1000, size, (0, 0, 0, 0))], [], 0
    while pending:
        at, length, root = pending.pop()
        page = np.frombuffer(data[at - 1000 : at - 1000 + length], dtype=copc._ENTRY)
        pages += 1
        assert len(page) <= 108
        assert root in map(tuple, page["key"][page["points"] > 0].tolist())
        found += page["key"][page["points"] > 0].tolist()
        for entry in page[page["points"] == -1]:
            pending.append((int(entry["offset"]), int(entry["size"]), tuple(entry["key"].tolist())))
    assert pages > 10
    assert sorted(map(tuple, found)) == sorted(keys)


def test_queries_by_level_and_box(cloud: Path) -> None:
    nodes, _ = tree(cloud)
    with CopcReader.open(cloud) as reader, laspy.open(cloud) as file:
        everything = file.read()
        assert len(reader.query()) == 300_000
        for level in range(max(key[0] for key in nodes) + 1):
            expected = sum(len(xyz) for key, xyz in nodes.items() if key[0] == level)
            assert len(reader.query(level=level)) == expected > 0
        low, high = UTM + np.array([9.7, -3.5, 0.8]), UTM + np.array([10.1, -2.9, 1.3])
        found = reader.query(Bounds(low, high))
        xyz = everything.xyz
        inside = ((xyz >= low) & (xyz <= high)).all(axis=1)
        assert 1000 < inside.sum() < 300_000
        assert np.sort(found.gps_time) == pytest.approx(np.sort(everything.gps_time[inside]))
        assert np.sort(found["sigma_x"]) == pytest.approx(np.sort(everything["sigma_x"][inside]))


def test_a_cloud_larger_than_memory(
    cloud: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks and tiles so small that the cloud is divided several times."""
    monkeypatch.setattr(copc, "_TILE", 90_000)
    monkeypatch.setattr(point_spool, "_BLOCK", 7_001)
    parts = [room(140_000, 1), room(1, 2), points(0, 3), room(159_999, 4)]
    path = write(tmp_path / "cloud.copc.laz", parts)
    assert (records(path) == records(cloud)).all()
    check_tree(path)


def test_the_same_points_are_the_same_bytes(cloud: Path, tmp_path: Path) -> None:
    """Whatever chunks they come in."""
    xyz = np.concatenate([room(140_000, 1)[0], room(1, 2)[0], room(159_999, 4)[0]])
    parts = [room(140_000, 1)[1], room(1, 2)[1], room(159_999, 4)[1]]
    values = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    path = write(tmp_path / "cloud.copc.laz", [(xyz, values)])
    assert path.read_bytes() == cloud.read_bytes()


@pytest.mark.parametrize("n", [1, 2, 40_000])
def test_equal_points_and_single_ones(tmp_path: Path, n: int) -> None:
    xyz, values = points(n)
    xyz[:] = xyz[0]
    path = write(tmp_path / "a.copc.laz", [(xyz, values)])
    assert len(records(path)) == n
    with CopcReader.open(path) as reader:
        assert [e.point_count for e in reader.root_page.entries.values()] == [n]
        assert reader.query().x == pytest.approx(xyz[:, 0], abs=0.6e-4)
        assert reader.copc_info.halfsize > 0


def test_many_points_in_two_places(tmp_path: Path) -> None:
    """Deep in the tree they cannot be parted any further."""
    xyz, values = points(210_000)
    xyz[:] = UTM
    xyz[::2] += 1e-4
    xyz[0] += 80.0
    path = write(tmp_path / "a.copc.laz", [(xyz, values)])
    assert len(records(path)) == 210_000
    nodes, _ = tree(path)
    assert max(key[0] for key in nodes) == 13  # 80 m / 2^20 < 0.1 mm < 80 m / 2^19


def test_no_points(tmp_path: Path) -> None:
    path = write(tmp_path / "a.copc.laz", [])
    assert len(records(path)) == 0
    with CopcReader.open(path) as reader:
        (entry,) = reader.root_page.entries.values()
        assert (entry.key.level, entry.point_count, entry.byte_size) == (0, 0, 0)
        assert len(reader.query()) == 0


def _stopped(path: Path) -> None:
    """Ctrl-C between two chunks."""
    with create(path, HEADER) as writer:
        writer.write(*points(10))
        raise KeyboardInterrupt


def test_what_is_stopped_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "cloud.copc.laz"
    path.write_bytes(b"old")

    def interrupt(*arguments: object) -> None:
        assert len(list(tmp_path.iterdir())) == 3  # the old one, the new one, the spool
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _stopped(path)
    assert list(tmp_path.iterdir()) == [path]
    monkeypatch.setattr(copc, "subtree", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(path, [points(1000)])
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == b"old"


@pytest.mark.parametrize("method", ["append", "divide"])
def test_a_full_disk_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(point_spool.PointSpool, method, full)
    with pytest.raises(InputError, match=r"No space left.*takes the points twice"):
        write(tmp_path / "a.copc.laz", [points(1000)])
    assert not list(tmp_path.iterdir())


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(-MOST, MOST)] * 3), min_size=1, max_size=40),
    st.integers(0, 24),
)
def test_places_of_extreme_coordinates(rows: list[tuple[int, int, int]], level: int) -> None:
    """Paths down the tree against exact fractions, over the whole range of the integers."""
    steps = np.array(rows)
    cube = Cube.around(steps.min(axis=0), steps.max(axis=0))
    places = cube.places(*steps.astype(np.int32).T)
    for row, place in zip(rows, places.tolist(), strict=True):
        for k in range(3):
            exact = (row[k] - int(cube.corner[k])) * 2**level // cube.side
            assert place[k] >> (31 - level) == min(exact, 2**level - 1)
    order, nodes = subtree(places, 0, cube.deepest)
    assert sorted(order) == list(range(len(rows)))
    assert nodes.keys.tolist() == [[0, 0, 0, 0]]
