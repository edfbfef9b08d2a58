"""The benchmark of stated uncertainty: its scorer by closed forms, its scenes, and a small form."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks.coverage.__main__ import main, submitted
from benchmarks.coverage.programs import PROGRAMS, placed
from benchmarks.coverage.scanner import exp
from benchmarks.coverage.scenes import Truth, make, names_of, read_points, scenes, truths
from benchmarks.coverage.score import advice, binomial, score
from benchmarks.coverage.submission import Answer, BadSubmission, Point, Pose, Submission, read
from benchmarks.coverage.world import Hits, Solid, Terrain, World, ball, box, pole
from scipy.stats import binom

FOLDER = Path(__file__).parents[1] / "benchmarks" / "coverage"
COUNT = 2000


def drawn(factor: float = 1.0, count: int = COUNT) -> tuple[Submission, dict[str, Truth]]:
    """Poses and points whose errors are drawn from ``factor`` times their stated covariance."""
    rng = np.random.default_rng(7)
    true, said = {}, {}
    for k in range(count):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = exp(rng.normal(0, 1, 3)), rng.normal(0, 10, 3)
        shape = rng.normal(size=(6, 6)) * np.repeat([1e-3, 1e-4], 3)[:, None]
        covariance = shape @ shape.T
        error = factor * shape @ rng.normal(size=6)
        stated = pose.copy()
        stated[:3, 3] -= error[:3]
        stated[:3, :3] = exp(-error[3:]) @ pose[:3, :3]
        place = rng.normal(0, 5, 3)
        point = Point(place - factor * shape[:3] @ rng.normal(size=6), covariance[:3, :3])
        name = f"room-{k:04d}"
        true[name] = Truth(name, {"S2": pose}, {"P1": place})
        said[name] = Answer(1.0, {"S2": Pose(stated, covariance)}, {"P1": point})
    return Submission("drawn", said), true


def shares(submission: Submission, true: dict[str, Truth]) -> tuple[int, int]:
    found = score(submission, true)
    return sum(r.inside for r in found.poses), sum(r.inside for r in found.points)


def test_errors_drawn_from_their_covariance_are_inside_in_95_percent() -> None:
    low, high = binom.interval(0.999, COUNT, 0.95)
    assert all(low <= inside <= high for inside in shares(*drawn()))
    assert not any(r.sure for r in score(*drawn()).poses)


def test_a_covariance_that_is_too_small_or_too_large_fails() -> None:
    low, high = binom.interval(0.999, COUNT, 0.95)
    assert all(inside < low for inside in shares(*drawn(1.5)))
    assert all(inside > high for inside in shares(*drawn(0.5)))
    assert any(r.sure for r in score(*drawn(4.0)).poses)


def test_interval_of_a_share_is_that_of_clopper_and_pearson() -> None:
    low, high = binomial(190, 200)
    assert binom.sf(189, 200, low) == pytest.approx(0.025)
    assert binom.cdf(190, 200, high) == pytest.approx(0.025)
    assert binomial(0, 10)[0] == 0
    assert binomial(10, 10)[1] == 1


def test_size_of_a_region_is_the_geometric_mean_of_its_axes() -> None:
    submission, true = drawn(count=1)
    pose = submission.scenes["room-0000"].poses["S2"]
    turn = exp(np.array([0.3, -0.2, 0.9]))
    covariance = np.eye(6)
    covariance[:3, :3] = turn @ np.diag([1.0, 4.0, 16.0]) @ turn.T
    said = {"room-0000": Answer(1.0, {"S2": Pose(pose.matrix, covariance)}, {})}
    row = score(Submission("p", said), true).poses[0]
    assert row.size(slice(0, 3)) == pytest.approx(2.0)


def test_what_is_left_out_counts_as_refused() -> None:
    true = drawn(count=3)[1]
    said = {"room-0000": Answer(1.0, {"S2": "symmetric"}, {})}
    found = score(Submission("p", said), true)
    assert [r[2] for r in found.refused] == ["symmetric"] + ["nothing was submitted"] * 2
    assert found.asked == 3


CHANGES = {
    "scan_from_first": (np.linalg.inv, lambda c: c),
    "millimetres": (lambda p: np.vstack([p[:3] * [1, 1, 1, 1e3], p[3:]]), lambda c: c),
    "rotation stood before": (lambda p: p, lambda c: np.roll(c, (3, 3), (0, 1))),
    "degrees": (lambda p: p, lambda c: c * np.outer(*[[1] * 3 + [180 / np.pi] * 3] * 2)),
}


@pytest.mark.parametrize("word", CHANGES)
def test_another_convention_is_named(word: str) -> None:
    submission, true = drawn(count=50)
    assert advice(submission, true) == []
    pose, covariance = CHANGES[word]
    said = {
        n: Answer(
            1.0, {s: Pose(pose(p.matrix), covariance(p.covariance)) for s, p in a.poses.items()}, {}
        )
        for n, a in submission.scenes.items()
    }
    told = advice(Submission("p", said), true)
    assert len(told) == 1
    assert word in told[0]


def test_a_submission_comes_back_and_bad_ones_are_refused(tmp_path: Path) -> None:
    submission, true = drawn(count=2)
    file = tmp_path / "mine.json"
    submission.write(file)
    assert shares(read(file), true) == shares(submission, true)
    whole = json.loads(file.read_text())
    pose = whole["scenes"]["room-0000"]["poses"]["S2"]
    mirrored = np.array(pose["first_from_scan"]) * [1, -1, 1, 1]
    good = {"first_from_scan": pose["first_from_scan"], "covariance": pose["covariance"]}
    bad = {
        "mirrors": {"first_from_scan": mirrored.tolist()},
        "transposed": {"first_from_scan": np.transpose(pose["first_from_scan"]).tolist()},
        "variance": {"covariance": (-np.eye(6)).tolist()},
        "positive definite": {"covariance": np.ones((6, 6)).tolist()},
        "array": {"covariance": np.eye(5).tolist()},
        "covariance": {"covariance": None},
    }
    for word, change in bad.items():
        whole["scenes"]["room-0000"]["poses"]["S2"] = good | change
        file.write_text(json.dumps(whole))
        with pytest.raises(BadSubmission, match=word if word != "covariance" else "S2"):
            read(file)


def test_beams_meet_surfaces_where_closed_forms_say() -> None:
    rng = np.random.default_rng(1)
    along = rng.normal(size=(500, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    start, time = np.zeros((500, 3)), np.zeros(500)

    def cast(*bodies: Solid) -> Hits:
        return World(bodies).cast(start, along, time, rng)

    inside = cast(box([0, 0, 0], [4, 6, 2], "plaster", 0.3))
    axes = np.array([[np.cos(0.3), np.sin(0.3), 0], [-np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    at = inside.ranges[:, None] * along @ axes.T
    assert np.allclose(np.abs(at / [2, 3, 1]).max(axis=1), 1)
    round_ = cast(ball([3, 0, 0], 1, "paint"))
    met = np.isfinite(round_.ranges)
    assert np.allclose(np.linalg.norm(round_.ranges[met, None] * along[met] - [3, 0, 0], axis=1), 1)
    assert met.sum() == (along[:, 0] > np.sqrt(8) / 3).sum()
    tube = cast(pole([0, 0, -5], 2, 10, "concrete", capped=False))
    far = np.isfinite(tube.ranges)
    assert np.allclose(np.hypot(*(tube.ranges[:, None] * along)[far, :2].T), 2)
    bells = np.array([[3.0, 1.0, 2.0, 1.5]])
    ground = Terrain("soil", bells=bells)
    high = np.array([0, 0, 4.0])
    ranges, normal = ground.hit(start + high, along)
    on = np.isfinite(ranges)
    place = high + ranges[on, None] * along[on]
    assert np.abs(place[:, 2] - ground.height(place[:, :2])).max() < 1e-4
    assert on.sum() > 150
    assert ((normal[on] * along[on]).sum(axis=1) < 0.05).all()


def test_generator_and_scorer_import_nothing_of_the_program() -> None:
    for file in [*FOLDER.glob("*.py"), FOLDER / "programs" / "__init__.py"]:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(n.split(".")[0] == "tribrach" for n in names), file


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One scene of each sort with few of the beams."""
    folder = tmp_path_factory.mktemp("scenes")
    assert main(["make", str(folder), "--scenes", "7", "--thin", "0.06"]) == 0
    return folder


