"""A static baseline from the RINEX files of two receivers.

Files are checked first, so that a user reads in a sentence what cannot work; then the engine runs,
and its solution becomes a vector from mark to mark with a covariance that is scaled as
:mod:`~tribrach.instruments.gnss_solutions` describes. What makes a baseline doubtful (its base, its
files, its ambiguities, its length) becomes a warning. ECEF in the frame of the base coordinates and
the broadcast orbits, metres. Method section 2.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tribrach._types import Array, Progress
from tribrach.answers import Matrix, Number, Result, Vector
from tribrach.errors import InputError
from tribrach.gnss.antennas import AntennaSetup, BaselineAntennas
from tribrach.gnss.attempts import FREQUENCIES, Attempt, choose, reason
from tribrach.gnss.engine import EngineName, run_engine, staged
from tribrach.gnss.orbits import (
    Calendar,
    check_precise,
    check_together,
    idle_systems,
    usable_systems,
)
from tribrach.gnss.outcome import (
    GIVEN,
    RunOutcome,
    outcome_of,
    outcome_standing,
    standing_place,
    stated_factor,
)
from tribrach.gnss.phase_noise import PhaseNoise
from tribrach.gnss.pieces import PieceScatter, piece_scatter, piece_spans
from tribrach.gnss.session_part import SessionPart
from tribrach.instruments.final_solution import (
    FEWEST_CHECKED,
    RARELY,
    FinalSolution,
)
from tribrach.io.gnss.antex_file import read_antex
from tribrach.io.gnss.l2_phases import SHIFT, aligned_l2
from tribrach.io.gnss.observation_file import RinexObservations, read_observations
from tribrach.io.gnss.orbit_files import Orbits, read_orbits
from tribrach.io.gnss.precise_file import sp3_text
from tribrach.io.gnss.solution_file import (
    SatelliteUse,
    Solution,
    read_solution,
    read_status,
)
from tribrach.scratch import scratch_folder
from tribrach.sentences import Sentence
from tribrach.units import percent

#: double differences of phases at 45 degrees have this standard deviation by the weights of the
#: engine [m]: twice the root of 3 mm squared and (3 mm / sin 45 degrees) squared
NOISY = 0.0104
#: receivers know their place better than this [m]
ASTRAY = 100.0
#: satellites are at least this far away [m]
NEAREST = 2.0e7
#: beyond this length the covariance is too small [m]
LONG = 20_000.0
#: bits of RTKLIB's satellite systems
_SYSTEM_BITS = {"G": 1, "S": 2, "R": 4, "E": 8, "J": 16, "C": 32, "I": 64}


def doubts_of_place(base: RinexObservations, reference: Array) -> list[str]:
    """A sentence if the base, at ``reference`` (3,) ECEF [m], is far from its receiver's belief."""
    away = float(np.linalg.norm(reference - base.approximate))
    # no position in the header is not a number, and never too far
    if not away > ASTRAY:
        return []
    return [
        Sentence(
            "the coordinates of the base are {away:0} m from the position in the header of "
            "{base.path.name}: are they right, or are base and rover exchanged? The "
            "baseline would be off by some {away2:0} ppm",
            away=away,
            base=base,
            away2=1000000.0 * away / 6400000.0,
        )
    ]


def effect_of_orbits(orbits: Orbits, used: Sequence[str], length: float) -> float:
    """Change of a baseline of ``length`` [m] by orbits' accuracy, of satellites used; else 0."""
    if not set(orbits.coarse) & set(used) or orbits.precise is not None:
        return 0.0
    return orbits.accuracy * length / NEAREST


