"""LandXML and JobXML: references between records, units, raw distances."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.survey.totalstation import corrected, reduce_file
from tribrach.io.totalstation import jobxml, landxml
from tribrach.units import GON, UNITS

LAND = """<?xml version="1.0"?>
<LandXML xmlns="http://www.landxml.org/schema/LandXML-{version}" version="{version}">
<Units><{system} linearUnit="{length}" angularUnit="{angle}"/></Units>
<CgPoints><CgPoint name="B">300.0 400.0 5.0</CgPoint></CgPoints>
<Survey>
<InstrumentSetup id="s1" stationName="S" instrumentHeight="1.5">
 <InstrumentPoint>100.0 200.0 10.0</InstrumentPoint>
 <Backsight id="b" azimuth="50" circle="20"><BacksightPoint name="B"/></Backsight>
 <RawObservation horizAngle="20" zenithAngle="80" slopeDistance="50" targetHeight="1.6"
   directFace="true"><TargetPoint name="B"/></RawObservation>
</InstrumentSetup>
<TargetSetup id="t" targetHeight="1.7" prismConstant="-0.03"/>
<ObservationGroup id="g" setupID="s1">
 <RawObservation horizAngle="220" zenithAngle="320" slopeDistance="50" targetSetupID="t"
   directFace="false"><TargetPoint pntRef="B"/></RawObservation>
 <RawObservation azimuth="70" zenithAngle="100" horizDistance="30"><TargetPoint desc="P">
   1.0 2.0 3.0</TargetPoint></RawObservation>
 <RawObservation setupID="none" horizAngle="1"><TargetPoint name="X"/></RawObservation>
 <RedHorizontalPosition/>
</ObservationGroup>
</Survey></LandXML>
"""


def land(tmp_path, version="1.2", system="Metric", length="meter", angle="grads", text=LAND):
    path = tmp_path / "survey.xml"
    path.write_text(text.format(version=version, system=system, length=length, angle=angle))
    return landxml.read(path)


@pytest.mark.parametrize("version", ["1.0", "1.1", "1.2", "2.0"])
@pytest.mark.parametrize(
    ("system", "length", "angle", "metre", "turn"),
    [
        ("Metric", "meter", "grads", 1.0, GON),
        ("Imperial", "foot", "decimal degrees", UNITS["ft"], UNITS["deg"]),
        ("Imperial", "USSurveyFoot", "decimal dd.mm.ss", UNITS["usft"], UNITS["deg"]),
    ],
)
def test_landxml(tmp_path, version, system, length, angle, metre, turn):
    raw = land(tmp_path, version, system, length, angle)
    assert raw.setups.station.tolist() == ["S"]
    assert raw.setups.backsight.tolist() == ["B"]
    np.testing.assert_allclose(raw.setups.azimuth, [50 * turn])
    np.testing.assert_allclose(raw.setups.height, [1.5 * metre])
    shots = raw.shots
    assert shots.target.tolist() == ["B", "B", "P"]
    assert shots.face.tolist() == [1, 2, 1]
    np.testing.assert_allclose(shots.direction, np.array([20, 220, 70]) * turn)
    np.testing.assert_allclose(shots.zenith, np.array([80, 320, 100]) * turn)
    level = 30 / np.sin(100 * turn)
    np.testing.assert_allclose(shots.distance, np.array([50, 50, level]) * metre)
    np.testing.assert_allclose(shots.height, np.array([1.6, 1.7, np.nan]) * metre)
    assert raw.unknown == {"<RedHorizontalPosition>": 1}
    assert "set-up none" in raw.problems[0].what
    assert raw.points.name.tolist() == ["B", "S", "P"]
    assert raw.points.given.tolist() == [True, True, False]
    np.testing.assert_allclose(raw.points.xyz[0], np.array([400, 300, 5]) * metre)


def test_control_of_landxml_is_told_not_to_be_held(tmp_path):
    assert not land(tmp_path).notes
    text = LAND.replace('<CgPoint name="B">', '<CgPoint name="B" role="control">')
    (note,) = land(tmp_path, text=text).notes
    assert "calls B control" in note


def test_landxml_with_units_that_do_not_exist(tmp_path):
    with pytest.raises(InputError, match="units furlong and grads are unknown"):
        land(tmp_path, length="furlong")


def test_landxml_without_survey(tmp_path):
    with pytest.raises(InputError, match="there is no <Survey>"):
        land(tmp_path, text='<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2"/>')


def test_entities_are_refused(tmp_path):
    text = '<!DOCTYPE x [<!ENTITY a "b">]><LandXML/>'
    with pytest.raises(InputError, match="entities"):
        land(tmp_path, text=text)
    path = tmp_path / "x.jxl"
    path.write_text(text.replace("LandXML", "JOBFile"))
    with pytest.raises(InputError, match="entities"):
        jobxml.read(path)


JOB = """<?xml version="1.0"?>
<JOBFile jobName="test" version="5.6"><FieldBook>
<InstrumentRecord ID="i"><Type>TotalStation</Type><Model>S6</Model></InstrumentRecord>
<AtmosphereRecord ID="a"><Pressure>1009</Pressure><Temperature>20</Temperature>
 <PPM>-2.9002174499703</PPM></AtmosphereRecord>
<StationRecord ID="s"><StationName>S</StationName><TheodoliteHeight>1.7</TheodoliteHeight>
 <AtmosphereID>a</AtmosphereID></StationRecord>
<TargetRecord ID="t"><PrismConstant>-0.0169</PrismConstant><TargetHeight>1.5</TargetHeight>
</TargetRecord>
<BackBearingRecord ID="b"><BackSight>B</BackSight><Face1HorizontalCircle>10</Face1HorizontalCircle>
 <OrientationCorrection>30</OrientationCorrection></BackBearingRecord>
