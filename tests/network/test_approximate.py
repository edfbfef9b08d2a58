"""Start values: closed forms against truth, free networks, missing ties in words."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.network.start_networks import (
    GON,
    Truth,
    figure_misfit,
    levelled_scanner,
    scanner,
    total_station,
)
from tribrach.errors import NoStartValues
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geometry import rotation
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.start.start_values import find_start
from tribrach.network.survey import Survey
from tribrach.observations.control import DirectedComponents, Heights, VectorPriors
from tribrach.observations.gnss import Antennas, GnssBaselines
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.planes import FittedPlanes
from tribrach.observations.poses import RelativePoses
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.observations.unknowns import State

FIXED = (False, False, False)
PLAN = (True, True, False)


def start_of(survey: Survey) -> State:
    """Start values of a survey."""
    return find_start(survey.network())


def point(state: State, name: str) -> np.ndarray:
    """Coordinates of a point."""
    return state.points[state.layout.index("point", name)]


def scalar(state: State, name: str) -> float:
    """Value of a scalar."""
    return float(state.scalars[state.layout.index("scalar", name)])


class TestTextbooks:
    """Set-ups of the literature, without any approximate coordinates."""

    def test_two_point_resection_with_distances(self) -> None:
        survey = Survey()
        survey.point("A", (1000, 2000, 50), free=FIXED)
        survey.point("B", (1040, 2030, 53), free=FIXED)
        ends = {"start": ["P", "P"], "end": ["A", "B"]}
        survey.add(SlopeDistances, values=[18.1174, 47.4135], sigma=0.001, **ends)
        directions = np.array([300.31001, 398.43814]) * GON
        survey.add(Directions, values=directions, sigma=1e-5, orientation=["o", "o"], **ends)
        zeniths = np.array([93.66460, 93.54399]) * GON
        survey.add(ZenithAngles, values=zeniths, sigma=1e-5, **ends)
        state = start_of(survey)
        assert np.allclose(point(state, "P"), (1015, 1990, 48.2), atol=2e-4)
        assert scalar(state, "o") / GON == pytest.approx(37.1234, abs=1e-3)

    def test_free_station_of_baumann(self) -> None:
        survey = Survey()
        targets = {
            "1": (1000, 1201.171, 108.680),
            "2": (1371.217, 1072.895, 111.974),
            "3": (1016.437, 952.352, 117.312),
        }
        for name, xyz in targets.items():
            survey.point(name, xyz, free=FIXED)
        sight = {"start": ["N"] * 3, "end": list(targets), "height_instrument": 1.6}
        sight["height_target"] = [1.572, 1.650, 1.588]
        survey.add(SlopeDistances, values=[223.6428, 190.2878, 205.1894], sigma=0.005, **sight)
        zeniths = np.array([95.9015, 94.0450, 92.8390]) * GON
        survey.add(ZenithAngles, values=zeniths, sigma=0.0025 * GON, **sight)
        directions = np.array([0, 160.1838, 320.7884]) * GON
        survey.add(Directions, values=directions, sigma=0.002 * GON, orientation=["o"] * 3, **sight)
        assert np.allclose(point(start_of(survey), "N"), (1181.7645, 1071.6795, 94.2598), atol=0.02)
        adjustment = adjust(survey.network())
        assert adjustment.sigma0_posterior == pytest.approx(1.1396, abs=2e-3)
        orientation = scalar(adjustment.state, "o") % (2 * np.pi)
        assert orientation / GON == pytest.approx(339.4087, abs=1e-3)

    def test_resection_by_angles_of_ghilani(self) -> None:
        survey = Survey()
        known = {
            "P": (1303.599, 1458.615),
            "Q": (1636.436, 1310.468),
            "R": (1503.395, 888.362),
            "S": (1506.262, 785.061),
        }
        for name, (e, n) in known.items():
            survey.point(name, (e, n, 0), free=FIXED)
        survey.point("U", free=PLAN)
        survey.add(
            Angles,
            values=np.radians([30.492504, 38.508615, 10.499157]),
            sigma=2e-5,
            start=["U"] * 3,
            end=["P", "Q", "R"],
            foresight=["Q", "R", "S"],
        )
        assert np.allclose(point(start_of(survey), "U")[:2], (1000, 1000), atol=0.1)

    def test_indoor_distances_in_space_with_two_gross_errors(self) -> None:
        # Blankenbach and Willert 2009: eight distances, of which two are wrong by decimetres
        rows = [
            (-8.62, 27.42, 10.29, 8.20), (-4.95, 27.30, 10.04, 3.85), (-4.85, 20.69, 10.51, 4.35),
            (0.52, 22.59, 9.77, 3.51), (-6.12, 25.48, 10.92, 3.98), (0.45, 27.39, 10.75, 4.37),
            (0.61, 17.19, 9.71, 8.17), (-7.88, 22.45, 10.16, 5.73),
        ]  # fmt: skip
        survey = Survey()
        for i, (e, n, u, _) in enumerate(rows):
            survey.point(f"A{i}", (e, n, u), free=FIXED)
        survey.add(
            SlopeDistances,
            values=[r[3] for r in rows],
            sigma=0.05,
            start=["MS"] * 8,
            end=[f"A{i}" for i in range(8)],
        )
        adjusted = adjust(survey.network()).state
        assert np.allclose(point(adjusted, "MS"), (-2.3042, 24.3101, 9.5248), atol=1e-3)


class TestPlan:
    """Single figures in the plane."""

    def test_intersection_of_two_oriented_rays(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "A", ["B", "P"], distances=False)
        total_station(survey, truth, "B", ["A", "P"], distances=False)
        assert truth.near(start_of(survey), "P")

    def test_resection_by_three_directions(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "P", ["A", "B", "C"], distances=False)
        state = start_of(survey)
        assert truth.near(state, "P")
        assert scalar(state, "o P") == pytest.approx(truth.orientation["P"], abs=1e-8)

    def test_two_directions_and_one_distance(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "P", ["A", "B"], distances=False)
        total_station(survey, truth, "P", ["C"], directions=False)
        total_station(survey, truth, "A", ["P"], directions=False)
        assert truth.near(start_of(survey), "P")

    def test_three_distances(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C", plan=True)
        for name in "ABC":
            d = truth.plan(name, "P")
            survey.add(HorizontalDistances, values=[d], sigma=0.01, start=[name], end=["P"])
        assert truth.near(start_of(survey), "P", axes=2)

    def test_two_unknown_stations_on_two_known_points(self, truth: Truth) -> None:
        # Hansen's problem: no distance anywhere
        survey = truth.survey("A", "B")
        total_station(survey, truth, "P", ["A", "B", "Q"], distances=False)
        total_station(survey, truth, "Q", ["A", "B", "P"], distances=False)
        assert truth.near(start_of(survey), "P", "Q")

    def test_traverse_between_unknown_stations(self, truth: Truth) -> None:
        survey = truth.survey("A", "B")
        for station, targets in (("P", "AQ"), ("Q", "PR"), ("R", "QB")):
            total_station(survey, truth, station, list(targets))
        assert truth.near(start_of(survey), "P", "Q", "R")

    def test_azimuth_gives_the_heading(self, truth: Truth) -> None:
        survey = truth.survey("A")
        total_station(survey, truth, "P", ["A", "Q"])
        azimuth = [truth.azimuth("P", "Q")]
        survey.add(Azimuths, values=azimuth, sigma=1e-5, start=["P"], end=["Q"])
        assert truth.near(start_of(survey), "P", "Q")

    def test_height_known_plan_unknown(self, truth: Truth) -> None:
        survey = truth.survey("A", "B")
        u = truth.xyz["P"][2]
        survey.point("P", (np.nan, np.nan, u), free=PLAN)
        total_station(survey, truth, "P", ["A", "B"])
        state = start_of(survey)
        assert truth.near(state, "P")
        assert point(state, "P")[2] == u


class TestHeights:
    """Levelling alone."""

    def test_levelled_chain_from_either_end(self) -> None:
        survey = Survey()
        survey.point("A", (0, 0, 100), free=FIXED)
        for name in "BCD":
            survey.point(name, (0, 0, np.nan), free=(False, False, True))
        survey.add(
            HeightDifferences,
            values=[1.0, -2.0, 4.0],
            sigma=0.001,
            start=["A", "C", "C"],
            end=["B", "B", "D"],
        )
        state = start_of(survey)
        assert [point(state, n)[2] for n in "BCD"] == pytest.approx([101, 103, 107])

    def test_free_levelling_starts_anywhere(self) -> None:
        survey = Survey(datum=Datum("free"))
        for name in "ABC":
            survey.point(name, free=(False, False, True))
        ends = {"start": list("ABC"), "end": list("BCA")}
        survey.add(HeightDifferences, values=[1.0, 2.0, -3.0], sigma=0.001, **ends)
        heights = [point(start_of(survey), n)[2] for n in "ABC"]
        assert np.diff(heights) == pytest.approx([1.0, 2.0])


class TestSpace:
    """Scanners, GNSS, planes."""

    def test_scanner_by_three_targets_places_a_fourth(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        pose = scanner(survey, truth, "S", ["A", "B", "C", "P"])
        state = start_of(survey)
        assert np.allclose(state.pose_r[0], pose, atol=1e-9)
        assert truth.near(state, "P")

    def test_levelled_scanner_by_two_targets(self, truth: Truth) -> None:
        survey = truth.survey("A", "B")
        pose = levelled_scanner(survey, truth, "S", ["A", "B", "P"])
        state = start_of(survey)
        assert np.allclose(state.pose_r[0], pose, atol=1e-6)
        assert truth.near(state, "P", atol=1e-4)

    def test_scanners_before_control(self, truth: Truth) -> None:
        # no station sees three control points, all together do
        survey = truth.survey("A", "B", "C")
        names = ["P", "Q", "R", "T"]
        scanner(survey, truth, "S1", ["A", *names])
        scanner(survey, truth, "S2", ["B", *names])
        scanner(survey, truth, "S3", ["C", *names])
        assert truth.near(start_of(survey), *names)

    def test_relative_poses_carry_on(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        first = scanner(survey, truth, "S1", ["A", "B", "C"])
        turn, shift = rotation.exp(np.array([0.1, 0.2, 1.0])), np.array([5.0, 6.0, 7.0])
        for start, end, r, t in (
            ("S1", "S2", turn, shift),
            ("S3", "S2", turn, shift),
        ):
            survey.add(
                RelativePoses,
                values=[[*t, 0, 0, 0]],
                sigma=np.full((1, 6), 0.001),
                start=[start],
                end=[end],
                rotation=r[None],
            )
        state = start_of(survey)
        s1, s2, s3 = (state.layout.index("pose", n) for n in ("S1", "S2", "S3"))
        assert np.allclose(state.pose_r[s2], first @ turn)
        assert np.allclose(state.pose_t[s2], state.pose_t[s1] + first @ shift)
        assert np.allclose(state.pose_r[s3], first)
        assert np.allclose(state.pose_t[s3], state.pose_t[s1])

    def test_planes_place_a_scanner(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        normals = np.array([[1.0, 0.1, 0], [0, 1.0, 0.1], [0.1, 0, 1.0], [0.5, 0.5, 0.1]])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        offsets = np.array([30.0, 40.0, 20.0, 50.0])
        first = scanner(survey, truth, "S1", ["A", "B", "C"])
        second, t2 = rotation.exp(np.array([0.2, -0.3, 2.0])), np.array([3.0, -4.0, 1.0])
        for name, r, t in (("S1", first, truth.xyz["S1"]), ("S2", second, t2)):
            seen = normals @ r
            d = offsets - normals @ t
            survey.add(
                FittedPlanes,
                values=np.zeros((4, 3)),
                sigma=np.full((4, 3), 0.001),
                station=[name] * 4,
                plane=["N", "E", "F", "D"],
                normal=seen,
                centroid=seen * d[:, None],
            )
        survey.station("S2")
        state = start_of(survey)
        s2 = state.layout.index("pose", "S2")
        assert np.allclose(state.pose_r[s2], second, atol=1e-9)
        assert np.allclose(state.pose_t[s2], t2, atol=1e-8)

    def test_antennas_of_several_stations(self, truth: Truth) -> None:
        survey = Survey()
        names = ["P", "Q", "R", "T"]
        lever = np.array([0.1, 0.2, 0.3])
        survey.add(VectorPriors, values=[lever], sigma=np.full((1, 3), 0.001), vector=["arm"])
        for i in range(4):
            r = scanner(survey, truth, f"S{i}", names)
            survey.add(
                Antennas,
                values=[truth.xyz[f"S{i}"] + r @ lever],
                sigma=np.full((1, 3), 0.01),
                station=[f"S{i}"],
                lever_arm=["arm"],
            )
        assert truth.near(start_of(survey), *names)

    def test_baselines_and_sights_on_the_ellipsoid(self) -> None:
        site = EllipsoidSite(np.radians(50.0), np.radians(15.0), 300.0)
        survey = Survey(site=site)
        truth = {"A": (30000.0, 20000.0, -90.0), "B": (31000.0, 20500.0, -80.0)}
        truth["P"] = (30400.0, 21000.0, -95.0)
        x = {k: np.array(v) for k, v in truth.items()}
        survey.point("A", x["A"], free=FIXED)
        baseline = {"start": ["A"], "end": ["B"]}
        survey.add(GnssBaselines, values=[x["B"] - x["A"]], sigma=np.full((1, 3), 0.01), **baseline)
        u = site.axes(x["A"][None])[0] @ np.stack([x["B"] - x["A"], x["P"] - x["A"]], axis=1)
        ends = {"start": ["A", "A"], "end": ["B", "P"]}
        azimuth = np.arctan2(u[0], u[1])
        survey.add(Directions, values=azimuth - 1.0, sigma=1e-5, orientation=["o"] * 2, **ends)
        survey.add(SlopeDistances, values=np.linalg.norm(u, axis=0), sigma=0.01, **ends)
        zenith = np.arctan2(np.hypot(u[0], u[1]), u[2])
        survey.add(ZenithAngles, values=zenith, sigma=1e-5, **ends)
        state = start_of(survey)
        assert scalar(state, "o") == pytest.approx(1.0, abs=1e-4)
        assert np.allclose(point(state, "P"), x["P"], atol=0.3)

    def test_gross_errors_are_outvoted(self) -> None:
        rng = np.random.default_rng(3)
        x = rng.uniform(0, 50, (40, 3))
        survey = Survey()
        for i in range(40):
            survey.point(f"T{i}", x[i] if i < 5 else [np.nan] * 3, free=(i >= 5,) * 3)
        for j in range(8):
            t, r = rng.uniform(0, 50, 3), rotation.exp(rng.uniform(-2, 2, 3))
            seen = rng.choice(40, 25, replace=False)
            u = (x[seen] - t) @ r
            u[rng.choice(25, 1)] += 10.0
            names = [f"T{i}" for i in seen]
            survey.station(f"S{j}")
            survey.add(
                TargetCentres,
                values=u,
                sigma=np.full((25, 3), 0.002),
                station=[f"S{j}"] * 25,
                target=names,
            )
        assert np.abs(start_of(survey).points - x).max() < 0.05


class TestFreeNetworks:
    """Nothing is given: the figure must be right, wherever it lies."""

    @settings(max_examples=25, deadline=None)
    @given(seed=st.integers(0, 10**6), n=st.integers(4, 12))
    def test_total_stations(self, seed: int, n: int) -> None:
        truth = Truth.random(seed, [f"P{i}" for i in range(n)])
        survey = Survey(datum=Datum("free"))
        names = list(truth.xyz)
        for i, name in enumerate(names):
            total_station(survey, truth, name, [names[(i + 1) % n], names[(i + 2) % n]])
        assert figure_misfit(start_of(survey), truth) < 1e-6

    @settings(max_examples=15, deadline=None)
    @given(seed=st.integers(0, 10**6), stations=st.integers(2, 6))
    def test_scanners(self, seed: int, stations: int) -> None:
        truth = Truth.random(seed, [f"P{i}" for i in range(10)])
        rng = np.random.default_rng(seed)
        survey = Survey(datum=Datum("free"))
        for j in range(stations):
            scanner(survey, truth, f"S{j}", [f"P{i}" for i in sorted(rng.permutation(10)[:8])])
        assert figure_misfit(start_of(survey), truth) < 1e-6

    @settings(max_examples=15, deadline=None)
    @given(seed=st.integers(0, 10**6))
    def test_distances_in_the_plane(self, seed: int) -> None:
        truth = Truth.random(seed, list("PQRTUV"))
        survey = Survey(datum=Datum("free"))
        for name in truth.xyz:
            survey.point(name, free=PLAN)
        pairs = [(a, b) for a in truth.xyz for b in truth.xyz if a < b]
        survey.add(
            HorizontalDistances,
            values=[truth.plan(a, b) for a, b in pairs],
            sigma=0.01,
            start=[a for a, _ in pairs],
            end=[b for _, b in pairs],
        )
        state = start_of(survey)
        for a, b in pairs:
            d = np.linalg.norm((point(state, a) - point(state, b))[:2])
            assert d == pytest.approx(truth.plan(a, b), abs=1e-3)


class TestMissingTies:
    """The sentences name what is missing."""

    def sentences(self, survey: Survey) -> str:
        with pytest.raises(NoStartValues) as caught:
            start_of(survey)
        return "\n".join(caught.value.sentences)

    def test_one_direction_only(self, truth: Truth) -> None:
        survey = truth.survey("A", "B")
        total_station(survey, truth, "A", ["B"])
        total_station(survey, truth, "A", ["P"], distances=False, zeniths=False)
        text = self.sentences(survey)
        assert "point P is observed only by one direction from A" in text
        assert "a second direction from another one" in text

    def test_height_only(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "C", ["A"])
        total_station(survey, truth, "A", ["B", "P"], distances=False, zeniths=False)
        total_station(survey, truth, "B", ["A", "P"], distances=False, zeniths=False)
        assert "the height of point P is observed only by 2 directions" in self.sentences(survey)

    def test_scanner_with_one_common_target(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        scanner(survey, truth, "S1", ["A", "B", "C", "P"])
        scanner(survey, truth, "S2", ["P", "Q"])
        text = self.sentences(survey)
        assert "station S2 shares only 1 target with the rest: 3 common targets" in text

    def test_part_without_connection(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "A", ["B", "C"])
        total_station(survey, truth, "P", ["Q", "R", "T"])
        text = self.sentences(survey)
        assert "P, Q, R, T are connected, but no observation ties them to the rest" in text

    def test_swapped_columns_of_the_control(self) -> None:
        truth = Truth.random(8, list("ABCDE"))
        survey = Survey()
        for name, (e, n, u) in truth.xyz.items():
            survey.point(name, (n, e, u), free=FIXED)
        scanner(survey, truth, "S1", list("ABCDE"))
        assert "your columns look swapped (N/E)" in self.sentences(survey)

    def test_observed_by_nothing(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "A", ["B", "C"])
        survey.point("Z")
        assert "point Z is observed by nothing; a distance" in self.sentences(survey)

    def test_observed_by_what_gives_no_start_values(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "A", ["B", "C"])
        for name in "YZ":
            survey.point(name)
        survey.add(
            DirectedComponents,
            values=[1.0, 2.0, 3.0, 4.0],
            sigma=0.01,
            position=["Y", "Z", "Z", "A"],
            direction=np.array([[0.6, 0.8, 0.0], [0.6, 0.8, 0.0], [0.8, -0.6, 0.0], [0.6, 0.8, 0]]),
        )
        text = self.sentences(survey)
        assert "point Y is observed by nothing that gives start values: one component;" in text
        assert "point Z is observed by nothing that gives start values: 2 components;" in text

    def test_observed_in_height_alone(self, truth: Truth) -> None:
        survey = truth.survey("A", "B", "C")
        total_station(survey, truth, "A", ["B", "C"])
        survey.point("Z")
        survey.add(Heights, values=[3.0], sigma=0.01, position=["Z"])
        assert "point Z is observed by nothing that gives start values in plan: one" in (
            self.sentences(survey)
        )


@pytest.mark.data
def test_networks_of_gama_without_approximate_coordinates(shared_data: Path) -> None:
    from tribrach.io.survey.gama.reader import read

    files = sorted((shared_data / "networks" / "gama").rglob("*.gkf"))
    assert len(files) > 40
    for file in files:
        survey = read(file)
        for given_point in survey.points.values():
            if given_point.covariance is None:
                given_point.xyz = np.where(given_point.free, np.nan, given_point.xyz)
        assert adjust(survey.network()).iterations <= 5, file.name


@pytest.fixture
def truth() -> Truth:
    """Eight points and four stations of a small site."""
    return Truth.random(11, list("ABCPQRTU"))
