"""A room with scanner stations, calibration unknowns and targets, and what may come to it."""

from collections.abc import Sequence

import numpy as np

from tribrach._types import Index
from tribrach.geometry.polar import polar_from_xyz
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import NIST
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar
from tribrach.planning.blocks import Blocks

KINDS = ("sigma", "redundancy", "undetected", "correlation")
MODEL = NIST.select(["x10", "x4", "x6"])
SIGMA = np.array([0.001, 4e-5, 4e-5])
STATIONS = {"S0": ([0, 0, 0], 0.3), "S1": ([4, 1, 0.1], -1.0), "S2": ([1, 4, 0], 2.0)}


def places(count=10, seed=3):
    """Targets around the stations."""
    rng = np.random.default_rng(seed)
    return rng.uniform([-4, -4, -1.5], [7, 8, 3], (count, 3))


def sights(survey, station, pose, names, xyz, faces=(1.0, -1.0)):
    """A station sees all named targets in two faces."""
    t, heading = pose
    polar = polar_from_xyz((xyz - np.array(t, dtype=float)) @ exp(np.array([0, 0, heading])))
    for face in faces:
        survey.add(
            ScannerPolar,
            values=polar,
            sigma=np.tile(SIGMA, (len(names), 1)),
            station=[station] * len(names),
            target=list(names),
            face=np.full(len(names), face),
            model=MODEL,
            parameters=np.tile(np.array(MODEL.parameters, dtype=object), (len(names), 1)),
        )


def given_station(survey, name, pose):
    survey.station(name, translation=pose[0], rotation=exp(np.array([0, 0, pose[1]])))


def room_network(datum="control", count=10, stations=STATIONS, without=""):
    """The survey of a room; control: four weighted targets."""
    survey, xyz = Survey(), places(count)
    for i, x in enumerate(xyz):
        if f"T{i}" != without:
            control = np.eye(3) * 1e-6 if datum == "control" and i < 4 else None
            survey.point(f"T{i}", x, covariance=control)
    for name, pose in stations.items():
        given_station(survey, name, pose)
        seen = [i for i in range(count) if (name != "S2" or i < count - 3) and f"T{i}" != without]
        sights(survey, name, pose, [f"T{i}" for i in seen], xyz[seen])
    if datum != "control":
        survey.datum = Datum("free")
    return survey


def candidates(what):
    """A function that adds numbered candidates to a survey, or to none but what they touch."""
    extra = places(20, seed=9)
    rng = np.random.default_rng(5)
    poses = [([*rng.uniform(-2, 5, 2), 0.2], float(rng.uniform(-3, 3))) for _ in range(20)]

    def bare():
        survey = Survey()
        for name, pose in STATIONS.items():
            given_station(survey, name, pose)
        for i, x in enumerate(places()):
            survey.point(f"T{i}", x)
        return survey

    def targets(survey, numbers):
        survey = bare() if survey is None else survey
        names = [f"new {k}" for k in numbers]
        for name, k in zip(names, numbers, strict=True):
            survey.point(name, extra[k])
        for j, (station, pose) in enumerate(STATIONS.items()):
            seen = [k for k in numbers if (k + j) % 4 or j == 0]
            if seen:
                sights(survey, station, pose, [f"new {k}" for k in seen], extra[seen])
        return survey.network(), {f"new {k}": k for k in numbers}

    def stations(survey, numbers):
        survey = bare() if survey is None else survey
        for k in numbers:
            given_station(survey, f"place {k}", poses[k])
            seen = [i for i in range(10) if (i + k) % 3]
            sights(survey, f"place {k}", poses[k], [f"T{i}" for i in seen], places()[seen])
        return survey.network(), {f"place {k}": k for k in numbers}

    return targets if what == "targets" else stations


def combine(blocks: Blocks, members: Sequence[Index] | Index) -> Blocks:
    """Groups made of several others (c, j), indices into the blocks, all of them at once.

    The members share no own unknowns. Columns may repeat, which does no harm.
    """
    index = np.asarray(members, dtype=np.int64)
    c, j = index.shape
    k, w = blocks.rows.shape[1:]
    rows = np.zeros((c, j * k, j * w))
    for i in range(j):
        rows[:, i * k : (i + 1) * k, i * w : (i + 1) * w] = blocks.rows[index[:, i]]
    return Blocks(
        np.arange(c),
        rows,
        blocks.columns[index].reshape(c, j * w),
        blocks.leverage[index].reshape(c, j * k),
        blocks.line[index].reshape(c, j * k),
        np.all(blocks.determined[index], axis=1),
    )