def doubts_of_orbits(orbits: Orbits, used: Sequence[str], length: float) -> list[str]:
    """A sentence if broadcast orbits of satellites that were used are not known well."""
    coarse = sorted(set(orbits.coarse) & set(used))
    effect = effect_of_orbits(orbits, used, length)
    if effect == 0.0:
        return []
    return [
        Sentence(
            "the broadcast orbits of {coarse} Galileo satellites ({names}) state an "
            "accuracy of {orbits.accuracy:mg}: errors of this size change {length:m0} by "
            "{effect:mm1}",
            coarse=len(coarse),
            names=", ".join(coarse),
            orbits=orbits,
            length=length,
            effect=effect,
        )
    ]


def doubts_of_files(*files: RinexObservations) -> list[str]:
    """A sentence for each file whose epochs had to be counted anew."""
    return [
        f"{file.path.name}: {file.recounted} of {len(file.times)} epochs promise more satellites "
        "than they list; they were counted anew"
        for file in files
        if file.recounted
    ]


def doubts_of_fixes(name: str, final: FinalSolution) -> list[str]:
    """Sentences on ambiguities that are float, rarely fixed, or checked by too few epochs."""
    if not final.fixed:
        return [
            Sentence(
                "{name}: the baseline is a float solution: {final.reason}; its sigma is that "
                "of real ambiguities and of the scatter of the epochs at the end",
                name=name,
                final=final,
            )
        ]
    out: list[str] = []
    if final.share < RARELY:
        out.append(
            Sentence(
                "{name}: only {final.share:%} of the epochs are fixed, fewer than {rarely:%}; "
                "the integers are found late in the session",
                name=name,
                final=final,
                rarely=RARELY,
            )
        )
    if final.epochs_end < FEWEST_CHECKED:
        out.append(
            f"{name}: the end of the session has {_epochs(final.epochs_end)}, and fewer than "
            f"{FEWEST_CHECKED} do not check each other's integers"
        )
    return out


def doubts_of_phases(name: str, residual: float | None) -> list[str]:
    """A sentence where phases' RMS ``residual`` [m], if known, exceeds the engine's weights."""
    if residual is None or residual <= NOISY:
        return []
    return [
        Sentence(
            "{name}: phases scatter by {residual:mm1} (root mean square), more than the "
            "{NOISY:mm1} that their weights let expect: multipath, the ionosphere, wrong "
            "integers or mixed signals",
            name=name,
            residual=residual,
            NOISY=NOISY,
        )
    ]


def _epochs(n: int) -> str:
    return "one epoch" if n == 1 else f"{n} epochs"


def doubts_of_length(name: str, length: float, *, precise: bool, satellites: bool) -> list[str]:
    """What a baseline of a long ``length`` [m] suffers from and the covariance leaves out."""
    if length <= LONG:
        return []
    causes = ["ionosphere", "troposphere"]
    if not precise:
        causes.insert(0, "broadcast orbits")
    elif not satellites:
        causes.insert(0, "phase centres of satellites, which an ANTEX file would give")
    return [
        Sentence(
            "{name}: over {length:0} km errors of {causes} and {causes2} add up, which the "
            "covariance leaves out",
            name=name,
            length=length / 1000,
            causes=", ".join(causes[:-1]),
            causes2=causes[-1],
        )
    ]


@dataclass(frozen=True)
class Processing:
    """Settings of the processing of baselines."""

    mask: float = 15.0  #: elevation mask [deg]
    frequencies: int = 2  #: 1, 2 or 3
    #: letters of satellite systems; those that the files have in common are used
    systems: str = "GEJC"
    #: model troposphere and ionosphere; False for simulated data, or receivers side by side
    atmosphere: bool = True
    ratio: float = 3.0  #: threshold of the ambiguity test
    factor: float | None = None  #: on formal standard deviations, None for the default
    antex: Path | None = None  #: file of antenna phase centres
    engine: EngineName = "auto"  #: ``auto``, ``pyrtklib`` or ``rnx2rtkp``
    seconds: float = 600.0  #: time limit of the engine
    #: compute a doubtful baseline in other ways too, and take the best (method section 2.7)
    alternatives: bool = True
    pieces: bool = True  #: check sigma by computing pieces of the session
    #: sigmas of each axis in plan and of the height that stay alike within a session [m], None for
    #: the usual ones
    session: tuple[float, float] | None = None

    def part(self, length: float) -> SessionPart | None:
        """Errors common to a session for a length [m]; None without air or with a factor."""
        if self.session is not None:
            return SessionPart(*self.session, "given")
        if self.factor is not None or not self.atmosphere:
            return None
        return SessionPart.usual(length)


