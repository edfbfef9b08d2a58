"""Rank defects of self-calibration networks, in number and in words (AC-14, 15, 18, 42).

The network of Sabzali & Pilgrim (2023) as method section 4.3 reconstructs it: two stations 6.2417 m
apart, 52 targets, eight parameters per station; and rooms of 60 targets for the NIST model.
"""

import numpy as np
import pytest
import scipy.sparse as sp

from tribrach.errors import NotConverged, RankDefect
from tribrach.geometry import rotation
from tribrach.instruments.calibration import (
    NIST,
    PAPER_EIGHT,
    PAPER_EIGHT_ELEVATION,
    CalibrationModel,
)
from tribrach.network.adjustment import adjust
from tribrach.network.assembly import Assembly
from tribrach.network.datum import open_motions
from tribrach.network.defects import column_length, null_space, sentences
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar
from tribrach.units import SEC

S2 = np.array([1.2, np.sqrt(6.2417**2 - 1.2**2), 0.0])


def paper_targets() -> np.ndarray:
    out, k = [], 0
    for x in (-5.0, 6.0):
        for i in range(6):
            for z in (-0.85, -0.30, 0.40):
                shift = (0.13 * k) % 0.5
                out.append((x, -3.5 + 2.6 * i + shift, z + 0.02 * ((7 * k) % 5 - 2)))
                k += 1
    for y in (-4.2, 10.4):
        for i in range(4):
            for z in (-0.85, 0.40):
                shift = 0.05 * (k % 3)
                out.append((-3.6 + 2.6 * i + shift, y, z + 0.02 * ((7 * k) % 5 - 2)))
                k += 1
    return np.array(out)


def polar(u: np.ndarray) -> np.ndarray:
    flat = np.hypot(u[:, 0], u[:, 1])
    return np.column_stack(
        [np.hypot(flat, u[:, 2]), np.arctan2(u[:, 1], u[:, 0]), np.arctan2(flat, u[:, 2])]
    )


def observe(
    survey: Survey,
    station: str,
    targets: np.ndarray,
    model: CalibrationModel,
    *,
    face: float = 1.0,
    owner: str | None = None,
) -> None:
    """All targets seen from a station; values are free of errors."""
    given = survey.stations[station]
    values = polar((targets - given.translation) @ given.rotation)
    n = len(targets)
    names = [f"{p}({owner or station})" for p in model.parameters]
    sigma = np.column_stack([0.0012 + 1e-5 * values[:, 0], np.full((n, 2), 8 * SEC)])
    survey.add(
        ScannerPolar,
        values=values,
        sigma=sigma,
        station=[station] * n,
        target=[f"T{i}" for i in range(n)],
        face=face,
        model=model,
        parameters=np.array([names] * n, dtype=object),
    )


def paper_network(model: CalibrationModel, *, fixed: tuple[int, ...] = ()) -> Network:
    """Station 1 fixed; ``fixed`` components of station 2 (E, N, U, tilts, heading) held too."""
    targets = paper_targets()
    survey = Survey()
    for i, x in enumerate(targets):
        survey.point(f"T{i}", x)
    survey.station("S1", translation=np.zeros(3), rotation=np.eye(3), free=np.zeros(6, dtype=bool))
    free = np.array([k not in fixed for k in range(6)])
    survey.station("S2", translation=S2, rotation=np.eye(3), free=free)
    for station in ("S1", "S2"):
        observe(survey, station, targets, model)
    for name in [f"{p}({s})" for p in model.parameters for s in ("S1", "S2")]:
        survey.scalars[name] = (0.0, True)
    return survey.network()


def defect(network: Network) -> tuple[int, tuple[float, float], list[str]]:
    """Number of null vectors, the gap, and the sentences."""
    assembly = Assembly(network)
    state = network.start
    design = assembly.design(state)
    constraints, _ = assembly.constraints(state)
    motions = open_motions(design, state, assembly.free_columns, constraints)
    null, gap = null_space(design, constraints, motions.basis)
    words = sentences(assembly, null, motions.basis, column_length(design)) if null.shape[1] else []
    return null.shape[1] + motions.basis.shape[1], gap, words


def test_paper_network_has_eight_defects_with_elevation_and_six_with_zenith() -> None:
    """AC-14."""
    count, gap, words = defect(paper_network(PAPER_EIGHT_ELEVATION))
    assert count == 8
    assert gap[0] < 1e-9
    assert gap[1] > 1e-6
    assert len(words) == 8
    count, _, words = defect(paper_network(PAPER_EIGHT))
    assert count == 6
    assert len(words) == 6


def test_the_sentences_name_what_cannot_be_separated() -> None:
    _, _, words = defect(paper_network(PAPER_EIGHT_ELEVATION))
    text = "\n".join(words)
    for station in ("S1", "S2"):
        pair = [w for w in words if f"E_R({station})" in w and f"a1({station})" in w]
        assert pair, text
        assert any(f"E_V({station})" in w and f"a3({station})" in w for w in words), text
    assert any("heading of station S2" in w and "E_H(S2)" in w for w in words), text
    assert any("rotation about U" in w and "E_H(S1)" in w for w in words), text
    assert any("shift in U" in w and "a2(S1)" in w for w in words), text
    assert any("U of station S2" in w and "a2(S2)" in w for w in words), text


