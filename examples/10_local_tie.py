"""A local tie: the invariant point of a radio telescope, from CSV, with its vector to a GNSS mark.

Twelve targets on a simulated telescope are measured from four pillars in eighteen positions of the
dish. `telescope.csv` says which point is which target and what the circles of the telescope read;
the point where its axes come closest, their offset, their skew and their tilt are unknowns.
"""

import tempfile
from pathlib import Path

import numpy as np

import tribrach as tb

SECOND = np.pi / 648000
#: pillars, the GNSS mark among them, and the invariant point: E, N, U [m]
PILLARS = {"P1": (25, 2, 0), "P2": (-3, 27, 0.5), "P3": (-26, -4, 0.2), "GNSS": (4, -24, -0.3)}
INVARIANT_POINT = np.array([1.2, -0.8, 11.5])
OFFSET, SKEW, TILT_EAST, TILT_NORTH, ZERO = 0.7123, 20 * SECOND, 15e-5, -9e-5, np.radians(12.3)


def about(axis: int, angle: float) -> np.ndarray:
    """Counter-clockwise rotation about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn


def simulate(folder: Path, seed: int) -> Path:
    """Write points.csv, sights.csv, telescope.csv and local-tie.toml, with the noise of a seed."""
    rng = np.random.default_rng(seed)
    body = np.random.default_rng(1).uniform([-5, -2, -3], [5, 2, 3], (12, 3))
    lean = about(1, TILT_EAST) @ about(0, -TILT_NORTH)
    sights: list[str] = []
    targets: list[str] = []
    orientation = {name: rng.uniform(0, 400) for name in PILLARS}

    def sight(pillar: str, name: str, place: np.ndarray) -> None:
        e, n, u = place - PILLARS[pillar]
        flat = np.hypot(e, n)
        direction = np.degrees(np.arctan2(e, n)) / 0.9 - orientation[pillar] + rng.normal(0, 3e-4)
        zenith = np.degrees(np.arctan2(flat, u)) / 0.9 + rng.normal(0, 3e-4)
        length = np.hypot(flat, u) + rng.normal(0, 5e-4)
        sights.append(f"{pillar},{name},{direction % 400:.6f},{zenith:.6f},{length:.6f}")

    for pillar in PILLARS:
        for other in PILLARS.keys() - {pillar}:
            sight(pillar, other, np.array(PILLARS[other]))
    for k in range(18):
        azimuth, elevation = np.radians(60 * (k % 6)), np.radians((8, 40, 72)[k // 6])
        dial = np.degrees([azimuth, elevation] - np.array([ZERO, 0]) + rng.normal(0, 4 * SECOND, 2))
        turned = lean @ about(2, -azimuth)
        for i, p in enumerate(body):
            dish = np.array([0, OFFSET, 0]) + about(1, -SKEW) @ about(0, elevation) @ p
            place = INVARIANT_POINT + turned @ dish + rng.normal(0, 1e-4, 3)
            targets.append(f"VLBI,T{i + 1},T{i + 1}-{k + 1},{dial[0] % 360:.7f},{dial[1]:.7f}")
            for pillar in sorted(PILLARS, key=lambda n: np.linalg.norm(place - PILLARS[n]))[:2]:
                sight(pillar, f"T{i + 1}-{k + 1}", place)

    marks = [
        f"{n},{x[0]:.6f},{x[1]:.6f},{x[2]:.6f}"
        for n, x in ((n, rng.normal(p, 3e-4)) for n, p in PILLARS.items())
    ]
    tables = {
        "points.csv": (
            "point,e_m,n_m,u_m", marks,
            "sigma_e_mm,sigma_n_mm,sigma_u_mm", "0.3,0.3,0.3",
        ),
        "sights.csv": (
            "from,to,direction_gon,zenith_gon,slope_distance_m", sights,
            "sigma_direction_mgon,sigma_zenith_mgon,sigma_slope_distance_mm", "0.3,0.3,0.5",
        ),
        "telescope.csv": (
            "telescope,target,point,azimuth_deg,elevation_deg", targets,
            "sigma_mm,sigma_azimuth_arcsec,sigma_elevation_arcsec", "0.1,4,4",
        ),
    }  # fmt: skip
    for file, (head, rows, sigmas, values) in tables.items():
        lines = [f"{head},{sigmas}", *(f"{row},{values}" for row in rows)]
        (folder / file).write_text("\n".join(lines) + "\n", encoding="utf-8")
    project = folder / "local-tie.toml"
    project.write_text(
        'title = "Local tie"\n[[points]]\nfile = "points.csv"\n'
        '[[observations]]\nfiles = ["sights.csv", "telescope.csv"]\n',
        encoding="utf-8",
    )
    return project


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        adjustment = tb.adjust(simulate(Path(folder), seed=0))
    telescope, mark = adjustment.points["VLBI"], adjustment.points["GNSS"]
    print(telescope)
    print("off the truth by", ((telescope.xyz - INVARIANT_POINT) * 1e3).round(2), "mm")
    print("from the GNSS mark:", (telescope.xyz - mark.xyz).round(4), "m")
    both = adjustment.covariance("VLBI", "GNSS")
    tie = adjustment.covariance("VLBI") + adjustment.covariance("GNSS") - both - both.T
    print("with the sigmas", (np.sqrt(np.diag(tie)) * 1e3).round(2), "mm")
