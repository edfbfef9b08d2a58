"""Published comparisons of two epochs with all data and the figures of every test.

A levelled network of nine height differences in two epochs, with the report of a program by the
method of Hannover, at github.com/brunazupanovic/deformation-analysis (data in its scripts, figures
in izvjestaj_deformacije.txt; compared there with the program PANDA). A GNSS network at
Konya (:mod:`tests.epochs.konya`).
"""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.epochs.konya import COORDINATES, LIMIT, NAMES, PRINTED, TRIANGLES, covariance
from tests.io.survey.gnss_samples import write_sinex
from tribrach._types import Array
from tribrach.cli.commands import app
from tribrach.epochs.comparison import Settings, compare
from tribrach.epochs.congruence import Congruence
from tribrach.epochs.differences import Difference, Epoch, difference
from tribrach.io.epoch_files import read_epoch
from tribrach.job.epochs import EpochInput, EpochSettings, compare_epochs, epoch_of
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.levelling import HeightDifferences

SHIFTS = ("shift in E", "shift in N", "shift in U")

#: start, end, length [m], height differences of both epochs [m]; 1.5 mm for a kilometre
LEVELLED = [
    ("A2", "A3", 23.0, -0.0434, -0.0433),
    ("A2", "O1", 40.0, 0.3222, 0.3228),
    ("A2", "O2", 50.0, 0.3033, 0.3034),
    ("A3", "O1", 35.0, 0.3660, 0.3661),
    ("A3", "O2", 40.0, 0.3465, 0.3462),
    ("O1", "O2", 22.0, -0.0186, -0.0193),
    ("O2", "O3", 8.0, -0.0384, -0.0397),
    ("O3", "O4", 22.0, 0.0666, 0.0659),
    ("O4", "O1", 8.0, -0.0096, -0.0075),
]
#: approximate heights, over which the inner constraints lie [m]
APPROXIMATE = {
    "A2": 100.0,
    "A3": 99.9566,
    "O1": 100.3222,
    "O2": 100.3036,
    "O3": 100.2652,
    "O4": 100.3318,
}
#: as printed: heights of both epochs [m], differences [mm], test values
REPORTED = np.array(
    [
        [100.0001, 100.0005, 0.38, 2.06],
        [99.9566, 99.9572, 0.60, 5.81],
        [100.3223, 100.3231, 0.84, 26.02],
        [100.3035, 100.3039, 0.37, 4.81],
        [100.2651, 100.2643, -0.85, 20.35],
        [100.3318, 100.3305, -1.34, 50.03],
    ]
)


def levelled(epoch: int) -> EpochInput:
    survey = Survey()
    for name, height in APPROXIMATE.items():
        survey.point(name, (0.0, 0.0, height), role="free")
    survey.add(
        HeightDifferences,
        values=[row[3 + epoch] for row in LEVELLED],
        sigma=1.5e-3 * np.sqrt([row[2] / 1000 for row in LEVELLED]),
        start=[row[0] for row in LEVELLED],
        end=[row[1] for row in LEVELLED],
    )
    return epoch_of(adjust(observed_part(survey).network().with_datum(Datum("free"))), str(epoch))


def test_a_levelled_network_as_printed() -> None:
    """Heights, differences and test values of all six points to the last digit.

    The report tests each point by d_j^2 P_jj against the variance of both epochs, with the
    differences of the free datum.
    """
    one, two = levelled(0), levelled(1)
    for column, epoch in enumerate((one, two)):
        np.testing.assert_allclose(epoch.epoch.xyz[:, 2], REPORTED[:, column], atol=0.5e-4)
    d = two.epoch.xyz[:, 2] - one.epoch.xyz[:, 2]
    np.testing.assert_allclose(1e3 * d, REPORTED[:, 2], atol=0.5e-2)
    changes = difference(one.epoch, two.epoch)
    form = Congruence(changes.values.ravel(), changes.covariance, changes.basis, 1)
    assert changes.dof == 8
    tests = d**2 * np.diag(form.weights) / changes.factor
    np.testing.assert_allclose(tests, REPORTED[:, 3], atol=0.5e-2)