def test_scenes_are_the_same_each_time_and_keep_the_truth_apart(
    small: Path, tmp_path: Path
) -> None:
    name, seed = names_of(2, 1)[1]
    make(tmp_path, name, seed, 0.06)
    for file in sorted(tmp_path.rglob("*.*")):
        assert file.read_bytes() == (small / file.relative_to(tmp_path)).read_bytes()
    assert len(truths(small)) == 7
    for scene in scenes(small):
        assert not {"seed", "first_from_scan", "instrument"} & set(scene.given)
        assert {f.name for f in scene.folder.iterdir()} == {
            "scene.json", *(f"{s}.ply" for s in scene.scans)
        }  # fmt: skip


def test_true_poses_lay_check_points_on_their_places(small: Path) -> None:
    """With the true poses points are off by the noise of their scanner alone."""
    true, answers = truths(small), {}
    for scene in scenes(small):
        tiny = np.diag([1e-5**2] * 6)
        poses = {s: Pose(m, tiny) for s, m in true[scene.name].first_from_scan.items()}
        xyz = read_points(scene.file("S2"))[0]
        for point in scene.given["points"].values():
            assert point["scan"] != "S2" or np.allclose(xyz[point["number"]], point["xyz"])
        answers[scene.name] = Answer(0.0, dict(poses), placed(scene, poses))
    found = score(Submission("truth", answers), true)
    assert all(r.inside for r in found.poses)
    assert len(found.points) > 30
    assert np.median([np.linalg.norm(r.error) for r in found.points]) < 0.005
    assert max(np.linalg.norm(r.error) for r in found.points) < 0.05


@pytest.mark.slow
def test_small_form_of_the_benchmark(tmp_path: Path) -> None:
    """Ours by its Python on twelve scenes with half of the beams."""
    small = tmp_path
    assert main(["make", str(small), "--scenes", "12", "--thin", "0.5"]) == 0
    assert main(["run", str(small), "--programs", "tribrach_started"]) == 0
    submission = submitted(small, "tribrach_started", None)
    assert submission is not None
    found = score(submission, truths(small))
    assert len(found.poses) + len(found.refused) == found.asked
    assert sum(r.sure for r in found.poses) <= 1
    assert main(["score", str(small)]) == 0


def test_every_program_has_its_file() -> None:
    files = {f.stem for f in (FOLDER / "programs").glob("*.py")} - {"__init__"}
    assert files == set(PROGRAMS)
