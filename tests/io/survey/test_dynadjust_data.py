"""The sample networks of DynAdjust against the adjustment that DynAdjust printed."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.io.survey.dynadjust import reader as dynadjust
from tribrach.network.adjustment import Adjustment, adjust

pytestmark = pytest.mark.data

FORMATS = {
    "xml": ("gnss-networkstn.xml", "gnss-networkmsr.xml"),
    "dna": ("gnss-network.stn", "gnss-network.msr"),
}


@pytest.fixture(scope="module")
def folder(shared_data) -> Path:
    """Where the sample files are."""
    return shared_data / "networks" / "dynadjust"


@pytest.fixture(scope="module", params=FORMATS)
def adjustment(request, folder) -> Adjustment:
    """The GNSS network adjusted, from either format."""
    return adjust(dynadjust.read([folder / name for name in FORMATS[request.param]]).network())


def expected(folder: Path, title: str) -> list[str]:
    """Rows of a table of DynAdjust's output."""
    lines = (folder / "gnss.simult.adj.expected").read_text().splitlines()
    start = lines.index(title) + 5
    rows = lines[start:]
    return rows[: rows.index("")] if "" in rows else rows


def test_global_figures(adjustment):
    assert adjustment.n_observations == 417
    assert adjustment.n_unknowns == 129
    assert adjustment.dof == 288
    assert round(adjustment.vtpv, 2) == 336.64
    # DynAdjust calls the variance factor sigma zero
    assert round(adjustment.posterior_factor, 3) == 1.169


def test_coordinates_and_sigmas(adjustment, folder):
    """Coordinates are printed to 0.1 mm, sigmas too: half of that is rounding."""
    rows = expected(folder, "Adjusted Coordinates")
    assert len(rows) == 43
    site, layout = adjustment.network.site, adjustment.layout
    for row in rows:
        name, numbers = row[:20].strip(), row[24:].split()
        xyz, sigma = np.array(numbers[4:7], float), np.array(numbers[7:10], float)
        x = adjustment.state.points[layout.index("point", name)][None]
        np.testing.assert_allclose(site.to_ecef(x)[0], xyz, atol=0.6e-4, err_msg=name)
        axes = site.axes(x)[0]
        got = np.sqrt(np.diag(axes @ adjustment.covariance(name) @ axes.T))
        np.testing.assert_allclose(got, sigma, atol=0.5e-4 + 1e-6, rtol=0.001, err_msg=name)


def test_corrections_and_normalised_residuals(adjustment, folder):
    """Every measurement's correction, sigmas and N-statistic, in geocentric axes."""
    rows = expected(folder, "Adjusted Measurements")
    assert len(rows) == 417
    table = {}
    for row in rows:
        letter, *numbers = row[62:].split()
        key = (row[0], row[2:22].strip(), row[22:42].strip(), letter)
        table.setdefault(key, []).append(np.array(numbers[:7], float))
    turn = adjustment.network.site.w_from_ecef
    layout = adjustment.layout
    for number, observations in enumerate(adjustment.network.observations):
        ends = observations.ends(layout)
        residual = adjustment.residuals[adjustment.rows.table == number].reshape(-1, 3) @ turn
        for item, (first, second) in enumerate(ends):
            prior = turn.T @ observations.covariance[item] @ turn
            adjusted = adjustment.covariance(first)
            if second:
                cross = adjustment.covariance(first, second)
                adjusted = adjusted + adjustment.covariance(second) - cross - cross.T
            left = np.sqrt(np.diag(prior - turn.T @ adjusted @ turn))
            for axis, letter in enumerate("XYZ"):
                kinds = "GX" if second else "Y"
                found = [r for k in kinds for r in table.get((k, first, second, letter), [])]
                measured, sigma, rest = residual[item, axis], np.sqrt(prior[axis, axis]), left[axis]
                row = min(found, key=lambda r: abs(r[2] - measured) + abs(r[3] - sigma))
                assert abs(row[2] - measured) < 0.6e-4, (first, second, letter)
                assert abs(row[3] - sigma) < 0.6e-4
                assert abs(row[5] - rest) < 0.6e-4
                assert abs(row[6] - measured / rest) < 0.02 + 0.6e-4 / rest


def test_both_formats_agree(folder):
    """The given stations of the two files differ a little, and so do the work frames."""
    a = dynadjust.read([folder / name for name in FORMATS["xml"]]).network()
    b = dynadjust.read([folder / name for name in FORMATS["dna"]]).network()
    for one, other in zip(a.observations, b.observations, strict=True):
        assert one.ends(a.start.layout) == other.ends(b.start.layout)
        if one.kind == "gnss_position":
            x, y = a.site.to_ecef(one.values), b.site.to_ecef(other.values)
        else:
            x, y = one.values @ a.site.w_from_ecef, other.values @ b.site.w_from_ecef
        np.testing.assert_allclose(x, y, atol=1e-7)


def test_free_baseline_network(folder):
    """The tutorial network has no control: minimum-norm least squares in ECEF by pseudoinverse."""
    survey = dynadjust.read([folder / "skye-tutorial.stn", folder / "skye-tutorial.msr"])
    assert survey.datum.kind == "free"
    adjustment = adjust(survey.network())
    assert adjustment.dof == 9 * 3 - 6 * 3 + 3
    layout, site = adjustment.layout, survey.site
    table = adjustment.network.observations[0]
    start = adjustment.network.start.points @ np.eye(3)
    design = np.zeros((27, 18))
    for k, (first, second) in enumerate(table.ends(layout)):
        i, j = layout.index("point", first), layout.index("point", second)
        design[3 * k : 3 * k + 3, 3 * i : 3 * i + 3] = -np.eye(3)
        design[3 * k : 3 * k + 3, 3 * j : 3 * j + 3] = np.eye(3)
    weight = np.zeros((27, 27))
    for k in range(9):
        weight[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.linalg.inv(table.covariance[k])
    cofactor = np.linalg.pinv(design.T @ weight @ design, hermitian=True)
    misclosure = table.values.ravel() - design @ start.ravel()
    moved = cofactor @ design.T @ weight @ misclosure
    got = adjustment.state.points
    np.testing.assert_allclose(got, start + moved.reshape(-1, 3), atol=1e-7)
    names = layout.names["point"]
    np.testing.assert_allclose(
        np.concatenate([adjustment.covariance(names[0], n) for n in names], axis=1),
        cofactor[:3],
        atol=1e-12,
    )
    assert site.ellipsoid[0] == 6378137.0