@dataclass(frozen=True)
class Baseline(
    Result,
    also=("vector",),
    without=("names", "orbit_effect"),
    keys={
        "base": "base_ecef",
        "rover": "rover_ecef",
        "vector": "baseline",
        "formal": "covariance_formal",
        "factor": "sigma_factor",
        "factor_source": "sigma_factor_source",
        "ratio": "ratio_median",
        "satellites": "satellites_mean",
        "interval": "interval_s",
        "residual": "phase_residual_rms",
        "orbits": "precise_orbits",
        "heights": "antenna_heights",
        "idle": "systems_idle",
        "noise": "phase_noise",
    },
):
    """A GNSS vector from mark to mark with its covariance, geocentric [m]."""

    #: coordinates of the marks
    base: Vector
    rover: Vector
    #: of the vector: the formal one times the factor squared, the engine's last decimal where it is
    #: left, for a float solution the scatter of the epochs at the end of the session, and the part
    #: that stays alike within the session
    covariance: Matrix
    #: with independent epochs: of the least squares of fixed phases, else that which the engine
    #: states
    formal: Matrix
    #: the factor, and where it comes from
    factor: float
    factor_source: str
    #: of the solution at the end of the session (method section 2.7)
    ambiguities: Literal["fixed", "float"]
    fixed_share: float  #: of the solved epochs
    #: with a solution, and those that both files have
    epochs: int
    epochs_common: int
    ratio: Number  #: of the ambiguity test, median over the end of the session
    satellites: Number  #: mean over the solved epochs
    #: first and last epoch [s] since 1980-01-06
    start: Calendar
    end: Calendar
    interval: Number  #: time between epochs [s]
    systems: str  #: letters of the systems that were used
    engine: str  #: which one computed it
    #: root mean square of the phases' double differences, null if the engine does not give it
    residual: float | None = None
    #: of the marks and of the observations, base first
    names: tuple[str, str] = ("", "")
    files: tuple[str, str] = ("", "")
    orbits: tuple[str, ...] = ()  #: files of precise orbits; empty if broadcast orbits were used
    heights: tuple[float, float] = (0.0, 0.0)  #: of the antennas over the marks, base first
    #: systems in the observations that took no part, each with the reason
    idle: tuple[str, ...] = ()
    noise: PhaseNoise | None = None  #: of the phases, null if the factor does not come from them
    #: scatter of the pieces of the session, null where it was not split
    pieces: PieceScatter | None = None
    warnings: tuple[str, ...] = field(default=())  #: sentences
    frequencies: int = 2  #: how many were used
    #: the ways that were tried, where the first one was doubtful; else none
    attempts: tuple[Attempt, ...] = ()
    choice: str = ""  #: why one of them was taken
    #: what the accuracy that coarse broadcast orbits state changes the baseline by; it is not in
    #: the covariance
    orbit_effect: float = 0.0
    #: what stays alike within the session, null where a factor is given or air is left out
    session_part: SessionPart | None = None

    @property
    def vector(self) -> Vector:
        """Rover minus base (3,) [m]."""
        return self.rover - self.base

    @property
    def sigma(self) -> float:
        """Sigma of the whole vector: root of the sum of the three variances [m]."""
        return float(np.sqrt(np.trace(self.covariance)))

    @property
    def own(self) -> Matrix:
        """Covariance (3, 3) [m^2] without what stays alike within the session."""
        return self.covariance - (
            0.0 if self.session_part is None else self.session_part.covariance(self.base)
        )

    def with_session(self, part: SessionPart | None) -> Baseline:
        """The same with another part that stays alike within the session."""
        more = 0.0 if part is None else part.covariance(self.base)
        return replace(self, covariance=self.own + more, session_part=part)

    @property
    def headline(self) -> Sentence:
        """Length, state of the ambiguities with its figures, and sigma of the whole vector.

        Where coarse orbits do more to the baseline than that, they are named beside it.
        """
        orbits = " without the orbits ({b.orbit_effect:mm1} by the accuracy that they state)"
        return Sentence(
            "{b.names[0]} to {b.names[1]}: {b.length:m4}, {b.ambiguities} ambiguities, {share} of "
            "{b.epochs} epochs fixed, ratio {b.ratio:1}, sigma {b.sigma:mm1}"
            + (orbits if self.orbit_effect > self.sigma else ""),
            b=self,
            share=percent(self.fixed_share),
        )

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
    """The baseline from base, ECEF mark ``base_xyz`` (3,) [m], to rover; files tell antennas."""
    settings = processing or Processing()
    reference = np.asarray(base_xyz, dtype=float)
    if reference.shape != (3,) or not 6e6 < np.linalg.norm(reference) < 7e6:
        raise InputError(
            "the coordinates of the base are not on the Earth",
            cure="give geocentric X, Y, Z in metres",
        )
    progress("reading RINEX", 0, 2 + len(navigation))
    first, second = read_observations(base), read_observations(rover)
    orbits = read_orbits(navigation).for_engine()
    progress("reading RINEX", 2 + len(navigation), 2 + len(navigation))
    check_together(first, second, orbits.broadcast)
    if first.body == second.body:
        raise InputError(
            f"these are the observations of the base, {base.name}, once more",
            file=rover,
            cure="give those of the other receiver",
        )
    systems = usable_systems(first, second, orbits.broadcast, settings.systems)
    if orbits.precise is not None:
        check_precise(orbits.precise, first, second)
    setups = BaselineAntennas(
        base_antenna or AntennaSetup.of(first),
        rover_antenna or AntennaSetup.of(second),
        None if settings.antex is None else read_antex(settings.antex),
    )
    progress("computing baseline", 0, 1)
    found = _computed(first, second, orbits, setups, settings, reference, systems, progress)
    if settings.alternatives and _doubtful(found):
        ways = _other_ways(first, second, settings)
        progress("computing baseline", 1, 1 + len(ways))
        others = []
        for what, cures, one, two, wish in ways:
            try:
                other = _computed(one, two, orbits, setups, wish, reference, systems, progress)
            except InputError:
                # this way has no solution
                continue
            others.append((what, cures, other))
            progress("computing baseline", 1 + len(others), 1 + len(ways))
        found = _taken(found, others)
    progress("computing baseline", 1, 1)
    return found.with_session(settings.part(found.length))


