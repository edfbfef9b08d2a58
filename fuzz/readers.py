"""The readers, what mutates their files, and their seeds.

Seeds are small files of our own making in ``fuzz/seeds``: one folder for each reader, and in it
files, or folders of files that are read together and of which one is mutated.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.io.arrays import read_joint_covariance, read_named
from tribrach.io.calibration_file import read_calibration
from tribrach.io.comparison_table import read_comparison
from tribrach.io.epoch_files import read_epoch
from tribrach.io.geoid_files import read_geoid
from tribrach.io.gnss.antex_file import read_antex
from tribrach.io.gnss.navigation_file import read_navigation
from tribrach.io.gnss.observation_file import read_observations
from tribrach.io.gnss.orbit_files import read_orbits
from tribrach.io.gnss.solution_file import read_solution, read_status
from tribrach.io.lever_arm_file import read_lever_arm
from tribrach.io.models.formats import read_model
from tribrach.io.number_table import read_numbers
from tribrach.io.point_list import read_point_list
from tribrach.io.readings_through_time import read_timed_readings
from tribrach.io.scans.formats import read_scans
from tribrach.io.site_table import read_sites
from tribrach.io.survey import formats as surveys
from tribrach.io.survey.csv.matrix import read_matrix
from tribrach.io.survey.riscan.info import describe_project
from tribrach.io.transformation_file import read_transformation
from tribrach.job.poses import read_poses
from tribrach.job.truth import read_truth
from tribrach.project import Project
from tribrach.project.edits import read_edits
from tribrach.questions.check.readings import read_earlier

__all__ = ["READERS", "SEEDS", "Reader", "Seed", "seeds_of"]

SEEDS = Path(__file__).parent / "seeds"
Read = Callable[[list[Path]], Any]


@dataclass(frozen=True)
class Reader:
    """A reader under test.

    Attributes
    ----------
    read
        Reads files; what comes of it does not matter.
    style
        What mutates them, a key of ``STYLES``.
    errors
        Exceptions besides our own that it raises on purpose, for its callers.
    """

    read: Read
    style: str
    errors: tuple[type[Exception], ...] = ()


@dataclass(frozen=True)
class Seed:
    """Files that are read together, by name, and which of them is mutated."""

    files: dict[str, bytes]
    mutated: str

    def write(self, folder: Path, data: bytes) -> list[Path]:
        """Write the files, one of them with other content, into an emptied folder."""
        for old in folder.iterdir():
            if old.is_dir():
                shutil.rmtree(old)
            else:
                old.unlink()
        for name, whole in self.files.items():
            (folder / name).write_bytes(data if name == self.mutated else whole)
        return [folder / name for name in self.files]


def _scan(paths: list[Path]) -> None:
    for scan in read_scans(paths[0]):
        for _ in scan.stored():
            pass


def _survey(paths: list[Path]) -> None:
    surveys.read_files(paths).network()


def _comp3d(paths: list[Path]) -> None:
    surveys.read_files([p for p in paths if p.suffix == ".comp"] or paths[:1]).network()


def _geoid(paths: list[Path]) -> Any:
    """A grid, and its height in the middle of the seeds."""
    return read_geoid(paths[0]).undulation(np.array([0.803]), np.array([0.152]))


def _one(read: Callable[[Path], Any]) -> Read:
    return lambda paths: read(paths[0])


def _riscan(paths: list[Path]) -> None:
    describe_project(paths[0])
    _survey(paths)


def _solution(paths: list[Path]) -> None:
    read_status(paths[0])
    read_solution(paths[0])


def _project(paths: list[Path]) -> None:
    Project.load(next(p for p in paths if p.suffix == ".toml"))


_RAW = ("fbk", "gsi", "gts6", "gts7", "m5", "nikon", "rw5", "sdr")
_TEXTS = ("csv", "dna", "jsonl", "levels", "ngs", "pos", "sinex", "ski", "starnet", "tdef")
READERS: dict[str, Reader] = {
    **{name: Reader(_survey, "text") for name in (*_RAW, *_TEXTS)},
    **{name: Reader(_survey, "xml") for name in ("dynaml", "gama", "gvx", "jobxml", "landxml")},
    "comp3d": Reader(_comp3d, "text"),
    "riscan": Reader(_riscan, "xml"),
    **{name: Reader(_scan, "las") for name in ("las", "laz", "copc")},
    **{name: Reader(_scan, "headed") for name in ("ply", "pcd")},
    **{name: Reader(_scan, "text") for name in ("pts", "ptx", "xyz")},
    "e57": Reader(_scan, "e57"),
    "scan text, packed": Reader(_scan, "packed"),
    "rinex": Reader(_one(read_observations), "text"),
    "rinex, packed": Reader(_one(read_observations), "packed"),
    "navigation": Reader(_one(read_navigation), "text"),
    "sp3": Reader(read_orbits, "text"),
    "antex": Reader(_one(read_antex), "text"),
    "solution": Reader(_solution, "text"),
    "project": Reader(_project, "keyed"),
    "calibration": Reader(_one(read_calibration), "keyed"),
    "edits": Reader(_one(read_edits), "keyed"),
    "lever arm": Reader(_one(read_lever_arm), "keyed"),
    "transformation": Reader(_one(read_transformation), "keyed"),
    "poses": Reader(_one(read_poses), "keyed"),
    "comparison": Reader(
        lambda paths: read_comparison(paths[0], ["reach", "range"]), "keyed"
    ),
    "timed readings": Reader(_one(read_timed_readings), "text"),
    "epochs": Reader(lambda paths: read_epoch(paths), "keyed"),
    "earlier check": Reader(_one(read_earlier), "keyed"),
    "truth": Reader(_one(read_truth), "keyed"),
    "points": Reader(_one(read_point_list), "text"),
    "spreadsheet": Reader(_one(read_point_list), "zipped"),
    "sites": Reader(_one(read_sites), "text"),
    "numbers": Reader(lambda paths: read_numbers(paths[0], ["x", "y"]), "text"),
    "covariances": Reader(_one(read_matrix), "text"),
    "mesh": Reader(_one(read_model), "headed"),
    "geoid": Reader(_geoid, "headed"),
    "joint covariance": Reader(lambda paths: read_joint_covariance(paths[0], 2), "array"),
    "arrays": Reader(_one(read_named), "zipped", (OSError, ValueError, KeyError, EOFError)),
}  # fmt: skip


def seeds_of(name: str) -> list[Seed]:
    """The seeds of a reader, in the order of their names; of files read together one for each."""
    out = []
    for entry in sorted((SEEDS / name.replace(", ", "-").replace(" ", "-")).iterdir()):
        if entry.is_file():
            out.append(Seed({entry.name: entry.read_bytes()}, entry.name))
        else:
            files = {file.name: file.read_bytes() for file in sorted(entry.iterdir())}
            out += [Seed(files, mutated) for mutated in files if not mutated.startswith("whole")]
    return out
