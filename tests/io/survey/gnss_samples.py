"""The GNSS network of Ghilani, chapter 17 (AC-32), as the files of other programs."""

from pathlib import Path

import numpy as np

#: held: A and B; the adjusted others (Ghilani 2010, p. 337)
GIVEN = {
    "A": (402.35087, -4652995.30109, 4349760.77753),
    "B": (8086.03178, -4642712.84739, 4360439.08326),
}
ADJUSTED = {
    "C": (12046.5808, -4649394.0826, 4353160.0644),
    "D": (-3081.5831, -4643107.3692, 4359531.1233),
    "E": (-4919.3391, -4649361.2199, 4352934.4548),
    "F": (1518.8012, -4648399.1453, 4354116.6914),
}
ROWS = """\
A C 11644.2232 3601.2165 3399.2550 9.884e-4 -9.580e-6 9.520e-6 9.377e-4 -9.520e-6 9.827e-4
A E -5321.7164 3634.0754 3173.6652 2.158e-4 -2.100e-6 2.160e-6 1.919e-4 -2.100e-6 2.005e-4
B C 3960.5442 -6681.2467 -7279.0148 2.305e-4 -2.230e-6 2.070e-6 2.546e-4 -2.230e-6 2.252e-4
B D -11167.6076 -394.5204 -907.9593 2.700e-4 -2.750e-6 2.850e-6 2.721e-4 -2.720e-6 2.670e-4
D C 15128.1647 -6286.7054 -6371.0583 1.461e-4 -1.430e-6 1.340e-6 1.614e-4 -1.440e-6 1.308e-4
D E -1837.7459 -6253.8534 -6596.6697 1.231e-4 -1.190e-6 1.220e-6 1.277e-4 -1.210e-6 1.283e-4
F A -1116.4523 -4596.1610 -4355.9062 7.475e-5 -7.900e-7 8.800e-7 6.593e-5 -8.100e-7 7.616e-5
F C 10527.7852 -994.9377 -956.6246 2.567e-4 -2.250e-6 2.400e-6 2.163e-4 -2.270e-6 2.397e-4
F E -6438.1364 -962.0694 -1182.2305 9.442e-5 -9.200e-7 1.040e-6 9.959e-5 -8.900e-7 8.826e-5
F D -4600.3787 5291.7785 5414.4311 9.330e-5 -9.900e-7 9.000e-7 9.875e-5 -9.900e-7 1.204e-4
F B 6567.2311 5686.2926 6322.3917 6.643e-5 -6.500e-7 6.900e-7 7.465e-5 -6.400e-7 6.048e-5
B F -6567.2310 -5686.3033 -6322.3807 5.512e-5 -6.300e-7 6.100e-7 7.472e-5 -6.300e-7 6.629e-5
A F 1116.4577 4596.1553 4355.9141 6.619e-5 -8.000e-7 9.000e-7 8.108e-5 -8.200e-7 9.376e-5
"""
VECTORS = [line.split() for line in ROWS.splitlines()]


def write_csv(path: Path) -> Path:
    """The baselines as our own table with six numbers of the covariance each."""
    head = "from,to,dx_m,dy_m,dz_m,cxx_m2,cxy_m2,cxz_m2,cyy_m2,cyz_m2,czz_m2"
    path.write_text("\n".join([head, *(",".join(row) for row in VECTORS)]) + "\n")
    return path


def write_gvx(path: Path, frame: str = "ITRF2014", epoch: str = "2010.0") -> Path:
    """The same as GVX with standard deviations and correlations."""
    near = {n: np.round(xyz, 1) for n, xyz in (GIVEN | ADJUSTED).items()}
    points = "".join(
        f"<POINT><ID>{k}</ID><NAME>{name}</NAME><COORDINATES><REFERENCE_SYSTEM_ID>7"
        f"</REFERENCE_SYSTEM_ID><EPOCH>{epoch}</EPOCH><GEOCENTRIC_COORDINATES>"
        + "".join(f"<{a}>{v!r}</{a}>" for a, v in zip("XYZ", xyz.tolist(), strict=True))
        + "</GEOCENTRIC_COORDINATES></COORDINATES></POINT>\n"
        for k, (name, xyz) in enumerate(near.items())
    )
    number = {name: k for k, name in enumerate(near)}
    vectors = "".join(_vector(k, row, number) for k, row in enumerate(VECTORS))
    path.write_text(
        '<?xml version="1.0"?>\n<GVX VERSION="1.0"><REFERENCE_SYSTEM><ID>7</ID>'
        f"<NAME>{frame}</NAME><LINEAR_UNIT><NAME>meters</NAME></LINEAR_UNIT></REFERENCE_SYSTEM>\n"
        f"{points}{vectors}</GVX>\n"
    )
    return path


