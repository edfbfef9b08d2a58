"""Sessions of several receivers: which baselines, from where, with which correlation.

The engine is replaced by one that knows the truth and adds receiver errors.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.gnss import sessions as session_run
from tribrach.gnss.antennas import AntennaSetup
from tribrach.gnss.attempts import Attempt, reason
from tribrach.gnss.baseline import Baseline, Processing
from tribrach.gnss.sessions import Occupation, ReceiverSession, run_sessions
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.project import Project
from tribrach.report.chapters import gnss as gnss_report

from .rinex_samples import navigation, rinex_2

PLACES = {
    "A": np.array([4253000.0, 2710000.0, 3893000.0]),
    "B": np.array([4253100.0, 2710500.0, 3892600.0]),
    "C": np.array([4252500.0, 2710300.0, 3893400.0]),
    "D": np.array([4252000.0, 2711000.0, 3893500.0]),
}
RECEIVER = np.diag([4e-6, 4e-6, 9e-6])


class Engine:
    """Baselines between true places with one error per receiver and session."""

    def __init__(self, rng: np.random.Generator | None = None) -> None:
        self.rng, self.calls = rng, []
        self.errors: dict[tuple[str, str], np.ndarray] = {}
        self.heights: dict[str, float] = {}

    def error(self, session: str, name: str) -> np.ndarray:
        if self.rng is None:
            return np.zeros(3)
        if (session, name) not in self.errors:
            drawn = self.rng.multivariate_normal(np.zeros(3), RECEIVER)
            self.errors[session, name] = drawn
        return self.errors[session, name]

    def __call__(
        self,
        base: Path,
        rover: Path,
        navigation: tuple[Path, ...],
        base_xyz: np.ndarray,
        processing: Processing,
        *,
        base_antenna: AntennaSetup,
        rover_antenna: AntennaSetup,
        progress: Progress,
    ) -> Baseline:
        (session, a), (_, b) = (path.stem.split("_") for path in (base, rover))
        self.calls.append((a, b, tuple(base_xyz)))
        self.heights |= {a: base_antenna.height, b: rover_antenna.height}
        vector = PLACES[b] - PLACES[a] + self.error(session, b) - self.error(session, a)
        return Baseline(
            base=base_xyz, rover=base_xyz + vector, covariance=2 * RECEIVER, formal=RECEIVER,
            factor=1.41, factor_source="test", ambiguities="fixed", fixed_share=1.0, epochs=100,
            epochs_common=100, ratio=9.0, satellites=8.0, start=1.3e9, end=1.3e9 + 3600,
            interval=30.0, systems="G", engine="test", files=(base.name, rover.name),
        )  # fmt: skip


def session(folder: Path, name: str, points: str, star: str | None = None) -> ReceiverSession:
    (folder / "day.nav").write_text(navigation())
    occupations = []
    for point in points:
        path = folder / f"{name}_{point}.obs"
        x, y, z = PLACES[point]
        there = f"{x:14.4f}{y:14.4f}{z:14.4f}"
        path.write_text(rinex_2().replace("  4157177.0658   671230.4766  4774767.0311", there))
        occupations.append(Occupation(point, path))
    return ReceiverSession(name, tuple(occupations), (folder / "day.nav",), star)


def test_baselines_start_where_coordinates_are_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = Engine()
    monkeypatch.setattr(session_run, "compute_baseline", engine)
    shown: list[tuple[int, int | None]] = []
    given = {"B": PLACES["B"] + [0.0, 0.0, 5.0]}
    results = run_sessions(
        [session(tmp_path, "one", "ABC"), session(tmp_path, "two", "CD")],
        given,
        Processing(),
        lambda what, done, total: shown.append((done, total)),
    )
    assert [len(result.baselines) for result in results] == [2, 1]
    assert shown[-1] == (3, 3)
    # every baseline starts at the given point or at one just computed from it
    start = {"B": given["B"]}
    for a, b, xyz in engine.calls:
        np.testing.assert_allclose(xyz, start[a], atol=1e-6)
        start[b] = PLACES[b] + [0.0, 0.0, 5.0]
    # heights of the files' headers
    assert engine.heights["A"] == 1.2345
    assert not any(result.warnings for result in results)


def test_without_coordinates_the_header_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_run, "compute_baseline", Engine())
    (result,) = run_sessions([session(tmp_path, "one", "AB")], {}, Processing())
    assert "header of one_A.obs" in result.warnings[0]


def test_a_star_needs_the_coordinates_of_its_centre(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = Engine()
    monkeypatch.setattr(session_run, "compute_baseline", engine)
    wish = session(tmp_path, "one", "ABCD", star="D")
    run_sessions([wish], {"D": PLACES["D"]}, Processing())
    assert [(a, b) for a, b, _ in engine.calls] == [("D", "A"), ("D", "B"), ("D", "C")]
    with pytest.raises(InputError, match="centre D of session one has no coordinates"):
        run_sessions([wish], {"A": PLACES["A"]}, Processing())


PROJECT = """
title = "Four receivers"
[site]
frame = "ITRF2014"
epoch = 2021.2
[[points]]
file = "control.csv"
role = "fixed"
[gnss]
navigation = ["day.nav"]
[[gnss.sessions]]
name = "one"
receivers = [{ point = "A", file = "one_A.obs" }, { point = "B", file = "one_B.obs" },
  { point = "C", file = "one_C.obs", antenna_height_m = 1.7 }, { point = "D", file = "one_D.obs" }]
