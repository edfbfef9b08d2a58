"""Real files of many makers: what is in them, file by file."""

import contextlib

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.reduction import reduce
from tribrach.io.survey.totalstation import reduce_file
from tribrach.io.totalstation import formats
from tribrach.units import SEC

pytestmark = pytest.mark.data

LESSONS = "osgeolabbp/english/data_processing/lessons/code"
#: file -> set-ups, sights, coordinates, records left out
FILES = {
    "geoeasy/leica/coords.gsi": (0, 0, 48, 0),
    "geoeasy/leica/network.GSI": (22, 1400, 0, 0),
    f"{LESSONS}/labor.gsi": (0, 0, 59, 0),
    "tops/leica_gsi/RILIEVO.gsi": (1, 23, 0, 0),
    "tops/leica_gsi/leica_gsi16_gurob.gsi": (1, 343, 0, 0),
    "tops/leica_gsi/leica_gsi8_ertola.gsi": (4, 694, 693, 0),
    "geoeasy/sdr33/20151125.sdr": (1, 14, 7, 0),
    "geoeasy/sdr33/20151130.sdr": (1, 21, 6, 0),
    "geoeasy/sdr33/20151204.sdr": (1, 10, 5, 0),
    "geoeasy/spectra/focus6/1.sdr": (1, 18, 4, 0),
    "geoeasy/spectra/focus6/2.sdr": (0, 0, 21, 0),
    "tops/sokkia_sdr33.tops": (1, 0, 13, 0),
    "geoeasy/ruide/group_1_obs.sdr": (2, 71, 8, 0),
    "geoeasy/nikon/sample.raw": (1, 1, 1, 3),
    f"{LESSONS}/nikon.raw": (1, 20, 2, 0),
    "tops/nikon_raw_v200/nikon_dtm.tops": (4, 10, 0, 0),
    "tops/nikon_raw_v200/nikon_npl_350": (2, 12, 0, 0),
    "tops/nikon_raw_v200/nikon_raw_v200.tops": (1, 82, 1, 0),
    "tops/trimble/051012-1.RAW": (3, 177, 0, 0),
    "geoeasy/topcon/jkv.gts7": (1, 4, 2, 0),
    "geoeasy/topcon/minta.210": (4, 409, 0, 0),
    "tops/topcon_gts_229": (1, 53, 0, 0),
    "tops/carlson_rw5/Leica1200.rw5": (2, 10, 1, 0),
    "tops/carlson_rw5/Trav_19leg.rw5": (39, 420, 84, 4),
    "tops/landxml.xml": (2, 3, 5, 0),
    "geoeasy/trimble/m3/180416-1.m5": (1, 20, 20, 0),
    "geoeasy/trimble/m3/180416-2.m5": (1, 18, 18, 0),
    "geoeasy/trimble/m3/180416-3.m5": (2, 20, 20, 0),
    "geoeasy/trimble/m3/180416-4.m5": (1, 22, 22, 0),
    "tops/zeiss_elta_r55/zeiss_elta_r55-R_E.tops": (2, 0, 145, 0),
}
UNREAD = (
    "geoeasy/foif/0407A2.mes", "geoeasy/geodimeter/DT.job", "geoeasy/geodimeter/ullo.are",
    "geoeasy/geoprofi/robuj.mjk", "geoeasy/geozseni/minta.gjk", "geoeasy/leica/test.idx",
    "geoeasy/nikon/kismaros.nik", "geoeasy/sokia/1cs.scr", "tops/leica_tcr_705",
    "tops/leica_tcr_1205", "tops/trimble/BSG-08-11-19.are", f"{LESSONS}/test.gsi",
    "tops/zeiss_elta_r55/zeiss_elta_r55", "tops/zeiss_elta_r55/zeiss_elta_r55-R4.tops",
    "tops/zeiss_elta_r55/zeiss_elta_r55-R5.tops", "tops/carlson_rw5/Leica1200.rw5.csv",
)  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_counts(shared_data, name):
    path = shared_data / "totalstation" / name
    if not path.is_file():
        pytest.skip(f"{name} is not there")
    raw = formats.read(path)
    found = (len(raw.setups), len(raw.shots), len(raw.points), len(raw.problems))
    assert found == FILES[name], raw.summary()


