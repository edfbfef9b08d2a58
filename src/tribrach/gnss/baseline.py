"""A static baseline from the RINEX files of two receivers.

Files are checked first, so that what cannot work is said in a sentence; then the engine runs, and
its solution becomes a vector from mark to mark with a covariance that is scaled as
:mod:`~tribrach.instruments.gnss_solutions` says. ECEF in the frame of the base coordinates and the
broadcast orbits, metres. Method section 2.7.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.gnss.antennas import (
    AntennaSetup,
    antenna_options,
    antenna_warnings,
    satellite_options,
)
from tribrach.gnss.engine import EngineName, run_engine
from tribrach.gnss.orbits import Orbits, check_precise, check_together, read_orbits, usable_systems
from tribrach.instruments.gnss_solutions import SOURCE, sigma_factor
from tribrach.io.gnss.navigation_file import NavigationFile
from tribrach.io.gnss.observation_file import RinexObservations, read_observations
from tribrach.io.gnss.precise_file import sp3_text
from tribrach.io.gnss.solution_file import (
    FIXED,
    FLOAT,
    SatelliteUse,
    Solution,
    read_solution,
    read_status,
)

__all__ = ["Baseline", "Processing", "compute_baseline", "doubts_of_length"]

# What makes a baseline doubtful, in sentences: its base, its files, its ambiguities.


#: fixed epochs of the second half of a session agree better than this [m]
DISAGREEING = 0.05


#: receivers know their place better than this [m]
ASTRAY = 100.0


#: beyond this length the covariance is too small [m]
LONG = 20_000.0


def doubts_of_place(base: RinexObservations, reference: Array) -> list[str]:
    """Coordinates of the base that are not where its receiver believed to be."""
    away = float(np.linalg.norm(reference - base.approximate))
    # no position in the header is not a number, and never too far
    if not away > ASTRAY:
        return []
    return [
        f"the coordinates of the base are {away:.0f} m from the position in the header of "
        f"{base.path.name}: are they right, or are base and rover exchanged? The baseline would be "
        f"off by some {1e6 * away / 6.4e6:.0f} ppm"
    ]


def doubts_of_files(*files: RinexObservations) -> list[str]:
    """Epochs that were counted anew."""
    return [
        f"{file.path.name}: {file.recounted} of {len(file.times)} epochs promise more satellites "
        "than they list; they were counted anew"
        for file in files
        if file.recounted
    ]


def doubts_of_fixes(
    name: str, solution: Solution, fixed: NDArray[np.int64], share: float, best: int
) -> list[str]:
    """Sentences on ambiguities that are float, rarely fixed, or fixed in different ways."""
    if not len(fixed):
        return [f"{name}: the ambiguities could not be fixed, the baseline is a float solution"]
    out = []
    if share < 0.5:
        out.append(f"{name}: only {100 * share:.0f} % of the epochs are fixed")
    late = fixed[len(fixed) // 2 :]
    apart = np.linalg.norm(solution.values[late] - solution.values[best], axis=1).max()
    if apart > DISAGREEING:
        out.append(
            f"{name}: fixed epochs differ by {apart:.3f} m, some of them are fixed to wrong "
            "integers: measure longer, or raise the threshold of the ratio"
        )
    return out


def doubts_of_length(name: str, length: float, *, precise: bool, satellites: bool) -> list[str]:
    """What a long baseline [m] suffers from and the covariance leaves out.

    Parameters
    ----------
    precise
        Orbits are precise ones.
    satellites
        With their phase centres.
    """
    if length <= LONG:
        return []
    causes = ["ionosphere", "troposphere"]
    if not precise:
        causes.insert(0, "broadcast orbits")
    elif not satellites:
        causes.insert(0, "phase centres of satellites, which an ANTEX file would give")
    return [
        f"{name}: over {length / 1000:.0f} km errors of {', '.join(causes[:-1])} and {causes[-1]} "
        "add up, which the covariance leaves out"
    ]


#: bits of RTKLIB's satellite systems
_SYSTEM_BITS = {"G": 1, "S": 2, "R": 4, "E": 8, "J": 16, "C": 32, "I": 64}


@dataclass(frozen=True)
class Processing:
    """How baselines are computed.

    Attributes
    ----------
    mask
        Elevation mask [deg].
    frequencies
        1, 2 or 3.
    systems
        Letters, those that files have in common are used; atmosphere False switches troposphere and
        ionosphere models off (simulated data, or receivers side by side).
    ratio
        Threshold of the ambiguity test.
    factor
        On formal sigmas, None for the default.
    antex
        File of antenna phase centres.
    seconds
        Time limit.
    """

    mask: float = 15.0
    frequencies: int = 2
    systems: str = "GEJC"
    atmosphere: bool = True
    ratio: float = 3.0
    factor: float | None = None
    antex: Path | None = None
    engine: EngineName = "auto"
    seconds: float = 600.0


@dataclass(frozen=True)
class Baseline:
    """A baseline from mark to mark.

    Attributes
    ----------
    base, rover
        ECEF (3,) [m] of the marks; covariance (3, 3) [m^2], formal times ``factor`` squared;
        ambiguities of the chosen epoch; epochs with a solution and those both files have;
        fixed_share of the solved epochs; ratio median of them; satellites mean; start, end [s]
        since 1980-01-06, interval [s]; formal (3, 3); systems that were used.
    residual
        Root mean square of the phases' double differences [m], None if the engine does not give it.
    orbits
        Files of precise ones, none if broadcast orbits were used; heights [m] of the antennas over
        the marks.
    """

    base: Array
    rover: Array
    covariance: Array
    formal: Array
    factor: float
    factor_source: str
    ambiguities: Literal["fixed", "float"]
    fixed_share: float
    epochs: int
    epochs_common: int
    ratio: float
    satellites: float
    start: float
    end: float
    interval: float
    systems: str
    engine: str
    residual: float | None = None
    names: tuple[str, str] = ("", "")
    files: tuple[str, str] = ("", "")
    orbits: tuple[str, ...] = ()
    heights: tuple[float, float] = (0.0, 0.0)
    warnings: tuple[str, ...] = field(default=())

    @property
    def vector(self) -> Array:
        """Rover minus base (3,) [m]."""
        return self.rover - self.base

    @property
    def length(self) -> float:
        """Slope length [m]."""
        return float(np.linalg.norm(self.vector))


def compute_baseline(
    base: Path,
    rover: Path,
    navigation: Sequence[Path],
    base_xyz: ArrayLike,
    processing: Processing | None = None,
    *,
    base_antenna: AntennaSetup | None = None,
    rover_antenna: AntennaSetup | None = None,
    progress: Progress = lambda what, done, total: None,
) -> Baseline:
    """The baseline from base to rover.

    Parameters
    ----------
    base_xyz
        ECEF (3,) [m] of the base mark; antennas : None takes height and type of the file.

    Raises
    ------
    InputError
        Files damaged, truncated, empty, of other days, without common satellites, no solution,
        engine missing or too slow.
    """
    wish = processing or Processing()
    reference = np.asarray(base_xyz, dtype=float)
    if reference.shape != (3,) or not 6e6 < np.linalg.norm(reference) < 7e6:
        raise InputError(
            "the coordinates of the base are not on the Earth",
            cure="give geocentric X, Y, Z in metres",
        )
    progress("reading RINEX", 0, 2 + len(navigation))
    first, second = read_observations(base), read_observations(rover)
    orbits = read_orbits(navigation)
    check_together(first, second, orbits.broadcast)
    systems = usable_systems(first, second, orbits.broadcast, wish.systems)
    if orbits.precise is not None:
        check_precise(orbits.precise, first, second)
    setups = (
        base_antenna or AntennaSetup.of(first),
        rover_antenna or AntennaSetup.of(second),
    )
    progress("computing baseline", 0, 1)
    options = _options(wish, reference, systems) | {"pos2-maxage": _tolerance(first, second)}
    options["pos1-sateph"] = 0 if orbits.precise is None else 1
    solution, used, engine = _solved(first, second, orbits, setups, wish, options)
    progress("computing baseline", 1, 1)
    warnings = [
        *doubts_of_place(first, reference),
        *doubts_of_files(first, second),
        *antenna_warnings(*setups, wish.antex),
    ]
    if used is None:
        used = SatelliteUse(tuple(systems), None)
    found = _baseline(first, second, reference, solution, wish, (used, engine), warnings)
    far: list[str] = []
    if wish.atmosphere:
        far = doubts_of_length(
            f"{base.name} to {rover.name}",
            found.length,
            precise=orbits.precise is not None,
            satellites="file-satantfile" in options,
        )
    return replace(
        found,
        orbits=orbits.names,
        heights=(setups[0].height, setups[1].height),
        warnings=(*found.warnings, *far),
    )


def _solved(
    first: RinexObservations,
    second: RinexObservations,
    orbits: Orbits,
    setups: tuple[AntennaSetup, AntennaSetup],
    wish: Processing,
    options: dict[str, object],
) -> tuple[Solution, SatelliteUse | None, EngineName]:
    """A run of the engine in a folder of its own; the options get those of antennas."""
    with tempfile.TemporaryDirectory(prefix="tribrach-") as name:
        folder = Path(name)
        options |= antenna_options(*setups, wish.antex, folder)
        files = _staged(folder, [second, first, *orbits.broadcast])
        if orbits.precise is not None:
            options |= satellite_options(wish.antex, folder)
            files.append(folder / "precise.sp3")
            common = first.satellites & second.satellites
            files[-1].write_bytes(sp3_text(orbits.precise, common))
        out, engine = run_engine(options, files, folder, engine=wish.engine, seconds=wish.seconds)
        return read_solution(out), read_status(out.with_name(out.name + ".stat")), engine


def _options(wish: Processing, base: Array, systems: str) -> dict[str, object]:
    """Options of RTKLIB as numbers, which all its versions read alike."""
    return {
        "pos1-posmode": 3,  # static
        "pos1-frequency": wish.frequencies,
        "pos1-soltype": 0,  # forward
        "pos1-elmask": wish.mask,
        "pos1-ionoopt": 1 if wish.atmosphere else 0,  # broadcast
        "pos1-tropopt": 1 if wish.atmosphere else 0,  # Saastamoinen
        "pos1-navsys": sum(_SYSTEM_BITS[letter] for letter in systems),
        "pos2-armode": 1,  # continuous
        "pos2-gloarmode": 0,
        "pos2-arthres": wish.ratio,
        "out-solformat": 1,  # x/y/z
        "out-outhead": 1,
        "out-outopt": 1,
        "out-timesys": 0,
        "out-timeform": 0,  # GPS week and seconds
        "out-timendec": 6,
        "out-solstatic": 0,  # every epoch
        "out-outstat": 2,  # residuals beside the solution
        "ant1-postype": 0,
        "ant2-postype": 1,  # x/y/z
        "ant2-pos1": f"{base[0]:.6f}",
        "ant2-pos2": f"{base[1]:.6f}",
        "ant2-pos3": f"{base[2]:.6f}",
    }


def _staged(folder: Path, files: Sequence[RinexObservations | NavigationFile]) -> list[Path]:
    """Plain RINEX of all files in a folder, under names the engine cannot misread."""
    out = []
    for k, file in enumerate(files):
        suffix = "obs" if isinstance(file, RinexObservations) else "nav"
        path = folder / f"file{k}.{suffix}"
        path.write_bytes(file.text)
        out.append(path)
    return out


def _tolerance(first: RinexObservations, second: RinexObservations) -> float:
    """Epochs of two receivers this far apart are the same [s]; others are not combined."""
    shortest = min([f.interval for f in (first, second) if f.interval > 0], default=1.0)
    return min(0.5, 0.45 * shortest)


def _common(first: RinexObservations, second: RinexObservations) -> int:
    """Epochs of the second receiver that the first has as well."""
    a, b = first.times, second.times
    place = np.clip(np.searchsorted(a, b), 1, max(len(a) - 1, 1))
    near = np.minimum(np.abs(b - a[place - 1]), np.abs(b - a[np.minimum(place, len(a) - 1)]))
    return int((near <= _tolerance(first, second)).sum())


def _baseline(
    first: RinexObservations,
    second: RinexObservations,
    reference: Array,
    solution: Solution,
    wish: Processing,
    run: tuple[SatelliteUse, EngineName],
    warnings: list[str],
) -> Baseline:
    """The baseline of a solution: its best determined epoch, fixed where any is."""
    phase = np.flatnonzero(solution.quality <= FLOAT)
    if not len(phase):
        what = f"no baseline from {first.path.name} to {second.path.name}: "
        if astray := doubts_of_place(first, reference):
            raise InputError(
                what + astray[0].split("?")[0], cure="give the coordinates of the base mark"
            )
        raise InputError(
            what + "no epoch has phases of enough common satellites",
            cure="lower the elevation mask, or check that both files hold phases and the "
            "navigation file their satellites",
        )
    fixed = phase[solution.quality[phase] == FIXED]
    chosen = fixed if len(fixed) else phase
    best = int(chosen[np.argmin(np.einsum("nii->n", solution.covariance[chosen]))])
    interval = max(first.interval, second.interval)
    factor, source = wish.factor, "given"
    if factor is None:
        factor, source = sigma_factor(interval, len(phase)), SOURCE
    share = len(fixed) / len(phase)
    warnings += doubts_of_fixes(
        f"{first.path.name} to {second.path.name}", solution, fixed, share, best
    )
    times = solution.times[phase]
    return Baseline(
        base=reference,
        rover=solution.values[best],
        covariance=solution.covariance[best] * factor**2,
        formal=solution.covariance[best],
        factor=factor,
        factor_source=source,
        ambiguities="fixed" if len(fixed) else "float",
        fixed_share=share,
        epochs=len(phase),
        epochs_common=_common(first, second),
        ratio=float(np.median(solution.ratio[phase])),
        satellites=float(solution.satellites[phase].mean()),
        start=float(times[0]),
        end=float(times[-1]),
        interval=interval,
        systems=run[0].systems,
        residual=run[0].residual,
        engine=run[1],
        names=(first.marker or first.path.stem, second.marker or second.path.stem),
        files=(first.path.name, second.path.name),
        warnings=tuple(warnings),
    )
