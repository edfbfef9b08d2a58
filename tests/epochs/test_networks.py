"""Epochs of networks that are adjusted here, from files and projects, through the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli.commands import app
from tribrach.epochs.comparison import Settings
from tribrach.errors import InputError
from tribrach.io.epoch_files import read_epoch
from tribrach.job.epochs import EpochSettings, compare_epochs, epoch_of, shared_covariance
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.control import Coordinate
from tribrach.observations.levelling import HeightDifferences
from tribrach.questions.epochs.from_files import compare_epoch_files, epoch_from_files

GAMA = Path(__file__).parents[3] / "shared/data/networks/gama/deformation"
HEIGHTS = {"A": 10.0, "B": 11.2, "C": 12.9, "D": 9.4, "P": 10.7}
LINES = [
    ("A", "B"),
    ("B", "C"),
    ("C", "D"),
    ("D", "A"),
    ("A", "P"),
    ("P", "C"),
    ("B", "D"),
    ("D", "P"),
]


def levelling(
    rng: np.random.Generator, moved: dict[str, float], survey: Survey | None = None
) -> Survey:
    """Lines of levelling with errors, in a survey of their own or beside others."""
    survey, sigma = survey or Survey(), 3e-4
    true = {name: height + moved.get(name, 0.0) for name, height in HEIGHTS.items()}
    for name, height in HEIGHTS.items():
        survey.point(name, (0.0, 0.0, height), role="free")
    values = [true[b] - true[a] + rng.normal(0, sigma) for a, b in LINES]
    survey.add(
        HeightDifferences,
        values=values,
        sigma=np.full(len(values), sigma),
        start=[a for a, _ in LINES],
        end=[b for _, b in LINES],
    )
    return survey


def free(survey: Survey) -> object:
    return adjust(observed_part(survey).network().with_datum(Datum("free")))


def test_the_form_is_what_joining_both_epochs_costs() -> None:
    """One adjustment in which every point is one point: its sum of squares grows by T."""
    rng = np.random.default_rng(4)
    one, two = levelling(rng, {}), levelling(rng, {"P": 0.002})
    first, second = free(one), free(two)
    (lines,) = two.tables()
    one.replace_tables([[*one.tables(), lines]])
    joined = free(one)
    found = compare_epochs(epoch_of(first, "1"), epoch_of(second, "2"), EpochSettings())
    expected = joined.vtpv - first.vtpv - second.vtpv
    assert found.comparison.whole.statistic == pytest.approx(expected, rel=1e-6)
    assert found.comparison.whole.dof == joined.dof - first.dof - second.dof
    assert found.comparison.moved == ("P",)


def test_control_that_both_share_cancels() -> None:
    """Errors of control that both epochs use alike are no difference: drawn and predicted."""
    rng = np.random.default_rng(9)

    def epoch(control: np.ndarray) -> object:
        survey = levelling(rng, {})
        survey.add(
            Coordinate,
            values=control,
            sigma=[2e-3, 2e-3],
            position=["A", "C"],
            axis=np.array([2, 2]),
            group="control",
            source=["c.csv:1", "c.csv:2"],
        )
        return adjust(observed_part(survey).network())

    differences = []
    for _ in range(300):
        control = np.array([10.0, 12.9]) + rng.normal(0, 2e-3, 2)
        one, two = epoch(control), epoch(control)
        names = one.layout.names["point"]
        differences.append(two.state.points[:, 2] - one.state.points[:, 2])
    cross, shared = shared_covariance(one, two)
    assert shared == 2
    n = len(names)
    columns = one.layout.columns("point", np.arange(n)).ravel()
    alone = one.covariance_columns(columns, columns) + two.covariance_columns(columns, columns)
    together = alone - cross - cross.T
    up = np.arange(n) * 3 + 2
    spread = np.var(differences, axis=0)
    np.testing.assert_allclose(spread, np.diag(together)[up], rtol=0.35)
    assert (spread < 0.5 * np.diag(alone)[up]).all()


def test_control_given_otherwise_is_not_shared() -> None:
    rng = np.random.default_rng(9)
    one, two = (free(levelling(rng, {})) for _ in range(2))
    assert shared_covariance(one, two) == (None, 0)


def written(folder: Path, name: str, moved: dict[str, float], seed: int) -> Path:
    """A levelled network as a CSV table."""
    rng = np.random.default_rng(seed)
    true = {k: v + moved.get(k, 0.0) for k, v in HEIGHTS.items()}
    rows = ["from,to,height_difference_m,sigma_height_difference_mm"]
    rows += [f"{a},{b},{true[b] - true[a] + rng.normal(0, 3e-4):.6f},0.3" for a, b in LINES]
    path = folder / name
    path.write_text("\n".join(rows) + "\n")
    return path


def test_from_files_to_json_page_and_map(tmp_path: Path) -> None:
    """Two levelled networks: P rose by 4 mm. There is no map without plan."""
    a = written(tmp_path, "a.csv", {}, 1)
    b = written(tmp_path, "b.csv", {"P": 0.004}, 2)
    out, page = tmp_path / "moved.json", tmp_path / "moved.html"
    result = CliRunner().invoke(
        app, ["epochs", str(a), str(b), "--json", str(out), "--html", str(page)]
    )
    assert result.exit_code == 0, result.output
    assert "P moved" in result.output
    assert "up (test" in result.output.replace("\n", " ")
    (one,) = json.loads(out.read_text())["comparisons"]
    assert one["axes"] == ["U"]
    assert one["references"]["moved"] == ["P"]
    assert one["motions"] == ["shift in U"]
    point = one["points"]["P"]
    assert point["verdict"] == "moved"
    assert point["displacement"][0] == pytest.approx(
        0.004, abs=4 * point["covariance"][0][0] ** 0.5
    )
    assert "Comparison of epochs" in page.read_text()
    refused = CliRunner().invoke(app, ["epochs", str(a), str(b), "--map", str(tmp_path / "m.svg")])
    assert refused.exit_code == 2
    assert not (tmp_path / "m.svg").exists()


def test_an_epoch_file_says_the_same_as_its_network(tmp_path: Path) -> None:
    """Written by adjust --epoch, in the datum of its control, and read again."""
    a, b = written(tmp_path, "a.csv", {}, 1), written(tmp_path, "b.csv", {"P": 0.004}, 2)
    stored = tmp_path / "a.json"
    result = CliRunner().invoke(app, ["adjust", str(a), "--datum", "free", "--epoch", str(stored)])
    assert result.exit_code == 0, result.output
    direct = compare_epoch_files([[a], [b]], EpochSettings())[0].comparison
    through = compare_epoch_files([[stored], [b]], EpochSettings())[0].comparison
    assert through.whole.statistic == pytest.approx(direct.whole.statistic, rel=1e-9)
    assert through.moved == direct.moved
    assert any(
        "independent" in s
        for s in compare_epoch_files([[stored], [b]], EpochSettings())[0].sentences
    )


def test_a_project_against_an_earlier_epoch(tmp_path: Path) -> None:
    """The chapter of the report says what the command says."""
    a, b = written(tmp_path, "a.csv", {}, 1), written(tmp_path, "b.csv", {"P": 0.004}, 2)
    project = tmp_path / "now.toml"
    project.write_text(
        'title = "now"\ndatum = "free"\n[[observations]]\nfile = "b.csv"\n'
        '[[epochs]]\nagainst = ["a.csv"]\nreferences = ["A", "B", "C", "D"]\n'
        "[output]\nepoch = true\n"
    )
    result = CliRunner().invoke(app, ["run", str(project)])
    assert result.exit_code == 0, result.output
    assert "! Since a: P moved, " in result.output
    (one,) = json.loads((tmp_path / "out/result.json").read_text())["epochs"]
    settings = EpochSettings(Settings(references=("A", "B", "C", "D")))
    same = compare_epoch_files([[a], [b]], settings)[0].comparison
    assert one["references"]["before"]["statistic"] == pytest.approx(
        same.search.before.statistic, rel=1e-6
    )
    assert one["points"]["P"]["verdict"] == "moved"
    assert "What moved: a to now" in (tmp_path / "out/report.html").read_text()
    again = epoch_from_files([tmp_path / "out/epoch.json"])
    assert set(again.epoch.names) == set(HEIGHTS)


def test_an_epoch_that_a_run_left_is_named_after_its_folder(tmp_path: Path) -> None:
    """All of them are called epoch.json; a name that somebody chose stays."""
    a = written(tmp_path, "a.csv", {}, 1)
    chosen = tmp_path / "zero.json"
    result = CliRunner().invoke(app, ["adjust", str(a), "--datum", "free", "--epoch", str(chosen)])
    assert result.exit_code == 0, result.output
    files = [tmp_path / name for name in ("2024/out/epoch.json", "out/spring/epoch.json")]
    for file in files:
        file.parent.mkdir(parents=True)
        file.write_text(chosen.read_text())
    for file, label in zip([*files, chosen], ["2024", "spring", "zero"], strict=True):
        assert epoch_from_files([file]).epoch.label == label
    (compared,) = compare_epoch_files([[file] for file in files], EpochSettings())
    assert compared.comparison.difference.labels == ("2024", "spring")
    # two of one name are told apart by their paths
    (tmp_path / "2024/epoch.json").write_text(chosen.read_text())
    both = [[files[0]], [tmp_path / "2024/epoch.json"]]
    (compared,) = compare_epoch_files(both, EpochSettings())
    assert compared.comparison.difference.labels == ("out/epoch.json", "2024/epoch.json")


def test_a_run_is_named_as_the_epoch_that_it_is_compared_with(tmp_path: Path) -> None:
    """After its folder where that one is; both stand in one heading."""
    for name, moves in (("spring", {}), ("autumn", {"P": 0.004})):
        written(tmp_path, f"{name}.csv", moves, 1 + len(moves))
        against = '[[epochs]]\nagainst = ["out/spring/epoch.json"]\n' if moves else ""
        project = tmp_path / f"{name}.toml"
        project.write_text(
            f'title = "The long title of {name}"\ndatum = "free"\n'
            f'[[observations]]\nfile = "{name}.csv"\n{against}'
            f'[output]\nfolder = "out/{name}"\nepoch = true\n'
        )
        result = CliRunner().invoke(app, ["run", str(project)])
        assert result.exit_code == 0, result.output
    page = (tmp_path / "out/autumn/report.html").read_text()
    assert "What moved: spring to autumn" in page
    assert "autumn by itself, as a free network: the global test" in page


def test_a_project_names_an_epoch_that_is_not_there(tmp_path: Path) -> None:
    written(tmp_path, "b.csv", {}, 2)
    project = tmp_path / "now.toml"
    project.write_text(
        'datum = "free"\n[[observations]]\nfile = "b.csv"\n[[epochs]]\nagainst = ["gone.json"]\n'
    )
    result = CliRunner().invoke(app, ["adjust", str(project)])
    assert result.exit_code == 2
    assert "gone.json" in result.output


def test_files_without_joint_covariance_are_refused(tmp_path: Path) -> None:
    """A result says what to give instead; a table without sigmas too."""
    a = written(tmp_path, "a.csv", {}, 1)
    result = tmp_path / "result.json"
    CliRunner().invoke(app, ["adjust", str(a), "--datum", "free", "--json", str(result)])
    with pytest.raises(InputError, match="adjust --epoch"):
        read_epoch([result])
    bare = tmp_path / "bare.csv"
    bare.write_text("point,x_m,y_m,z_m\nA,0,0,0\n")
    with pytest.raises(InputError, match="no covariance"):
        read_epoch([bare])
    for text in ("{}", "[]", '{"kind": "epoch", "schema": 1}', "no"):
        broken = tmp_path / "broken.json"
        broken.write_text(text)
        with pytest.raises(InputError, match="no epoch"):
            read_epoch([broken])


def test_coordinates_with_their_matrix(tmp_path: Path) -> None:
    """The matrix in another order than the table; sigmas alone are told to be uncorrelated."""
    table = tmp_path / "one.csv"
    table.write_text("point,x_m,y_m\nA,0,0\nB,10,0\n")
    matrix = tmp_path / "one-matrix.csv"
    matrix.write_text(
        "covariance_mm2,B_e,B_n,A_e,A_n\nB_e,4,0,1,0\nB_n,0,4,0,1\nA_e,1,0,2,0\nA_n,0,1,0,2\n"
    )
    stored = read_epoch([table, matrix])
    assert stored is not None
    plan = stored.epoch.covariance[np.ix_([0, 3], [0, 3])]
    np.testing.assert_allclose(plan, np.array([[2, 1], [1, 4]]) * 1e-6)
    alone = tmp_path / "two.csv"
    alone.write_text("point,x_m,y_m,sigma_x_mm,sigma_y_mm\nA,0,0,1,1\nB,10,0,1,1\n")
    stored = read_epoch([alone])
    assert stored is not None
    assert "uncorrelated" in stored.sentences[0]


@pytest.mark.data
def test_results_of_gama() -> None:
    """Two results of GNU Gama: A, B, C held in both; the same figures as its own comparison."""
    if not GAMA.is_dir():
        pytest.skip("the shared data are not there")
    compared = compare_epoch_files([[GAMA / "data-1.xml"], [GAMA / "data-2.xml"]], EpochSettings())
    found = compared[0].comparison
    # its own differences are printed to 0.01 mm
    assert found.whole.statistic == pytest.approx(32.398, abs=0.01)
    assert found.moved == ("d", "l")
    assert found.held == ("A", "B", "C")
    assert found.difference.dofs == (26, 33)
