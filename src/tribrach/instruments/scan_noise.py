"""Noise of one scanned point as a function of its range, the beam and the surface it hit.

This is ``C_int`` of method sections 5.1 and 5.2. It has three parts: the range, ``s_0 + s_ppm
rho``, divided by a power of the cosine of the incidence where that is known, or a law of light
(:class:`~tribrach.instruments.range_law.RangeLaw`), which both act through; the angles of the
encoders, in noise and in a systematic part that neighbouring points share; and the place of the
echo within the beam's footprint, ``delta / 4`` in both directions across the beam, with the beam's
diameter ``d(rho)`` (:class:`~tribrach.instruments.beam.Beam`) and ``delta = d / rho`` (Lichti and
Gordon 2004). Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.neighbours import SharedNoise
from tribrach.instruments.range_law import RangeLaw
from tribrach.sentences import Sentence, joined
from tribrach.units import SEC


@dataclass(frozen=True)
class ScanNoise:
    """Standard deviations of single points of a scanner."""

    #: of ranges [m] and [m/m], added linearly
    range: float
    range_scale: float
    #: noise of encoder readings [rad], new with every point
    horizontal: float
    vertical: float
    beam_exit: float = 0.0  #: diameter of the beam where it leaves the scanner [m]
    #: full angle of the beam [rad]; with both at zero the footprint is left out
    beam_divergence: float = 0.0
    #: what both angles are wrong by for a whole neighbourhood [rad]: part of a point's standard
    #: deviation, which no mean of points makes smaller
    systematic: float = 0.0
    #: true if the beam is a cone from its exit on, else it has its waist there
    beam_cone: bool = False
    #: of the noise of ranges with the intensity, which takes the place of range, range_scale and
    #: incidence where an intensity is known; None if there is none
    law: RangeLaw | None = None
    #: what neighbouring points share of the variance of their ranges, None if nobody says, and the
    #: angle [rad] over which they do, zero for the beam's own width (method section 5.7)
    shared_share: float | None = None
    shared_angle: float = 0.0
    #: power of the cosine of the incidence that the noise of ranges is divided by
    incidence: float = 1.0

    def __post_init__(self) -> None:
        """Refuse values that are not standard deviations or diameters."""
        for item in fields(self):
            figure = getattr(self, item.name)
            if item.name == "law" or figure is None:
                continue
            if not 0 <= figure < np.inf:
                raise InputError(
                    f"the noise of scanned points has {item.name} = {figure:g}",
                    cure="give zero or a positive number of metres or radians",
                )
        if self.shared_share is not None:
            SharedNoise(self.shared_share, self.shared_angle, self.beam)

    @property
    def beam(self) -> Beam:
        """The beam by itself."""
        return Beam(self.beam_exit, self.beam_divergence, self.beam_cone)

    def beam_diameter(self, length: Array) -> Array:
        """Diameter (n,) [m] of the beam at ranges (n,) [m]."""
        return self.beam.diameter(length)

    def beam_angle(self, length: Array) -> Array:
        """Standard deviation (n,) [rad] of the echo's place within the footprint, ``delta / 4``."""
        angle: Array = self.beam_diameter(length) / length / 4
        return angle

    @property
    def shared(self) -> SharedNoise:
        """What neighbouring points share at most: all where beams overlap unless a share is known.

        Sheets give the noise of single points and nothing of their neighbours. For the sigma of a
        mean, all is the cautious end.
        """
        share = 1.0 if self.shared_share is None else self.shared_share
        return SharedNoise(share, self.shared_angle, self.beam)

    @property
    def estimated_shared(self) -> SharedNoise | None:
        """The same where it is known, else None: fits that judge by their own residuals do then."""
        return None if self.shared_share is None else self.shared

    @property
    def random(self) -> ScanNoise:
        """The noise that is new with every point, without the systematic part of the angles."""
        return replace(self, systematic=0.0)

    def range_sigma(
        self, length: Array, cosine: Array | float = 1.0, intensity: Array | None = None
    ) -> Array:
        """Standard deviations (n,) [m] of ranges (method section 5.2).

        ``length`` (n,): ranges [m]; ``cosine`` (n,): of the incidence angle on the surface;
        ``intensity`` (n,): intensities as in the file, NaN where unknown. With a law of the noise
        it is that which they give, whatever range and incidence.
        """
        stated: Array = (self.range + self.range_scale * length) / cosine**self.incidence
        if self.law is None or intensity is None:
            return stated
        lawful = self.law.sigma(intensity)
        return np.where(np.isnan(lawful), stated, lawful)

    def lawful_sigma(self, intensity: Array | None) -> Array:
        """Give the law's sigmas to a compiled loop.

        ``intensity`` (n,): intensities as in the file, NaN where unknown. Returns (n,): standard
        deviations of ranges [m], -1 where the law says nothing; empty if it says nothing at all.
        """
        if self.law is None or intensity is None:
            return np.empty(0)
        sigma = self.law.sigma(intensity)
        return np.where(np.isnan(sigma), -1.0, sigma)

    @property
    def least_range(self) -> float:
        """The smallest standard deviation of a range that can occur [m]."""
        return self.range if self.law is None else min(self.range, self.law.limits[0])

    @property
    def words(self) -> str:
        """The figures in words, for facts and reports."""
        angles = joined(
            " and ", (Sentence('{a:g3}"', a=a / SEC) for a in (self.horizontal, self.vertical))
        )
        plain = Sentence("ranges {own.range:mmg3} + {own.range_scale:ppmg3}", own=self)
        if self.incidence != 1:
            plain += Sentence(" over cos^{own.incidence:g2} of the incidence", own=self)
        parts = [
            plain
            if self.law is None
            else Sentence("{own.law.words} (without intensity {plain})", own=self, plain=plain),
            Sentence("angles {angles}", angles=angles),
        ]
        if self.systematic:
            parts.append(Sentence('systematic {systematic:g3}"', systematic=self.systematic / SEC))
        if self.beam_exit or self.beam_divergence:
            parts.append(
                Sentence(
                    "beam {own.beam_exit:mmg3} and {beam_divergence:g3} mrad",
                    own=self,
                    beam_divergence=1000.0 * self.beam_divergence,
                )
                + (" as a cone" if self.beam_cone else "")
            )
        if self.shared_share is not None:
            parts.append(
                Sentence(
                    "neighbours share {own.shared_share:g2} of the variance of ranges", own=self
                )
                + (
                    Sentence(
                        " over {shared_angle:g3} mrad", shared_angle=1000.0 * self.shared_angle
                    )
                    if self.shared_angle
                    else ""
                )
            )
        return "noise of the scanner: " + joined(", ", parts)

    @property
    def parameters(self) -> Array:
        """The eight numbers (8,) of the sheet in the order of the fields, for compiled loops."""
        return np.array(
            [
                self.range,
                self.range_scale,
                self.horizontal,
                self.vertical,
                self.beam_exit,
                self.beam_divergence,
                self.systematic,
                float(self.beam_cone),
            ]
        )
