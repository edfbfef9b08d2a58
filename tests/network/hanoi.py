"""The network of the twin hanoi-facade: its raw files, and targets seen from its four stations."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from tribrach.job.opened import open_job
from tribrach.network.survey import Survey
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.simulate.twin import Twin
from tribrach.simulate.twins import build
from tribrach.units import SEC

#: of a target centre in each coordinate [m], and of a levelled axis
CENTRE, LEVEL = 0.0006, 3 * SEC


def twin(seed: int = 1) -> Twin:
    """The twin; its scans are never simulated here."""
    return build("hanoi-facade", 10_000, seed)


def survey(
    made: Twin,
    folder: Path,
    edit: Callable[[str], str] = lambda text: text,
    moved: Mapping[tuple[str, str], np.ndarray] | None = None,
    seed: int = 0,
) -> Survey:
    """The survey as files and scans give it.

    edit : of the raw file of the total station; moved : errors (3,) [m] of target centres in the
    scanner frame by station and target, or of all stations by ("", target) in the world.
    """
    for name, text in made.files.items():
        (folder / name).write_text(edit(text) if name == "traverse.gsi" else text)
    path = folder / "hanoi.toml"
    path.write_text(made.project.split("[[comparison]]")[0] + '[[scans]]\nfile = "none.laz"\n')
    out = open_job(path).surveyed()
    rng, moved = np.random.default_rng(seed), moved or {}
    targets = {t.name: t.center for t in made.targets}
    for station in made.stations:
        names = made.visible(station.name)
        places = np.array([targets[n] + moved.get(("", n), np.zeros(3)) for n in names])
        seen = station.pose.inverse @ places + CENTRE * rng.normal(size=places.shape)
        seen += np.array([moved.get((station.name, n), np.zeros(3)) for n in names])
        out.station(station.name)
        out.add(
            TargetCentres, values=seen, sigma=np.full(seen.shape, CENTRE),
            station=[station.name] * len(names), target=names, source=[f"scan {station.name}"] *
            len(names),
        )  # fmt: skip
        out.add(Inclinations, values=[[0.0, 0.0]], sigma=LEVEL, station=[station.name])
    return out
