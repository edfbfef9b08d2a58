"""A panoramic scanner drawn as a mechanism, with one misalignment at a time.

The laser shines along the trunnion axis onto a mirror that turns about that axis and stands at
45 degrees to it; the alidade turns about the standing axis z. The ray is traced exactly to the
target, so that nothing here knows a calibration formula. One free choice of sign per error is
that of the parameter in the calibration model.
"""

import numpy as np


def reading_angles(error: str, size: float, h: float, v: float) -> tuple[float, float]:
    """Angles that the axes really have when the encoders read h and v.

    A disc off its centre by c reads ``atan2(sin a - c_y, cos a - c_x)`` at the angle a, found here
    by fixed-point iteration; a disc drawn out to an ellipse stretches its graduation.
    """
    centre = {"x8x": (-1, 0), "x8y": (0, -1), "x9n": (0, 1), "x9z": (1, 0)}.get(error)
    if centre:
        reading = h if error.startswith("x8") else v
        cx, cy = size * np.array(centre)
        angle = reading
        for _ in range(8):
            angle += (
                reading
                - np.unwrap([reading, np.arctan2(np.sin(angle) - cy, np.cos(angle) - cx)])[1]
            )
        return (angle, v) if error.startswith("x8") else (h, angle)
    if error in ("x11a", "x11b"):
        return h + size * (np.cos(2 * h) if error == "x11a" else np.sin(2 * h)), v
    if error in ("x12a", "x12b"):
        return h, v + size * (np.cos(2 * v) if error == "x12a" else np.sin(2 * v))
    return h, v + size if error == "x4" else v


def trace(error: str, size: float, r: float, h: float, v: float) -> np.ndarray:
    """Where the target is (3,) [m] if the scanner with this error reads r, h, v (raw)."""
    h, v = reading_angles(error, size, h, v)
    n, t, z = (
        np.array([np.cos(h), np.sin(h), 0]),
        np.array([-np.sin(h), np.cos(h), 0]),
        np.eye(3)[2],
    )
    if error == "x7":  # the trunnion axis is not square to the standing axis
        t, z = np.cos(size) * t + np.sin(size) * z, np.cos(size) * z - np.sin(size) * t
    along = np.sin(v) * n + np.cos(v) * z
    # a mirror turned by x6 from 45 degrees turns the beam twice as much
    slant = np.pi / 4 + (size if error == "x6" else 0.0)
    normal = np.cos(slant) * along + np.sin(slant) * t
    mirror = np.zeros(3)
    if error == "x3":  # the mirror stands off the axis of its rotation
        mirror = size / np.sqrt(2) * normal
    start = 0.1 * t  # the laser, on the trunnion axis
    beam = -t
    if error in ("x1n", "x1z"):  # the beam runs beside the axis
        start = start + size * (n if error == "x1n" else z)
    if error in ("x5n", "x5z"):  # the beam crosses the axis on the mirror, at an angle
        beam = beam + size * (n if error == "x5n" else z)
        beam = beam / np.linalg.norm(beam)
        start = -0.1 * beam
    to_mirror = (mirror - start) @ normal / (beam @ normal)
    hit = start + to_mirror * beam
    reflected = beam - 2 * (beam @ normal) * normal
    path = r + (size if error == "x10" else 0.0) - (to_mirror - 0.1)
    offset = size * n if error == "x2" else 0.0  # the trunnion axis beside the standing axis
    return hit + path * reflected + offset
