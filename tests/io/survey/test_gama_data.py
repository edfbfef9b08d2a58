"""Every network of GNU Gama's test collection against the answers it prints."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from tribrach.io.survey.gama import reader as gama
from tribrach.io.survey.gama.reader import GamaFacts
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.facts import facts_of

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data" / "networks" / "gama"
#: networks that have an answer beside them
NETWORKS = sorted(
    str(p.relative_to(FOLDER)) for p in FOLDER.glob("*/*.gkf") if p.with_suffix(".xml").exists()
)
RESULT = "{http://www.gnu.org/software/gama/gama-local-adjustment}"


@dataclass
class Answer:
    """What the answer file says, in metres (file's own axes) and its used sigma0."""

    coordinates: dict[tuple[str, str], float]
    sigma: dict[tuple[str, str], float]
    sigma0: float
    sigma0_prior: float
    dof: int


def answer(path: Path) -> Answer:
    root = etree.parse(str(path)).getroot()

    def find(name: str) -> etree._Element:
        element = root.find(f".//{RESULT}{name}")
        assert element is not None
        return element

    coordinates, order = {}, []
    for point in find("adjusted"):
        if not isinstance(point.tag, str):
            continue
        name = point.findtext(f"{RESULT}id")
        for child in point:
            axis = child.tag.removeprefix(RESULT).lower()
            if axis in "xyz":
                coordinates[name, axis] = float(child.text)
                order.append((name, axis))
    matrix = find("coordinates").find(f"{RESULT}cov-mat")
    numbers = [float(e.text) for e in matrix.iter(f"{RESULT}flt")]
    dim, band = (int(matrix.findtext(RESULT + n)) for n in ("dim", "band"))
    diagonal, place = [], 0
    for i in range(dim):
        diagonal.append(numbers[place])
        place += min(band, dim - 1 - i) + 1
    sigma = {key: np.sqrt(v) * 1e-3 for key, v in zip(order, diagonal, strict=False)}
    return Answer(
        coordinates,
        sigma,
        float(find("aposteriori").text),
        float(find("apriori").text),
        int(find("degrees-of-freedom").text),
    )


def ours(adjustment: Adjustment) -> tuple[dict, dict]:
    """Adjusted coordinates and a-priori sigmas in the file's own axes."""
    world = facts_of(adjustment.network.facts, GamaFacts)[0].axes.matrix()
    covariances = adjustment.family_covariances("point")
    coordinates, sigma = {}, {}
    for i, name in enumerate(adjustment.layout.names["point"]):
        xyz = world.T @ adjustment.state.points[i]
        spread = np.sqrt(np.diag(world.T @ covariances[i] @ world))
        for k, axis in enumerate("xyz"):
            coordinates[name, axis], sigma[name, axis] = xyz[k], spread[k]
    return coordinates, sigma


@pytest.mark.data
@pytest.mark.parametrize("name", NETWORKS or [pytest.param("", marks=pytest.mark.skip("no data"))])
def test_network_reproduces_its_answer(name: str) -> None:
    expected = answer((FOLDER / name).with_suffix(".xml"))
    adjustment = adjust(gama.read(FOLDER / name).network())
    coordinates, sigma = ours(adjustment)
    factor = 1.0
    if facts_of(adjustment.network.facts, GamaFacts)[0].sigma_act == "aposteriori" and expected.dof:
        factor = adjustment.sigma0_posterior / adjustment.sigma0
    apart = max(abs(coordinates[k] - v) for k, v in expected.coordinates.items())
    ratio = [abs(factor * sigma[k] / v - 1) for k, v in expected.sigma.items() if v > 1e-12] + [0.0]
    # one answer was printed with another a-priori sigma0 than its file gives: compare the ratio
    unit = expected.sigma0_prior / adjustment.sigma0
    posterior = unit * adjustment.sigma0_posterior if expected.dof else expected.sigma0
    off = abs(posterior - expected.sigma0)
    print(
        f"{name:52s} r {adjustment.dof:3d}  coordinates {apart * 1e3:7.4f} mm  "
        f"sigma0 {posterior:12.6f} ({off:.1e})  sigmas {max(ratio) * 100:6.3f} %"
    )
    assert adjustment.dof == expected.dof
    assert apart < 0.05e-3
    # the answers print eight significant digits; sigma0 may be in the thousands
    assert off < 1e-4 or off < 1e-7 * expected.sigma0
    assert max(ratio) < 0.005


@pytest.mark.data
def test_the_collection_is_complete(shared_data: Path) -> None:
    folder = shared_data / "networks" / "gama"
    # the two epochs of a deformation are answers without the networks that they belong to
    answers = [p for p in folder.glob("*/*.xml") if p.parent.name != "deformation"]
    assert len(NETWORKS) == len(answers)


@pytest.mark.data
@pytest.mark.slow
def test_a_railway_with_and_without_approximate_coordinates(shared_data: Path) -> None:
    folder = shared_data / "networks" / "gama" / "railway"
    if not folder.is_dir():
        pytest.skip(f"third-party data are not in {folder}")
    files = ("railway-survey.gkf", "railway-survey-with-aproximate-xy.gkf")
    first, second = (adjust(gama.read(folder / name).network()) for name in files)
    assert first.dof == second.dof
    assert first.posterior_factor == pytest.approx(second.posterior_factor, rel=1e-6)
    for name, point in first.points.items():
        known = np.isfinite(point.xyz)
        np.testing.assert_allclose(
            point.xyz[known], second.points[name].xyz[known], rtol=0, atol=1e-5
        )