[[gnss.sessions]]
name = "two"
star = "A"
receivers = [{ point = "A", file = "two_A.obs" }, { point = "B", file = "two_B.obs" },
  { point = "C", file = "two_C.obs" }, { point = "D", file = "two_D.obs" }]
"""


def four_receivers(folder: Path) -> Project:
    for name in ("one", "two"):
        session(folder, name, "ABCD")
    x, y, z = PLACES["A"]
    (folder / "control.csv").write_text(f"point,ecef_x_m,ecef_y_m,ecef_z_m\nA,{x},{y},{z}\n")
    (folder / "p.toml").write_text(PROJECT)
    return Project.load(folder / "p.toml")


def test_project_adjusts_sessions_with_their_correlation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Monte Carlo over receiver errors: sum of squares and errors of points are as stated."""
    rng = np.random.default_rng(11)
    project = four_receivers(tmp_path)
    sums, errors = [], []
    for _ in range(60):
        engine = Engine(rng)
        monkeypatch.setattr(session_run, "compute_baseline", engine)
        adjustment = adjust(open_job(project).network())
        assert adjustment.dof == 9
        sums.append(adjustment.vtpv)
        layout, site = adjustment.layout, adjustment.network.site
        found = site.to_ecef(adjustment.state.points)  # type: ignore[attr-defined]
        names = ["B", "C", "D"]
        e = np.concatenate([found[layout.index("point", n)] - PLACES[n] for n in names])
        turn = np.kron(np.eye(3), site.w_from_ecef)  # type: ignore[attr-defined]
        c = np.block([[adjustment.covariance(a, b) for b in names] for a in names])
        errors.append(e @ np.linalg.solve(turn.T @ c @ turn, e))
    for total, dof in ((sum(sums), 60 * 9), (sum(errors), 60 * 9)):
        assert chi2.ppf(0.001, dof) < total < chi2.ppf(0.999, dof)
    assert engine.heights["C"] == 1.2345
    # the exact answer: two sessions of equal receiver errors leave half of 2 receivers' variance
    turned = site.w_from_ecef @ RECEIVER @ site.w_from_ecef.T  # type: ignore[attr-defined]
    np.testing.assert_allclose(adjustment.covariance("B", "B"), turned, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(adjustment.covariance("B", "C"), turned / 2, rtol=1e-6, atol=1e-12)


def test_a_float_baseline_takes_part_with_its_covariance_and_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A-B is float in the first of two sessions: it counts by its larger covariance."""
    ways = (
        Attempt("L1 and L2", 2, "float", 0.04, 1.5, 0.04, taken=True),
        Attempt("L1 alone", 1, "float", 0.5, 2.5, 0.05, away=0.01),
    )

    class Floating(Engine):
        def __call__(self, base: Path, rover: Path, *args: object, **more: object) -> Baseline:
            found = super().__call__(base, rover, *args, **more)  # type: ignore[arg-type]
            if (base.stem, rover.stem) != ("one_A", "one_B"):
                return found
            return replace(
                found, rover=found.rover + np.array([0.09, 0.0, 0.0]),
                covariance=100 * found.covariance,
                ambiguities="float", fixed_share=0.04, ratio=1.5, names=("A", "B"),
                attempts=ways, choice=reason(ways, 0),
            )  # fmt: skip

    monkeypatch.setattr(session_run, "compute_baseline", Floating())
    for name in ("one", "two"):
        session(tmp_path, name, "AB")
    x, y, z = PLACES["A"]
    (tmp_path / "control.csv").write_text(f"point,ecef_x_m,ecef_y_m,ecef_z_m\nA,{x},{y},{z}\n")
    receivers = '{ point = "A", file = "%s_A.obs" }, { point = "B", file = "%s_B.obs" }'
    text = PROJECT[: PROJECT.index("[[gnss.sessions]]")]
    for name in ("one", "two"):
        text += f'[[gnss.sessions]]\nname = "{name}"\nreceivers = [{receivers % (name, name)}]\n'
    (tmp_path / "p.toml").write_text(text)
    job = open_job(Project.load(tmp_path / "p.toml"))
    adjustment = adjust(job.network())
    site, layout = adjustment.network.site, adjustment.layout
    found = site.to_ecef(adjustment.state.points)[layout.index("point", "B")]  # type: ignore[attr-defined]
    # weights 1 : 100 of two baselines that differ by 90 mm
    np.testing.assert_allclose(found - PLACES["B"], [0.09 / 101, 0.0, 0.0], atol=1e-6)
    drawn: list[tuple[str, bool]] = []
    monkeypatch.setattr(
        gnss_report,
        "baseline_map",
        lambda plan, names, lines: drawn.extend((x.session, x.floating) for x in lines),
    )
    chapter = gnss_report.gnss_chapter(adjustment, job.sessions)
    assert chapter is not None
    words = " ".join(chapter.sentences)
    assert "ambiguities of 1 are fixed" in words
    assert "Not fixed in session one is A to B" in words
    assert "float ambiguities, 4 % of 100 epochs fixed, ratio 1.5, sigma 58.3 mm" in words
    assert (
        "A to B of session one was doubtful and computed in other ways too: L1 and L2 is kept"
        in words
    )
    tables = {table.name: table for table in chapter.tables}
    assert [len(tables[f"gnss-{name}"].rows) for name in ("baselines", "attempts")] == [2, 2]
    states = [b.ambiguities for b in chapter.data.baselines]  # type: ignore[union-attr]
    assert states == ["float", "fixed"]
    assert drawn == [("one", True), ("two", False)]


def test_baselines_are_computed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = Engine()
    monkeypatch.setattr(session_run, "compute_baseline", engine)
    job = open_job(four_receivers(tmp_path))
    for _ in range(3):
        job.network()
    assert len(engine.calls) == 6
    assert len(job.sessions) == 2


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("epoch = 2021.2", "", "move with time and have no epoch"),
        ("ITRF2014", "ITRF1914", "not known"),
        ('star = "A"', 'star = "X"', "star names X"),
        ('point = "B", file = "two_B', 'point = "A", file = "two_B', "two receivers"),
        ('navigation = ["day.nav"]', "", "no navigation files"),
        ('role = "fixed"', 'role = "fixed"\nepoch = 2005.0', "not to be mixed"),
        ('role = "fixed"', 'role = "fixed"\nplate = "ANAT"', "plate 'ANAT' is none"),
        (
            'role = "fixed"',
            'role = "fixed"\nvelocity_m_per_year = [20.0, 1.0, 1.0]',
            "in m, not mm",
        ),
        ('frame = "ITRF2014"\nepoch = 2021.2', "curvature_radius_m = 6.4e6", "site is flat"),
        (
            'frame = "ITRF2014"\nepoch = 2021.2',
            'kind = "flat"\nframe = "ITRF2014"\nepoch = 2021.2',
            "ellipsoid, and the site is flat",
        ),
        ("[gnss]", '[[observations]]\nfile = "n.gkf"\nepoch = 2000.0\n[gnss]', "says nothing"),
        ("two_B.obs", "two_X.obs", "cannot be read"),
    ],
)
def test_wrong_projects_end_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, words: str
) -> None:
    monkeypatch.setattr(session_run, "compute_baseline", Engine())
    four_receivers(tmp_path)
    path = tmp_path / "p.toml"
    assert old in PROJECT
    path.write_text(PROJECT.replace(old, new))
    (tmp_path / "n.gkf").write_text("<gama-local/>")
    if "flat" in words:
        (tmp_path / "control.csv").write_text("point,e_m,n_m,u_m\nA,0,0,0\n")
    with pytest.raises(InputError, match=words):
        open_job(path).network()


def test_control_of_another_epoch_is_carried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_run, "compute_baseline", Engine())
    four_receivers(tmp_path)
    path = tmp_path / "p.toml"
    text = PROJECT.replace(
        'role = "fixed"',
        'role = "fixed"\nepoch = 2011.2\nvelocity_m_per_year = [0.01, -0.02, 0.03]',
    )
    path.write_text(text)
    network = open_job(path).network()
    found = network.site.to_ecef(network.start.points)[0]  # type: ignore[attr-defined]
    np.testing.assert_allclose(found, PLACES["A"] + [0.1, -0.2, 0.3], atol=1e-6)
    assert network.reference.epoch == 2021.2
