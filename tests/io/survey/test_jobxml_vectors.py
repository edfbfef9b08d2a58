"""GNSS vectors of Trimble JobXML."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geodesy.site import ecef_from_geodetic
from tribrach.io.gnss.jobxml import read_jobxml
from tribrach.io.survey.formats import format_of, read_files
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.observations.gnss import GnssBaselines

COVARIANCE = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -2.0], [0.5, -2.0, 16.0]]) * 1e-6
PLACES = {"B1": (48.1, 11.5, 520.0), "B2": (48.102, 11.51, 530.0), "P": (48.105, 11.503, 525.0)}
CIRCLE = "<Circle><HorizontalCircle>1</HorizontalCircle></Circle>"


def ecef(name: str) -> np.ndarray:
    latitude, longitude, height = PLACES[name]
    return np.asarray(ecef_from_geodetic(np.radians(latitude), np.radians(longitude), height))


def vector(start: str, end: str, by: str, record: str = "") -> str:
    """A vector whose base is named by ``RTK_Base`` or by its record."""
    delta = ecef(end) - ecef(start)
    base = {
        "name": f"<RTK_Base>{start}</RTK_Base>",
        "record": f"<ReferenceRecordID>{start}-id</ReferenceRecordID>",
        "none": "",
    }[by]
    deltas = "".join(f"<Delta{a}>{x:.6f}</Delta{a}>" for a, x in zip("XYZ", delta, strict=True))
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    vcv = "".join(
        f"<VCV{'xyz'[i]}{'xyz'[j]}>{COVARIANCE[i, j]:.3e}</VCV{'xyz'[i]}{'xyz'[j]}>"
        for i, j in pairs
    )
    return (
        f"<PointRecord><Name>{end}</Name>{base}<ECEFDeltas>{deltas}</ECEFDeltas>"
        f"<QualityControl2>{vcv}</QualityControl2>{record}</PointRecord>\n"
    )


def base(name: str, reference: bool = False) -> str:
    latitude, longitude, height = PLACES[name]
    place = (
        f"<WGS84><Latitude>{latitude}</Latitude><Longitude>{longitude}</Longitude>"
        f"<Height>{height}</Height></WGS84>"
    )
    own = "" if reference else f' ID="{name}-id"'
    records = f"<PointRecord{own}><Name>{name}</Name>{place}</PointRecord>\n"
    if reference:
        records += (
            f'<ReferenceRecord ID="{name}-id"><PointName>{name}</PointName></ReferenceRecord>\n'
        )
    return records


def job(folder: Path, *records: str) -> Path:
    path = folder / "job.jxl"
    path.write_text(f"<JOBFile>\n<FieldBook>\n{''.join(records)}</FieldBook>\n</JOBFile>\n")
    return path


@pytest.mark.parametrize(
    ("by", "reference"), [("name", False), ("record", False), ("record", True)]
)
def test_vectors_with_their_covariance(tmp_path: Path, by: str, reference: bool) -> None:
    path = job(
        tmp_path, base("B1", reference), base("B2", reference), vector("B1", "P", by),
        vector("B2", "P", by), vector("B1", "B2", by),
    )  # fmt: skip
    assert format_of(path) == "gnss"
    records = read_jobxml(path)
    assert list(zip(records.start, records.end, strict=True)) == [
        ("B1", "P"), ("B2", "P"), ("B1", "B2"),
    ]  # fmt: skip
    np.testing.assert_allclose(records.vectors[0], ecef("P") - ecef("B1"), atol=1e-6)
    np.testing.assert_allclose(records.blocks[0], COVARIANCE)
    survey = read_files([path])
    adjustment = adjust(replace(survey.network(), datum=Datum("free")))
    assert [o.kind for o in survey.network().observations] == [GnssBaselines.kind]
    assert adjustment.dof == 3
    assert adjustment.vtpv < 1e-4


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (vector("B1", "P", "none"), "has no base"),
        (vector("B1", "P", "name").replace("<VCVxx>4", "<VCVxx>-4"), "covariance"),
        (vector("B1", "P", "name").replace("<DeltaX>", "<DeltaX>x"), "no numbers"),
    ],
)
def test_what_cannot_be_is_told_with_its_line(tmp_path: Path, text: str, what: str) -> None:
    with pytest.raises(InputError, match=what) as refused:
        read_jobxml(job(tmp_path, base("B1"), text))
    assert refused.value.line == 4


def test_precisions_of_plan_and_height_without_covariance(tmp_path: Path) -> None:
    known = "<Precision><Horizontal>0.01</Horizontal><Vertical>0.03</Vertical></Precision>"
    latitude, longitude, height = PLACES["P"]
    at = f"<Latitude>{latitude}</Latitude><Longitude>{longitude}</Longitude><Height>0</Height>"
    text = vector("B1", "P", "name", f"{known}<WGS84>{at}</WGS84>").replace("VCV", "none")
    records = read_jobxml(job(tmp_path, base("B1"), text))
    up = ecef_from_geodetic(np.radians(latitude), np.radians(longitude), height + 1) - ecef("P")
    assert up @ records.blocks[0] @ up == pytest.approx(0.03**2)
    assert np.linalg.eigvalsh(records.blocks[0])[:2] == pytest.approx([0.01**2] * 2)
    assert len(records.warnings) == 1
    with pytest.raises(InputError, match="neither"):
        read_jobxml(job(tmp_path, base("B1"), text.replace("WGS84", "Grid")))


def test_deleted_vectors_are_not_read(tmp_path: Path) -> None:
    gone = vector("B1", "P", "name", "<Deleted>true</Deleted>")
    path = job(tmp_path, base("B1"), base("B2"), gone, vector("B1", "B2", "name"))
    assert read_jobxml(path).end == ["B2"]


def test_a_job_with_sights_as_well_is_one_of_a_total_station(tmp_path: Path) -> None:
    sight = f"<PointRecord><Name>T</Name>{CIRCLE}</PointRecord>"
    path = job(tmp_path, base("B1"), vector("B1", "P", "name"), sight)
    assert format_of(path) == "totalstation"


def test_a_job_of_others(shared_data: Path) -> None:
    path = shared_data / "faults" / "networks2" / "18-jobxml-vectors" / "job.jxl"
    if not path.is_file():
        pytest.skip(f"third-party data are not in {path.parent}")
    records = read_jobxml(path)
    assert (records.start, records.end) == (["BASE"], ["P1"])
    assert records.vectors[0, 0] == pytest.approx(12757.950516091)
    assert records.blocks[0, 0, 0] == pytest.approx(0.00232697860338)
    # its coordinates are those of a grid that the file does not describe
    with pytest.raises(InputError, match="no coordinates"):
        read_files([path])