<PointRecord ID="1"><Name>B</Name><Method>KeyedIn</Method><Grid><North>1</North><East>2</East>
 <Elevation>3</Elevation></Grid></PointRecord>
{sights}
<StrangeRecord/>
</FieldBook></JOBFile>
"""

SIGHT = """<PointRecord ID="{name}"><Name>{name}</Name><Code>TREE</Code><Method>{method}</Method>
<Deleted>{deleted}</Deleted><StationID>{station}</StationID><BackBearingID>b</BackBearingID>
<TargetID>t</TargetID><Circle><HorizontalCircle>{h}</HorizontalCircle>
<VerticalCircle>{v}</VerticalCircle><EDMDistance>154.81087</EDMDistance><Face>{face}</Face></Circle>
<ComputedGrid><North>5</North><East>6</East><Elevation>7</Elevation></ComputedGrid></PointRecord>
"""


def sight(name, h, v, face="Face1", method="DirectReading", deleted="false", station="s"):
    return SIGHT.format(
        name=name, h=h, v=v, face=face, method=method, deleted=deleted, station=station
    )


def test_jobxml(tmp_path):
    path = tmp_path / "job.jxl"
    sights = [
        sight("P", 260.6505192, 90.9680796),
        sight("P", 80.6505192, 269.0319204, "Face2"),
        sight("P", 260.65, 90.968, method="MeanTurnedAngle"),
        sight("Q", 1, 90, deleted="true"),
        sight("R", 1, 90, station="gone"),
    ]
    path.write_text(JOB.format(sights="".join(sights)))
    raw = jobxml.read(path)
    assert raw.instrument == "TotalStation S6"
    assert raw.setups.station.tolist() == ["S"]
    assert raw.setups.height.tolist() == [1.7]
    np.testing.assert_allclose(raw.setups.azimuth, [np.radians(40)])
    shots = raw.shots
    assert shots.target.tolist()[:2] == ["B", "P"]  # the circle was set on the backsight
    assert shots.off.tolist()[3:] == [
        "the instrument made this mean of readings that are used",
        "deleted in the field",
    ]
    assert not shots.series.any()
    assert shots.face.tolist()[1:3] == [1, 2]
    np.testing.assert_allclose(shots.direction[1:3], np.radians([260.6505192, 80.6505192]))
    assert not shots.applied[1:].any()
    # the figure that Trimble's own conversion gives for these readings
    assert corrected(raw)[1] == pytest.approx(154.7935210148134, abs=1e-9)
    assert raw.unknown == {"<StrangeRecord>": 1}
    assert "'gone'" in raw.problems[0].what
    assert raw.points.name.tolist() == ["B", "P", "P", "P", "R"]
    assert raw.points.given.tolist() == [True, False, False, False, False]


def test_rounds_and_their_means_count_once(tmp_path):
    """Two rounds in two faces, the means that the instrument made of them, and a lone mean."""
    start = '<StartRoundRecord ID="r"><RoundNumber>{}</RoundNumber></StartRoundRecord>'
    sights = [sight("X", 50, 95)]
    for number, turn in ((1, 0.0), (2, 0.001)):
        sights.append(start.format(number))
        for name, h, v in (("B", 10, 90), ("P", 80, 85)):
            sights.append(sight(name, h + turn, v))
            sights.append(sight(name, h + 180 + turn, 360 - v, "Face2"))
        sights.append("<EndRoundRecord/>")
    sights += [
        sight("B", 10.0005, 90, "FaceNull", "MeanTurnedAngle"),
        sight("P", 80.0005, 85, "FaceNull", "MeanTurnedAngle"),
        sight("M", 120, 88, "FaceNull", "MeanTurnedAngle"),
        sight("D", 130, 88, deleted="true"),
        sight("D", 130, 88, "FaceNull", "MeanTurnedAngle"),
    ]
    path = tmp_path / "job.jxl"
    path.write_text(JOB.format(sights="".join(sights)))
    raw = jobxml.read(path)
    used = raw.shots.off == ""
    assert raw.shots.series[:9].tolist() == [1] * 5 + [2] * 4
    assert raw.shots.target[used].tolist() == ["X", *"BBPP", *"BBPP", "M", "D"]
    assert (~used).sum() == 3
    assert raw.notes == (
        "2 mean turned angles have no readings beside them; each is taken as one reading in one "
        "face.",
    )
    assert raw.unknown == {"<StrangeRecord>": 1}
    means = reduce_file(raw).reduction.directions
    rows = list(
        zip(np.array(list("XBPMD"))[means.target], means.circle, means.readings, strict=True)
    )
    # X is in the first set only, M and D were read after the second
    assert rows == [
        *(("X", 0, 1), ("B", 0, 2), ("P", 0, 2)),
        *(("B", 1, 2), ("P", 1, 2), ("M", 1, 1), ("D", 1, 1)),
    ]
    turn = np.degrees(means.value[[2, 4]] - means.value[[1, 3]])
    np.testing.assert_allclose(turn, 70, atol=1e-9)


def test_raw_distances_with_air_and_without_ppm(tmp_path):
    """The first velocity correction stands in for parts per million that are not given."""
    path = tmp_path / "job.jxl"
    text = JOB.format(sights=sight("P", 1, 90)).replace("<PPM>-2.9002174499703</PPM>", "")
    path.write_text(text)
    raw = jobxml.read(path)
    found = (corrected(raw)[-1] + 0.0169) / 154.81087 - 1
    # 8 degrees warmer: about +8 ppm, 4 hPa less: about +1 ppm
    assert found * 1e6 == pytest.approx(9.0, abs=0.8)
