"""A scanner that reads long is named with the size of it; clean ones are not accused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.calibration.systematic_errors import SystematicErrors, systematic_errors
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.network.network import Network
from tribrach.observations.scanner import TargetCentres
from tribrach.project import Project
from tribrach.simulate.surveying import observe
from tribrach.solution import AdjustmentSettings, Solving


def world(shared_data: Path, case: str = "k_3") -> Network:
    """Five stations whose ranges are 1 mm + 30 ppm long, control with 2 mm."""
    path = shared_data / "faults" / "worlds" / "08-zero-error-unnamed" / case / "p.toml"
    job = open_job(Project.load(path))
    return job.network_of(job.surveyed(None))


def longer(network: Network, zero: float, scale: float = 0.0) -> Network:
    """The network with longer ranges."""
    tables = []
    for o in network.observations:
        if isinstance(o, TargetCentres):
            far = np.linalg.norm(o.values, axis=1, keepdims=True)
            o = replace(o, values=o.values * (1 + scale + zero / far))
        tables.append(o)
    return replace(network, observations=tuple(tables))


@pytest.mark.parametrize("case", ["k_3", "k_6"])
def test_a_scanner_that_reads_long_is_named(shared_data: Path, case: str) -> None:
    solving = Solving(world(shared_data, case), AdjustmentSettings(snoop=True))
    found = solving.accused
    assert isinstance(found, SystematicErrors)
    (zero,) = found.errors
    assert zero.name == "x10"
    # 30 ppm of some 30 m go with the zero
    assert -0.0025 < zero.value < -0.0006
    keys = [w.key for w in solving.solved.warnings]
    assert keys.count("systematic_error") == 1
    assert not {"wrong_list", "wrong_coordinate", "mistake"} & set(keys)


def test_errors_are_named_with_their_size_and_clean_scanners_are_not(shared_data: Path) -> None:
    first = adjust(world(shared_data))
    clean = wrong = 0
    for seed in range(30):
        drawn = observe(first.network, first.state, np.random.default_rng(seed))
        clean += systematic_errors(adjust(drawn)) is not None
        found = systematic_errors(adjust(longer(drawn, -0.0012)))
        assert found is not None
        (zero,) = found.errors
        assert zero.name == "x10"
        wrong += abs(zero.value - 0.0012) > 2 * zero.sigma
    assert clean <= 1
    assert wrong <= 5


def test_one_blunder_is_no_systematic_error(shared_data: Path) -> None:
    first = adjust(world(shared_data))
    for seed in range(10):
        drawn = observe(first.network, first.state, np.random.default_rng(seed))
        tables = list(drawn.observations)
        k = next(k for k, o in enumerate(tables) if isinstance(o, TargetCentres))
        values = tables[k].values.copy()
        values[seed] *= 1 + 0.02 / np.linalg.norm(values[seed])
        tables[k] = replace(tables[k], values=values)
        assert systematic_errors(adjust(replace(drawn, observations=tuple(tables)))) is None