def test_adjusting_it_stops_with_these_sentences() -> None:
    with pytest.raises(RankDefect) as caught:
        adjust(paper_network(PAPER_EIGHT_ELEVATION))
    assert len(caught.value.sentences) >= 8


def test_identical_columns() -> None:
    """AC-15: a2 of station 2 equals -Z_S, E_R equals a1, E_H of station 2 equals -kappa."""
    network = paper_network(PAPER_EIGHT_ELEVATION)
    assembly = Assembly(network)
    design = assembly.design(network.start).toarray()
    layout = assembly.layout

    def scalar(name: str) -> np.ndarray:
        column = layout.columns("scalar", layout.index("scalar", name))[0]
        return design[:, assembly.reduced[column]]

    pose = layout.columns("pose", layout.index("pose", "S2"))
    scale = np.abs(design).max()
    up, heading = (design[:, assembly.reduced[pose[k]]] for k in (2, 5))
    assert np.abs(scalar("E_R(S2)") - scalar("a1(S2)")).max() < 1e-8 * scale
    # signs depend on conventions (true = measured + Delta, left increments); the identity does not
    for a, b in ((scalar("a2(S2)"), up), (scalar("E_H(S2)"), heading)):
        assert min(np.abs(a - b).max(), np.abs(a + b).max()) < 1e-8 * scale


def minimum_norm(network: Network) -> tuple[np.ndarray, Assembly]:
    """Moore-Penrose cofactor matrix of the whole normal matrix in metres and radians."""
    assembly = Assembly(network)
    design = assembly.design(network.start).toarray()
    return np.linalg.pinv(design.T @ design, rcond=1e-13, hermitian=True), assembly


def test_a_decomposition_that_gives_up_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    design = sp.csr_array(np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 1.0]]))
    rest = sp.csr_array((0, 3)), np.zeros((3, 0))
    vectors, gap = null_space(design, *rest)

    def gives_up(matrix: np.ndarray) -> None:
        raise np.linalg.LinAlgError

    monkeypatch.setattr(np.linalg, "svd", gives_up)
    again, same = null_space(design, *rest)
    assert same == pytest.approx(gap)
    assert np.abs(again) == pytest.approx(np.abs(vectors))
    with pytest.raises(NotConverged):
        null_space(sp.csr_array(np.full((3, 3), np.nan)), *rest)


def test_fixing_y_is_a_datum_and_changes_no_estimable_quantity() -> None:
    """AC-18: the sigma of a distance between points has the ratio 1.000000."""
    sigmas = []
    for fixed in ((), (1,)):
        q, assembly = minimum_norm(paper_network(PAPER_EIGHT_ELEVATION, fixed=fixed))
        x = paper_targets()
        unit = (x[40] - x[3]) / np.linalg.norm(x[40] - x[3])
        row = np.zeros(len(q))
        row[assembly.reduced[assembly.layout.columns("point", 40)]] = unit
        row[assembly.reduced[assembly.layout.columns("point", 3)]] = -unit
        sigmas.append(np.sqrt(row @ q @ row))
    assert sigmas[1] / sigmas[0] == pytest.approx(1.0, abs=1e-5)


def room(stations: int, *, faces: tuple[float, ...]) -> Network:
    """60 targets on the walls, floor and ceiling of 10 x 8 x 5.5 m; the NIST model, one set."""
    rng = np.random.default_rng(4)
    targets = rng.uniform([-5, -4, -1.7], [5, 4, 3.8], (60, 3))
    side = rng.integers(0, 3, 60)
    high = rng.random(60) < 0.5
    bounds = np.array([[-5, -4, -1.7], [5, 4, 3.8]])
    targets[np.arange(60), side] = bounds[high.astype(int), side]
    survey = Survey()
    for i, x in enumerate(targets):
        survey.point(f"T{i}", x)
    places = [(-1.5, -0.8, 0.0), (1.8, 1.2, 0.1), (-0.5, 1.9, -0.1), (1.1, -1.7, 0.05)]
    for j in range(stations):
        turn = rotation.exp(np.array([0.01, -0.02, 1.3 * j]))
        survey.station(f"S{j}", translation=places[j], rotation=turn)
        for face in faces:
            observe(survey, f"S{j}", targets, NIST, face=face, owner="scanner")
    for name in NIST.parameters:
        survey.scalars[f"{name}(scanner)"] = (0.0, True)
    return survey.network()


@pytest.mark.parametrize(
    ("stations", "faces", "expected"),
    [(1, (1.0,), 24), (1, (1.0, -1.0), 13), (2, (1.0,), 8), (2, (1.0, -1.0), 8)],
)
def test_defects_of_the_nist_model(stations: int, faces: tuple[float, ...], expected: int) -> None:
    """AC-42: 24, 13, 8, 8, of which six are the datum."""
    count, gap, words = defect(room(stations, faces=faces))
    assert count == expected
    assert gap[0] < 1e-9 < gap[1] / 10
    assert all(w for w in words)