def test_the_two_points_that_settled_are_found_together() -> None:
    """O3 and O4, which are named there; single tests are beyond 5.32 for A3 and O1 as well.

    That nothing else moved is what F says: 4.38 of what is left with three degrees of freedom.
    """
    one, two = levelled(0), levelled(1)
    settings = EpochSettings(Settings(posterior=True))
    found = compare_epochs(one, two, settings).comparison
    assert found.limits.limit(1) == pytest.approx(5.32, abs=0.005)
    assert (REPORTED[:, 3] > found.limits.limit(1)).sum() == 4
    assert found.moved == ("O3", "O4")
    assert found.search is not None
    assert not found.partners
    assert found.search.after.statistic == pytest.approx(4.38, abs=0.005)
    assert found.search.after.passed
    assert all(point.vector[0] < 0 for point in found.displacements[4:])


def konya() -> Difference:
    one, two = (
        Epoch(label, NAMES, xyz, covariance(text))
        for label, xyz, text in zip(("26 July", "27 July"), COORDINATES, TRIANGLES, strict=True)
    )
    return difference(one, two, free=SHIFTS)


def test_a_gnss_network_as_printed() -> None:
    """Displacements and test values of all seven stations to the last of four digits."""
    found = compare(konya(), Settings(references=NAMES[1:]))
    for point, printed in zip(found.displacements, PRINTED, strict=True):
        ours = [*(1e3 * point.vector), 1e3 * point.length, point.statistic / 3]
        np.testing.assert_allclose(ours, printed, atol=0.5001e-4)
        if not point.reference:
            assert point.limit / 3 == pytest.approx(LIMIT, abs=0.5e-4)
    # those that did not move are judged by the test that they passed together
    common = {point.limit for point in found.displacements if point.reference}
    assert common == {found.after.limit if found.search is None else found.search.after.limit}
    assert found.moved == ("OBJ1",)
    assert found.stable == NAMES[1:]
    # the source finds OBJ1 among all seven by single tests; the global test of all seven with 18
    # degrees of freedom does not see it at 95 %, and nothing is sought that it does not see
    every = compare(konya())
    assert every.whole.statistic == pytest.approx(24.77, abs=0.005)
    assert every.whole.limit == pytest.approx(28.87, abs=0.005)
    assert every.moved == ()


def test_a_gnss_network_from_its_files(tmp_path: Path) -> None:
    """The same through SINEX, in a local frame and by the command line."""
    files = [
        write_sinex(tmp_path / f"{name}.snx", list(NAMES), xyz, covariance(text), epoch=time)
        for name, xyz, text, time in zip(
            ("first", "second"),
            COORDINATES,
            TRIANGLES,
            ("16:208:43200", "16:209:43200"),
            strict=True,
        )
    ]
    one, two = (_stored(file) for file in files)
    settings = EpochSettings(Settings(references=NAMES[1:]), free=SHIFTS)
    found = compare_epochs(one, two, settings).comparison
    back = one.site.w_from_ecef.T
    for point, printed in zip(found.displacements, PRINTED, strict=True):
        np.testing.assert_allclose(1e3 * back @ point.vector, printed[:3], atol=1e-4)
        assert point.statistic / 3 == pytest.approx(printed[4], abs=1e-3)
    arguments = [str(f) for f in files] + ["--free", "shift"]
    for name in NAMES[1:]:
        arguments += ["--reference", name]
    run = CliRunner().invoke(app, ["epochs", *arguments])
    assert run.exit_code == 0, run.output
    assert "OBJ1 moved 6.6 mm towards 275 gon, 2.5 mm up" in " ".join(run.output.split())


def _stored(path: Path) -> EpochInput:
    stored = read_epoch([path])
    assert stored is not None
    return EpochInput(stored.epoch, stored.site, sentences=stored.sentences)


def test_what_is_printed_follows_from_the_covariances() -> None:
    """The test values by hand, without any part of the program: the source is consistent."""
    d = (COORDINATES[1] - COORDINATES[0]).ravel()
    total: Array = covariance(TRIANGLES[0]) + covariance(TRIANGLES[1])
    mean = np.zeros((3, 21))
    for k in range(1, 7):
        mean[:, 3 * k : 3 * k + 3] = np.eye(3) / 6
    s = np.eye(21) - np.tile(np.eye(3), (7, 1)) @ mean
    d, total = s @ d, s @ total @ s.T
    for k, printed in enumerate(PRINTED):
        part = slice(3 * k, 3 * k + 3)
        value = d[part] @ np.linalg.solve(total[part, part], d[part]) / 3
        assert value == pytest.approx(printed[4], abs=0.5001e-4)
