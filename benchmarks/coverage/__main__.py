"""The open benchmark of stated uncertainty: ``python -m benchmarks.coverage WORD FOLDER``.

    make FOLDER --scenes 200 --seed 1           scenes, and the truth apart from them
    run FOLDER --programs tribrach small_gicp   what programs say; scenes that were run are kept
    calibrate FOLDER --from OTHER               constant covariances, from scenes of other seeds
    score FOLDER [FILE ...]                     one table of all submissions
    page FOLDER                                 docs/coverage.md

Everything can be stopped and goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from benchmarks.coverage.page import write_page
from benchmarks.coverage.programs import PROGRAMS, Found, load, placed
from benchmarks.coverage.scenes import Scene, make, names_of, scenes, truths
from benchmarks.coverage.score import HEADS, advice, normalised, pose_error, score
from benchmarks.coverage.submission import Answer, BadSubmission, Pose, Submission, read

ROOT = Path(__file__).resolve().parents[2]
#: what a program found of a scene, as it is kept
Kept = dict[str, Found | str]


def run(folder: Path, program: str) -> str | None:
    """Have a program register all scenes that it has not; says why if it cannot be run."""
    module = load(program)
    if isinstance(module, str):
        return module
    results = folder / "results" / program
    results.mkdir(parents=True, exist_ok=True)
    (results / "settings.txt").write_text(module.SETTINGS + "\n")
    for scene in scenes(folder):
        file = results / f"{scene.name}.json"
        if file.exists():
            continue
        begun = time.perf_counter()
        found: Kept = module.register(scene)
        seconds = time.perf_counter() - begun
        poses = {
            s: {"refused": f}
            if isinstance(f, str)
            else {"first_from_scan": f.matrix.tolist(), "covariance": None}
            if f.covariance is None
            else Pose(f.matrix, f.covariance).as_json()
            for s, f in found.items()
        }
        file.write_text(json.dumps({"seconds": seconds, "poses": poses}, indent=1) + "\n")
        print(program, scene.name, f"{seconds:.1f} s", flush=True)
    return None


def kept(folder: Path, program: str) -> Iterator[tuple[Scene, float, Kept]]:
    """What a program said of the scenes."""
    for scene in scenes(folder):
        file = folder / "results" / program / f"{scene.name}.json"
        if not file.exists():
            continue
        result = json.loads(file.read_text())
        found: Kept = {}
        for scan, pose in result["poses"].items():
            if "refused" in pose:
                found[scan] = str(pose["refused"])
                continue
            covariance = pose["covariance"]
            known = None if covariance is None else np.array(covariance)
            found[scan] = Found(np.array(pose["first_from_scan"]), known)
        yield scene, float(result["seconds"]), found


def calibrated(folder: Path, program: str) -> np.ndarray | None:
    """The constant covariance (6, 6) whose region holds 95 % of the poses of these scenes."""
    true = truths(folder)
    errors = np.array([
        pose_error(true[scene.name].first_from_scan[scan], f.matrix)
        for scene, _, found in kept(folder, program)
        for scan, f in found.items()
        if isinstance(f, Found)
    ])  # fmt: skip
    if not len(errors):
        return None
    shift, turn = (np.median(np.abs(e)) / 0.6745 for e in (errors[:, :3], errors[:, 3:]))
    plain = np.diag([shift**2] * 3 + [turn**2] * 3)
    squares = [normalised(error, plain) for error in errors]
    return plain * np.quantile(squares, 0.95) / chi2.ppf(0.95, 6)


def submitted(folder: Path, program: str, constant: np.ndarray | None) -> Submission | None:
    """What a program says, with its own covariances, or with a constant one in their place."""
    answers = {}
    for scene, seconds, found in kept(folder, program):
        poses: dict[str, Pose | str] = {}
        for scan, f in found.items():
            if isinstance(f, str):
                poses[scan] = f
            elif constant is not None:
                poses[scan] = Pose(f.matrix, constant)
            elif f.covariance is not None:
                poses[scan] = Pose(f.matrix, f.covariance)
            else:
                return None
        stated = {s: p for s, p in poses.items() if isinstance(p, Pose)}
        answers[scene.name] = Answer(seconds, poses, placed(scene, stated))
    if not answers:
        return None
    settings = (folder / "results" / program / "settings.txt").read_text().strip()
    if constant is None:
        return Submission(program, answers, settings)
    return Submission(f"{program}, constant", answers, f"{settings}; calibrated constant")


def assembled(folder: Path) -> list[Path]:
    """Submissions of all programs that were run, as files."""
    (folder / "submissions").mkdir(exist_ok=True)
    file = folder / "calibration.json"
    constants = json.loads(file.read_text()) if file.exists() else {}
    out = []
    for program in PROGRAMS:
        constant = np.array(constants[program]) if program in constants else None
        ways = [None] if constant is None else [None, constant]
        for way in ways:
            made = submitted(folder, program, way)
            if made is not None:
                out.append(folder / "submissions" / f"{made.program.replace(', ', '_')}.json")
                made.write(out[-1])
    return out


def main(words: list[str] | None = None) -> int:
    """Do what the command line asks for; 2 where a submission cannot be read."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.coverage",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("word", choices=("make", "run", "calibrate", "score", "page"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("files", nargs="*", type=Path, help="submissions to score")
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1, help="of the first scene")
    parser.add_argument("--thin", type=float, default=1.0, help="share of the beams")
    parser.add_argument("--programs", nargs="+", default=PROGRAMS, choices=PROGRAMS)
    parser.add_argument("--from", dest="other", type=Path, help="scenes of calibration")
    asked = parser.parse_args(words)
    folder: Path = asked.folder
    if asked.word == "make":
        for name, seed in names_of(asked.scenes, asked.seed):
            if not (folder / "scenes" / name / "scene.json").exists():
                make(folder, name, seed, asked.thin)
                print(name, flush=True)
    elif asked.word == "run":
        for program in asked.programs:
            why = run(folder, program)
            if why is not None:
                print(f"{program} is left out: {why}", file=sys.stderr)
    elif asked.word == "calibrate":
        if asked.other is None or set(truths(asked.other)) & set(truths(folder)):
            parser.error("calibrate needs --from with a folder of other scenes")
        peers = [p for p in PROGRAMS if not p.startswith("tribrach")]
        found = {p: c.tolist() for p in peers if (c := calibrated(asked.other, p)) is not None}
        (folder / "calibration.json").write_text(json.dumps(found, indent=1) + "\n")
    else:
        try:
            read_in = [read(file) for file in asked.files or assembled(folder)]
        except BadSubmission as error:
            print(error, file=sys.stderr)
            return 2
        true = truths(folder)
        scores = [score(submission, true) for submission in read_in]
        if asked.word == "page":
            write_page(ROOT / "docs" / "coverage.md", folder, read_in, scores)
            return 0
        for cells in (HEADS, *(s.cells() for s in scores)):
            print(f"| {' | '.join(cells)} |")
        for submission in read_in:
            for sentence in advice(submission, true):
                print(f"{submission.program}: {sentence}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