def _doubtful(baseline: Baseline) -> bool:
    """True if other ways of computing a baseline are worth a trial."""
    noisy = baseline.residual is not None and baseline.residual > NOISY
    return baseline.ambiguities != "fixed" or baseline.fixed_share < RARELY or noisy


def _other_ways(
    first: RinexObservations, second: RinexObservations, settings: Processing
) -> list[tuple[str, str, RinexObservations, RinexObservations, Processing]]:
    """Other ways in words, what they cure, their files and settings; none with one frequency."""
    if settings.frequencies < 2:
        return []
    ways = []
    one, two = aligned_l2(first), aligned_l2(second)
    names = [new.path.name for old, new in ((first, one), (second, two)) if new is not old]
    if names:
        mixed = " and ".join(names)
        what = f"{FREQUENCIES[settings.frequencies]} with L2C moved by {SHIFT} cycles in {mixed}"
        ways.append((what, f"phases of L2C and P(Y) are mixed in {mixed}", one, two, settings))
    ways.append((FREQUENCIES[1], "", first, second, replace(settings, frequencies=1)))
    return ways


def _taken(asked: Baseline, others: Sequence[tuple[str, str, Baseline]]) -> Baseline:
    """The best of several ways, each with its words and what it cures; the comparison of all."""
    if not others:
        return asked
    every = [(FREQUENCIES[asked.frequencies], "", asked), *others]
    attempts = [
        Attempt(
            what=what,
            frequencies=b.frequencies,
            ambiguities=b.ambiguities,
            fixed_share=b.fixed_share,
            ratio=b.ratio,
            sigma=float(np.sqrt(np.trace(b.covariance))),
            away=float(np.linalg.norm(b.rover - asked.rover)),
            scatter=None if b.pieces is None else b.pieces.scatter,
            pieces=0 if b.pieces is None else b.pieces.pieces,
            cures=cures,
        )
        for what, cures, b in every
    ]
    best = choose(attempts)
    attempts[best] = replace(attempts[best], taken=True)
    return replace(every[best][2], attempts=tuple(attempts), choice=reason(attempts, best))