@pytest.mark.parametrize("name", UNREAD)
def test_files_that_end_with_their_sentence(shared_data, name):
    with pytest.raises(InputError, match=r"not read; export|staff readings of a level"):
        formats.read(shared_data / "totalstation" / name)


def test_every_file_reads_or_says_why(shared_data):
    for path in sorted((shared_data / "totalstation").rglob("*")):
        if not path.is_file() or path.stat().st_size > 1_000_000:
            continue
        with contextlib.suppress(InputError):
            assert formats.read(path).understood


def test_coordinates_of_the_instrument_agree_with_its_readings(shared_data):
    """A detail survey holds readings and the coordinates the instrument computed from them."""
    raw = formats.read(shared_data / "totalstation/tops/leica_gsi/leica_gsi8_ertola.gsi")
    at = np.flatnonzero(raw.setups.station == "STAZLIB3")[0]
    origin = raw.points.xyz[raw.points.name == "STAZLIB3"][0]
    shots = raw.shots
    names = raw.points.name[~raw.points.given]
    rows = np.flatnonzero((shots.setup == at) & np.isin(shots.target, names))
    assert len(rows) > 20
    level = shots.distance[rows] * np.sin(shots.zenith[rows])
    computed = dict(zip(names, raw.points.xyz[~raw.points.given], strict=True))
    there = np.array([computed[name] for name in shots.target[rows]])
    rise = shots.distance[rows] * np.cos(shots.zenith[rows])
    expected = origin[2] + raw.setups.height[at] + rise - shots.height[rows]
    np.testing.assert_allclose(there[:, 2], expected, atol=1.5e-3)
    e, n = (there - origin)[:, :2].T
    np.testing.assert_allclose(np.hypot(e, n), level, atol=2e-3)
    # one orientation for all of them
    turn = np.angle(np.exp(1j * (np.arctan2(e, n) - shots.direction[rows])))
    assert np.ptp(turn) * level.min() < 3e-3


def test_rounds_of_a_real_network(shared_data):
    """Seven sets in both faces from 22 stations, with an instrument of half a second."""
    raw = formats.read(shared_data / "totalstation/geoeasy/leica/network.GSI")
    found = reduce_file(raw).reduction
    assert found.axes.pairs == 700
    assert found.axes.collimation / SEC == pytest.approx(-2.0, abs=0.1)
    assert found.axes.index / SEC == pytest.approx(0.4, abs=0.1)
    assert not found.cells[0].far.any()
    assert {len(setup.sets) for setup in found.setups} == {7}
    dof = np.array([setup.rounds.dof for setup in found.setups])
    pooled = np.sqrt(np.average([s.rounds.sigma**2 for s in found.setups], weights=dof))
    assert 0.2 * SEC < pooled < 0.6 * SEC
    assert found.directions.readings.tolist() == [14] * 100


def test_means_of_sets_agree_with_those_of_the_field_program(shared_data):
    """A traverse whose comments hold the means that the field program made of its sets."""
    path = shared_data / "totalstation/tops/carlson_rw5/Trav_19leg.rw5"
    raw = formats.read(path)
    shots = raw.shots
    # two sets from 104 to 103 and 105, lines 42 to 54; the comment says 189-14-20 between them
    rows = np.flatnonzero((shots.line >= 42) & (shots.line <= 54))
    names, target = np.unique(shots.target[rows].astype(str), return_inverse=True)
    assert names.tolist() == ["103", "105"]
    found = reduce(
        np.zeros(len(rows), dtype=np.int64), target, shots.face[rows], shots.direction[rows],
        shots.zenith[rows], shots.distance[rows], np.zeros(len(rows), dtype=np.int64),
    )  # fmt: skip
    turned = np.diff(found.directions.value)[0] % (2 * np.pi)
    assert turned == pytest.approx(np.radians(189 + 14 / 60 + 20 / 3600), abs=1.0 * SEC)
    assert found.zeniths.value[1] == pytest.approx(
        np.radians(89 + 22 / 60 + 36 / 3600), abs=1.0 * SEC
    )
    assert found.distances.value[1] / 0.3048006096 == pytest.approx(619.474208, abs=1e-3)
