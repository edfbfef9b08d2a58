"""GNSS baselines."""

from __future__ import annotations

from pydantic import Field

from tribrach.report.schema.base import Document, DocumentPart, Finite, Matrix

__all__ = ["SCHEMA", "BaselineDocument", "SessionBaselinePart"]

SCHEMA = 1


class AttemptPart(DocumentPart):
    """One way of computing a doubtful baseline, lengths in metres."""

    what: str
    frequencies: int
    ambiguities: str
    fixed_share: float
    ratio_median: Finite
    sigma: float
    from_first: float
    pieces: int
    pieces_scatter: Finite
    taken: bool


class PhaseNoisePart(DocumentPart):
    """Noise of phases: against what the engine assumes, and after how long it is a new one [s]."""

    scale: float
    independent_after_s: float


class PiecesPart(DocumentPart):
    """Pieces of a session: standard deviations of one in X, Y, Z [m], found and stated; their test.

    ``ratio`` is the scatter over what is stated, ``widened`` what sigmas were multiplied with.
    """

    cut: int
    solved: int
    sigma: list[float]
    stated: list[float]
    statistic: float
    dof: int
    limit: float
    ratio: float
    widened: float


class BaselineFigures(DocumentPart):
    """A baseline [m], geocentric."""

    rover_ecef: list[float]
    base_ecef: list[float]
    baseline: list[float]
    covariance: Matrix
    covariance_formal: Matrix
    sigma_factor: float
    sigma_factor_source: str
    ambiguities: str
    fixed_share: float
    epochs: int
    epochs_common: int
    ratio_median: Finite
    satellites_mean: Finite
    start: str
    end: str
    interval_s: Finite
    systems: str
    phase_residual_rms: Finite
    engine: str
    files: list[str]
    precise_orbits: list[str]
    antenna_heights: list[float]
    frequencies: int
    choice: str
    attempts: list[AttemptPart]
    systems_idle: list[str]
    phase_noise: PhaseNoisePart | None
    pieces: PiecesPart | None
    warnings: list[str]


class SessionBaselinePart(BaselineFigures):
    """A baseline of a session."""

    from_: str = Field(alias="from")
    to: str
    session: str


class BaselineDocument(BaselineFigures, Document):
    """What ``tribrach baseline --json`` writes."""