def _computed(
    first: RinexObservations,
    second: RinexObservations,
    orbits: Orbits,
    setups: BaselineAntennas,
    settings: Processing,
    reference: Array,
    systems: str,
    progress: Progress,
) -> Baseline:
    """The baseline computed in one way, checked by pieces of its session."""
    options = _options(settings, reference, systems) | {"pos2-maxage": _tolerance(first, second)}
    options["pos1-sateph"] = 0 if orbits.precise is None else 1
    times = _common(first, second)
    spans = piece_spans(times) if settings.pieces else []
    solve = partial(_solved, first, second, orbits, setups, settings, options)
    solution, used, engine = solve()
    interval = max(first.interval, second.interval)
    outcome = partial(outcome_of, base=reference, air=settings.atmosphere)
    whole = outcome(solution, used)
    if whole is None:
        raise _no_baseline(first, second, reference)
    noise = whole.noise(interval, air=settings.atmosphere)
    stands = whole.noticed(stated_factor(noise, interval, whole.epochs)[0])
    standing = partial(outcome_standing, base=reference, air=settings.atmosphere)
    if stands:
        whole = standing(whole, *solve(None, standing_place(whole))[:2])
        noise = whole.noise(interval, air=settings.atmosphere)
    pieces: list[tuple[RunOutcome, int]] = []
    for k, (start, end) in enumerate(spans):
        progress("pieces of the session", k, len(spans))
        piece = outcome(*solve((start, end))[:2], weights=whole.weights)
        if piece is not None and stands:
            again = solve((start, end), standing_place(piece))[:2]
            piece = standing(piece, *again, weights=whole.weights)
        if piece is not None:
            pieces.append((piece, int(((times > start) & (times < end)).sum())))
    if spans:
        progress("pieces of the session", len(spans), len(spans))
    length = float(np.linalg.norm(whole.place - reference))
    warnings = [
        *doubts_of_place(first, reference),
        *doubts_of_files(first, second),
        *setups.warnings(settings.frequencies),
        *doubts_of_orbits(orbits, whole.satellites_used, length),
    ]
    baseline = _baseline(
        (first, second),
        reference,
        (whole, noise),
        settings,
        (used, systems, engine),
        len(times),
        warnings,
    )
    baseline = checked_by_pieces(baseline, (whole, noise), pieces, len(spans), settings)
    far: list[str] = []
    if settings.atmosphere:
        far = doubts_of_length(
            f"{first.path.name} to {second.path.name}",
            baseline.length,
            precise=orbits.precise is not None,
            satellites=setups.has_satellites,
        )
    return replace(
        baseline,
        orbits=orbits.names,
        orbit_effect=effect_of_orbits(orbits, whole.satellites_used, length),
        idle=tuple(
            idle_systems(first, second, orbits.broadcast, settings.systems, whole.satellites_used)
            if whole.satellites_used
            else ()
        ),
        heights=(setups.base.height, setups.rover.height),
        warnings=(*baseline.warnings, *far),
    )


