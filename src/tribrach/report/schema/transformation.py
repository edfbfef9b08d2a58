"""Transformations by common points."""

from __future__ import annotations

from pydantic import Field

from tribrach.report.schema.base import Document, DocumentPart, Finite, Matrix

__all__ = ["TransformationDocument"]


class TransformationParameter(DocumentPart):
    """A parameter with its unit."""

    name: str
    unit: str
    value: float
    sigma: Finite


class TransformationSigma0(DocumentPart):
    """Sigma of unit weight; null without redundancy."""

    posterior: Finite
    dof: int
    vtpv: Finite


class ScaleTestPart(DocumentPart):
    """Whether the scale is real."""

    excess: Finite
    sigma: Finite
    t: Finite
    limit: Finite
    needed: bool
    sigma_is: str


class ModelPart(DocumentPart):
    """What a model gains over the one before it."""

    count: int
    words: str
    vtpv: Finite
    rms: Finite
    dof: int
    statistic: Finite
    limit: Finite


class CommonPointPart(DocumentPart):
    """A common point: differences ``b - T(a)`` and residuals [m]."""

    name: str
    use: str
    difference: list[Finite]
    residual_a: list[Finite]
    residual_b: list[Finite]
    redundancy: Finite
    test: Finite
    limit: Finite
    reason: str


class TransformationDocument(Document):
    """What ``tribrach transform fit --json`` writes, and ``transform apply`` reads."""

    kind: str
    model: int
    dimension: int
    words: str
    centre: list[float]
    shift_at_centre: list[float]
    rotation: Matrix
    factors: list[float]
    matrix: Matrix
    shift_at_origin: list[float]
    parameters: list[TransformationParameter]
    covariance: Matrix | None
    covariance_at_origin: Matrix | None
    covariance_is: str
    sigma0: TransformationSigma0
    rms_of_fit: Finite
    check_rmse: list[Finite] | None
    scale_test: ScaleTestPart | None
    models: list[ModelPart]
    points: list[CommonPointPart]
    removed: list[str]
    warnings: list[str]
    from_: str = Field(alias="from")
    to: str
