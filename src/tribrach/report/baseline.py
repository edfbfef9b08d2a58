"""A baseline in words and as the JSON of the command ``baseline``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach.gnss.attempts import comparison
from tribrach.gnss.orbits import calendar
from tribrach.gnss.pieces import UNSEEN, PieceScatter
from tribrach.units import percent

if TYPE_CHECKING:
    from tribrach.gnss.baseline import Baseline

__all__ = ["baseline_facts", "baseline_headline", "baseline_lines"]


def baseline_facts(baseline: Baseline) -> dict[str, Any]:
    """Everything of a baseline in metres, ready for JSON."""
    return {
        "rover_ecef": baseline.rover.tolist(),
        "base_ecef": baseline.base.tolist(),
        "baseline": baseline.vector.tolist(),
        "covariance": baseline.covariance.tolist(),
        "covariance_formal": baseline.formal.tolist(),
        "sigma_factor": baseline.factor,
        "sigma_factor_source": baseline.factor_source,
        "ambiguities": baseline.ambiguities,
        "fixed_share": baseline.fixed_share,
        "epochs": baseline.epochs,
        "epochs_common": baseline.epochs_common,
        "ratio_median": baseline.ratio,
        "satellites_mean": baseline.satellites,
        "start": calendar(baseline.start),
        "end": calendar(baseline.end),
        "interval_s": baseline.interval,
        "systems": baseline.systems,
        "phase_residual_rms": baseline.residual,
        "engine": baseline.engine,
        "files": list(baseline.files),
        "precise_orbits": list(baseline.orbits),
        "antenna_heights": list(baseline.heights),
        "frequencies": baseline.frequencies,
        "choice": baseline.choice,
        "attempts": [
            {
                "what": a.what,
                "frequencies": a.frequencies,
                "ambiguities": a.ambiguities,
                "fixed_share": a.fixed_share,
                "ratio_median": a.ratio,
                "sigma": a.sigma,
                "from_first": a.away,
                "pieces": a.pieces,
                "pieces_scatter": a.scatter,
                "taken": a.taken,
            }
            for a in baseline.attempts
        ],
        "systems_idle": list(baseline.idle),
        "phase_noise": None
        if baseline.noise is None
        else {
            "scale": baseline.noise.scale,
            "independent_after_s": baseline.noise.duration,
        },
        "pieces": None if baseline.pieces is None else _piece_facts(baseline.pieces),
        "warnings": list(baseline.warnings),
    }


def _piece_facts(pieces: PieceScatter) -> dict[str, Any]:
    return {
        "cut": pieces.cut,
        "solved": pieces.pieces,
        "sigma": pieces.sigma.tolist(),
        "stated": pieces.stated.tolist(),
        "statistic": pieces.statistic,
        "dof": pieces.dof,
        "limit": pieces.limit,
        "ratio": pieces.ratio,
        "widened": pieces.factor,
    }


def baseline_headline(baseline: Baseline) -> str:
    """Length, state of the ambiguities with its figures, and sigma of the whole vector.

    Parameters
    ----------
    baseline
        Its sigma is the root of the sum of the three variances; where coarse orbits do more to the
        baseline than that, they are named beside it.
    """
    sigma = float(np.sqrt(np.trace(baseline.covariance)))
    orbits = ""
    if baseline.orbit_effect > sigma:
        effect = 1e3 * baseline.orbit_effect
        orbits = f" without the orbits ({effect:.1f} mm by the accuracy that they state)"
    return (
        f"{baseline.names[0]} to {baseline.names[1]}: {baseline.length:.4f} m, "
        f"{baseline.ambiguities} ambiguities, {percent(baseline.fixed_share)} of "
        f"{baseline.epochs} epochs fixed, ratio {baseline.ratio:.1f}, "
        f"sigma {1e3 * sigma:.1f} mm{orbits}"
    )


def baseline_lines(baseline: Baseline) -> list[str]:
    """The same for people."""
    sigma = 1e3 * np.sqrt(np.diag(baseline.covariance))
    x, y, z = baseline.rover
    dx, dy, dz = baseline.vector
    residual = (
        ""
        if baseline.residual is None
        else f", phases {1e3 * baseline.residual:.1f} mm (root mean square)"
    )
    words = [
        baseline_headline(baseline),
        f"session: {calendar(baseline.start)} to {calendar(baseline.end)}, "
        f"{baseline.epochs} of {baseline.epochs_common} common epochs solved, "
        f"{baseline.satellites:.1f} satellites ({baseline.systems}){residual}",
        f"antennas: {baseline.heights[0]:.4f} m over the base, "
        f"{baseline.heights[1]:.4f} m over the rover",
        f"baseline X, Y, Z: {dx:.4f} {dy:.4f} {dz:.4f} m, geocentric",
        f"rover X, Y, Z: {x:.4f} {y:.4f} {z:.4f} m (frame and epoch of the base coordinates)",
        f"sigma X, Y, Z: {sigma[0]:.1f} {sigma[1]:.1f} {sigma[2]:.1f} mm of the baseline, "
        f"formal times {baseline.factor:.2f} ({baseline.factor_source})"
        + ("" if baseline.ambiguities == "fixed" else ", and the scatter of the last third"),
    ]
    if baseline.noise is not None:
        words.append(f"noise: {baseline.noise.sentence()}")
    if baseline.pieces is not None:
        words.append(f"check: {baseline.pieces.sentence()}; {UNSEEN}")
    if baseline.idle:
        words.insert(2, f"systems without part: {'; '.join(baseline.idle)}")
    if baseline.orbits:
        words.insert(2, f"orbits: precise ones of {', '.join(baseline.orbits)}")
    if baseline.choice:
        words.append(f"choice: {baseline.choice}")
        words += [f"    {line}" for line in comparison(baseline.attempts)]
    return [*words, *(f"warning: {text}" for text in baseline.warnings)]