def _solved(
    first: RinexObservations,
    second: RinexObservations,
    orbits: Orbits,
    setups: BaselineAntennas,
    settings: Processing,
    options: dict[str, object],
    span: tuple[float, float] | None = None,
    stand: Array | None = None,
) -> tuple[Solution, SatelliteUse | None, EngineName]:
    """Run the engine in a temporary folder, within ``span`` [s]; ``stand`` (3,) holds the rover."""
    options = options | ({} if stand is None else _standing_options(stand))
    with scratch_folder() as folder:
        options |= setups.options(folder)
        staged(folder, setups.file())
        contents = {"rover.obs": second.text, "base.obs": first.text}
        contents |= {f"orbits{k}.nav": file.text for k, file in enumerate(orbits.broadcast)}
        if orbits.precise is not None:
            options |= setups.satellite_options(folder)
            common = first.satellites & second.satellites
            contents["precise.sp3"] = sp3_text(orbits.precise, common)
        files = staged(folder, contents)
        out, engine = run_engine(
            options, files, folder, engine=settings.engine, seconds=settings.seconds, span=span
        )
        return read_solution(out), read_status(out.with_name(out.name + ".stat")), engine


def _options(settings: Processing, base: Array, systems: str) -> dict[str, object]:
    """Options of RTKLIB as numbers, which all its versions read alike."""
    return {
        "pos1-posmode": 3,  # static
        "pos1-frequency": settings.frequencies,
        "pos1-soltype": 0,  # forward
        "pos1-elmask": settings.mask,
        "pos1-ionoopt": 1 if settings.atmosphere else 0,  # broadcast
        "pos1-tropopt": 1 if settings.atmosphere else 0,  # Saastamoinen
        "pos1-navsys": sum(_SYSTEM_BITS[letter] for letter in systems),
        "pos2-armode": 1,  # continuous
        "pos2-gloarmode": 0,
        "pos2-arthres": settings.ratio,
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


def _standing_options(place: Array) -> dict[str, object]:
    """Options of RTKLIB for a rover whose place (3,) [m] is given.

    Versions have different numbers for this mode, and the same word.
    """
    coordinates = {f"ant1-pos{k}": f"{x:.{GIVEN}f}" for k, x in enumerate(place, start=1)}
    return {"pos1-posmode": "fixed", "ant1-postype": 1, **coordinates}


def _tolerance(first: RinexObservations, second: RinexObservations) -> float:
    """Epochs of two receivers this far apart are the same [s]; others are not combined."""
    shortest = min([f.interval for f in (first, second) if f.interval > 0], default=1.0)
    return min(0.5, 0.45 * shortest)


def _common(first: RinexObservations, second: RinexObservations) -> Array:
    """Times (n,) [s] of the second receiver's epochs that the first has as well."""
    a, b = first.times, second.times
    place = np.clip(np.searchsorted(a, b), 1, max(len(a) - 1, 1))
    near = np.minimum(np.abs(b - a[place - 1]), np.abs(b - a[np.minimum(place, len(a) - 1)]))
    return b[near <= _tolerance(first, second)]


def _no_baseline(
    first: RinexObservations, second: RinexObservations, reference: Array
) -> InputError:
    """The error of a run that found nothing."""
    what = f"no baseline from {first.path.name} to {second.path.name}: "
    if astray := doubts_of_place(first, reference):
        return InputError(
            what + astray[0].split("?")[0], cure="give the coordinates of the base mark"
        )
    return InputError(
        what + "no epoch has phases of enough common satellites",
        cure="lower the elevation mask, or check that both files hold phases and the "
        "navigation file their satellites",
    )


def _baseline(
    files: tuple[RinexObservations, RinexObservations],
    reference: Array,
    outcome: tuple[RunOutcome, PhaseNoise | None],
    settings: Processing,
    run: tuple[SatelliteUse | None, str, EngineName],
    common: int,
    warnings: list[str],
) -> Baseline:
    """The baseline of an outcome, before its pieces are looked at."""
    first, second = files
    used, systems, engine = run
    whole, noise = outcome
    interval = max(first.interval, second.interval)
    if settings.factor is None:
        factor, source = stated_factor(noise, interval, whole.epochs)
        covariance = whole.covariance(factor) + whole.air
    else:
        factor, source = settings.factor, "given"
        covariance = whole.formal * factor**2 + whole.final.scatter
    name = f"{first.path.name} to {second.path.name}"
    warnings += doubts_of_fixes(name, whole.final)
    warnings += doubts_of_phases(name, whole.residual)
    return Baseline(
        base=reference,
        rover=whole.place,
        covariance=covariance,
        formal=whole.formal,
        factor=factor,
        factor_source=source,
        ambiguities="fixed" if whole.final.fixed else "float",
        fixed_share=whole.final.share,
        epochs=whole.epochs,
        epochs_common=common,
        ratio=whole.final.ratio,
        satellites=whole.satellites,
        start=whole.start,
        end=whole.end,
        interval=interval,
        systems=systems if used is None else used.systems,
        residual=whole.residual,
        engine=engine,
        noise=noise if settings.factor is None else None,
        names=(first.marker or first.path.stem, second.marker or second.path.stem),
        files=(first.path.name, second.path.name),
        warnings=tuple(warnings),
        frequencies=settings.frequencies,
    )


def checked_by_pieces(
    baseline: Baseline,
    outcome: tuple[RunOutcome, PhaseNoise | None],
    pieces: Sequence[tuple[RunOutcome, int]],
    cut: int,
    settings: Processing,
) -> Baseline:
    """The baseline with the scatter of its pieces, and with wider sigmas where they disagree.

    ``outcome``: what it is made of, and the noise of its phases; ``pieces``: RunOutcome of each
    piece that has one, and its common epochs; ``settings``: a factor that is given stays as it is.
    """
    whole, noise = outcome
    # a piece that solved half of its epochs, and whose ambiguities are of the same kind
    alike = [
        piece
        for piece, common in pieces
        if 2 * piece.epochs > common and (piece.final.fixed or not whole.final.fixed)
    ]
    blocks = []
    for piece in alike:
        factor = settings.factor
        if factor is None:
            factor, _ = stated_factor(noise, baseline.interval, piece.epochs)
        blocks.append(piece.covariance(factor))
    floating = sum(not piece.final.fixed for piece in alike)
    correlation = None
    if noise is not None and noise.learned and alike and not floating:
        starts = [round((piece.start - whole.start) / baseline.interval) for piece in alike]
        correlation = noise.alike(starts, [piece.epochs for piece in alike])
    places = [piece.place for piece in alike]
    scatter = piece_scatter(places, blocks, cut, floating, correlation)
    if scatter is None:
        return baseline
    if scatter.agree:
        return replace(baseline, pieces=scatter)
    name = f"{baseline.files[0]} to {baseline.files[1]}"
    if settings.factor is not None:
        given = Sentence(
            "the factor {settings.factor:g} that is given is too small by {scatter.ratio:2}",
            settings=settings,
            scatter=scatter,
        )
        words = Sentence(
            "{name}: {scatter}: {given}", name=name, scatter=scatter.figures(), given=given
        )
        return replace(baseline, pieces=scatter, warnings=(*baseline.warnings, words))
    return replace(
        baseline,
        covariance=baseline.covariance * scatter.factor**2,
        factor=baseline.factor * scatter.factor,
        pieces=scatter,
        warnings=(
            *baseline.warnings,
            Sentence("{name}: {scatter}", name=name, scatter=scatter.sentence()),
        ),
    )