def _vector(k: int, row: list[str], number: dict[str, int]) -> str:
    xx, xy, xz, yy, yz, zz = (float(word) for word in row[5:])
    sx, sy, sz = np.sqrt([xx, yy, zz])
    cells = {"SDX": sx, "SDY": sy, "SDZ": sz}
    cells |= {"PXY": xy / sx / sy, "PXZ": xz / sx / sz, "PYZ": yz / sy / sz}
    deltas = "".join(f"<D{a}>{v}</D{a}>" for a, v in zip("XYZ", row[2:5], strict=True))
    matrix = "".join(f"<{tag}>{float(value)!r}</{tag}>" for tag, value in cells.items())
    return (
        f"<GNSS_VECTOR><ID>V{k}</ID><INITIAL_POINT_ID>{number[row[0]]}</INITIAL_POINT_ID>"
        f"<TERMINAL_POINT_ID>{number[row[1]]}</TERMINAL_POINT_ID>"
        f"<ECEF_DELTAS>{deltas}</ECEF_DELTAS>"
        f"<CORRELATION_MATRIX>{matrix}</CORRELATION_MATRIX></GNSS_VECTOR>\n"
    )


def write_sinex(
    path: Path,
    names: list[str],
    xyz: np.ndarray,
    covariance: np.ndarray,
    *,
    kind: str = "COVA",
    epoch: str = "05:092:43200",
    velocity: np.ndarray | None = None,
    triangle: str = "L",
) -> Path:
    """Coordinates (and velocities) with one matrix over all parameters in the order written."""
    tags = ["STAX", "STAY", "STAZ"] + (["VELX", "VELY", "VELZ"] if velocity is not None else [])
    rows, k = [], 0
    for n, name in enumerate(names):
        values = [*xyz[n], *(velocity[n] if velocity is not None else [])]
        for tag, value in zip(tags, values, strict=True):
            k += 1
            sigma = np.sqrt(covariance[k - 1, k - 1])
            rows.append(
                f" {k:5d} {tag:6s} {name:4s}  A    1 {epoch} m    2 {value:21.14e} {sigma:11.5e}"
            )
    matrix = covariance
    if kind == "INFO":
        matrix = np.linalg.inv(covariance)
    if kind == "CORR":
        roots = np.sqrt(np.diag(covariance))
        matrix = covariance / roots / roots[:, None]
        np.fill_diagonal(matrix, roots)
    cells = []
    for i in range(k):
        columns = range(i + 1) if triangle == "L" else range(i, k)
        for first in range(columns.start, columns.stop, 3):
            part = matrix[i, first : min(first + 3, columns.stop)]
            words = "".join(f" {v:21.14e}" for v in part)
            cells.append(f" {i + 1:5d} {first + 1:5d}{words}")
    lines = [
        "%=SNX 2.02 TST 05:100:00000 TST 05:092:00000 05:093:00000 P 00006 2 S",
        "+SOLUTION/ESTIMATE",
        "*INDEX TYPE__ CODE PT SOLN _REF_EPOCH__ UNIT S __ESTIMATED VALUE____ _STD_DEV___",
        *rows,
        "-SOLUTION/ESTIMATE",
        f"+SOLUTION/MATRIX_ESTIMATE {triangle} {kind}",
        *cells,
        f"-SOLUTION/MATRIX_ESTIMATE {triangle} {kind}",
        "%ENDSNX",
    ]
    path.write_text("\n".join(lines) + "\n")
    return path
